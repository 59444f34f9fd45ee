//! How many samples of each source of odometry, and of each gyro, drive the belief. The estimator reports only those that do not.

use coloc_estimator::{Kind, Measurement, Report, Source};

/// Each source of what drives in what was `given`, and how many of its samples are not in `reports`.
pub(super) fn driven<'a>(
    given: &'a [Measurement],
    reports: &'a [Report],
) -> impl Iterator<Item = (Source, u64)> + 'a {
    let sources = move || given.iter().filter_map(driving);
    let is_first =
        move |(place, source): &(usize, Source)| sources().take(*place).all(|it| it != *source);
    let firsts = sources().enumerate().filter(is_first);
    firsts.map(move |(_, source)| {
        let own = sources().filter(|it| *it == source).count();
        let driven = own.saturating_sub(refused(reports, source));
        (source, driven as u64)
    })
}

fn driving(measurement: &Measurement) -> Option<Source> {
    match measurement {
        Measurement::Odometry(sample) => Some(Source::new(Kind::Odometry, sample.source)),
        Measurement::Gyro(sample) => Some(Source::new(Kind::Gyro, sample.origin.source)),
        _ => None,
    }
}

fn refused(reports: &[Report], source: Source) -> usize {
    reports.iter().filter(|it| it.source == source).count()
}

#[cfg(test)]
mod tests {
    use coloc_estimator::{
        Covariance2, GyroSample, Motion, OdometrySample, Origin, PositionFix, SlowError, Stamp,
        Verdict,
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
    fn what_drives_is_counted_for_each_of_its_sources() {
        let mut given: Vec<_> = [0, 7, 0, 0, 7].map(sample).into();
        given.insert(2, fix());
        given.push(Measurement::Gyro(GyroSample::default()));
        let wheels = |number| Source::new(Kind::Odometry, number);
        let gyro = Source::new(Kind::Gyro, 0);
        let of = |reports: &[Report]| driven(&given, reports).collect::<Vec<_>>();
        assert_eq!(of(&[]), [(wheels(0), 3), (wheels(7), 2), (gyro, 1)]);
        let reports = [
            report(Kind::Odometry, 7),
            report(Kind::Fix, 0),
            report(Kind::Odometry, 7),
        ];
        assert_eq!(of(&reports), [(wheels(0), 3), (wheels(7), 0), (gyro, 1)]);
    }
}
