//! A leader and two children that see range and bearing alone: tracks are what they tell one another by (the thesis's §5.4, figure 5.13).
//!
//! The leader of [`super::single`] sees its first child always and the fourth never, the first sees the fourth; the other two are left out.
//! Each keeps a track of whom it sees, by both robots' wheels, and what a track knows with its heading is a reading of an event. But such a
//! reading is not news: a track remembers, and the wheels that it was predicted with are those that the child has driven by.

use std::collections::BTreeMap;

use coloc_estimator::assist::datum::Reading;
use coloc_estimator::assist::slot::Slot;
use coloc_estimator::{Covariance3, Motion, Pose, RobotId, Stamp};
use coloc_track::manager::Odometry;
use coloc_track::{
    Config, Manager, Published, Rate, Reading as Polar, Seen, Sensor, Sensors as Eyes, Sighting,
    Track, publish,
};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::Form;
use super::event::Readings;
use super::robot::{Absolute, Method};
use super::run::{self, Scene};
use super::score::Score;
use super::single::world::{self, CASES, Sensors, World};
use crate::campaign::Finding;
use crate::honest::table::{Table, digits, percent};
use crate::random::{Noise, Purpose};

const LEADER: [RobotId; 1] = [RobotId(0)];
const CHILDREN: [RobotId; 2] = [RobotId(1), RobotId(4)];
/// Who keeps a track of whom.
const PAIRS: [[RobotId; 2]; 2] = [[RobotId(0), RobotId(1)], [RobotId(1), RobotId(4)]];

/// Of the sensor \[m, rad\]: the thesis's §5.3.1.
const RANGE: f64 = 0.0068;
const BEARING: f64 = 0.0036;
/// Steps between two sightings.
const SEEN_EVERY: usize = 10;

/// What is done about it.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
enum Rule {
    /// Tracks are not told: children go by their wheels.
    Alone,
    /// The thesis: nothing. Each reading is news.
    Thesis,
    /// The same, the leader's error dependent.
    Split,
    /// All of it is dependent, and so is all that the child believes.
    Dependent,
    /// A track that was told begins anew, and all is dependent as well: its wheels are.
    Restarted,
}

impl Rule {
    const ALL: [Self; 5] = [
        Self::Alone,
        Self::Thesis,
        Self::Split,
        Self::Dependent,
        Self::Restarted,
    ];

    fn name(self) -> &'static str {
        match self {
            Self::Alone => "no tracks, wheels alone",
            Self::Thesis => "tracks as news, leader-kf: the thesis",
            Self::Split => "tracks as news, leader-split",
            Self::Dependent => "tracks dependent",
            Self::Restarted => "tracks dependent, each told once",
        }
    }

    fn method(self) -> Method {
        match self {
            Self::Thesis => Method::Kalman,
            _ => Method::Split,
        }
    }
}

type Tracker = Manager<Vec<Option<Track>>>;

/// A run.
struct Tracked<'a> {
    sensors: Sensors<'a>,
    rule: Rule,
    /// By step.
    readings: BTreeMap<usize, Readings>,
}

impl<'a> Tracked<'a> {
    fn new(world: &'a World, seed: u64, number: u16, rule: Rule) -> Self {
        let sensors = Sensors::new(world, seed, number, &CASES[0]);
        let noise = Noise::new(seed, number);
        let mut readings = BTreeMap::<usize, Readings>::new();
        let pairs: &[_] = if rule == Rule::Alone { &[] } else { &PAIRS };
        for pair in pairs.iter().copied() {
            let mut tracker = tracker(Stamp::from_nanos(0));
            for step in 1..=sensors.steps() {
                watch(&mut tracker, &sensors, &noise, (step, pair));
                let told = if step.is_multiple_of(SEEN_EVERY) {
                    tracker.track(pair[1]).and_then(told)
                } else {
                    None
                };
                let Some(told) = told else {
                    continue;
                };
                readings.entry(step).or_default().insert(pair, told);
                if rule == Rule::Restarted {
                    tracker = self::tracker(stamp(step));
                }
            }
        }
        Self {
            sensors,
            rule,
            readings,
        }
    }
}

fn tracker(now: Stamp) -> Tracker {
    let eyes = Eyes::new(&[Sensor::default()]).expect("one");
    Manager::new(Config::default(), eyes, now, vec![None; 2])
}

fn stamp(step: usize) -> Stamp {
    let ms = i64::try_from(step).unwrap_or(i64::MAX).saturating_mul(10);
    Stamp::from_nanos(ms.saturating_mul(1_000_000))
}

/// How the wheels say that a robot moves in a step.
fn rate(sensors: &Sensors<'_>, step: usize, robot: RobotId) -> Rate {
    let motion = sensors.motion(step, robot);
    let [v, _, omega] = motion.velocity();
    let mut covariance_per_s = Matrix3::zeros();
    if let Motion::Nonholonomic { noise, .. } = motion {
        let [vv, _, _, ww] = noise.to_row_major();
        covariance_per_s = Matrix3::from_diagonal(&Vector3::new(vv, 0.0, ww)) * sensors.dt_s();
    }
    Rate {
        velocity: Vector3::new(v, 0.0, omega),
        covariance_per_s,
    }
}

/// One step of a track.
fn watch(
    tracker: &mut Tracker,
    sensors: &Sensors<'_>,
    noise: &Noise,
    (step, [observer, observed]): (usize, [RobotId; 2]),
) {
    let neighbours = [(observed, rate(sensors, step, observed))];
    let odometry = Odometry {
        observer: Some(rate(sensors, step, observer)),
        neighbours: &neighbours,
    };
    let mut seen = Vec::new();
    if step.is_multiple_of(SEEN_EVERY)
        && let (Some(from), Some(to)) =
            (sensors.truth(step, observer), sensors.truth(step, observed))
    {
        let [a, b] = [observer, observed].map(|it| usize::from(it.0));
        let mut draws = noise.draws(Purpose::TrackedSight, step, a, b);
        let (dx, dy) = (to.x - from.x, to.y - from.y);
        seen.push(Sighting {
            stamp: stamp(step),
            sequence: step as u64,
            seen: Seen::Neighbour {
                id: Some(observed),
                sensor: 0,
                reading: Polar::RangeBearing {
                    range_m: dx.hypot(dy) + RANGE * draws.normal(),
                    bearing_rad: dy.atan2(dx) - from.phi + BEARING * draws.normal(),
                    white: [RANGE * RANGE, BEARING * BEARING],
                },
            },
        });
    }
    tracker.step(stamp(step), &odometry, &mut seen, |_, _| ());
}

/// What a track tells of an event; nothing without a heading.
fn told(track: &Track) -> Option<Reading> {
    let Published::Pose(state) = publish(track) else {
        return None;
    };
    let ([x, y, phi], covariance) = state.relative_pose();
    Some(Reading {
        relative: Pose::new(x, y, phi),
        covariance: Covariance3::new(covariance).ok()?,
    })
}

impl Scene for Tracked<'_> {
    fn dt_s(&self) -> f64 {
        self.sensors.dt_s()
    }

    fn steps(&self) -> usize {
        self.sensors.steps()
    }

    fn leaders(&self) -> &[RobotId] {
        &LEADER
    }

    fn children(&self) -> &[RobotId] {
        &CHILDREN
    }

    fn start(&self, robot: RobotId) -> Pose {
        self.sensors.start(robot)
    }

    fn truth(&self, step: usize, robot: RobotId) -> Option<Pose> {
        self.sensors.truth(step, robot)
    }

    fn motion(&self, step: usize, robot: RobotId) -> Motion {
        self.sensors.motion(step, robot)
    }

    fn absolute(&self, step: usize, leader: RobotId) -> Option<Absolute> {
        self.sensors.absolute(step, leader)
    }

    fn event(&self, step: usize) -> Option<(Slot, Readings)> {
        let readings = self.readings.get(&step)?.clone();
        Some((Slot(i64::try_from(step / SEEN_EVERY).ok()?), readings))
    }

    fn is_news(&self) -> bool {
        matches!(self.rule, Rule::Thesis | Rule::Split)
    }
}

fn score(form: &Form, world: &World, rule: Rule) -> Score {
    let runs = (0..form.runs).into_par_iter();
    let scores = runs.map(|it| {
        let run = Tracked::new(world, form.seed, it, rule);
        run::score(&run, &[rule.method()])
    });
    scores.reduce(Score::default, Score::merged)
}

/// All rules.
#[must_use]
pub fn find(form: &Form) -> Finding {
    let mut table = Table::new(["", "child", "x cm", "y cm", "φ rad", "outside", "mean NEES"]);
    let steps = form.steps(100, world::STEPS);
    let world = World::new(steps);
    let scores = Rule::ALL.map(|rule| (rule, score(form, &world, rule)));
    for (rule, score) in &scores {
        let method = rule.method();
        for child in 0..CHILDREN.len() {
            let [x, y, phi] = score.accuracy(method, child, |_| true);
            table.row([
                rule.name().into(),
                format!("c{}", child + 1),
                format!("{:.2} ± {:.2}", 100.0 * x[0], 100.0 * x[1]),
                format!("{:.2} ± {:.2}", 100.0 * y[0], 100.0 * y[1]),
                format!("{:.4} ± {:.4}", phi[0], phi[1]),
                percent(score.outside(method, child)),
                digits(score.nees(method, child)),
            ]);
        }
    }
    let missed = missed(&scores);
    Finding {
        title: "Tracks as sightings".into(),
        text: format!(
            "{} runs of {} s each; the leader sees c1, c1 sees c2, range and bearing alone, ten times a second. RMSE over runs at each step, \
             its mean and deviation over time; share of NEES beyond the 95 % bound, and mean NEES (3 is honest):\n\n{}",
            form.runs,
            steps / 100,
            table.text()
        ),
        missed,
    }
}

/// Nominal.
const MOST_OUTSIDE: f64 = 0.05;

/// Where a child does not know how wrong it is, or is no better off than by its wheels alone.
fn missed(scores: &[(Rule, Score)]) -> Vec<String> {
    let of = |rule: Rule| scores.iter().find(|it| it.0 == rule).map(|it| &it.1);
    let [Some(alone), Some(told)] = [Rule::Alone, Rule::Dependent].map(of) else {
        return Vec::new();
    };
    let off = |score: &Score, child| {
        let [x, y, _] = score.accuracy(Method::Split, child, |_| true);
        x[0].hypot(y[0])
    };
    let mut missed = Vec::new();
    for child in 0..CHILDREN.len() {
        let name = format!("{}, c{}", Rule::Dependent.name(), child + 1);
        let outside = told.outside(Method::Split, child);
        if outside > MOST_OUTSIDE {
            missed.push(format!("{name}: {} outside", percent(outside)));
        }
        let [wheels, tracks] = [alone, told].map(|it| off(it, child));
        if tracks >= wheels {
            missed.push(format!(
                "{name}: {tracks:.3} m off, by wheels {wheels:.3} m"
            ));
        }
    }
    missed
}
