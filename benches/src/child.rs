//! A child with fifteen neighbours and three leaders, five events a second; and the same robot in the same team without leaders.

use std::hint::black_box;

use coloc_estimator::assist::assistant::{
    Ack, Agreement, Assistant, Heard, Message, Words, step as step_among,
};
use coloc_estimator::assist::cross::Leader;
use coloc_estimator::assist::events::Word;
use coloc_estimator::assist::search::Patience;
use coloc_estimator::assist::slot::Slot;
use coloc_estimator::assist::transition::{Past, TRANSITIONS};
use coloc_estimator::convert::GlobalPose;
use coloc_estimator::history::Slot as Place;
use coloc_estimator::{
    Estimator, Measurement, NeighbourPose, NotACovariance, OdometrySample, Origin, Pose, RobotId,
    Settings, Sighting, Span, Stamp, TickInputs, step,
};

use crate::case;
use crate::robot::DEFAULT_SLOTS;

const PERIOD: Span = Span::from_millis(20);
const EVENT: Span = Span::from_millis(200);
/// Ticks from one event to the next.
const TICKS: u32 = 10;
const LEADERS: u16 = 3;
const OWN: u16 = 4;
const NEIGHBOURS: u16 = 15;

/// The robot, its clock and its team.
#[derive(Clone, Debug)]
pub struct Child {
    estimator: Estimator<Vec<Place>>,
    /// `None`: it has no part in a team, and everybody tells it what they see of it.
    assistant: Option<Box<Assistant>>,
    now: Stamp,
    sequence: u64,
    word: GlobalPose,
    pose: Pose,
    measurements: Vec<Measurement>,
    data: Vec<Heard>,
    acks: Vec<Ack>,
}

fn leaders() -> impl Iterator<Item = u16> {
    1..=LEADERS
}

fn neighbours() -> impl Iterator<Item = u16> {
    OWN + 1..=OWN + NEIGHBOURS
}

impl Child {
    /// One that has lived for two seconds.
    ///
    /// # Errors
    /// None, unless a number of [`case`] is changed for the worse.
    pub fn warm(is_child: bool) -> Result<Self, NotACovariance> {
        let mut settings = Settings::default();
        settings.fusion.gate = f64::INFINITY;
        let now = Stamp::from_nanos(1_000_000_000);
        let places = vec![Place::default(); DEFAULT_SLOTS];
        let mut child = Self {
            estimator: Estimator::new(settings, now, case::belief()?, places),
            assistant: is_child.then(assistant).flatten(),
            now,
            sequence: 0,
            word: case::received(0.5)?,
            pose: case::belief()?.pose,
            measurements: Vec::with_capacity(64),
            data: Vec::with_capacity(64),
            acks: Vec::with_capacity(64),
        };
        for _ in 0..10 {
            child.event()?;
        }
        Ok(child)
    }

    /// All ticks of an event: in the first one comes everything that robots see and say of it, in the second what they answer.
    ///
    /// # Errors
    /// As [`Self::warm`].
    pub fn event(&mut self) -> Result<f64, NotACovariance> {
        self.clear();
        self.hear_all()?;
        let mut x = self.first_tick();
        self.clear();
        if self.assistant.is_some() {
            self.hear_answers();
        }
        for _ in 1..TICKS {
            x += self.tick();
            self.clear();
        }
        Ok(x)
    }

    /// How many data the child has taken, declined, and handed on.
    #[must_use]
    pub fn counts(&self) -> Option<[u64; 3]> {
        let counts = self.assistant.as_ref()?.counts();
        Some([counts.accepted, counts.declined, counts.forwarded])
    }

    /// By a name of its own, so that it can be counted alone.
    #[inline(never)]
    pub fn first_tick(&mut self) -> f64 {
        self.tick()
    }

    fn clear(&mut self) {
        self.measurements.clear();
        self.data.clear();
        self.acks.clear();
    }

    /// At the tick to come.
    fn at(&self) -> Stamp {
        self.now + PERIOD
    }

    fn origin(&mut self, source: u16) -> Origin {
        self.sequence += 1;
        Origin {
            source,
            ..Origin::counted(self.sequence)
        }
    }

    fn hear_all(&mut self) -> Result<(), NotACovariance> {
        let (relative, covariance) = case::sighting()?;
        for robot in neighbours() {
            let sighting = Sighting {
                stamp: self.at(),
                origin: self.origin(0),
                observed: RobotId(robot),
                relative,
                covariance,
            };
            self.measurements.push(sighting.into());
        }
        if self.assistant.is_none() {
            for robot in leaders().chain(neighbours()) {
                let told = NeighbourPose {
                    stamp: self.at(),
                    origin: self.origin(robot),
                    pose: self.pose,
                    parts: self.word.parts,
                };
                self.measurements.push(told.into());
            }
            return Ok(());
        }
        for leader in leaders() {
            self.hear(&[leader, OWN], leader);
        }
        for robot in neighbours() {
            for leader in leaders() {
                self.hear(&[leader, robot, OWN], robot);
            }
        }
        Ok(())
    }

    fn hear(&mut self, way: &[u16], sender: u16) {
        let stamp = self.at();
        let mut message = Message {
            slot: Slot(stamp.as_nanos().div_euclid(EVENT.as_nanos())),
            stamp,
            robots: u8::try_from(way.len()).unwrap_or(0),
            said: GlobalPose {
                pose: self.pose,
                parts: self.word.parts,
            },
            word: Word {
                leader: Leader {
                    pose: Pose::new(self.pose.x - 2.0, self.pose.y, 0.0),
                    covariance: self.word.parts.dependent,
                },
                past: standing(),
            },
            ..Message::default()
        };
        for (id, robot) in message.path.iter_mut().zip(way) {
            *id = RobotId(*robot);
        }
        let origin = self.origin(sender);
        self.data.push(Heard { origin, message });
    }

    /// Everybody uses what was handed on: of which leader, the search knows by whom it was sent to.
    fn hear_answers(&mut self) {
        let stamp = self.now;
        for robot in neighbours() {
            self.acks.push(Ack {
                robot: RobotId(robot),
                slot: Slot(stamp.as_nanos().div_euclid(EVENT.as_nanos())),
                stamp,
                leader: RobotId(1),
                taken: true,
            });
        }
    }

    fn tick(&mut self) -> f64 {
        let start = self.now;
        self.now = start + PERIOD;
        self.measurements
            .push(Measurement::Odometry(OdometrySample {
                source: 0,
                start,
                stamp: self.now,
                motion: case::motion(),
            }));
        let inputs = TickInputs {
            stamp: self.now,
            measurements: &self.measurements,
        };
        let outputs = match &mut self.assistant {
            None => step(&mut self.estimator, black_box(&inputs)),
            Some(assistant) => {
                let words = Words {
                    ahead: Span::ZERO,
                    data: &self.data,
                    acks: &self.acks,
                    ..Words::default()
                };
                step_among(&mut self.estimator, assistant, black_box(&inputs), &words).0
            }
        };
        self.pose = outputs.estimate.belief.pose;
        self.pose.x
    }
}

/// Of a leader that has stood for long.
fn standing() -> Past {
    let unit = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    Past {
        transitions: [unit; TRANSITIONS],
        said: 8,
        known: 8,
    }
}

fn assistant() -> Option<Box<Assistant>> {
    let ids = |robots: &mut dyn Iterator<Item = u16>| robots.map(RobotId).collect::<Vec<_>>();
    let patience = Patience {
        ack_timeout: 160,
        close_after: 160 + 2 * 20 * u32::from(OWN + NEIGHBOURS),
    };
    let (leaders, children) = (ids(&mut leaders()), ids(&mut (OWN..=OWN + NEIGHBOURS)));
    let agreement = Agreement::new(&leaders, &children, EVENT, patience).ok()?;
    Assistant::new(agreement, RobotId(OWN)).map(Box::new)
}

#[cfg(test)]
mod tests {
    use coloc_estimator::assist::bond::Bonds;

    use super::*;

    #[test]
    fn at_each_event_a_datum_of_each_leader_is_taken_and_every_neighbour_is_told() {
        let mut child = Child::warm(true).unwrap();
        let before = child.counts().unwrap();
        child.event().unwrap();
        let after = child.counts().unwrap();
        let of_one: Vec<u64> = (0..3).map(|i| after[i] - before[i]).collect();
        assert_eq!(of_one, [3, 45, 15]);
        assert_eq!(Child::warm(false).unwrap().counts(), None);
    }

    /// As docs/leaders.md has it.
    #[test]
    fn what_a_child_remembers_of_its_leaders_errors_is_less_than_2_kib() {
        let size = size_of::<Bonds>();
        assert!((8 * 3 * 72..=2048).contains(&size), "{size} B");
    }
}
