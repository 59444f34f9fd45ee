//! Messages as the channels carry them, and as a [`Seat`](coloc_rounds::seat::Seat) understands them. Robots have team numbers there, and places in the
//! ascending list of these here.

use std::sync::Arc;

use coloc_estimator::Pose;
use coloc_estimator::rounds::row_major;
use coloc_rounds::model::Kind;
use coloc_rounds::round::{Entry, Robot};
use coloc_rounds::{Correction, Going, Message, Round, Share, Shared, Sighting, Standing};
use coloc_shm_types as shm;
use nalgebra::Matrix3;

use coloc_rounds::seat::{Deed, Told};

/// The team numbers, ascending.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Team(Vec<u16>);

impl Team {
    /// Of these robots, each once.
    #[must_use]
    pub fn new(robots: impl Iterator<Item = u16>) -> Self {
        let mut robots: Vec<u16> = robots.collect();
        robots.sort_unstable();
        robots.dedup();
        Self(robots)
    }

    /// All of them.
    #[must_use]
    pub fn numbers(&self) -> &[u16] {
        &self.0
    }

    /// The place of a robot.
    #[must_use]
    pub fn place(&self, number: u16) -> Option<Robot> {
        self.0.binary_search(&number).ok()
    }

    /// The number of a robot; zero, which nobody has, beyond the last one.
    #[must_use]
    pub fn number(&self, place: Robot) -> u16 {
        self.0.get(place).copied().unwrap_or_default()
    }
}

/// What `colocd` says at a slot.
#[must_use]
pub fn told(message: &shm::Shared) -> Told {
    let since = message.since;
    let standing = match message.standing {
        shm::Shared::JOINING => Standing::Joining(since),
        shm::Shared::SINCE => Standing::Since(since),
        shm::Shared::NOWHERE => return Told::Nowhere,
        _ => return Told::Apart,
    };
    Told::Belief(Shared {
        slot: message.slot,
        pose: pose(message.pose),
        covariance: matrix(&message.covariance),
        psi: matrix(&message.psi),
        standing,
    })
}

/// What `colocd` is to do.
#[must_use]
pub fn correction(deed: &Deed) -> shm::Correction {
    let blank = shm::Correction::default();
    match deed {
        Deed::Correct(told) => shm::Correction {
            slot: told.slot,
            pose: told.pose.to_vector().into(),
            covariance: row_major(&told.covariance),
            factor: told.factor,
            kind: shm::Correction::CORRECT,
            ..blank
        },
        Deed::Undo(Some(slot)) => shm::Correction {
            slot: *slot,
            kind: shm::Correction::UNDO,
            ..blank
        },
        Deed::Undo(None) => shm::Correction {
            kind: shm::Correction::UNDO_ALL,
            ..blank
        },
        Deed::Join => shm::Correction {
            kind: shm::Correction::JOIN,
            ..blank
        },
        Deed::Leave => shm::Correction {
            kind: shm::Correction::LEAVE,
            ..blank
        },
    }
}

/// What a robot tells a leader.
#[must_use]
pub fn share(team: &Team, leader: Robot, known: u64, share: &Share) -> shm::Share {
    let Shared {
        slot,
        pose,
        covariance,
        psi,
        standing,
    } = &share.shared;
    let (standing, since) = match standing {
        Standing::Joining(from) => (shm::Shared::JOINING, *from),
        Standing::Since(last) => (shm::Shared::SINCE, *last),
    };
    let mut message = shm::Share {
        slot: *slot,
        known,
        since,
        pose: pose.to_vector().into(),
        covariance: row_major(covariance),
        psi: row_major(psi),
        velocity: share.going.velocity,
        velocity_noise: row_major(&share.going.noise),
        leader: team.number(leader),
        standing,
        ..shm::Share::default()
    };
    for (place, seen) in message.seen.iter_mut().zip(&share.sightings) {
        *place = shm::SeenAtSlot {
            observed: team.number(seen.observed),
            reserved: [0; 6],
            age_s: seen.age_s,
            pose: seen.y,
            covariance: row_major(&symmetric(&seen.noise)),
        };
        message.seen_count += 1;
    }
    message
}

/// Of a message that is valid in this team.
#[must_use]
pub fn heard_share(team: &Team, message: &shm::Share) -> Option<Message> {
    let standing = match message.standing {
        shm::Shared::JOINING => Standing::Joining(message.since),
        _ => Standing::Since(message.since),
    };
    let sightings = message.seen().iter().map(|it| {
        Some(Sighting {
            kind: Kind::Pose,
            observed: team.place(it.observed)?,
            y: it.pose,
            noise: matrix(&it.covariance),
            age_s: it.age_s,
        })
    });
    Some(Message::Share {
        leader: team.place(message.leader)?,
        known: message.known,
        share: Box::new(Share {
            robot: team.place(message.header.source)?,
            shared: Shared {
                slot: message.slot,
                pose: pose(message.pose),
                covariance: matrix(&message.covariance),
                psi: matrix(&message.psi),
                standing,
            },
            going: Going {
                velocity: message.velocity,
                noise: matrix(&message.velocity_noise),
            },
            sightings: sightings.collect::<Option<_>>()?,
        }),
    })
}

/// What came of a slot.
#[must_use]
#[allow(clippy::cast_possible_truncation)] // Sixteen at most.
pub fn round(team: &Team, round: &Round) -> shm::Round {
    let mut message = shm::Round {
        slot: round.slot,
        leader: team.number(round.leader),
        count: team.numbers().len() as u8,
        ..shm::Round::default()
    };
    for (place, number) in message.robots.iter_mut().zip(team.numbers()) {
        *place = *number;
    }
    for (place, entry) in message.entries.iter_mut().zip(&round.entries) {
        let Some(Entry { correction, owed }) = entry else {
            continue;
        };
        *place = shm::RoundEntry {
            slot: correction.slot,
            pose: correction.pose.to_vector().into(),
            covariance: row_major(&correction.covariance),
            factor: correction.factor,
            owed: *owed,
            is_there: 1,
            reserved: [0; 7],
        };
    }
    for (place, block) in message.cross.iter_mut().zip(round.crosses()) {
        *place = row_major(block);
    }
    message
}

/// Of a message that is valid in this team.
#[must_use]
pub fn heard_round(team: &Team, message: &shm::Round) -> Option<Message> {
    let robots = team.numbers().len();
    if message.robots() != team.numbers() {
        return None;
    }
    let entries = message.entries.iter().take(robots).map(|it| {
        (it.is_there == 1).then(|| Entry {
            correction: Correction {
                slot: it.slot,
                pose: pose(it.pose),
                covariance: matrix(&it.covariance),
                factor: it.factor,
            },
            owed: it.owed,
        })
    });
    let pairs = robots * robots.saturating_sub(1) / 2;
    let cross = message.cross.iter().take(pairs).map(matrix);
    let round = Round::from_parts(
        message.slot,
        team.place(message.leader)?,
        entries.collect(),
        cross.collect(),
    )?;
    Some(Message::Round(Arc::new(round)))
}

/// That a robot is there, or asks `to`.
#[must_use]
pub fn call(team: &Team, slot: u64, known: u64, to: Option<Robot>) -> shm::Call {
    shm::Call {
        slot,
        known,
        to: to.map_or(0, |it| team.number(it)),
        kind: if to.is_some() {
            shm::Call::ASK
        } else {
            shm::Call::HERE
        },
        ..shm::Call::default()
    }
}

/// Of a message that is valid in this team; `None` if it asks another one than `me`.
#[must_use]
pub fn heard_call(team: &Team, me: Robot, message: &shm::Call) -> Option<Message> {
    let from = team.place(message.header.source)?;
    let known = message.known;
    if message.kind == shm::Call::HERE {
        let slot = message.slot;
        return Some(Message::Hello { from, slot, known });
    }
    (team.place(message.to) == Some(me)).then_some(Message::Ask { from, known })
}

/// As it was, not wrapped once more.
fn pose([x, y, phi]: [f64; 3]) -> Pose {
    Pose { x, y, phi }
}

pub(crate) fn matrix(rows: &[f64; 9]) -> Matrix3<f64> {
    Matrix3::from_row_slice(rows)
}

fn symmetric(matrix: &Matrix3<f64>) -> Matrix3<f64> {
    0.5 * (matrix + matrix.transpose())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_round_comes_back_to_the_bit() {
        let team = Team::new([9, 4, 7].into_iter());
        let covariance = Matrix3::new(0.1, 0.01, 0.0, 0.01, 0.2, 0.0, 0.0, 0.0, 0.3);
        let beliefs = [(Pose::new(1.0, 2.0, 3.0), covariance); 3];
        let mut made = Round::together(&beliefs);
        (made.slot, made.leader, made.entries[1]) = (8, 2, None);
        let message = round(&team, &made);
        assert_eq!((message.robots(), message.leader), (&[4, 7, 9][..], 9));
        assert_eq!(
            heard_round(&team, &message),
            Some(Message::Round(Arc::new(made)))
        );
        let other = Team::new([9, 4, 8].into_iter());
        assert_eq!(heard_round(&other, &message), None);
    }
}
