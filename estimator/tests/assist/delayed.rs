//! Poses that come late are fused where they belong, and what followed is done again.

use std::collections::BTreeMap;

use coloc_estimator::assist::wait::Wait;
use coloc_estimator::{Belief, Covariance2, Covariance3, Fusion, GlobalPose, Motion, RobotId};
use serde::Deserialize;

use crate::case::{Rows, Tolerance, covariance, pose, rows, sigma};
use crate::replay::Child;
use crate::support::read_vectors;
use crate::updates::{self, Datum};

#[derive(Deserialize)]
struct File {
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    id: String,
    tag: String,
    tol: f64,
    input: Input,
    expected: Expected,
}

#[derive(Deserialize)]
struct Input {
    dt: f64,
    x0: [f64; 3],
    P0: Rows,
    Q_diag: Vec<f64>,
    odometry: Vec<Vec<f64>>,
    fusion: updates::Fusion,
    n_bar: usize,
    max_delay: u32,
    events: Vec<Event>,
}

#[derive(Deserialize)]
struct Event {
    k_m: usize,
    arrivals: Vec<Arrival>,
}

#[derive(Deserialize)]
struct Arrival {
    tick: usize,
    #[serde(flatten)]
    datum: Datum,
}

#[derive(Deserialize)]
struct Expected {
    liberate: Outcome,
    arrival: Outcome,
    points: Vec<Points>,
}

#[derive(Deserialize)]
struct Points {
    k_m: usize,
    k_lp: Option<usize>,
    fuse: usize,
}

/// Step, then the upper triangle.
type Triangle = (usize, f64, f64, f64, f64, f64, f64);

#[derive(Deserialize)]
struct Outcome {
    x: Vec<[f64; 3]>,
    P: Vec<Triangle>,
    P_ind: Option<Vec<Triangle>>,
    log: Vec<(usize, u16, f64, bool, Option<f64>)>,
}

/// Two velocities or three.
pub(crate) fn motion(velocity: &[f64], variances: &[f64]) -> Motion {
    match (velocity, variances) {
        ([v, omega], [a, b]) => Motion::Nonholonomic {
            velocity: [*v, *omega],
            noise: Covariance2::diagonal([*a, *b]).unwrap(),
        },
        ([vx, vy, omega], [a, b, c]) => Motion::Holonomic {
            velocity: [*vx, *vy, *omega],
            noise: Covariance3::diagonal([*a, *b, *c]).unwrap(),
        },
        other => panic!("{other:?}"),
    }
}

#[derive(Copy, Clone, PartialEq)]
enum Mode {
    Liberate,
    Arrival,
}

/// When an event was fused, and whether all poses were there.
struct Waiting<'a> {
    event: &'a Event,
    wait: Wait,
    liberated: bool,
}

impl Waiting<'_> {
    fn come(&self, step: usize) -> Vec<(RobotId, GlobalPose)> {
        let come = self.event.arrivals.iter().filter(|it| it.tick <= step);
        come.map(|it| it.datum.said()).collect()
    }

    /// Poses to be fused in this step.
    fn due(&mut self, mode: Mode, step: usize) -> Option<Vec<(RobotId, GlobalPose)>> {
        let age = step.checked_sub(self.event.k_m)?;
        if mode == Mode::Arrival {
            let now = self.event.arrivals.iter().filter(|it| it.tick == step);
            return Some(now.map(|it| it.datum.said()).collect());
        }
        let come = self.come(step);
        let is_due = self.wait.is_due(u32::try_from(age).unwrap(), come.len());
        self.liberated |= is_due && come.len() >= self.wait.most();
        is_due.then_some(come)
    }
}

impl Case {
    fn run(&self, mode: Mode, tolerance: &mut Tolerance) -> Belief {
        let Input {
            dt,
            x0,
            P0,
            Q_diag,
            odometry,
            fusion,
            n_bar,
            max_delay,
            events,
        } = &self.input;
        let outcome = match mode {
            Mode::Liberate => &self.expected.liberate,
            Mode::Arrival => &self.expected.arrival,
        };
        let start = Belief::independent(pose(*x0), covariance(P0));
        let mut child = Child::new(start, fusion.rule(), *dt);
        let waiting = events.iter().map(|event| Waiting {
            event,
            wait: Wait::of(*n_bar, *max_delay),
            liberated: false,
        });
        let mut waiting: Vec<_> = waiting.collect();
        let mut log: BTreeMap<(usize, RobotId), Fusion> = BTreeMap::new();
        for (index, velocity) in odometry.iter().enumerate() {
            let step = index + 1;
            child.drive(motion(velocity, Q_diag));
            if events.iter().any(|it| it.k_m == step) {
                child.meet();
            }
            for it in &mut waiting {
                let Some(poses) = it.due(mode, step).filter(|it| !it.is_empty()) else {
                    continue;
                };
                let account = child.fuse(it.event.k_m, &poses);
                log.extend(account.into_iter().map(|(at, id, it)| ((at, id), it)));
            }
            self.compare(mode, outcome, (step, &child.belief), tolerance);
        }
        if mode == Mode::Liberate {
            self.check_points(&waiting);
        }
        self.check_log(outcome, &log);
        child.belief
    }

    fn compare(
        &self,
        mode: Mode,
        outcome: &Outcome,
        (step, belief): (usize, &Belief),
        tolerance: &mut Tolerance,
    ) {
        let mode = if mode == Mode::Liberate {
            "liberate"
        } else {
            "arrival"
        };
        let name = format!("{} ({}), {mode}, step {step}", self.id, self.tag);
        tolerance.pose(&name, &belief.pose, outcome.x[step - 1], [0.0; 3]);
        let at = |list: &[Triangle]| {
            let found = list.iter().find(|it| it.0 == step);
            found.map(|(_, a, b, c, d, e, f)| rows([*a, *b, *c, *d, *e, *f]))
        };
        let Some(P) = at(&outcome.P) else { return };
        let of = (sigma(&P), sigma(&P));
        tolerance.matrix(&name, &belief.total().matrix(), &P, of);
        if let Some(P_ind) = outcome.P_ind.as_deref().and_then(at) {
            let independent = belief.parts.independent.matrix();
            tolerance.matrix(&format!("{name}: P_ind"), &independent, &P_ind, of);
        }
    }

    fn check_points(&self, waiting: &[Waiting]) {
        assert_eq!(waiting.len(), self.expected.points.len());
        for (it, stated) in waiting.iter().zip(&self.expected.points) {
            let fused = it.event.k_m + it.wait.fused().unwrap() as usize;
            let liberated = it.liberated.then_some(fused);
            let found = (it.event.k_m, liberated, fused);
            assert_eq!(found, (stated.k_m, stated.k_lp, stated.fuse), "{}", self.id);
        }
    }

    fn check_log(&self, outcome: &Outcome, log: &BTreeMap<(usize, RobotId), Fusion>) {
        assert_eq!(log.len(), outcome.log.len(), "{}", self.id);
        for ((found, fusion), stated) in log.iter().zip(&outcome.log) {
            let (at, leader, d2, accepted, alpha) = *stated;
            assert_eq!((found.0, found.1.0), (at, leader), "{}", self.id);
            assert_eq!(fusion.accepted, accepted, "{}", self.id);
            let is_inside = alpha.is_none_or(|it| (1e-3..=1.0 - 1e-3).contains(&it));
            let error = (fusion.d2 - d2).abs();
            assert!(!is_inside || error <= 1e-5 * d2, "{}: {error:e}", self.id);
        }
    }

    /// Whether no pose came too late.
    fn is_in_time(&self) -> bool {
        let fused = self.expected.points.iter().map(|it| it.fuse);
        let mut all = self.input.events.iter().zip(fused);
        all.all(|(event, fused)| event.arrivals.iter().all(|it| it.tick <= fused))
    }
}

#[test]
fn delayed() {
    let Some(file) = read_vectors::<File>("leader/delayed.json") else {
        return;
    };
    assert!(file.cases.len() > 15, "{}", file.cases.len());
    let (mut exact, mut in_time) = (Tolerance::new(|_, _| 1e-9, (1e-9, 1e-12)), 0);
    let mut split = Tolerance::new(|_, _| 1e-6, (1e-6, 1e-12));
    for case in &file.cases {
        let tolerance = if case.tol > 1e-9 {
            &mut split
        } else {
            &mut exact
        };
        let liberated = case.run(Mode::Liberate, tolerance);
        let arrived = case.run(Mode::Arrival, tolerance);
        if case.is_in_time() {
            in_time += 1;
            assert_eq!(liberated, arrived, "{}: not the same bits", case.id);
        }
    }
    assert!(in_time > 10, "{in_time}");
    exact.report("delayed.json");
    split.report("delayed.json, split");
}
