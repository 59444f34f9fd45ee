//! What is promised of every robot in the demo, and who kept it.

use serde::Serialize;

use super::summary::RobotSummary;
use super::tale::Trial;

/// One promise.
#[derive(Debug, Serialize)]
pub(crate) struct Bar {
    /// What is promised of every robot.
    pub(crate) promise: String,
    /// What was seen of it, where it is of one robot and was kept.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub(crate) seen: String,
    /// Who broke it, and with what.
    pub(crate) broken_by: Vec<String>,
}

/// What can be expected of a robot, whatever the seed of the world.
#[derive(Copy, Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Expectation {
    /// For people: of whom.
    #[serde(skip)]
    pub(crate) whose: &'static str,
    /// Time means of |x|, |y|, |φ| are below \[m, m, rad\]; nothing is said of a robot that drifts.
    pub(crate) error: Option<[f64; 3]>,
    /// Smallest share of the time inside ±3σ.
    pub(crate) inside: f64,
    /// Smallest share of the time in which others tell something to whom they help.
    pub(crate) told: f64,
}

impl Expectation {
    fn too_far_off(&self, robot: &RobotSummary) -> Option<String> {
        let (error, most) = (robot.accuracy?.mean_abs_error, self.error?);
        let [x, y, phi] = error;
        (0..3)
            .any(|i| error[i].is_nan() || error[i] >= most[i])
            .then(|| format!("{x:.3} m, {y:.3} m, {phi:.3} rad"))
    }

    fn too_often_outside(&self, robot: &RobotSummary) -> Option<String> {
        let inside = robot.accuracy?.inside_3_sigma;
        let [x, y, phi] = inside.map(|share| 100.0 * share);
        inside
            .iter()
            .any(|share| share.is_nan() || *share < self.inside)
            .then(|| format!("{x:.1} %, {y:.1} %, {phi:.1} %"))
    }

    fn too_rarely_told(&self, robot: &RobotSummary) -> Option<String> {
        let told = robot.told.filter(|_| robot.help.is_from_others())?;
        (told < self.told).then(|| format!("{:.0} %", 100.0 * told))
    }
}

impl RobotSummary {
    fn too_late(&self) -> Option<String> {
        let all = self.deadlines_missed_by_more_than_a_period;
        let own = all.saturating_sub(self.deadlines_missed_by_the_machine);
        (own > 0).then(|| format!("{own} (is the machine busy?)"))
    }

    fn absent(&self) -> Option<String> {
        (!self.up_at_the_end || self.accuracy.is_none()).then(|| "it was not".into())
    }
}

/// Holds every robot against every promise.
pub(crate) fn bars(robots: &[RobotSummary]) -> Vec<Bar> {
    let everybody: Vec<&RobotSummary> = robots.iter().collect();
    let mut bars: Vec<Bar> = alike(robots)
        .iter()
        .flat_map(|group| own_bars(group))
        .collect();
    bars.extend(robots.iter().flat_map(of_tale));
    bars.push(hold(
        "no deadline missed by more than a period".into(),
        &everybody,
        RobotSummary::too_late,
    ));
    bars.push(hold(
        "up at the end".into(),
        &everybody,
        RobotSummary::absent,
    ));
    bars
}

/// Robots of whom the same is expected, in the order of the first ones.
fn alike(robots: &[RobotSummary]) -> Vec<Vec<&RobotSummary>> {
    let mut groups: Vec<Vec<&RobotSummary>> = Vec::new();
    for robot in robots {
        let same = |group: &&mut Vec<&RobotSummary>| group[0].expected == robot.expected;
        match groups.iter_mut().find(same) {
            Some(group) => group.push(robot),
            None => groups.push(vec![robot]),
        }
    }
    groups
}

/// What is promised of robots that are alike.
fn own_bars(group: &[&RobotSummary]) -> Vec<Bar> {
    let Some(expected) = group.first().and_then(|robot| robot.expected) else {
        return Vec::new();
    };
    let whose = expected.whose;
    let near = expected.error.map(|[x, y, phi]| {
        let promise = format!("{whose}: mean error below {x:.2} m, {y:.2} m, {phi:.2} rad");
        hold(promise, group, |robot| expected.too_far_off(robot))
    });
    let promise = format!(
        "{whose}: inside 3σ for {:.0} % of the time",
        100.0 * expected.inside
    );
    let honest = hold(promise, group, |robot| expected.too_often_outside(robot));
    let is_helped = |robot: &&RobotSummary| robot.help.is_from_others();
    let told = group.iter().any(is_helped).then(|| {
        let promise = format!(
            "{whose}: told something by others in {:.0} % of the time",
            100.0 * expected.told
        );
        hold(promise, group, |robot| expected.too_rarely_told(robot))
    });
    near.into_iter().chain([honest]).chain(told).collect()
}

/// What is promised of one robot to which something happens.
fn of_tale(robot: &RobotSummary) -> impl Iterator<Item = Bar> {
    let bar = |Trial {
                   promise,
                   seen,
                   kept,
               }: &Trial| Bar {
        promise: format!("{}: {promise}", robot.name),
        seen: if *kept { seen.clone() } else { String::new() },
        broken_by: (!kept).then(|| seen.clone()).into_iter().collect(),
    };
    robot.trials.iter().map(bar)
}

fn hold(
    promise: String,
    robots: &[&RobotSummary],
    check: impl Fn(&RobotSummary) -> Option<String>,
) -> Bar {
    let broken = robots
        .iter()
        .filter_map(|robot| check(robot).map(|how| format!("{}: {how}", robot.name)));
    Bar {
        promise,
        seen: String::new(),
        broken_by: broken.collect(),
    }
}

impl Bar {
    /// As a person reads it: `word` says what came of it.
    pub(crate) fn line(&self, word: &str) -> String {
        let broken = self.broken_by.join("; ");
        let colon = if broken.is_empty() { "" } else { ": " };
        let seen = if self.seen.is_empty() {
            String::new()
        } else {
            format!(" ({})", self.seen)
        };
        format!("{word}  {}{seen}{colon}{broken}", self.promise)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comparison::Accuracy;
    use crate::demo::record::Record;
    use crate::demo::scene::{Help, Part};

    const PART: Part = Part {
        help: Help::Told,
        expected: Some(Expectation {
            whose: "told",
            error: Some([0.10; 3]),
            inside: 0.99,
            told: 0.5,
        }),
        tale: None,
    };

    fn robot(mean: f64, inside: f64) -> RobotSummary {
        let accuracy = Accuracy {
            estimates: 1,
            mean_abs_error: [mean, 0.0, 0.0],
            rms_error: [mean; 3],
            inside_3_sigma: [1.0, inside, 1.0],
        };
        RobotSummary {
            accuracy: Some(accuracy),
            told: Some(0.9),
            ..RobotSummary::of(0, PART, &Record::new(), true, &[])
        }
    }

    /// Among others that are good.
    fn broken(robot: RobotSummary) -> Vec<String> {
        let others = (0..4).map(|_| good());
        bars(&others.chain([robot]).collect::<Vec<_>>())
            .into_iter()
            .filter(|bar| !bar.broken_by.is_empty())
            .map(|bar| bar.promise)
            .collect()
    }

    fn good() -> RobotSummary {
        robot(0.01, 1.0)
    }

    #[test]
    fn every_robot_is_held_to_what_is_expected_of_it_and_to_no_more() {
        let lost = Expectation {
            whose: "untold",
            error: None,
            inside: 0.6,
            told: 0.5,
        };
        let drifting = |inside| RobotSummary {
            expected: Some(lost),
            ..robot(5.0, inside)
        };
        assert!(broken(drifting(0.7)).is_empty());
        assert_eq!(
            broken(drifting(0.5)),
            ["untold: inside 3σ for 60 % of the time"]
        );
        let promises = |robots: &[RobotSummary]| {
            bars(robots)
                .into_iter()
                .map(|bar| bar.promise)
                .collect::<Vec<_>>()
        };
        let two_kinds = promises(&[good(), drifting(1.0), good()]);
        assert_eq!(
            two_kinds.len(),
            7,
            "three of the told, two of the untold, two of all: {two_kinds:?}"
        );
        assert_eq!(
            two_kinds[0],
            "told: mean error below 0.10 m, 0.10 m, 0.10 rad"
        );
    }

    #[test]
    fn good_robots_meet_every_bar() {
        assert!(broken(robot(0.05, 0.995)).is_empty());
    }

    #[test]
    fn nobody_has_to_tell_a_robot_something_that_others_do_not_help() {
        for help in [Help::Receiver, Help::Leader, Help::Nobody] {
            let untold = RobotSummary {
                help,
                told: Some(0.0),
                ..good()
            };
            assert!(broken(untold).is_empty(), "{help:?}");
        }
        let of_a_short_run = RobotSummary {
            told: None,
            ..good()
        };
        assert!(broken(of_a_short_run).is_empty());
    }

    #[test]
    fn each_bar_can_fail() {
        assert_eq!(broken(robot(0.10, 1.0)).len(), 1);
        assert_eq!(broken(robot(f64::NAN, 1.0)).len(), 1);
        assert_eq!(broken(robot(0.01, 0.98)).len(), 1);
        assert_eq!(
            broken(RobotSummary {
                told: Some(0.4),
                ..good()
            }),
            ["told: told something by others in 50 % of the time"]
        );
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
