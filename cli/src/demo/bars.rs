//! What is promised of every robot in the demo, and who kept it.

use serde::Serialize;

use super::summary::RobotSummary;

/// One promise.
#[derive(Debug, Serialize)]
pub(crate) struct Bar {
    /// What is promised of every robot.
    pub(crate) promise: &'static str,
    /// Who broke it, and with what.
    pub(crate) broken_by: Vec<String>,
}

impl RobotSummary {
    fn mean_error_too_large(&self) -> Option<String> {
        const BARS: [f64; 3] = [0.10, 0.10, 0.1];
        let error = self.accuracy?.mean_abs_error;
        let [x, y, phi] = error;
        (0..3)
            .any(|i| error[i].is_nan() || error[i] >= BARS[i])
            .then(|| format!("{x:.3} m, {y:.3} m, {phi:.3} rad"))
    }

    fn too_often_outside(&self) -> Option<String> {
        let inside = self.accuracy?.inside_3_sigma;
        let [x, y, phi] = inside.map(|share| 100.0 * share);
        inside
            .iter()
            .any(|share| share.is_nan() || *share < 0.99)
            .then(|| format!("{x:.1} %, {y:.1} %, {phi:.1} %"))
    }

    fn too_late(&self) -> Option<String> {
        let count = self.deadlines_missed_by_more_than_a_period;
        (count > 0).then(|| format!("{count} (is the machine busy?)"))
    }

    fn absent(&self) -> Option<String> {
        (!self.up_at_the_end || self.accuracy.is_none()).then(|| "it was not".into())
    }
}

/// Holds every robot against every promise.
pub(crate) fn bars(robots: &[RobotSummary]) -> Vec<Bar> {
    type Check = fn(&RobotSummary) -> Option<String>;
    let promises: [(&'static str, Check); 4] = [
        (
            "mean error below 0.10 m, 0.10 m, 0.1 rad",
            RobotSummary::mean_error_too_large,
        ),
        (
            "inside 3σ for 99 % of the time",
            RobotSummary::too_often_outside,
        ),
        (
            "no deadline missed by more than a period",
            RobotSummary::too_late,
        ),
        ("up at the end", RobotSummary::absent),
    ];
    let hold = |(promise, check): (&'static str, Check)| {
        let broken = robots
            .iter()
            .filter_map(|robot| check(robot).map(|how| format!("{}: {how}", robot.name)));
        Bar {
            promise,
            broken_by: broken.collect(),
        }
    };
    promises.map(hold).into()
}

impl Bar {
    /// As a person reads it.
    pub(crate) fn line(&self) -> String {
        let broken = self.broken_by.join("; ");
        let colon = if broken.is_empty() { "" } else { ": " };
        format!(
            "{}  {}{colon}{broken}",
            word(self.broken_by.is_empty()),
            self.promise
        )
    }
}

/// The verdict on a line.
pub(crate) fn word(good: bool) -> &'static str {
    if good { "PASS" } else { "FAIL" }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comparison::Accuracy;
    use crate::demo::record::Record;

    fn robot(mean: f64, inside: f64) -> RobotSummary {
        let accuracy = Accuracy {
            estimates: 1,
            mean_abs_error: [mean, 0.0, 0.0],
            rms_error: [mean; 3],
            inside_3_sigma: [1.0, inside, 1.0],
        };
        RobotSummary {
            accuracy: Some(accuracy),
            ..RobotSummary::of(0, &Record::new(), true)
        }
    }

    fn broken(robot: RobotSummary) -> Vec<&'static str> {
        bars(&[robot])
            .into_iter()
            .filter(|bar| !bar.broken_by.is_empty())
            .map(|bar| bar.promise)
            .collect()
    }

    #[test]
    fn good_robots_meet_every_bar() {
        assert!(broken(robot(0.05, 0.995)).is_empty());
    }

    #[test]
    fn each_bar_can_fail() {
        assert_eq!(broken(robot(0.10, 1.0)).len(), 1);
        assert_eq!(broken(robot(f64::NAN, 1.0)).len(), 1);
        assert_eq!(broken(robot(0.01, 0.98)).len(), 1);
        assert_eq!(
            broken(RobotSummary {
                deadlines_missed_by_more_than_a_period: 1,
                ..robot(0.01, 1.0)
            })
            .len(),
            1
        );
        assert_eq!(
            broken(RobotSummary {
                up_at_the_end: false,
                ..robot(0.01, 1.0)
            })
            .len(),
            1
        );
        assert_eq!(
            broken(RobotSummary {
                accuracy: None,
                ..robot(0.01, 1.0)
            })
            .len(),
            1
        );
    }
}
