//! `dynamic.json`

use coloc_bounds::team::{Motion, Pair, Supports};
use coloc_bounds::{AngleInterval, Arena, Source, Team, wrap};
use serde::Deserialize;

use crate::case::{Measured, Worst, read_vectors};

#[derive(Deserialize)]
#[allow(non_snake_case)] // So called in the file.
struct Case {
    id: String,
    n: usize,
    K: usize,
    dt: f64,
    dv: [f64; 2],
    domega: f64,
    gauge_robot: Option<usize>,
    initial: Known,
    epochs: Vec<Epoch>,
}

#[derive(Deserialize)]
struct Known {
    heading: Vec<[f64; 2]>,
    #[serde(default)]
    h: Vec<Vec<f64>>,
    #[serde(default)]
    pair_h: Vec<(usize, usize, Vec<f64>)>,
    #[serde(default)]
    odometry_supports: Vec<Vec<f64>>,
}

#[derive(Deserialize)]
struct Epoch {
    odometry: Vec<Vec<[f64; 2]>>,
    #[serde(default)]
    compass: Option<Vec<Option<[f64; 2]>>>,
    measurements: Vec<Measured>,
    truth: Vec<[f64; 2]>,
    #[serde(default)]
    expected: Option<Known>,
}

impl Case {
    fn team(&self) -> Team {
        let mut team = Team::new(self.n, self.K);
        let Known {
            heading, h, pair_h, ..
        } = &self.initial;
        team.gauge_robot = self.gauge_robot.map(|it| it - 1);
        team.headings = heading
            .iter()
            .map(|&[a, b]| AngleInterval::new(a, b))
            .collect();
        team.regions = h.iter().cloned().map(Supports::new).collect();
        let pairs = pair_h.iter().map(|(i, j, h)| Pair {
            i: i - 1,
            j: j - 1,
            region: Supports::new(h.clone()),
        });
        team.pairs = pairs.collect();
        team
    }

    /// How far each robot can have moved; headings go on.
    fn drive(&self, team: &mut Team, epoch: &Epoch) -> Vec<Supports> {
        let mut moved = vec![Supports::zero(self.K); self.n];
        for tick in &epoch.odometry {
            for (robot, &[v, omega]) in tick.iter().enumerate() {
                let motion = Motion {
                    velocity: [v, 0.0],
                    velocity_half: self.dv,
                    rate: omega,
                    rate_half: self.domega,
                    seconds: self.dt,
                };
                let before = team.headings[robot];
                moved[robot].add_motion(&motion, before);
                team.headings[robot] = before.turned(omega, self.domega, self.dt);
            }
        }
        moved
    }
}

struct Deviations {
    slack_m: f64,
    headings: Worst,
    odometry: Worst,
    supports: Worst,
    outside: Worst,
}

impl Deviations {
    fn run(&mut self, case: &Case) {
        let mut team = case.team();
        for (index, epoch) in case.epochs.iter().enumerate() {
            let name = format!("{}, epoch {index}", case.id);
            let moved = case.drive(&mut team, epoch);
            for (robot, heading) in epoch.compass.iter().flatten().enumerate() {
                if let Some([centre, half]) = *heading {
                    team.compass(robot, AngleInterval::new(centre, half))
                        .unwrap();
                }
            }
            team.predict(&moved);
            self.measure(&mut team, epoch);
            if let Some(expected) = &epoch.expected {
                self.check(&name, &team, &moved, expected);
            }
            self.check_truth(&name, &team, &epoch.truth);
        }
    }

    fn measure(&self, team: &mut Team, epoch: &Epoch) {
        let arena = Arena {
            centre: [0.0; 2],
            half: 1e3,
        };
        let mut polytope = team.polytope(arena, self.slack_m).unwrap();
        for (index, measured) in epoch.measurements.iter().enumerate() {
            let source = Source::Measurement(index);
            polytope.add(&measured.measurement(), source).unwrap();
        }
        team.keep(&mut polytope.region().unwrap());
    }

    fn check(&mut self, name: &str, team: &Team, moved: &[Supports], expected: &Known) {
        for (found, &[centre, half]) in team.headings.iter().zip(&expected.heading) {
            self.headings.take(name, wrap(found.centre - centre).abs());
            self.headings.take(name, (found.half - half).abs());
        }
        for (found, expected) in moved.iter().zip(&expected.odometry_supports) {
            compare(&mut self.odometry, name, found, expected);
        }
        for (found, expected) in team.regions.iter().zip(&expected.h) {
            compare(&mut self.supports, name, found, expected);
        }
        let pairs = expected.pair_h.len();
        assert!(pairs == 0 || pairs == team.pairs.len(), "{name}");
        for (found, (i, j, expected)) in team.pairs.iter().zip(&expected.pair_h) {
            assert_eq!((found.i + 1, found.j + 1), (*i, *j), "{name}");
            compare(&mut self.supports, name, &found.region, expected);
        }
    }

    fn check_truth(&mut self, name: &str, team: &Team, truth: &[[f64; 2]]) {
        let gauge = team.gauge_robot.map_or([0.0; 2], |it| truth[it]);
        for (region, at) in team.regions.iter().zip(truth) {
            self.contain(name, region, [at[0] - gauge[0], at[1] - gauge[1]]);
        }
        for Pair { i, j, region } in &team.pairs {
            let [a, b] = [truth[*i], truth[*j]];
            self.contain(name, region, [a[0] - b[0], a[1] - b[1]]);
        }
    }

    #[allow(clippy::cast_precision_loss)] // Sixteen.
    fn contain(&mut self, name: &str, region: &Supports, at: [f64; 2]) {
        let count = region.values().len() as f64;
        for (k, support) in region.values().iter().enumerate() {
            let psi = core::f64::consts::TAU * k as f64 / count;
            let beyond = psi.cos() * at[0] + psi.sin() * at[1] - support;
            self.outside.take(name, beyond.max(0.0));
        }
    }
}

fn compare(worst: &mut Worst, name: &str, found: &Supports, expected: &[f64]) {
    assert_eq!(found.values().len(), expected.len(), "{name}");
    for (found, expected) in found.values().iter().zip(expected) {
        worst.take(name, (found - expected).abs() / (1.0 + expected.abs()));
    }
}

fn run(slack_m: f64, tolerance: f64) {
    let mut deviations = Deviations {
        slack_m,
        headings: Worst::new("headings", 1e-12),
        odometry: Worst::new("odometry supports", 1e-12),
        supports: Worst::new("dynamic supports", tolerance),
        outside: Worst::new("truth outside by", 1e-9),
    };
    for case in read_vectors::<Case>("dynamic.json") {
        deviations.run(&case);
    }
}

#[test]
fn epochs_without_slack() {
    run(0.0, 1e-9);
}

#[test]
fn epochs_with_slack() {
    run(1e-9, 1e-6);
}
