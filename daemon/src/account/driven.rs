//! How many samples of each source of odometry drive the belief. The estimator reports only those that do not.

use coloc_estimator::{Kind, Measurement, OdometrySample, Report};

/// Each source of odometry in what was `given`, and how many of its samples are not in `reports`.
pub(super) fn driven<'a>(
    given: &'a [Measurement],
    reports: &'a [Report],
) -> impl Iterator<Item = (u16, u64)> + 'a {
    let samples = move || samples(given);
    let is_first = move |(place, sample): &(usize, &OdometrySample)| {
        samples().take(*place).all(|it| it.source != sample.source)
    };
    let firsts = samples().enumerate().filter(is_first);
    firsts.map(move |(_, first)| {
        let own = samples().filter(|it| it.source == first.source).count();
        let driven = own.saturating_sub(refused(reports, first.source));
        (first.source, driven as u64)
    })
}

fn samples(given: &[Measurement]) -> impl Iterator<Item = &OdometrySample> {
    given.iter().filter_map(Measurement::as_odometry)
}

fn refused(reports: &[Report], source: u16) -> usize {
    let own = |it: &&Report| it.source.kind == Kind::Odometry && it.source.number == source;
    reports.iter().filter(own).count()
}

#[cfg(test)]
mod tests {
    use coloc_estimator::{
        Covariance2, Motion, Origin, PositionFix, SlowError, Source, Stamp, Verdict,
    };

    use super::*;

    fn sample(source: u16) -> Measurement {
        let [start, stamp] = [0, 1].map(Stamp::from_nanos);
        Measurement::Odometry(OdometrySample {
            source,
            start,
            stamp,
            motion: Motion::standstill([1.0; 3]),
        })
    }

    fn fix() -> Measurement {
        Measurement::Fix(PositionFix {
            stamp: Stamp::from_nanos(1),
            origin: Origin::counted(0),
            position: [0.0; 2],
            covariance: Covariance2::ZERO,
            lever: [0.0; 2],
            slow: SlowError::default(),
        })
    }

    fn report(kind: Kind, number: u16) -> Report {
        Report {
            source: Source::new(kind, number),
            stamp: Stamp::from_nanos(1),
            verdict: Verdict::TooOld,
        }
    }

    #[test]
    fn odometry_is_counted_for_each_of_its_sources() {
        let mut given: Vec<_> = [0, 7, 0, 0, 7].map(sample).into();
        given.insert(2, fix());
        let of = |reports: &[Report]| driven(&given, reports).collect::<Vec<_>>();
        assert_eq!(of(&[]), [(0, 3), (7, 2)]);
        let reports = [
            report(Kind::Odometry, 7),
            report(Kind::Fix, 0),
            report(Kind::Odometry, 7),
        ];
        assert_eq!(of(&reports), [(0, 3), (7, 0)]);
    }
}
