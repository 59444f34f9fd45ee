//! What leaders say and children answer, as it is recorded.

use coloc_estimator::assist::assistant::{Ack, Heard, Message, Words};
use coloc_estimator::assist::cross::Leader;
use coloc_estimator::assist::datum::Reading;
use coloc_estimator::assist::readings::{HeardReadings, Readings, Sight};
use coloc_estimator::assist::slot::Slot;
use coloc_estimator::assist::trail::Trail;
use coloc_estimator::{
    Covariance3, GlobalPose, LeaderPose, NotACovariance, Origin, Parts, Pose, RobotId, Span, Stamp,
};

use super::{Record, RecordedTick};

/// How many lines they are.
pub(super) fn count(words: &Words<'_>) -> usize {
    let data = words.data.iter();
    let lines = data.map(|it| 2 + usize::from(it.message.word.past.said));
    let readings = words.readings.iter();
    let readings = readings.map(|it| {
        let way = usize::from(it.readings.trail.is_some());
        1 + way + it.readings.sights().len()
    });
    usize::from(is_said(words)) + lines.sum::<usize>() + words.acks.len() + readings.sum::<usize>()
}

/// The lines.
pub(super) fn lines(words: &Words<'_>) -> impl Iterator<Item = Record> {
    let ahead_ns = words.ahead.as_nanos();
    let clock = is_said(words).then_some(Record::TeamClock { ahead_ns });
    let data = words.data.iter().flat_map(datum);
    let acks = words.acks.iter().map(Record::from);
    let readings = words.readings.iter().flat_map(readings);
    clock.into_iter().chain(data).chain(acks).chain(readings)
}

fn is_said(words: &Words<'_>) -> bool {
    words.ahead.as_nanos() != 0
}

fn datum(heard: &Heard) -> impl Iterator<Item = Record> {
    let Message { said, word, .. } = &heard.message;
    let head = Record::Assist {
        stamp_ns: heard.message.stamp.as_nanos(),
        sender: heard.origin.source,
        session: heard.origin.session,
        sequence: heard.origin.sequence,
        slot: heard.message.slot.0,
        path: heard.message.path.map(|it| it.0),
        robots: heard.message.robots,
        is_final: heard.message.is_final,
        digest: heard.message.digest,
        pose: said.pose.to_vector().into(),
        independent: said.parts.independent.to_row_major(),
        dependent: said.parts.dependent.to_row_major(),
    };
    let leader = Record::Leader {
        pose: word.leader.pose.to_vector().into(),
        covariance: word.leader.covariance.to_row_major(),
        known: word.past.known,
    };
    let said = usize::from(word.past.said);
    let past = word.past.transitions.iter().take(said);
    let past = past.map(|[[a, b, c], [d, e, f], [g, h, i]]| Record::Transition {
        phi: [*a, *b, *c, *d, *e, *f, *g, *h, *i],
    });
    [head, leader].into_iter().chain(past)
}

impl From<&Ack> for Record {
    fn from(ack: &Ack) -> Self {
        Self::AssistAck {
            stamp_ns: ack.stamp.as_nanos(),
            sender: ack.robot.0,
            slot: ack.slot.0,
            leader: ack.leader.0,
            taken: ack.taken,
        }
    }
}

/// Takes such a line in; `None` if it is of something else, or belongs to nothing.
pub(super) fn take(tick: &mut RecordedTick, record: Record) -> Option<Result<(), NotACovariance>> {
    match record {
        Record::TeamClock { ahead_ns } => tick.ahead_ns = ahead_ns,
        Record::AssistAck {
            stamp_ns,
            sender,
            slot,
            leader,
            taken,
        } => tick.acks.push(Ack {
            robot: RobotId(sender),
            slot: Slot(slot),
            stamp: Stamp::from_nanos(stamp_ns),
            leader: RobotId(leader),
            taken,
        }),
        Record::Leader {
            pose,
            covariance,
            known,
        } => {
            let heard = tick.data.last_mut()?;
            heard.message.word.past.known = known;
            heard.message.word.leader = match Covariance3::from_row_major(covariance) {
                Ok(covariance) => Leader {
                    pose: at(pose),
                    covariance,
                },
                Err(problem) => return Some(Err(problem)),
            };
        }
        Record::Transition { phi } => {
            let past = &mut tick.data.last_mut()?.message.word.past;
            let place = past.transitions.get_mut(usize::from(past.said))?;
            let [a, b, c, d, e, f, g, h, i] = phi;
            *place = [[a, b, c], [d, e, f], [g, h, i]];
            past.said += 1;
        }
        Record::Readings { .. } => return Some(heard(record)?.map(|it| tick.readings.push(it))),
        Record::Way { ends } => {
            let trail = tick.readings.last_mut()?.readings.trail.as_mut()?;
            trail.ends = ends.map(at);
        }
        Record::Sight { .. } => {
            let readings = &mut tick.readings.last_mut()?.readings;
            match sight(record)? {
                Ok(sight) if readings.push(sight) => {}
                Ok(_) => return None,
                Err(problem) => return Some(Err(problem)),
            }
        }
        Record::Assist { .. } => return Some(assist(record)?.map(|it| tick.data.push(it))),
        _ => return None,
    }
    Some(Ok(()))
}

fn assist(record: Record) -> Option<Result<Heard, NotACovariance>> {
    let Record::Assist {
        stamp_ns,
        sender,
        session,
        sequence,
        slot,
        path,
        robots,
        is_final,
        digest,
        pose,
        independent,
        dependent,
    } = record
    else {
        return None;
    };
    let parts = match Parts::from_row_major(independent, dependent) {
        Ok(parts) => parts,
        Err(problem) => return Some(Err(problem)),
    };
    Some(Ok(Heard {
        origin: Origin {
            source: sender,
            session,
            sequence,
        },
        message: Message {
            slot: Slot(slot),
            stamp: Stamp::from_nanos(stamp_ns),
            path: path.map(RobotId),
            robots,
            is_final,
            digest,
            said: GlobalPose {
                pose: at(pose),
                parts,
            },
            ..Message::default()
        },
    }))
}

fn readings(heard: &HeardReadings) -> impl Iterator<Item = Record> {
    let HeardReadings { origin, readings } = heard;
    let vector = |pose: &Pose| [pose.x, pose.y, pose.phi];
    let way = readings.trail.map(|it| Record::Way {
        ends: it.ends.map(|end| vector(&end)),
    });
    let head = Record::Readings {
        stamp_ns: readings.stamp.as_nanos(),
        sender: origin.source,
        session: origin.session,
        sequence: origin.sequence,
        slot: readings.slot.0,
        trace: readings.trace,
        way_covariance: readings.trail.map(|it| it.noise.to_row_major()),
    };
    let sights = readings.sights().iter().map(move |it| Record::Sight {
        since_ns: it.since.as_nanos(),
        observed: it.observed.0,
        pose: vector(&it.reading.relative),
        covariance: it.reading.covariance.to_row_major(),
    });
    std::iter::once(head).chain(way).chain(sights)
}

fn heard(record: Record) -> Option<Result<HeardReadings, NotACovariance>> {
    let Record::Readings {
        stamp_ns,
        sender,
        session,
        sequence,
        slot,
        trace,
        way_covariance,
    } = record
    else {
        return None;
    };
    let noise = match way_covariance.map(Covariance3::from_row_major).transpose() {
        Ok(noise) => noise,
        Err(problem) => return Some(Err(problem)),
    };
    Some(Ok(HeardReadings {
        origin: Origin {
            source: sender,
            session,
            sequence,
        },
        readings: Readings {
            slot: Slot(slot),
            stamp: Stamp::from_nanos(stamp_ns),
            trace,
            trail: noise.map(|noise| Trail {
                noise,
                ..Trail::default()
            }),
            ..Readings::default()
        },
    }))
}

fn sight(record: Record) -> Option<Result<Sight, NotACovariance>> {
    let Record::Sight {
        since_ns,
        observed,
        pose,
        covariance,
    } = record
    else {
        return None;
    };
    Some(
        Covariance3::from_row_major(covariance).map(|covariance| Sight {
            since: Span::from_nanos(since_ns),
            observed: RobotId(observed),
            reading: Reading {
                relative: at(pose),
                covariance,
            },
        }),
    )
}

/// As it was, not wrapped once more.
fn at([x, y, phi]: [f64; 3]) -> Pose {
    Pose { x, y, phi }
}

/// Where somebody gives the estimator what was taken, it is recorded as a final word.
impl From<&LeaderPose> for Record {
    fn from(taken: &LeaderPose) -> Self {
        let mut path = [0; 16];
        path[0] = taken.leader.0;
        Self::Assist {
            stamp_ns: taken.stamp.as_nanos(),
            sender: taken.leader.0,
            session: 0,
            sequence: 0,
            slot: taken.slot.0,
            path,
            robots: 1,
            is_final: true,
            digest: 0,
            pose: taken.said.pose.to_vector().into(),
            independent: taken.said.parts.independent.to_row_major(),
            dependent: taken.said.parts.dependent.to_row_major(),
        }
    }
}
