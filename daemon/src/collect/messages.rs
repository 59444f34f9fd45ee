//! The three subscribers: drained, validated, and turned into what the estimator computes on.

use coloc_estimator::{
    Covariance2, Covariance3, Measurement, NeighbourPose, Origin, Parts, Pose, PositionFix,
    RobotId, Sighting, Stamp,
};
use coloc_shm_types::{
    Clock, Input, Limits, Message, Neighbour, PortError, Position, Present, Reject, RelativePose,
    Sessions, Space, Subscriber, boot,
};

use super::list::List;
use crate::account::Account;
use crate::clock::Moment;
use crate::config::{Config, nanos};

/// A tick takes in so many messages at most; the others wait in shared memory for the next one.
const SIGHTINGS: usize = 128;
const FIXES: usize = 32;
const NEIGHBOURS: usize = 256;
/// So many of all kinds.
pub const MOST: usize = SIGHTINGS + FIXES + NEIGHBOURS;

/// The subscribers and what they have received before.
#[derive(Debug)]
pub struct Messages {
    sightings: Port<RelativePose>,
    fixes: Port<Position>,
    neighbours: Port<Neighbour>,
    team: Team,
}

/// A subscriber, who was heard there, and how much of it a tick takes.
#[derive(Debug)]
struct Port<M: Message> {
    subscriber: Subscriber<M>,
    sessions: Sessions,
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
    boot: u64,
    history_ns: i64,
    future_tolerance_ns: i64,
}

impl Messages {
    /// Subscribes; publishers that are there already are connected before the first tick.
    ///
    /// # Errors
    /// If a port cannot be opened.
    pub fn open(config: &Config, space: &Space) -> Result<Self, PortError> {
        let team = Team::new(config);
        let (name, sensors) = (&config.robot.name, Sessions::SENSORS);
        let robots = team.robots.len();
        let opened = Self {
            sightings: Port::open(
                space.subscriber(name)?,
                Input::RelativePose,
                sensors,
                SIGHTINGS,
            ),
            fixes: Port::open(space.subscriber(name)?, Input::Position, sensors, FIXES),
            neighbours: Port::open(
                space.subscriber(name)?,
                Input::Neighbour,
                robots,
                NEIGHBOURS,
            ),
            team,
        };
        // Whom this does not reach now the first receive will.
        let _ = (
            opened.sightings.subscriber.refresh(),
            opened.fixes.subscriber.refresh(),
            opened.neighbours.subscriber.refresh(),
        );
        Ok(opened)
    }

    /// Takes in what has arrived until `moment`, as far as there is room.
    pub fn receive(
        &mut self,
        moment: &Moment,
        into: &mut List<Measurement>,
        account: &mut Account,
    ) {
        let limits = self.team.limits(moment.stamp);
        self.sightings.drain(moment, into, account, |message| {
            message.validate(&limits)?;
            Ok(sighting(message)?.into())
        });
        self.fixes.drain(moment, into, account, |message| {
            message.validate(&limits)?;
            Ok(fix(message)?.into())
        });
        self.neighbours.drain(moment, into, account, |message| {
            message.validate(&limits)?;
            Ok(neighbour(message)?.into())
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
    fn new(config: &Config) -> Self {
        let own = config.robot.id;
        let others = config.peers().map(|peer| peer.id);
        Self {
            own,
            robots: std::iter::once(own).chain(others).collect(),
            boot: boot(),
            history_ns: nanos(config.history.length_s),
            future_tolerance_ns: nanos(config.history.future_tolerance_s),
        }
    }

    fn limits(&self, now: Stamp) -> Limits<'_> {
        Limits {
            now: Present::only(Clock::Boottime, now.as_nanos()),
            boot: self.boot,
            history_ns: self.history_ns,
            future_tolerance_ns: self.future_tolerance_ns,
            own: self.own,
            robots: &self.robots,
        }
    }
}

impl<M: Message> Port<M> {
    fn open(subscriber: Subscriber<M>, input: Input, sources: usize, most: usize) -> Self {
        Self {
            subscriber,
            sessions: Sessions::new(sources),
            input,
            left: most,
            most,
        }
    }

    fn drain(
        &mut self,
        moment: &Moment,
        into: &mut List<Measurement>,
        account: &mut Account,
        mut check: impl FnMut(&M) -> Result<Measurement, Reject>,
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
            // What follows sees the inner clock alone.
            *message.header_mut() = moment.inner(message.header());
            let heard = check(&message).and_then(|measurement| {
                let now_ns = moment.stamp.as_nanos();
                self.sessions.accept(message.header(), now_ns)?;
                Ok(measurement)
            });
            match heard {
                Ok(measurement) => {
                    account.valid(input, stamp(&message));
                    // There is room: the list holds what all the ports take in.
                    let _ = into.push(measurement);
                }
                Err(Reject::Replayed) => account.rejected(input, Reject::Replayed),
                Err(reason) => account.invalid(input, reason),
            }
        }
    }
}

fn stamp(message: &impl Message) -> Stamp {
    Stamp::from_nanos(message.header().stamp_ns)
}

/// The history tells repetitions by it, and orders what has one stamp.
fn origin(message: &impl Message) -> Origin {
    let header = message.header();
    Origin {
        source: header.source,
        session: header.session,
        sequence: header.sequence,
    }
}

fn sighting(message: &RelativePose) -> Result<Sighting, Reject> {
    Ok(Sighting {
        stamp: stamp(message),
        origin: origin(message),
        observed: RobotId(message.observed),
        relative: pose(message.pose),
        covariance: covariance(message.covariance)?,
    })
}

fn fix(message: &Position) -> Result<PositionFix, Reject> {
    Ok(PositionFix {
        stamp: stamp(message),
        origin: origin(message),
        position: message.position,
        covariance: Covariance2::from_row_major(message.covariance).map_err(not_a_covariance)?,
    })
}

fn neighbour(message: &Neighbour) -> Result<NeighbourPose, Reject> {
    let parts = Parts::from_row_major(message.independent, message.dependent);
    let parts = parts.map_err(not_a_covariance)?;
    Ok(NeighbourPose {
        stamp: stamp(message),
        origin: origin(message),
        pose: pose(message.pose),
        total: parts.total(),
        independent: parts.independent,
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
