//! The three subscribers: drained, validated, and turned into what the estimator computes on.

use coloc_estimator::{
    Covariance2, Covariance3, Measurement, NeighbourPose, Origin, Pose, PositionFix, RobotId,
    Sighting, Stamp,
};
use coloc_shm_types::{
    Header, Input, Limits, Message, Neighbour, PortError, Position, Reject, RelativePose, Replay,
    Space, Subscriber,
};

use super::list::List;
use crate::account::Account;
use crate::clock::Moment;
use crate::config::{ClockSource, Config, nanos};

/// A tick takes in so many messages at most; the others wait in shared memory for the next one.
const SIGHTINGS: usize = 128;
const FIXES: usize = 32;
const NEIGHBOURS: usize = 256;
/// So many of all kinds.
pub const MOST: usize = SIGHTINGS + FIXES + NEIGHBOURS;

/// The subscribers and what they have received before.
#[derive(Debug)]
pub struct Messages {
    /// Of their stamps.
    clock: ClockSource,
    sightings: Port<RelativePose>,
    fixes: Port<Position>,
    neighbours: Port<Neighbour>,
    team: Team,
    seen_sightings: Replay,
    seen_fixes: Replay,
    /// By place in `team.robots`.
    seen_neighbours: Box<[Replay]>,
}

/// A subscriber, and how much of it a tick takes.
#[derive(Debug)]
struct Port<M: Message> {
    subscriber: Subscriber<M>,
    input: Input,
    /// How many messages a tick still takes in, and how many it takes in all.
    left: usize,
    most: usize,
}

/// What a message is held against.
#[derive(Debug)]
struct Team {
    own: u16,
    robots: Box<[u16]>,
    history_ns: i64,
    future_tolerance_ns: i64,
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
            clock: config.clock.source,
            sightings: Port::new(space.subscriber(name)?, Input::RelativePose, SIGHTINGS),
            fixes: Port::new(space.subscriber(name)?, Input::Position, FIXES),
            neighbours: Port::new(space.subscriber(name)?, Input::Neighbour, NEIGHBOURS),
            seen_sightings: Replay::new(),
            seen_fixes: Replay::new(),
            seen_neighbours: robots.iter().map(|_| Replay::new()).collect(),
            team: Team {
                own,
                robots,
                history_ns,
                future_tolerance_ns,
            },
        };
        // Whom this does not reach now the first receive will.
        let _ = (
            opened.sightings.subscriber.refresh(),
            opened.fixes.subscriber.refresh(),
            opened.neighbours.subscriber.refresh(),
        );
        Ok(opened)
    }

    /// Takes in what has arrived until `now`, as far as there is room.
    pub fn receive(
        &mut self,
        moment: &Moment,
        into: &mut List<Measurement>,
        account: &mut Account,
    ) {
        let limits = self.team.limits(moment);
        let inner = |header: &mut Header| {
            header.stamp_ns = moment.of_message(self.clock, header.stamp_ns);
        };
        let seen = &mut self.seen_sightings;
        self.sightings.drain(into, account, |message| {
            inner(&mut message.header);
            message.validate(&limits)?;
            let sighting = sighting(message)?;
            seen.accept(&message.header)
                .map(|()| (sighting.into(), message.header))
        });
        let seen = &mut self.seen_fixes;
        self.fixes.drain(into, account, |message| {
            inner(&mut message.header);
            message.validate(&limits)?;
            let fix = fix(message)?;
            seen.accept(&message.header)
                .map(|()| (fix.into(), message.header))
        });
        let seen = &mut self.seen_neighbours;
        self.neighbours.drain(into, account, |message| {
            inner(&mut message.header);
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
                .map(|()| (neighbour.into(), message.header))
        });
    }

    /// The tick is over: the next one takes in as many again.
    pub fn clear(&mut self) {
        self.sightings.left = self.sightings.most;
        self.fixes.left = self.fixes.most;
        self.neighbours.left = self.neighbours.most;
    }
}

impl Team {
    fn limits(&self, moment: &Moment) -> Limits<'_> {
        Limits {
            now_ns: moment.stamp.as_nanos(),
            history_ns: self.history_ns,
            future_tolerance_ns: self.future_tolerance_ns,
            set_back_ns: i64::MAX,
            own: self.own,
            robots: &self.robots,
        }
    }
}

impl<M: Message> Port<M> {
    fn new(subscriber: Subscriber<M>, input: Input, most: usize) -> Self {
        Self {
            subscriber,
            input,
            left: most,
            most,
        }
    }

    fn drain(
        &mut self,
        into: &mut List<Measurement>,
        account: &mut Account,
        mut accept: impl FnMut(&mut M) -> Result<(Measurement, Header), Reject>,
    ) {
        let input = self.input;
        while self.left > 0 {
            let mut message = match self.subscriber.receive() {
                Ok(Some(message)) => message,
                Ok(None) => return,
                // One publisher's messages cannot be read; the others' come at the next tick.
                Err(_) => return account.unreadable(input),
            };
            // Refused ones count: a flood of them must not make the tick longer than a flood of good ones.
            self.left -= 1;
            match accept(&mut message) {
                Ok((measurement, header)) => {
                    account.valid(input, Stamp::from_nanos(header.stamp_ns));
                    // There is room: the list holds what all the ports take in.
                    let _ = into.push(measurement);
                }
                Err(Reject::Replayed) => account.rejected(input, Reject::Replayed),
                Err(reason) => account.invalid(input, reason),
            }
        }
    }
}

fn sighting(message: &RelativePose) -> Result<Sighting, Reject> {
    Ok(Sighting {
        stamp: Stamp::from_nanos(message.header.stamp_ns),
        origin: Origin::counted(message.header.sequence),
        observed: RobotId(message.observed),
        relative: pose(message.pose),
        covariance: covariance(message.covariance)?,
    })
}

fn fix(message: &Position) -> Result<PositionFix, Reject> {
    Ok(PositionFix {
        stamp: Stamp::from_nanos(message.header.stamp_ns),
        origin: Origin::counted(message.header.sequence),
        position: message.position,
        covariance: Covariance2::from_row_major(message.covariance).map_err(not_a_covariance)?,
    })
}

fn neighbour(message: &Neighbour) -> Result<NeighbourPose, Reject> {
    Ok(NeighbourPose {
        stamp: Stamp::from_nanos(message.header.stamp_ns),
        origin: Origin {
            source: message.sender,
            ..Origin::counted(message.header.sequence)
        },
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
