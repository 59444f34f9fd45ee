//! The three subscribers: drained, validated, and turned into what the estimator computes on.

use coloc_estimator::{
    Covariance2, Covariance3, NeighbourPose, Pose, PositionFix, RobotId, Sighting, Span, Stamp,
};
use coloc_shm_types::{
    Header, Input, Limits, Message, Neighbour, PortError, Position, Reject, RelativePose, Replay,
    Space, Subscriber,
};

use super::list::List;
use crate::account::Account;
use crate::config::{Config, nanos};

/// A tick takes in so many messages at most; the others wait in shared memory for the next one.
const SIGHTINGS: usize = 128;
const FIXES: usize = 32;
const NEIGHBOURS: usize = 256;

/// The subscribers and what they have received before.
#[derive(Debug)]
pub struct Messages {
    sightings: Subscriber<RelativePose>,
    fixes: Subscriber<Position>,
    neighbours: Subscriber<Neighbour>,
    team: Team,
    seen_sightings: Replay,
    seen_fixes: Replay,
    /// By place in `team.robots`.
    seen_neighbours: Box<[Replay]>,
}

/// What a message is held against.
#[derive(Debug)]
struct Team {
    own: u16,
    robots: Box<[u16]>,
    history_ns: i64,
    future_tolerance_ns: i64,
    set_back_ns: i64,
}

/// What this tick's messages are, valid and converted.
#[derive(Debug)]
pub struct Received {
    /// Own sightings.
    pub sightings: List<Sighting>,
    /// Poses from neighbours.
    pub neighbours: List<NeighbourPose>,
    /// Satellite fixes.
    pub fixes: List<PositionFix>,
}

impl Default for Received {
    fn default() -> Self {
        Self {
            sightings: List::with_capacity(SIGHTINGS),
            neighbours: List::with_capacity(NEIGHBOURS),
            fixes: List::with_capacity(FIXES),
        }
    }
}

impl Received {
    /// Forgets everything.
    pub fn clear(&mut self) {
        self.sightings.clear();
        self.neighbours.clear();
        self.fixes.clear();
    }
}

impl Messages {
    /// Subscribes; publishers that are there already are connected before the first tick.
    ///
    /// # Errors
    /// If a port cannot be opened.
    pub fn open(config: &Config, space: &Space) -> Result<Self, PortError> {
        let own = config.robot.id;
        let robots: Box<[u16]> = std::iter::once(own)
            .chain(config.peers().map(|peer| peer.id))
            .collect();
        let name = &config.robot.name;
        let history_ns = nanos(config.history.length_s);
        let future_tolerance_ns = nanos(config.history.future_tolerance_s);
        let opened = Self {
            sightings: space.subscriber(name)?,
            fixes: space.subscriber(name)?,
            neighbours: space.subscriber(name)?,
            seen_sightings: Replay::new(),
            seen_fixes: Replay::new(),
            seen_neighbours: robots.iter().map(|_| Replay::new()).collect(),
            team: Team {
                own,
                robots,
                history_ns,
                future_tolerance_ns,
                set_back_ns: 0,
            },
        };
        // Whom this does not reach now the first receive will.
        let _ = (
            opened.sightings.refresh(),
            opened.fixes.refresh(),
            opened.neighbours.refresh(),
        );
        Ok(opened)
    }

    /// Takes in what has arrived until `now`, as far as there is room.
    pub fn receive(&mut self, now: Stamp, into: &mut Received, account: &mut Account) {
        let limits = self.team.limits(now);
        let seen = &mut self.seen_sightings;
        drain(
            &self.sightings,
            &mut into.sightings,
            Input::RelativePose,
            account,
            |message: &RelativePose| {
                message.validate(&limits)?;
                let sighting = sighting(message)?;
                seen.accept(&message.header)
                    .map(|()| (sighting, message.header))
            },
        );
        let seen = &mut self.seen_fixes;
        drain(
            &self.fixes,
            &mut into.fixes,
            Input::Position,
            account,
            |message: &Position| {
                message.validate(&limits)?;
                let fix = fix(message)?;
                seen.accept(&message.header).map(|()| (fix, message.header))
            },
        );
        let seen = &mut self.seen_neighbours;
        drain(
            &self.neighbours,
            &mut into.neighbours,
            Input::Neighbour,
            account,
            |message: &Neighbour| {
                message.validate(&limits)?;
                let neighbour = neighbour(message)?;
                let place = limits
                    .robots
                    .iter()
                    .position(|&robot| robot == message.sender);
                let window = place
                    .and_then(|place| seen.get_mut(place))
                    .ok_or(Reject::UnknownRobot)?;
                window
                    .accept(&message.header)
                    .map(|()| (neighbour, message.header))
            },
        );
    }

    /// The clock was stepped: sessions that began under the old one say nothing about which is newer, and after a
    /// step back they may seem to lie in the future.
    pub fn shift(&mut self, shift: Span) {
        self.team.set_back_ns = self
            .team
            .set_back_ns
            .saturating_sub(shift.as_nanos())
            .max(0);
        self.seen_sightings = Replay::new();
        self.seen_fixes = Replay::new();
        self.seen_neighbours.fill(Replay::new());
    }
}

impl Team {
    fn limits(&self, now: Stamp) -> Limits<'_> {
        Limits {
            now_ns: now.as_nanos(),
            history_ns: self.history_ns,
            future_tolerance_ns: self.future_tolerance_ns,
            set_back_ns: self.set_back_ns,
            own: self.own,
            robots: &self.robots,
        }
    }
}

fn drain<M: Message, T>(
    port: &Subscriber<M>,
    into: &mut List<T>,
    input: Input,
    account: &mut Account,
    mut accept: impl FnMut(&M) -> Result<(T, Header), Reject>,
) {
    while !into.is_full() {
        let message = match port.receive() {
            Ok(Some(message)) => message,
            Ok(None) => return,
            // One publisher's messages cannot be read; the others' come at the next tick.
            Err(_) => return account.unreadable(input),
        };
        match accept(&message) {
            Ok((value, header)) => {
                account.valid(input, Stamp::from_nanos(header.stamp_ns));
                // There is room: the loop's condition.
                let _ = into.push(value);
            }
            Err(Reject::Replayed) => account.rejected(input, Reject::Replayed),
            Err(reason) => account.invalid(input, reason),
        }
    }
}

fn sighting(message: &RelativePose) -> Result<Sighting, Reject> {
    Ok(Sighting {
        stamp: Stamp::from_nanos(message.header.stamp_ns),
        sequence: message.header.sequence,
        observed: RobotId(message.observed),
        relative: pose(message.pose),
        covariance: covariance(message.covariance)?,
    })
}

fn fix(message: &Position) -> Result<PositionFix, Reject> {
    Ok(PositionFix {
        stamp: Stamp::from_nanos(message.header.stamp_ns),
        sequence: message.header.sequence,
        position: message.position,
        covariance: Covariance2::from_row_major(message.covariance).map_err(not_a_covariance)?,
    })
}

fn neighbour(message: &Neighbour) -> Result<NeighbourPose, Reject> {
    Ok(NeighbourPose {
        stamp: Stamp::from_nanos(message.header.stamp_ns),
        sequence: message.header.sequence,
        sender: RobotId(message.sender),
        pose: pose(message.pose),
        total: covariance(message.total)?,
        independent: covariance(message.independent)?,
    })
}

fn pose([x, y, phi]: [f64; 3]) -> Pose {
    Pose::new(x, y, phi)
}

fn covariance(rows: [f64; 9]) -> Result<Covariance3, Reject> {
    Covariance3::from_row_major(rows).map_err(not_a_covariance)
}

fn not_a_covariance(problem: coloc_estimator::NotACovariance) -> Reject {
    use coloc_estimator::NotACovariance as Problem;
    match problem {
        Problem::NotFinite => Reject::NotFinite,
        Problem::Asymmetric => Reject::Asymmetric,
        Problem::NotPositiveSemidefinite => Reject::NotPositiveSemidefinite,
    }
}
