//! Five robots that see one another in part, in the order of their events.

use coloc_estimator::partial::{
    BodySighting, Innovation, PositionSettings, ReadingNoise, SplitPosition, fuse, observed, tell,
    told,
};
use coloc_estimator::{
    Belief, Covariance2, Fusion, Motion, Pace, Parts, Pose, Propagation, Span, Stamp, fix,
    propagate,
};
use serde::Deserialize;

use crate::case::{Rows, Rows2, State, Tolerance, covariance, covariance2};
use crate::support::read_vectors;

const TOLERANCE: Tolerance = Tolerance {
    pose: |_| 1e-6,
    relative: 1e-5,
    beside: 1e-12,
};

#[derive(Deserialize)]
pub(crate) struct Sequence {
    pub(crate) meta: Meta,
    pub(crate) steps: Vec<Step>,
}

#[derive(Deserialize)]
pub(crate) struct Meta {
    pub(crate) dt: f64,
    pub(crate) T0: f64,
    pub(crate) x0: Vec<[f64; 3]>,
    pub(crate) P_i0: Vec<Rows>,
    pub(crate) damping: f64,
    pub(crate) memory: f64,
    pub(crate) lever: f64,
    pub(crate) gate: f64,
    pub(crate) white: [f64; 3],
    pub(crate) slow: [f64; 2],
    pub(crate) R_dgps: Rows2,
}

#[derive(Deserialize)]
pub(crate) struct Step {
    pub(crate) odometry: Vec<[f64; 2]>,
    #[serde(default)]
    pub(crate) sightings: Vec<Seen>,
    #[serde(default)]
    pub(crate) fusions: Vec<(String, usize, usize, f64, f64, bool)>,
    #[serde(default)]
    pub(crate) dgps: Vec<Fix>,
    #[serde(default)]
    pub(crate) dgps_result: Vec<(usize, f64, bool)>,
    pub(crate) expected: Expected,
}

#[derive(Deserialize)]
pub(crate) struct Seen {
    pub(crate) observer: usize,
    pub(crate) observed: usize,
    pub(crate) rho: f64,
    pub(crate) theta: f64,
}

#[derive(Deserialize)]
pub(crate) struct Fix {
    pub(crate) robot: usize,
    pub(crate) y: [f64; 2],
}

#[derive(Deserialize)]
pub(crate) struct Expected {
    x: Option<Vec<[f64; 3]>>,
    P_i: Option<Vec<[f64; 6]>>,
    P_d: Option<Vec<[f64; 6]>>,
    K_H: Option<Vec<[f64; 6]>>,
}

#[derive(Clone)]
struct Robot {
    belief: Belief,
    pace: Pace,
}

impl Meta {
    fn start(&self) -> Vec<Robot> {
        let robots = self.x0.iter().zip(&self.P_i0);
        robots
            .map(|(&[x, y, phi], rows)| Robot {
                belief: Belief::gaussian(
                    Pose::new(x, y, phi),
                    Parts::independent(covariance(rows)),
                ),
                pace: Pace::beginning(Stamp::default()).met(),
            })
            .collect()
    }

    pub(crate) fn settings(&self) -> PositionSettings {
        PositionSettings {
            heading_lever_m: self.lever,
            damping: self.damping,
            memory: Span::from_seconds(self.memory),
            gate: self.gate,
            ..PositionSettings::default()
        }
    }

    fn motion(&self, [v, omega]: [f64; 2]) -> Motion {
        let share = self.T0 / self.dt;
        Motion::Nonholonomic {
            velocity: [v, omega],
            noise: Covariance2::diagonal([5.075 * v * v * share, 0.345 * share]).unwrap(),
        }
    }

    pub(crate) fn sighting(&self, seen: &Seen) -> BodySighting {
        let [relative, absolute, bearing] = self.white;
        let along = relative * seen.rho;
        let noise = ReadingNoise {
            white: [along * along + absolute * absolute, bearing * bearing],
            slow: self.slow,
        };
        BodySighting::of(seen.rho, seen.theta, &Pose::default(), &noise)
    }
}

impl Step {
    /// Every message from the beliefs before it; then each robot in turn: what it is told, then what it is answered.
    fn exchange(&self, robots: &mut [Robot], stamp: Stamp, meta: &Meta) {
        let before: Vec<Belief> = robots.iter().map(|it| it.belief).collect();
        let mut account = self.fusions.iter();
        for (index, robot) in robots.iter_mut().enumerate() {
            let hearing = in_order(&self.sightings, |it| (it.observed == index, it.observer));
            for seen in hearing {
                let said = tell(&before[seen.observer], &meta.sighting(seen));
                let innovation = told(&robot.belief, &said);
                let fusion = robot.hear(stamp, meta, &innovation);
                check(
                    account.next().unwrap(),
                    ("forward", seen.observer, index),
                    &fusion,
                );
            }
            for seen in in_order(&self.sightings, |it| (it.observer == index, it.observed)) {
                let answer = SplitPosition::of(&before[seen.observed]);
                let innovation = observed(&robot.belief, &meta.sighting(seen), &answer);
                let fusion = robot.hear(stamp, meta, &innovation);
                check(
                    account.next().unwrap(),
                    ("backward", index, seen.observed),
                    &fusion,
                );
            }
            if self
                .sightings
                .iter()
                .any(|it| it.observer == index || it.observed == index)
            {
                robot.belief.make_dependent();
            }
        }
        assert!(account.next().is_none());
    }

    fn correct(&self, robots: &mut [Robot], meta: &Meta) {
        for (fix, stated) in self.dgps.iter().zip(&self.dgps_result) {
            let robot = &mut robots[fix.robot];
            let update = fix::update(&robot.belief, fix.y, &covariance2(&meta.R_dgps), meta.gate);
            assert_eq!((fix.robot, update.accepted), (stated.0, stated.2));
            assert!((update.d2 - stated.1).abs() <= 1e-4 * stated.1);
            robot.belief = update.belief;
        }
    }
}

fn in_order(seen: &[Seen], key: impl Fn(&Seen) -> (bool, usize)) -> Vec<&Seen> {
    let mut chosen: Vec<&Seen> = seen.iter().filter(|it| key(it).0).collect();
    chosen.sort_by_key(|it| key(it).1);
    chosen
}

impl Robot {
    fn hear(&mut self, stamp: Stamp, meta: &Meta, innovation: &Innovation) -> Fusion {
        self.pace = self.pace.heard(stamp);
        let settings = meta.settings().damped(&self.pace);
        let fusion = fuse(&self.belief, innovation, &settings);
        self.belief = fusion.belief;
        fusion
    }
}

fn check(
    stated: &(String, usize, usize, f64, f64, bool),
    (kind, observer, observed): (&str, usize, usize),
    found: &Fusion,
) {
    let (stated_kind, a, b, alpha, d2, accepted) = stated;
    assert_eq!((kind, observer, observed), (stated_kind.as_str(), *a, *b));
    assert_eq!(found.accepted, *accepted, "{stated:?}");
    if (1e-3..=1.0 - 1e-3).contains(alpha) {
        assert!(
            (found.d2 - d2).abs() <= 1e-4 * d2,
            "{stated:?}: d² {}",
            found.d2
        );
    }
}

fn rows([xx, xy, xp, yy, yp, pp]: [f64; 6]) -> Rows {
    [[xx, xy, xp], [xy, yy, yp], [xp, yp, pp]]
}

/// Holds the beliefs of all against what is expected; whether that is all of them.
pub(crate) fn compare(index: usize, expected: &Expected, beliefs: &[Belief]) -> usize {
    let Some(poses) = &expected.x else { return 0 };
    let (Some(P_i), Some(P_d), Some(K_H)) = (&expected.P_i, &expected.P_d, &expected.K_H) else {
        for (belief, [x, y, phi]) in beliefs.iter().zip(poses) {
            let Pose { x: a, y: b, phi: c } = belief.pose;
            let turn = coloc_estimator::angle::wrap(c - phi);
            assert!(
                (a - x).abs().max((b - y).abs()).max(turn.abs()) <= 1e-6,
                "step {index}"
            );
        }
        return 0;
    };
    for (number, belief) in beliefs.iter().enumerate() {
        let [a, b, c, d, e, f] = K_H[number];
        let state = State {
            x: poses[number],
            P_i: rows(P_i[number]),
            P_d: rows(P_d[number]),
            K_H: [[a, b], [c, d], [e, f]],
        };
        TOLERANCE.check(&format!("step {index}, robot {number}"), belief, &state);
    }
    1
}

#[test]
fn five_robots() {
    let Some(sequence) = read_vectors::<Sequence>("tracking/sequence_coop.json") else {
        return;
    };
    let (meta, mut robots) = (&sequence.meta, sequence.meta.start());
    let (mut compared, mut stamp) = (0, Stamp::default());
    for (index, step) in sequence.steps.iter().enumerate() {
        stamp = stamp + Span::from_seconds(meta.dt);
        for (robot, velocity) in robots.iter_mut().zip(&step.odometry) {
            let motion = meta.motion(*velocity);
            robot.belief = propagate(&robot.belief, &motion, meta.dt, Propagation::Honest);
        }
        step.exchange(&mut robots, stamp, meta);
        step.correct(&mut robots, meta);
        let beliefs: Vec<Belief> = robots.iter().map(|it| it.belief).collect();
        compared += compare(index, &step.expected, &beliefs);
    }
    assert!(compared > 10, "{compared}");
}
