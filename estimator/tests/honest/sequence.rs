//! 1500 steps: through the functions one by one, and through the history as a robot lives them.

use coloc_estimator::settings::FusionSettings;
use coloc_estimator::{
    Belief, Estimator, FoundSettings, GlobalPose, Kind, Measurement, NeighbourPose, OdometrySample,
    Origin, OutgoingPose, PositionFix, Propagation, RobotId, Settings, Sighting, Slot, SlowError,
    Span, Stamp, TickInputs, Verdict, fix, fuse, step, to_global,
};
use serde::Deserialize;

use crate::case::{
    Rows, Rows2, State, Tolerance, Velocity, Wheels, covariance, covariance2, parts, pose, sigma,
    sum,
};
use crate::support::read_vectors;

const TOLERANCE: Tolerance = Tolerance {
    pose: |_, _| 1e-6,
    covariance: [1e-6, 1e-15],
    bend: [1e-6, 1e-12],
    by_own: false,
};

#[derive(Deserialize)]
struct Sequence {
    meta: Meta,
    steps: Vec<Step>,
    expected: Expected,
}

#[derive(Deserialize)]
struct Meta {
    dt: f64,
    gate_fix: f64,
    gate_message: f64,
    beta: f64,
    x0: [f64; 3],
    P_i0: Rows,
    P_d0: Rows,
}

#[derive(Deserialize)]
struct Step {
    velocity: Option<Velocity>,
    wheels: Option<Wheels>,
    sighting: Option<Seen>,
    message: Option<Message>,
    fix: Option<Fix>,
}

#[derive(Deserialize)]
struct Seen {
    z: [f64; 3],
    R: Rows,
}

#[derive(Deserialize)]
struct Message {
    y: [f64; 3],
    R_i: Rows,
    R_d: Rows,
}

#[derive(Deserialize)]
struct Fix {
    y: [f64; 2],
    R: Rows2,
}

#[derive(Deserialize)]
struct Expected {
    states: Vec<At>,
    fixes: Vec<(usize, bool, f64)>,
    messages: Vec<(usize, bool, f64, f64)>,
    converted: Vec<(usize, [f64; 3], Rows, Rows)>,
}

#[derive(Deserialize)]
struct At {
    step: usize,
    #[serde(flatten)]
    state: State,
}

/// What a run had to say.
#[derive(Default)]
struct Account {
    beliefs: Vec<Belief>,
    /// Step, accepted, d².
    fixes: Vec<(usize, bool, f64)>,
    messages: Vec<(usize, bool, f64)>,
    converted: Vec<(usize, GlobalPose)>,
}

impl Sequence {
    fn initial(&self) -> Belief {
        let Meta { x0, P_i0, P_d0, .. } = &self.meta;
        Belief::gaussian(pose(*x0), parts(P_i0, P_d0))
    }

    fn fusion(&self) -> FusionSettings {
        FusionSettings {
            damping: self.meta.beta,
            gate: self.meta.gate_message,
            reset_on_transmit: true,
            ..FusionSettings::paper()
        }
    }

    fn check(&self, account: &Account) {
        for At { step, state } in &self.expected.states {
            TOLERANCE.check(&format!("step {step}"), &account.beliefs[*step], state);
        }
        let verdicts = account.fixes.iter().zip(&self.expected.fixes);
        assert_eq!(account.fixes.len(), self.expected.fixes.len());
        for (found, stated) in verdicts {
            assert_eq!((found.0, found.1), (stated.0, stated.1));
            assert!(
                (found.2 - stated.2).abs() <= 1e-4 * stated.2,
                "fix {found:?}, {stated:?}"
            );
        }
        let verdicts = account.messages.iter().zip(&self.expected.messages);
        assert_eq!(account.messages.len(), self.expected.messages.len());
        for (found, &(step, accepted, d2, alpha)) in verdicts {
            assert_eq!((found.0, found.1), (step, accepted));
            let inside = (1e-3..=1.0 - 1e-3).contains(&alpha);
            assert!(
                !inside || (found.2 - d2).abs() <= 1e-4 * d2,
                "{found:?}, {d2}"
            );
        }
        assert_eq!(account.converted.len(), self.expected.converted.len());
        for ((at, told), (step, y, R_i, R_d)) in
            account.converted.iter().zip(&self.expected.converted)
        {
            assert_eq!(at, step);
            let (name, scale) = (format!("told in step {step}"), sigma(&sum(R_i, R_d)));
            TOLERANCE.check_pose(&name, &told.pose, *y, scale);
            TOLERANCE.check_covariance(&name, &told.parts.independent, R_i, scale);
            TOLERANCE.check_covariance(&name, &told.parts.dependent, R_d, scale);
        }
    }

    /// One function after the other.
    fn run(&self) -> Account {
        let (mut account, mut belief) = (Account::default(), self.initial());
        for (index, given) in self.steps.iter().enumerate() {
            if let Some(velocity) = &given.velocity {
                belief = velocity.drive(&belief);
            }
            if let Some(wheels) = &given.wheels {
                belief = wheels.drive(&belief);
            }
            if let Some(Seen { z, R }) = &given.sighting {
                let told = to_global(&belief, &pose(*z), &covariance(R), Propagation::Honest);
                account.converted.push((index, told));
                belief.make_dependent();
            }
            if let Some(message) = &given.message {
                let fusion = fuse(&belief, &message.told(), &self.fusion());
                account.messages.push((index, fusion.accepted, fusion.d2));
                belief = fusion.belief;
                belief.make_dependent();
            }
            if let Some(Fix { y, R }) = &given.fix {
                let update = fix::update(&belief, *y, &covariance2(R), self.meta.gate_fix);
                account.fixes.push((index, update.accepted, update.d2));
                belief = update.belief;
            }
            account.beliefs.push(belief);
        }
        account
    }

    /// A tick a step.
    fn live(&self) -> Account {
        let settings = Settings {
            fusion: self.fusion(),
            position_gate: self.meta.gate_fix,
            found: FoundSettings::OFF, // They fuse fixes at any heading, and everybody's.
            ..Settings::default()
        };
        let slots = vec![Slot::default(); 256];
        let mut robot = Estimator::new(settings, Stamp::default(), self.initial(), slots);
        let mut account = Account::default();
        for (index, given) in self.steps.iter().enumerate() {
            let measurements = given.measurements(index, self.meta.dt);
            let stamp = stamp(index + 1);
            let outputs = step(
                &mut robot,
                &TickInputs {
                    stamp,
                    measurements: &measurements,
                },
            );
            account.beliefs.push(outputs.estimate.belief);
            for OutgoingPose { pose, parts, .. } in outputs.outgoing {
                let told = GlobalPose {
                    pose: *pose,
                    parts: *parts,
                };
                account.converted.push((index, told));
            }
            for report in outputs.reports {
                let verdict = match report.verdict {
                    Verdict::Accepted { d2 } => (index, true, d2),
                    Verdict::Gated { d2 } => (index, false, d2),
                    other => panic!("step {index}: {other:?}"),
                };
                match report.source.kind {
                    Kind::Fix => account.fixes.push(verdict),
                    _ => account.messages.push(verdict),
                }
            }
        }
        account
    }
}

fn stamp(steps: usize) -> Stamp {
    Stamp::default() + Span::from_millis(20 * i64::try_from(steps).unwrap())
}

impl Message {
    fn told(&self) -> GlobalPose {
        GlobalPose {
            pose: pose(self.y),
            parts: parts(&self.R_i, &self.R_d),
        }
    }
}

impl Step {
    fn measurements(&self, index: usize, dt: f64) -> Vec<Measurement> {
        let stamp = stamp(index + 1);
        let velocity = self.velocity.as_ref().map(Velocity::motion);
        let wheels = self.wheels.as_ref().map(|wheels| wheels.motion(dt));
        let odometry = velocity.or(wheels).map(|motion| OdometrySample {
            source: 0,
            start: self::stamp(index),
            stamp,
            motion,
        });
        let sighting = self.sighting.as_ref().map(|seen| Sighting {
            stamp,
            origin: Origin::default(),
            observed: RobotId(2),
            relative: pose(seen.z),
            covariance: covariance(&seen.R),
        });
        let message = self.message.as_ref().map(|message| NeighbourPose {
            stamp,
            origin: Origin::default(),
            pose: message.told().pose,
            parts: message.told().parts,
        });
        let fix = self.fix.as_ref().map(|fix| PositionFix {
            stamp,
            origin: Origin::default(),
            position: fix.y,
            covariance: covariance2(&fix.R),
            lever: [0.0; 2],
            slow: SlowError::default(),
        });
        let all = [
            odometry.map(Measurement::from),
            sighting.map(Measurement::from),
            message.map(Measurement::from),
            fix.map(Measurement::from),
        ];
        all.into_iter().flatten().collect()
    }
}

fn check(name: &str) {
    let Some(sequence) = read_vectors::<Sequence>(name) else {
        return;
    };
    assert!(sequence.expected.states.len() > 50);
    sequence.check(&sequence.run());
    sequence.check(&sequence.live());
}

#[test]
fn sequence_a() {
    check("honest/sequence_a.json");
}

#[test]
fn sequence_b_with_others() {
    check("honest/sequence_b.json");
}
