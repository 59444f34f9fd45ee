//! Five estimators that fly, in a team of which some make rounds and the others fuse what they hear: a robot goes over from one to the other, a thousand
//! times. Nobody comes to be surer than it may be.
#![allow(clippy::unwrap_used, clippy::too_many_lines)] // What fails here fails the test, which is one world in the order of its time.

use coloc_estimator::angle::wrap;
use coloc_estimator::gate::{CHI2_1_99, CHI2_2_99, CHI2_3_99};
use coloc_estimator::rounds::{RoundSettings, Sharing, gate};
use coloc_estimator::{
    Belief, Covariance2, Covariance3, Deed, Estimator, Measurement, Motion, NeighbourPose,
    OdometrySample, Origin, Pose, PositionFix, RobotId, RoundWord, Settings, Sighting as Seen,
    Slot, SlowError, Stamp, TickInputs, step,
};
use coloc_rounds::model::Kind;
use coloc_rounds::{Going, Round, Share, Sighting};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const ROBOTS: usize = 5;
const SWITCHES: i64 = 1000;
/// Ticks of 20 ms from measurement to measurement, slot to slot, switch to switch.
const SENSED: i64 = 5;
const SLOT: i64 = 10;
const SWITCHED: i64 = 25;
const WITH_RECEIVER: usize = 2;

const SPEED: [f64; 2] = [0.3, 0.2];
const WHEELS: [f64; 2] = [0.1, 0.2];
const FIX_M: f64 = 0.1;
const SEEN: [f64; 3] = [0.1, 0.1, 0.017];

fn at(tick: i64) -> Stamp {
    Stamp::from_nanos(20_000_000 * tick)
}

fn counted(tick: i64, source: usize) -> Origin {
    Origin {
        source: u16::try_from(source).unwrap(),
        ..Origin::counted(tick.cast_unsigned())
    }
}

struct Robot {
    truth: Pose,
    estimator: Estimator<Vec<Slot>>,
    inbox: Vec<Measurement>,
    is_in: bool,
    nees: Vec<f64>,
}

impl Robot {
    fn at(pose: Pose) -> Self {
        let settings = Settings {
            rounds: Some(RoundSettings {
                robots: ROBOTS,
                gate: gate::CHI2_3_ONE_IN_A_MILLION,
            }),
            ..Settings::default()
        };
        let covariance = Covariance3::diagonal([0.01, 0.01, 0.0025]).unwrap();
        let belief = Belief::independent(pose, covariance);
        Self {
            truth: pose,
            estimator: Estimator::new(settings, at(0), belief, vec![Slot::default(); 512]),
            inbox: Vec::new(),
            is_in: false,
            nees: Vec::new(),
        }
    }

    fn drive(&mut self, tick: i64, error: &mut dyn FnMut(f64) -> f64) {
        let [v, omega] = SPEED;
        let half = self.truth.phi + 0.01 * omega;
        let way = 0.02 * v;
        let Pose { x, y, phi } = self.truth;
        self.truth = Pose::new(
            x + way * half.cos(),
            y + way * half.sin(),
            phi + 0.02 * omega,
        );
        let said = [v + error(WHEELS[0]), omega + error(WHEELS[1])];
        self.inbox.push(Measurement::Odometry(OdometrySample {
            source: 0,
            start: at(tick - 1),
            stamp: at(tick),
            motion: Motion::Nonholonomic {
                velocity: said,
                noise: Covariance2::diagonal(WHEELS.map(|it| it * it)).unwrap(),
            },
        }));
    }

    fn word(&mut self, tick: i64, sequence: i64, deed: Deed) {
        self.inbox.push(Measurement::Round(RoundWord {
            stamp: at(tick),
            origin: counted(sequence, 0),
            deed,
            of: None,
        }));
    }

    fn judge(&mut self, tick: i64) {
        let belief = self.estimator.belief_at(at(tick)).unwrap();
        let Pose { x, y, phi } = belief.pose;
        let off = nalgebra::Vector3::new(
            x - self.truth.x,
            y - self.truth.y,
            wrap(phi - self.truth.phi),
        );
        let inverse = belief.total().matrix().try_inverse().unwrap();
        self.nees.push(off.dot(&(inverse * off)));
    }
}

fn relative(from: &Pose, to: &Pose) -> Pose {
    let (s, c) = from.phi.sin_cos();
    let [dx, dy] = [to.x - from.x, to.y - from.y];
    Pose::new(c * dx + s * dy, c * dy - s * dx, to.phi - from.phi)
}

#[test]
fn a_thousand_switches_make_nobody_too_sure() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let places = [
        [0.0, 0.0, 0.0],
        [4.0, 0.0, 1.5],
        [3.0, 3.0, -2.0],
        [-1.0, 3.0, 3.0],
        [1.5, 1.5, 0.5],
    ];
    let mut robots: Vec<Robot> = places
        .iter()
        .map(|[x, y, phi]| Robot::at(Pose::new(*x, *y, *phi)))
        .collect();
    let noise = Covariance3::diagonal(SEEN.map(|it| it * it)).unwrap();
    let mut round = Round::beginning(ROBOTS);
    let (mut switches, mut rounds) = (0, 0);
    for tick in 1..=SWITCHES * SWITCHED {
        let mut error = |sigma: f64| {
            let it: f64 = StandardNormal.sample(&mut random);
            sigma * it
        };
        for robot in &mut robots {
            robot.drive(tick, &mut error);
        }
        let mut seen = vec![Vec::new(); ROBOTS];
        if tick % SENSED == 0 {
            for a in 0..ROBOTS {
                if a < WITH_RECEIVER {
                    let Pose { x, y, .. } = robots[a].truth;
                    let position = [x + error(FIX_M), y + error(FIX_M)];
                    robots[a].inbox.push(Measurement::Fix(PositionFix {
                        stamp: at(tick),
                        origin: counted(tick, 0),
                        position,
                        covariance: Covariance2::diagonal([FIX_M * FIX_M; 2]).unwrap(),
                        lever: [0.0; 2],
                        slow: SlowError::default(),
                    }));
                }
                for b in [(a + 1) % ROBOTS, (a + 2) % ROBOTS] {
                    let there = relative(&robots[a].truth, &robots[b].truth);
                    let y = [
                        there.x + error(SEEN[0]),
                        there.y + error(SEEN[1]),
                        wrap(there.phi + error(SEEN[2])),
                    ];
                    robots[a].inbox.push(Measurement::Sighting(Seen {
                        stamp: at(tick),
                        origin: counted(tick, 0),
                        observed: RobotId(u16::try_from(b).unwrap()),
                        relative: Pose::new(y[0], y[1], y[2]),
                        covariance: noise,
                    }));
                    seen[a].push(Sighting {
                        kind: Kind::Pose,
                        observed: b,
                        y,
                        noise: noise.matrix(),
                        age_s: 0.0,
                    });
                }
            }
        }
        if tick % SWITCHED == 0 {
            let robot = &mut robots[random.random_range(0..ROBOTS)];
            robot.is_in = !robot.is_in;
            let deed = if robot.is_in { Deed::Join } else { Deed::Leave };
            robot.word(tick, 2 * tick, deed);
            switches += 1;
        }
        let slot = (tick % SLOT == 0).then_some((tick / SLOT).cast_unsigned());
        let mut told = Vec::new();
        let mut shares = Vec::new();
        for (number, robot) in robots.iter_mut().enumerate() {
            if let Some(slot) = slot {
                robot.word(tick, 2 * tick + 1, Deed::Share(slot));
            }
            let measurements = std::mem::take(&mut robot.inbox);
            let inputs = TickInputs {
                stamp: at(tick),
                measurements: &measurements,
            };
            let outputs = step(&mut robot.estimator, &inputs);
            told.extend(outputs.outgoing.iter().map(|it| (number, *it)));
            if let Some(Sharing::Belief(shared)) = outputs.shared.map(|it| it.sharing) {
                shares.push(Share {
                    robot: number,
                    shared,
                    going: Going::default(),
                    sightings: std::mem::take(&mut seen[number]),
                });
            }
            if slot.is_some() {
                robot.judge(tick);
            }
        }
        for (from, word) in told {
            robots[usize::from(word.to.0)]
                .inbox
                .push(Measurement::Neighbour(NeighbourPose {
                    stamp: word.stamp,
                    origin: counted(tick, from),
                    pose: word.pose,
                    parts: word.parts,
                }));
        }
        let gates = [CHI2_1_99, CHI2_2_99, CHI2_3_99];
        let next = slot.and_then(|slot| round.next(slot, 0, &shares, &gates));
        let (Some(slot), Some((next, _))) = (slot, next) else {
            continue;
        };
        rounds += 1;
        for share in &shares {
            let Some(told) = next.correction(share.robot).filter(|it| it.slot == slot) else {
                continue;
            };
            let deed = Deed::Correct {
                slot,
                pose: told.pose,
                covariance: Covariance3::new(told.covariance).unwrap(),
                factor: told.factor,
            };
            robots[share.robot].word(tick, 2 * tick + 1, deed);
        }
        round = next;
    }
    assert!(
        switches == SWITCHES && rounds > 2000,
        "{switches}, {rounds}"
    );
    for (number, robot) in robots.iter().enumerate() {
        let warm = &robot.nees[10..];
        #[allow(clippy::cast_precision_loss)] // Thousands.
        let count = warm.len() as f64;
        let mean = warm.iter().sum::<f64>() / count;
        #[allow(clippy::cast_precision_loss)] // Likewise.
        let outside = warm.iter().filter(|it| **it > 9.348).count() as f64 / count;
        println!(
            "robot {number}: NEES {mean:.2}, outside {:.1} %",
            100.0 * outside
        );
        assert!(
            mean <= 3.2 && outside <= 0.05,
            "robot {number}: {mean} {outside}"
        );
    }
}
