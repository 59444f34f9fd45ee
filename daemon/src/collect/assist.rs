//! What leaders say of this robot, and what children answer.

use coloc_estimator::assist::assistant::{Ack, Heard, Message};
use coloc_estimator::assist::cross::Leader;
use coloc_estimator::assist::datum::Reading;
use coloc_estimator::assist::events::Word;
use coloc_estimator::assist::readings::{HeardReadings, Readings, Sight};
use coloc_estimator::assist::slot::Slot;
use coloc_estimator::assist::trail::Trail;
use coloc_estimator::assist::transition::Past;
use coloc_estimator::{Covariance3, GlobalPose, Parts, RobotId, Span};
use coloc_shm_types::{
    self as shm, Assist, AssistAck, Input, Limits, PortError, Reject, RobotName, Space,
};

use super::list::List;
use super::messages::{not_a_covariance, origin, pose, stamp};
use super::port::Port;
use crate::account::Account;
use crate::clock::Moment;
use crate::config::{self, AssistMode};

/// A tick takes in so many messages at most; the others wait in shared memory for the next one.
const DATA: usize = 64;
const ACKS: usize = 64;
const READINGS: usize = 64;

/// The subscribers of a robot with a part in the team.
#[derive(Debug)]
pub(super) struct Assists {
    data: Port<Assist>,
    acks: Port<AssistAck>,
    leaders: Box<[u16]>,
    heard: List<Heard>,
    /// Each with the sender's session and count, which order them.
    answered: List<([u64; 2], Ack)>,
    settled: List<Ack>,
    /// Of a leader that is told what all see.
    readings: Option<Port<shm::Readings>>,
    told: List<HeardReadings>,
}

impl Assists {
    /// Subscribes to the channels of `name`, one of so many robots.
    pub(super) fn open(
        space: &Space,
        name: &RobotName,
        robots: usize,
        config: &config::Assist,
        id: u16,
    ) -> Result<Self, PortError> {
        let gathers = config.mode == AssistMode::Full && config.leaders.contains(&id);
        Ok(Self {
            data: Port::open(space, name, (Input::Assist, robots, DATA))?,
            acks: Port::open(space, name, (Input::AssistAck, robots, ACKS))?,
            leaders: config.leaders.clone().into(),
            heard: List::with_capacity(DATA),
            answered: List::with_capacity(ACKS),
            settled: List::with_capacity(ACKS),
            readings: gathers
                .then(|| Port::open(space, name, (Input::Readings, robots, READINGS)))
                .transpose()?,
            told: List::with_capacity(if gathers { READINGS } else { 0 }),
        })
    }

    pub(super) fn deaf(&self) -> impl Iterator<Item = Input> {
        let readings = self.readings.as_ref().and_then(Port::deaf);
        [self.data.deaf(), self.acks.deaf(), readings]
            .into_iter()
            .flatten()
    }

    pub(super) fn tell_sessions(&self, now: coloc_estimator::Stamp, account: &mut Account) {
        self.data.tell_sessions(now, account);
        self.acks.tell_sessions(now, account);
        if let Some(readings) = &self.readings {
            readings.tell_sessions(now, account);
        }
    }

    pub(super) fn receive(&mut self, moment: &Moment, limits: &Limits<'_>, account: &mut Account) {
        let leaders = &self.leaders;
        while let Some((message, heard)) = self
            .data
            .next(moment, account, |it| datum(it, limits, leaders))
        {
            match heard {
                Ok(heard) => {
                    let leader = heard.message.leader().0;
                    account.valid(Input::Assist, leader, heard.message.stamp);
                    let _ = self.heard.push(heard); // There is room for all that the port takes in.
                }
                Err(reason) => self.data.refuse(message.header.source, reason, account),
            }
        }
        while let Some((message, heard)) = self.acks.next(moment, account, |it| ack(it, limits)) {
            let header = &message.header;
            match heard {
                Ok(ack) => {
                    account.valid(Input::AssistAck, header.source, ack.stamp);
                    let _ = self.answered.push(([header.session, header.sequence], ack)); // Likewise.
                }
                Err(reason) => self.acks.refuse(header.source, reason, account),
            }
        }
        let Some(port) = &mut self.readings else {
            return;
        };
        while let Some((message, heard)) = port.next(moment, account, |it| readings(it, limits)) {
            let header = &message.header;
            match heard {
                Ok(heard) => {
                    account.valid(Input::Readings, header.source, heard.readings.stamp);
                    let _ = self.told.push(heard); // Likewise.
                }
                Err(reason) => port.refuse(header.source, reason, account),
            }
        }
    }

    /// Puts what has come in the order of senders and of their counts.
    pub(super) fn gather(&mut self) {
        self.heard.sort_by_key(|it| it.origin);
        self.told.sort_by_key(|it| it.origin);
        self.answered
            .sort_by_key(|(count, ack)| (ack.robot, *count));
        self.settled.clear();
        for (_, ack) in self.answered.as_slice() {
            let _ = self.settled.push(*ack); // There is room for as many.
        }
    }

    pub(super) fn data(&self) -> &[Heard] {
        self.heard.as_slice()
    }

    pub(super) fn acks(&self) -> &[Ack] {
        self.settled.as_slice()
    }

    pub(super) fn readings(&self) -> &[HeardReadings] {
        self.told.as_slice()
    }

    pub(super) fn clear(&mut self) {
        self.data.clear();
        self.acks.clear();
        self.heard.clear();
        self.answered.clear();
        self.settled.clear();
        self.told.clear();
        self.readings.iter_mut().for_each(Port::clear);
    }
}

/// What is said of this robot as the search takes it, whatever the message holds.
///
/// # Errors
/// Why it is none.
pub fn datum(message: &Assist, limits: &Limits<'_>, leaders: &[u16]) -> Result<Heard, Reject> {
    message.validate(limits)?;
    let parts = Parts::from_row_major(message.independent, message.dependent);
    let covariance = Covariance3::from_row_major(message.leader_covariance);
    let [leader, _, ..] = message.robots() else {
        return Err(Reject::BadPath);
    };
    if !leaders.contains(leader) {
        return Err(Reject::NotForRole);
    }
    Ok(Heard {
        origin: origin(message),
        message: Message {
            slot: Slot(message.slot),
            stamp: stamp(message),
            path: message.path.map(RobotId),
            robots: message.robots,
            is_final: message.flags & Assist::FINAL != 0,
            digest: message.digest,
            said: GlobalPose {
                pose: pose(message.pose),
                parts: parts.map_err(not_a_covariance)?,
            },
            word: Word {
                leader: Leader {
                    pose: pose(message.leader_pose),
                    covariance: covariance.map_err(not_a_covariance)?,
                },
                past: Past {
                    transitions: message.transitions.map(rows),
                    said: message.said,
                    known: message.known,
                },
            },
        },
    })
}

/// What a child answers as the search takes it, whatever the message holds.
///
/// # Errors
/// Why it is none.
pub fn ack(message: &AssistAck, limits: &Limits<'_>) -> Result<Ack, Reject> {
    message.validate(limits)?;
    Ok(Ack {
        robot: RobotId(message.header.source),
        slot: Slot(message.slot),
        stamp: stamp(message),
        leader: RobotId(message.leader),
        taken: message.taken == 1,
    })
}

/// What another robot has seen as a leader takes it, whatever the message holds.
///
/// # Errors
/// Why it is none.
pub fn readings(message: &shm::Readings, limits: &Limits<'_>) -> Result<HeardReadings, Reject> {
    message.validate(limits)?;
    let has = |flag| message.flags & flag != 0;
    let covariance = |rows| Covariance3::from_row_major(rows).map_err(not_a_covariance);
    let noise = covariance(message.way_covariance)?;
    let mut readings = Readings {
        slot: Slot(message.slot),
        stamp: stamp(message),
        trace: has(shm::Readings::LEADS).then_some(message.trace),
        trail: has(shm::Readings::WAY).then(|| Trail {
            ends: message.way.map(pose),
            noise,
        }),
        ..Readings::default()
    };
    for sight in message.sights() {
        let _ = readings.push(Sight {
            observed: RobotId(sight.observed),
            since: Span::from_nanos(sight.since_ns),
            reading: Reading {
                relative: pose(sight.pose),
                covariance: covariance(sight.covariance)?,
            },
        }); // There is room for as many as a message holds.
    }
    Ok(HeardReadings {
        origin: origin(message),
        readings,
    })
}

fn rows([a, b, c, d, e, f, g, h, i]: [f32; 9]) -> [[f32; 3]; 3] {
    [[a, b, c], [d, e, f], [g, h, i]]
}
