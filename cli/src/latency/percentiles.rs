//! Durations, counted and summed up.

use hdrhistogram::Histogram;
use serde::Serialize;

/// The quantiles that are reported.
const QUANTILES: [f64; 5] = [0.5, 0.9, 0.99, 0.999, 0.9999];

/// One nanosecond to a minute, to 0.1 %.
const RANGE_NS: (u64, u64) = (1, 60_000_000_000);
const DIGITS: u8 = 3;

/// A histogram of durations.
#[derive(Clone, Debug)]
pub(crate) struct Durations(Histogram<u64>);

/// What is reported of a histogram \[ns\]: nothing that its count does not bear. A percentile needs so many durations that one of
/// them may be above it; p99 a hundred.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub(crate) struct Percentiles {
    pub(crate) p50_ns: Option<u64>,
    pub(crate) p90_ns: Option<u64>,
    pub(crate) p99_ns: Option<u64>,
    pub(crate) p99_9_ns: Option<u64>,
    pub(crate) p99_99_ns: Option<u64>,
    pub(crate) max_ns: Option<u64>,
    pub(crate) count: u64,
}

impl Durations {
    /// Counts durations \[ns\]; one below zero, which a clock's conversion may yield, counts as zero.
    pub(crate) fn of(durations_ns: impl IntoIterator<Item = i64>) -> Self {
        #[allow(clippy::expect_used)] // Constants of this file; any test would show it.
        let mut histogram = Histogram::new_with_bounds(RANGE_NS.0, RANGE_NS.1, DIGITS)
            .expect("the bounds are legal");
        for duration_ns in durations_ns {
            histogram.saturating_record(u64::try_from(duration_ns).unwrap_or(0));
        }
        Self(histogram)
    }

    /// Counts those of `more` as well.
    pub(crate) fn add(&mut self, more: &Self) {
        // All have the same bounds: every value fits.
        let _ = self.0.add(&more.0);
    }

    pub(crate) fn percentiles(&self) -> Percentiles {
        let [p50_ns, p90_ns, p99_ns, p99_9_ns, p99_99_ns] =
            QUANTILES.map(|quantile| self.at_quantile(quantile));
        Percentiles {
            p50_ns,
            p90_ns,
            p99_ns,
            p99_9_ns,
            p99_99_ns,
            max_ns: (!self.0.is_empty()).then(|| self.0.max()),
            count: self.0.len(),
        }
    }

    #[allow(clippy::cast_precision_loss)] // Counts are far below 2^53.
    fn at_quantile(&self, quantile: f64) -> Option<u64> {
        // Rounded, as 1 - 0.99 is not quite a hundredth.
        let above = (self.0.len() as f64 * (1.0 - quantile) * 1e6).round();
        (above >= 1e6).then(|| self.0.value_at_quantile(quantile))
    }

    /// Points `(quantile, µs)` of the curve up to the last quantile that the count supports.
    #[allow(clippy::cast_precision_loss)] // A minute in nanoseconds is far below 2^53.
    pub(crate) fn curve(&self) -> Vec<(f64, f64)> {
        if self.0.is_empty() {
            return Vec::new();
        }
        let points = self.0.iter_quantiles(5);
        points
            .map(|point| {
                let value = point.value_iterated_to() as f64 / 1e3;
                (point.quantile_iterated_to(), value)
            })
            .filter(|(quantile, _)| *quantile < 1.0)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_those_of_the_durations() {
        let percentiles = Durations::of(1..=10_000).percentiles();
        assert_eq!(
            (percentiles.count, percentiles.p50_ns),
            (10_000, Some(5_003))
        );
        assert!(percentiles.max_ns >= Some(10_000) && percentiles.p99_99_ns >= Some(9_999));
    }

    #[test]
    fn no_duration_has_no_figure_and_few_have_few() {
        let none = Durations::of([]);
        assert_eq!(none.percentiles(), Percentiles::default());
        assert!(none.curve().is_empty());
        let one = Durations::of([7]).percentiles();
        assert_eq!((one.p50_ns, one.max_ns, one.count), (None, Some(7), 1));
        let hundred = Durations::of(1..=100).percentiles();
        assert_eq!((hundred.p99_ns, hundred.p99_9_ns), (Some(99), None));
        assert_eq!(Durations::of(1..=99).percentiles().p99_ns, None);
    }

    #[test]
    fn what_was_counted_apart_adds_up() {
        let mut all = Durations::of(1..=5_000);
        all.add(&Durations::of(5_001..=10_000));
        let at_once = Durations::of(1..=10_000).percentiles();
        assert_eq!(all.percentiles().p99_ns, at_once.p99_ns);
        assert_eq!(all.percentiles().count, 10_000);
    }

    #[test]
    fn what_ends_before_it_begins_took_no_time() {
        assert_eq!(Durations::of([-5]).percentiles().max_ns, Some(0));
    }
}
