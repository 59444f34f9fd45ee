//! What a gyro read, over intervals of the wheels.

use coloc_estimator::{GyroSample, GyroSettings, Stamp};

use super::read::seconds;

/// How fast it turned, and from when to when: one after another, with gaps where samples were lost.
#[derive(Clone, Debug, Default)]
pub(super) struct Turns {
    pieces: Vec<Piece>,
}

#[derive(Copy, Clone, Debug)]
struct Piece {
    from_s: f64,
    until_s: f64,
    rate_radps: f64,
}

/// Ends that meet do so to this \[s\].
const MEET_S: f64 = 1e-6;

impl Turns {
    /// A sample is of the time since the one before or, where one was lost, of a period, as in the estimator.
    pub(super) fn new(mut samples: Vec<GyroSample>, settings: &GyroSettings, begin: Stamp) -> Self {
        samples.sort_by_key(|it| (it.stamp, it.origin));
        samples.dedup_by_key(|it| it.stamp);
        let period_s = settings.period.as_seconds();
        let mut last_s = f64::NEG_INFINITY;
        let piece = |sample: &GyroSample| {
            let until_s = seconds(sample.stamp, begin);
            let from_s = if until_s - last_s <= 1.5 * period_s {
                last_s
            } else {
                until_s - period_s
            };
            last_s = until_s;
            Piece {
                from_s,
                until_s,
                rate_radps: sample.rate_radps,
            }
        };
        Self {
            pieces: samples.iter().map(piece).collect(),
        }
    }

    /// The integral of its readings \[rad\]; `None` where it has not read all of it.
    pub(super) fn over(&self, [from_s, until_s]: [f64; 2]) -> Option<f64> {
        let first = self.pieces.partition_point(|it| it.until_s <= from_s);
        let (mut angle, mut at_s) = (0.0, from_s);
        for piece in self.pieces.get(first..)? {
            if piece.from_s > at_s + MEET_S {
                return None;
            }
            let end_s = piece.until_s.min(until_s);
            angle += piece.rate_radps * (end_s - at_s);
            at_s = end_s;
            if at_s >= until_s - MEET_S {
                return Some(angle);
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use coloc_estimator::Span;

    use super::*;

    #[test]
    fn an_interval_is_read_whole_or_not_at_all() {
        let sample = |millis: i64, rate_radps| GyroSample {
            stamp: Stamp::from_nanos(1_000_000 * millis),
            rate_radps,
            ..GyroSample::default()
        };
        let settings = GyroSettings {
            period: Span::from_millis(10),
            ..GyroSettings::ORDINARY
        };
        // Out of order, one twice, that of 40 ms lost.
        let samples =
            [30, 10, 20, 20, 50].map(|at| sample(at, 0.1 * f64::from(u8::try_from(at).unwrap())));
        let turns = Turns::new(samples.to_vec(), &settings, Stamp::default());
        let over = |from_ms: f64, until_ms: f64| turns.over([1e-3 * from_ms, 1e-3 * until_ms]);
        let near = |angle: Option<f64>, expected: f64| (angle.unwrap() - expected).abs() < 1e-12;
        assert!(near(over(0.0, 30.0), 0.06));
        assert!(near(over(5.0, 25.0), 0.005 + 0.02 + 0.015));
        assert!(near(over(40.0, 50.0), 0.05));
        assert_eq!(over(25.0, 45.0), None, "lost");
        assert_eq!(over(45.0, 55.0), None, "not read yet");
    }
}
