//! Algorithm 4 from end to end: five robots, a thousand steps, against an independent implementation.
#![allow(clippy::unwrap_used)] // A test may panic.

mod support;

use coloc_estimator::angle::wrap;
use coloc_estimator::settings::{Criterion, FusionSettings};
use coloc_estimator::{
    Belief, Covariance2, Covariance3, Estimator, Kind, Measurement, Motion, NeighbourPose,
    OdometrySample, Origin, OutgoingPose, Pose, PositionFix, Report, RobotId, Settings, Sighting,
    Slot, SlowError, Source, Span, Stamp, TickInputs, Verdict, step,
};
use nalgebra::{Matrix2, Matrix3, Vector3};
use serde::Deserialize;

#[derive(Deserialize)]
struct Sequence {
    meta: Meta,
    steps: Vec<Step>,
}

#[derive(Deserialize)]
#[allow(non_snake_case)] // The file's own names.
struct Meta {
    criterion: String,
    dt: f64,
    R_rel: [[f64; 3]; 3],
    R_dgps: [[f64; 2]; 2],
    gate_rel: f64,
    gate_dgps: f64,
    P0: [[f64; 3]; 3],
    x0: Vec<[f64; 3]>,
}

#[derive(Deserialize)]
#[allow(non_snake_case)]
struct Step {
    k: u32,
    odometry: Vec<Vec<f64>>,
    Q_diag: Vec<Vec<f64>>,
    #[serde(default)]
    relative: Vec<Relative>,
    #[serde(default)]
    dgps: Vec<Dgps>,
    expected: Expected,
}

#[derive(Deserialize)]
struct Relative {
    observer: u16,
    observed: u16,
    y: [f64; 3],
}

#[derive(Deserialize)]
struct Dgps {
    robot: u16,
    y: [f64; 2],
}

#[derive(Deserialize)]
#[allow(non_snake_case)]
struct Expected {
    x: Vec<[f64; 3]>,
    #[serde(default)]
    P: Vec<[f64; 6]>,
    #[serde(default)]
    P_ind: Vec<[f64; 6]>,
    /// Receiver, sender, α, d², accepted.
    #[serde(default)]
    fusions: Vec<(u16, u16, f64, f64, u8)>,
    /// Robot, d², accepted.
    #[serde(default)]
    dgps: Vec<(u16, f64, u8)>,
}

/// Robot `index` has the number `index + 1`.
struct Fleet {
    meta: Meta,
    robots: Vec<Estimator<Vec<Slot>>>,
}

impl Fleet {
    fn new(meta: Meta) -> Self {
        let settings = Settings {
            fusion: FusionSettings {
                criterion: criterion(&meta.criterion),
                gate: meta.gate_rel,
                ..FusionSettings::paper()
            },
            position_gate: meta.gate_dgps,
            ..Settings::paper()
        };
        let start = |x: &[f64; 3]| Belief::independent(pose(*x), covariance3(meta.P0));
        let robot = |x| {
            Estimator::new(
                settings,
                Stamp::default(),
                start(x),
                vec![Slot::default(); 512],
            )
        };
        let robots = meta.x0.iter().map(robot).collect();
        Self { meta, robots }
    }

    fn stamp(&self, k: u32) -> Stamp {
        #[allow(clippy::cast_possible_truncation)]
        let period = Span::from_nanos((self.meta.dt * 1e9).round() as i64);
        Stamp::from_nanos(period.as_nanos() * i64::from(k))
    }

    /// Every robot moves and tells the others where it sees them.
    fn move_and_look(&mut self, given: &Step) -> Vec<(RobotId, OutgoingPose)> {
        let (start, stamp) = (self.stamp(given.k - 1), self.stamp(given.k));
        let noise = covariance3(self.meta.R_rel);
        let mut sent = Vec::new();
        for (index, robot) in self.robots.iter_mut().enumerate() {
            let motion = motion(&given.odometry[index], &given.Q_diag[index]);
            let sightings: Vec<_> = given
                .relative
                .iter()
                .filter(|seen| number(index) == RobotId(seen.observer))
                .collect();
            let odometry = OdometrySample {
                source: 0,
                start,
                stamp,
                motion,
            };
            let sightings = sightings.iter().map(|seen| sighting(stamp, seen, noise));
            let measurements: Vec<Measurement> = std::iter::once(odometry.into())
                .chain(sightings.map(Measurement::from))
                .collect();
            let inputs = TickInputs {
                stamp,
                measurements: &measurements,
            };
            let outputs = step(robot, &inputs);
            assert!(outputs.reports.is_empty(), "{:?}", outputs.reports);
            sent.extend(
                outputs
                    .outgoing
                    .iter()
                    .map(|outgoing| (number(index), *outgoing)),
            );
        }
        assert_eq!(sent.len(), given.relative.len());
        sent
    }

    /// Every robot hears the others and its satellites; the verdicts of all.
    fn hear_and_fix(
        &mut self,
        given: &Step,
        sent: &[(RobotId, OutgoingPose)],
    ) -> Vec<(RobotId, Report)> {
        let stamp = self.stamp(given.k);
        let noise = Covariance2::new(Matrix2::from_fn(|i, j| self.meta.R_dgps[i][j])).unwrap();
        let mut reports = Vec::new();
        for (index, robot) in self.robots.iter_mut().enumerate() {
            let own = number(index);
            let neighbours = sent
                .iter()
                .filter(|(_, outgoing)| outgoing.to == own)
                .map(received);
            let fixes = given
                .dgps
                .iter()
                .filter(|fix| RobotId(fix.robot) == own)
                .map(|fix| PositionFix {
                    stamp,
                    origin: Origin::default(),
                    position: fix.y,
                    covariance: noise,
                    lever: [0.0; 2],
                    slow: SlowError::default(),
                });
            let measurements: Vec<Measurement> = neighbours
                .map(Measurement::from)
                .chain(fixes.map(Measurement::from))
                .collect();
            let inputs = TickInputs {
                stamp,
                measurements: &measurements,
            };
            let outputs = step(robot, &inputs);
            assert!(outputs.outgoing.is_empty(), "a sighting is told once");
            reports.extend(outputs.reports.iter().map(|report| (own, *report)));
        }
        reports
    }

    fn compare_beliefs(&self, given: &Step) {
        for (index, robot) in self.robots.iter().enumerate() {
            let place = format!("step {}, robot {}", given.k, index + 1);
            let belief = robot.belief_at(self.stamp(given.k)).unwrap();
            assert_pose(&belief.pose, &pose(given.expected.x[index]), &place);
            let Some(total) = given.expected.P.get(index) else {
                continue;
            };
            let scale = symmetric(total).diagonal().map(f64::sqrt);
            assert_covariance(
                &belief.total(),
                &symmetric(total),
                &scale,
                &format!("P, {place}"),
            );
            let independent = symmetric(&given.expected.P_ind[index]);
            assert_covariance(
                &belief.parts.independent,
                &independent,
                &scale,
                &format!("P_i, {place}"),
            );
        }
    }
}

fn run(name: &str) {
    let Some(sequence) = support::read_vectors::<Sequence>(name) else {
        return;
    };
    let mut fleet = Fleet::new(sequence.meta);
    assert!(!sequence.steps.is_empty());
    for given in &sequence.steps {
        let sent = fleet.move_and_look(given);
        let reports = fleet.hear_and_fix(given, &sent);
        compare_verdicts(given, &reports);
        fleet.compare_beliefs(given);
    }
}

fn compare_verdicts(given: &Step, reports: &[(RobotId, Report)]) {
    let expected = &given.expected;
    assert_eq!(
        reports.len(),
        expected.fusions.len() + expected.dgps.len(),
        "step {}",
        given.k
    );
    let find = |robot, source: Source| {
        let report = reports
            .iter()
            .find(|(own, report)| *own == RobotId(robot) && report.source == source);
        report
            .unwrap_or_else(|| {
                panic!(
                    "step {}: robot {robot} reports nothing about {source:?}",
                    given.k
                )
            })
            .1
            .verdict
    };
    for &(receiver, sender, alpha, d2, accepted) in &expected.fusions {
        let interior = (1e-3..=1.0 - 1e-3).contains(&alpha);
        let verdict = find(receiver, Source::new(Kind::Neighbour, sender));
        compare_verdict(verdict, accepted, interior.then_some(d2));
    }
    for &(robot, d2, accepted) in &expected.dgps {
        compare_verdict(find(robot, Source::new(Kind::Fix, 0)), accepted, Some(d2));
    }
}

fn compare_verdict(verdict: Verdict, accepted: u8, d2: Option<f64>) {
    let (was_accepted, found) = match verdict {
        Verdict::Accepted { d2 } => (true, d2),
        Verdict::Gated { d2 } => (false, d2),
        refused => panic!("{refused:?}"),
    };
    assert_eq!(was_accepted, accepted == 1);
    if let Some(d2) = d2 {
        assert!(
            (found - d2).abs() <= 1e-4 * d2,
            "d² {found} instead of {d2}"
        );
    }
}

fn assert_pose(found: &Pose, expected: &Pose, place: &str) {
    let heading = wrap(found.phi - expected.phi);
    let errors = [found.x - expected.x, found.y - expected.y, heading];
    assert!(
        errors.iter().all(|error| error.abs() <= 1e-6),
        "{place}: {found:?}, expected {expected:?}"
    );
}

fn assert_covariance(
    found: &Covariance3,
    expected: &Matrix3<f64>,
    scale: &Vector3<f64>,
    place: &str,
) {
    let allowed = scale * scale.transpose() * 1e-5 + Matrix3::from_element(1e-12);
    let error = (found.matrix() - expected).abs();
    assert!(
        error
            .zip_map(&allowed, |e, a| e <= a)
            .iter()
            .all(|within| *within),
        "{place}: {found:?}, expected {expected}"
    );
}

fn criterion(name: &str) -> Criterion {
    match name {
        "trace" => Criterion::Trace,
        "det" => Criterion::Determinant,
        other => panic!("criterion {other}"),
    }
}

fn number(index: usize) -> RobotId {
    RobotId(u16::try_from(index + 1).unwrap())
}

fn pose(x: [f64; 3]) -> Pose {
    Pose::new(x[0], x[1], x[2])
}

fn covariance3(rows: [[f64; 3]; 3]) -> Covariance3 {
    Covariance3::new(Matrix3::from_fn(|i, j| rows[i][j])).unwrap()
}

/// From the upper triangle.
fn symmetric(upper: &[f64; 6]) -> Matrix3<f64> {
    let [xx, xy, xphi, yy, yphi, phiphi] = *upper;
    Matrix3::new(xx, xy, xphi, xy, yy, yphi, xphi, yphi, phiphi)
}

fn motion(velocity: &[f64], variance: &[f64]) -> Motion {
    match (velocity, variance) {
        (&[v, omega], &[q_v, q_omega]) => Motion::Nonholonomic {
            velocity: [v, omega],
            noise: Covariance2::new(Matrix2::from_diagonal(&[q_v, q_omega].into())).unwrap(),
        },
        (&[v_x, v_y, omega], &[q_x, q_y, q_omega]) => Motion::Holonomic {
            velocity: [v_x, v_y, omega],
            noise: Covariance3::new(Matrix3::from_diagonal(&[q_x, q_y, q_omega].into())).unwrap(),
        },
        other => panic!("neither [v, ω] nor [v_x, v_y, ω]: {other:?}"),
    }
}

fn sighting(stamp: Stamp, seen: &Relative, covariance: Covariance3) -> Sighting {
    let (observed, relative) = (RobotId(seen.observed), pose(seen.y));
    Sighting {
        stamp,
        origin: Origin::default(),
        observed,
        relative,
        covariance,
    }
}

fn received((sender, outgoing): &(RobotId, OutgoingPose)) -> NeighbourPose {
    NeighbourPose {
        stamp: outgoing.stamp,
        origin: Origin {
            source: sender.0,
            ..Origin::default()
        },
        pose: outgoing.pose,
        parts: outgoing.parts,
    }
}

#[test]
fn sequence_a() {
    run("sequence_a.json");
}

#[test]
fn sequence_b_with_holonomic_robots_and_outliers() {
    run("sequence_b.json");
}

#[test]
fn sequence_c_with_one_way_losses() {
    run("sequence_c.json");
}
