//! Step 4 of the tick: the estimate to anyone, and to each robot that was seen what is known about it.

mod companion;

use coloc_estimator::assist::assistant::{Ack, Carried, Message as AssistMessage, Told};
use coloc_estimator::assist::readings::Readings;
use coloc_estimator::partial::SplitPosition;
use coloc_estimator::rounds::{AtSlot, Sharing, Standing as RoundStanding, row_major};
use coloc_estimator::{Estimate, OutgoingAnswer, OutgoingPose, OutgoingSeen, Stamp, TickOutputs};
use coloc_shm_types::{
    self as shm, GroupPage, Health, Input, Message, Neighbour, Opinion, PortError, Publisher,
    RobotName, Sender, Space,
};
use tracing::warn;

use self::companion::Companion;
use crate::clock::Moment;
use crate::config::{self, AssistMode, Config};
use crate::health::Standing;
use crate::start::StartError;

/// The ports, all opened at start: a peer that is missing does not matter, its service waits for it. A peer's channel that is
/// full is a state, not a reason not to start.
#[derive(Debug)]
pub struct Publish {
    sender: Sender,
    /// For the users of a group, if one is configured.
    page: Option<GroupPage>,
    estimates: Publisher<shm::Estimate>,
    peers: Vec<Peer>,
    /// Where the robot may make rounds.
    shared: Option<Rounds>,
    /// Messages that did not reach everybody; they are not sent again, the next tick's are newer.
    pub undelivered: u64,
}

#[derive(Debug)]
struct Peer {
    id: u16,
    /// None if there was no place for it: then this robot cannot be told where it is seen.
    port: Option<Publisher<Neighbour>>,
    sender: Sender,
    /// Where this robot may make rounds.
    companion: Option<Companion>,
    /// Where this robot takes part in the exchange of what is seen in part.
    parts: Option<Parts>,
    /// Where this robot has a part in `[assist]`.
    assists: Option<Assists>,
}

/// To the robot's own `coloc-rounds`.
#[derive(Debug)]
struct Rounds {
    port: Publisher<shm::Shared>,
    sender: Sender,
}

/// To a peer, of what leaders say; likewise.
#[derive(Debug)]
struct Assists {
    data: Option<Publisher<shm::Assist>>,
    acks: Option<Publisher<shm::AssistAck>>,
    data_sender: Sender,
    ack_sender: Sender,
    /// To a leader that is told what all see.
    readings: Option<Publisher<shm::Readings>>,
    reading_sender: Sender,
}

/// To a peer, of what is seen in part; likewise.
#[derive(Debug)]
struct Parts {
    seen: Option<Publisher<shm::Seen>>,
    answers: Option<Publisher<shm::Answer>>,
    seen_sender: Sender,
    answer_sender: Sender,
}

/// What accompanies the belief of a tick.
#[derive(Copy, Clone, Debug, Default)]
pub struct Circumstances {
    /// Ticks since the start.
    pub tick: u64,
    /// By [`Input`].
    pub health: [Health; Input::COUNT],
    /// What may be said of the belief.
    pub standing: Standing,
    /// What `coloc-bounds` says of it.
    pub opinion: Opinion,
}

impl Publish {
    /// Opens a port for the estimate and one for each peer; whoever listens already is connected before the first tick.
    ///
    /// # Errors
    /// If a port, or the page for a group, cannot be opened.
    pub fn open(config: &Config, space: &Space, sender: &Sender) -> Result<Self, StartError> {
        let estimates = space.publisher(&config.robot.name)?;
        let page = page(config, &estimates)?;
        // Whom this does not reach now the first message will.
        let _ = estimates.refresh();
        let peers = config
            .peers()
            .map(|peer| Peer::open(space, (peer.id, &peer.name), sender, config))
            .collect::<Result<_, PortError>>()?;
        Ok(Self {
            sender: sender.beside(),
            page,
            estimates,
            peers,
            shared: config
                .makes_rounds()
                .then(|| Rounds::open(space, &config.robot.name, sender))
                .transpose()?,
            undelivered: 0,
        })
    }

    /// Puts the estimate where everybody finds it who looks.
    pub fn estimate(&mut self, estimate: &Estimate, with: &Circumstances, moment: &Moment) {
        let message = self.message(estimate, with, moment);
        let write = |message: &shm::Estimate| {
            if let Some(page) = &self.page {
                page.write(message);
            }
        };
        let put = self.estimates.put_with(message, write);
        self.undelivered += u64::from(put.is_err());
    }

    /// Wakes those who wait for what was said, once all of it was: a reader of a higher priority takes the processor at once.
    pub fn ring(&self) {
        self.estimates.ring();
        self.page.iter().for_each(GroupPage::settle);
        self.peers.iter().for_each(Peer::ring);
        self.shared.iter().for_each(|it| it.port.ring());
    }

    /// The next estimate comes in less than half a millisecond.
    pub(crate) fn expect(&self) {
        self.page.iter().for_each(GroupPage::expect);
    }

    /// What is refused to the tick as well was said of that, and without it only readers of a group are later.
    pub(crate) fn hasten(&self, priority: u8) {
        let _ = self.page.as_ref().map(|page| page.hasten(priority));
    }

    /// The robots whose channels have no place for this one.
    pub fn unreachable(&self) -> impl Iterator<Item = u16> {
        let without = self.peers.iter().filter(|peer| peer.port.is_none());
        without.map(|peer| peer.id)
    }

    /// Does in advance what sending the estimate would take beside the message.
    pub fn rehearse(&self) {
        self.estimates.rehearse();
    }

    /// Tells the robots that were seen, and answers those that saw this one; who waits is not woken yet.
    pub fn others(&mut self, outputs: &TickOutputs<'_>, moment: &Moment) {
        self.neighbours(outputs.outgoing, moment);
        if !(outputs.seen.is_empty() && outputs.answers.is_empty()) {
            self.parts(outputs, moment);
        }
    }

    fn parts(&mut self, outputs: &TickOutputs<'_>, moment: &Moment) {
        let clock = self.sender.clock().into();
        for seen in outputs.seen {
            let stamp_ns = moment.on(clock, seen.stamp.as_nanos());
            let parts = parts_of(&mut self.peers, seen.sighting.robot.0);
            let sent = parts.is_none_or(|parts| parts.tell(stamp_ns, seen));
            self.undelivered += u64::from(!sent);
        }
        for answer in outputs.answers {
            let stamp_ns = moment.on(clock, answer.stamp.as_nanos());
            let parts = parts_of(&mut self.peers, answer.sighting.robot.0);
            let sent = parts.is_none_or(|parts| parts.answer(stamp_ns, answer));
            self.undelivered += u64::from(!sent);
        }
    }

    /// Tells children where leaders have them, and answers what children have told.
    pub fn carried(&mut self, carried: &Carried<'_>, moment: &Moment) {
        let clock = self.sender.clock().into();
        for told in carried.data {
            let stamp_ns = moment.on(clock, told.message.stamp.as_nanos());
            let assists = assists_of(&mut self.peers, told.to.0);
            let sent = assists.is_none_or(|it| it.tell(stamp_ns, told));
            self.undelivered += u64::from(!sent);
        }
        for ack in carried.acks {
            let stamp_ns = moment.on(clock, ack.stamp.as_nanos());
            let assists = assists_of(&mut self.peers, ack.robot.0);
            let sent = assists.is_none_or(|it| it.answer(stamp_ns, ack));
            self.undelivered += u64::from(!sent);
        }
        for readings in carried.readings {
            let stamp_ns = moment.on(clock, readings.stamp.as_nanos());
            let leaders = self.peers.iter_mut().filter_map(|it| it.assists.as_mut());
            for leader in leaders {
                let sent = leader.say(stamp_ns, readings);
                self.undelivered += u64::from(!sent);
            }
        }
    }

    /// Says what is believed at a slot.
    pub fn share(&mut self, at: &AtSlot, moment: &Moment) {
        let stamp_ns = moment.on(self.sender.clock().into(), at.stamp.as_nanos());
        let sent = self.shared.as_mut().is_none_or(|it| it.say(stamp_ns, at));
        self.undelivered += u64::from(!sent);
    }

    fn neighbours(&mut self, outgoing: &[OutgoingPose], moment: &Moment) {
        let clock = self.sender.clock().into();
        let common = Stamp::from_nanos(moment.on(clock, moment.stamp.as_nanos()));
        for pose in outgoing {
            let Some(peer) = self.peers.iter_mut().find(|peer| peer.id == pose.to.0) else {
                continue;
            };
            if peer.makes_rounds(common) {
                continue;
            }
            let stamp_ns = moment.on(clock, pose.stamp.as_nanos());
            self.undelivered += u64::from(!peer.send(stamp_ns, pose));
        }
    }

    fn message(
        &mut self,
        estimate: &Estimate,
        with: &Circumstances,
        moment: &Moment,
    ) -> shm::Estimate {
        let boot_ns = estimate.stamp.as_nanos();
        let stamp_ns = moment.on(self.sender.clock().into(), boot_ns);
        let belief = &estimate.belief;
        let (parts, driven) = (&belief.parts, estimate.driven);
        let (fit, unfit, fit_limit) = with.standing.fitness();
        let gyro = estimate.gyro.map(|it| [it.bias, it.bias_variance.sqrt()]);
        let [gyro_bias_radps, gyro_bias_sigma_radps] = gyro.unwrap_or_default();
        shm::Estimate {
            header: self.sender.header(stamp_ns),
            boot_ns,
            tick: with.tick,
            pose: [belief.pose.x, belief.pose.y, belief.pose.phi],
            odometry: [driven.x, driven.y, driven.phi],
            velocity: estimate.velocity,
            independent: parts.independent.to_row_major(),
            dependent: parts.dependent.to_row_major(),
            velocity_covariance: estimate.velocity_covariance.to_row_major(),
            gyro_bias_radps,
            gyro_bias_sigma_radps,
            health: bytes(with.health),
            state: with.standing.state as u8,
            fit,
            unfit,
            opinion: with.opinion as u8,
            fit_limit,
        }
    }
}

fn page(
    config: &Config,
    estimates: &Publisher<shm::Estimate>,
) -> Result<Option<GroupPage>, StartError> {
    let Some(group) = config.readers()? else {
        return Ok(None);
    };
    let robot = &config.robot;
    Ok(Some(estimates.open_to(&group, &robot.name, robot.id)?))
}

impl Peer {
    fn open(
        space: &Space,
        (id, name): (u16, &RobotName),
        sender: &Sender,
        config: &Config,
    ) -> Result<Self, PortError> {
        Ok(Self {
            id,
            port: port(space, name)?,
            sender: sender.beside(),
            companion: Companion::open(space, (id, name), config)?,
            parts: config
                .sighting
                .heard
                .then(|| Parts::open(space, name, sender))
                .transpose()?,
            assists: config
                .assist
                .is_on()
                .then(|| Assists::open(space, (id, name), sender, &config.assist))
                .transpose()?,
        })
    }

    fn ring(&self) {
        self.port.iter().for_each(Publisher::ring);
        if let Some(parts) = &self.parts {
            parts.seen.iter().for_each(Publisher::ring);
            parts.answers.iter().for_each(Publisher::ring);
        }
        if let Some(assists) = &self.assists {
            assists.data.iter().for_each(Publisher::ring);
            assists.acks.iter().for_each(Publisher::ring);
            assists.readings.iter().for_each(Publisher::ring);
        }
    }

    /// Whether it fuses nothing of what it is told, at `now` of the common clock.
    fn makes_rounds(&mut self, now: Stamp) -> bool {
        self.companion.as_mut().is_some_and(|it| it.is_here(now))
    }

    fn send(&mut self, stamp_ns: i64, pose: &OutgoingPose) -> bool {
        let message = Neighbour {
            header: self.sender.header(stamp_ns),
            pose: [pose.pose.x, pose.pose.y, pose.pose.phi],
            independent: pose.parts.independent.to_row_major(),
            dependent: pose.parts.dependent.to_row_major(),
        };
        let port = self.port.as_ref();
        port.is_some_and(|port| port.put(message).is_ok())
    }
}

impl Parts {
    fn open(space: &Space, name: &RobotName, sender: &Sender) -> Result<Self, PortError> {
        Ok(Self {
            seen: port(space, name)?,
            answers: port(space, name)?,
            seen_sender: sender.beside(),
            answer_sender: sender.beside(),
        })
    }

    fn tell(&mut self, stamp_ns: i64, seen: &OutgoingSeen) -> bool {
        let id = seen.sighting;
        let blank = shm::Seen {
            header: self.seen_sender.header(stamp_ns),
            sensor: id.sensor,
            session: id.session,
            sighting: id.sequence,
            ..shm::Seen::default()
        };
        let message = match &seen.place {
            Some(place) => {
                let (position, independent, dependent) = numbers(place);
                shm::Seen {
                    position,
                    independent,
                    dependent,
                    ..blank
                }
            }
            None => shm::Seen {
                flags: shm::Seen::NOTHING_TOLD,
                ..blank
            },
        };
        let port = self.seen.as_ref();
        port.is_some_and(|port| port.put(message).is_ok())
    }

    fn answer(&mut self, stamp_ns: i64, answer: &OutgoingAnswer) -> bool {
        let id = answer.sighting;
        let (position, independent, dependent) = numbers(&answer.place);
        let message = shm::Answer {
            header: self.answer_sender.header(stamp_ns),
            sensor: id.sensor,
            reserved: [0; 6],
            session: id.session,
            sighting: id.sequence,
            position,
            independent,
            dependent,
        };
        let port = self.answers.as_ref();
        port.is_some_and(|port| port.put(message).is_ok())
    }
}

impl Rounds {
    fn open(space: &Space, name: &RobotName, sender: &Sender) -> Result<Self, PortError> {
        let port = space.publisher(name)?;
        let _ = port.refresh();
        Ok(Self {
            port,
            sender: sender.beside(),
        })
    }

    fn say(&mut self, stamp_ns: i64, at: &AtSlot) -> bool {
        let blank = shm::Shared {
            header: self.sender.header(stamp_ns),
            slot: at.slot,
            ..shm::Shared::default()
        };
        let message = match &at.sharing {
            Sharing::Apart => blank,
            Sharing::Nowhere => shm::Shared {
                standing: shm::Shared::NOWHERE,
                ..blank
            },
            Sharing::Belief(shared) => {
                let (standing, since) = match shared.standing {
                    RoundStanding::Joining(from) => (shm::Shared::JOINING, from),
                    RoundStanding::Since(last) => (shm::Shared::SINCE, last),
                };
                shm::Shared {
                    since,
                    pose: shared.pose.to_vector().into(),
                    covariance: row_major(&shared.covariance),
                    psi: row_major(&shared.psi),
                    standing,
                    ..blank
                }
            }
        };
        self.port.put(message).is_ok()
    }
}

impl Assists {
    fn open(
        space: &Space,
        (id, name): (u16, &RobotName),
        sender: &Sender,
        config: &config::Assist,
    ) -> Result<Self, PortError> {
        let gathers = config.mode == AssistMode::Full && config.leaders.contains(&id);
        Ok(Self {
            data: port(space, name)?,
            acks: port(space, name)?,
            data_sender: sender.beside(),
            ack_sender: sender.beside(),
            readings: gathers.then(|| port(space, name)).transpose()?.flatten(),
            reading_sender: sender.beside(),
        })
    }

    fn tell(&mut self, stamp_ns: i64, told: &Told) -> bool {
        let AssistMessage { said, word, .. } = &told.message;
        let row = |[[a, b, c], [d, e, f], [g, h, i]]: [[f32; 3]; 3]| [a, b, c, d, e, f, g, h, i];
        let message = shm::Assist {
            header: self.data_sender.header(stamp_ns),
            slot: told.message.slot.0,
            pose: said.pose.to_vector().into(),
            independent: said.parts.independent.to_row_major(),
            dependent: said.parts.dependent.to_row_major(),
            leader_pose: word.leader.pose.to_vector().into(),
            leader_covariance: word.leader.covariance.to_row_major(),
            transitions: word.past.transitions.map(row),
            path: told.message.path.map(|it| it.0),
            robots: told.message.robots,
            known: word.past.known,
            flags: if told.message.is_final {
                shm::Assist::FINAL
            } else {
                0
            },
            said: word.past.said,
            digest: told.message.digest,
        };
        let port = self.data.as_ref();
        port.is_some_and(|port| port.put(message).is_ok())
    }

    /// To a leader; others are not told.
    fn say(&mut self, stamp_ns: i64, readings: &Readings) -> bool {
        let Some(port) = &self.readings else {
            return true;
        };
        port.put(said(self.reading_sender.header(stamp_ns), readings))
            .is_ok()
    }

    fn answer(&mut self, stamp_ns: i64, ack: &Ack) -> bool {
        let message = shm::AssistAck {
            header: self.ack_sender.header(stamp_ns),
            slot: ack.slot.0,
            leader: ack.leader.0,
            taken: u8::from(ack.taken),
            reserved: [0; 5],
        };
        let port = self.acks.as_ref();
        port.is_some_and(|port| port.put(message).is_ok())
    }
}

/// As they are said.
fn said(header: shm::Header, readings: &Readings) -> shm::Readings {
    let mut said = shm::Readings {
        header,
        slot: readings.slot.0,
        trace: readings.trace.unwrap_or_default(),
        count: readings.count,
        ..shm::Readings::default()
    };
    if readings.trace.is_some() {
        said.flags |= shm::Readings::LEADS;
    }
    if let Some(trail) = &readings.trail {
        said.flags |= shm::Readings::WAY;
        said.way = trail.ends.map(|it| [it.x, it.y, it.phi]);
        said.way_covariance = trail.noise.to_row_major();
    }
    for (place, sight) in said.sights.iter_mut().zip(readings.sights()) {
        *place = shm::Sight {
            since_ns: sight.since.as_nanos(),
            pose: sight.reading.relative.to_vector().into(),
            covariance: sight.reading.covariance.to_row_major(),
            observed: sight.observed.0,
            ..shm::Sight::default()
        };
    }
    said
}

/// Of a robot without a part there are none.
fn assists_of(peers: &mut [Peer], robot: u16) -> Option<&mut Assists> {
    let peer = peers.iter_mut().find(|peer| peer.id == robot)?;
    peer.assists.as_mut()
}

/// Of a robot that does not take part there are none.
fn parts_of(peers: &mut [Peer], robot: u16) -> Option<&mut Parts> {
    let peer = peers.iter_mut().find(|peer| peer.id == robot)?;
    peer.parts.as_mut()
}

fn numbers(place: &SplitPosition) -> ([f64; 2], [f64; 4], [f64; 4]) {
    (
        place.position,
        place.independent.to_row_major(),
        place.dependent.to_row_major(),
    )
}

/// A port to a robot; none if there is no place for it.
fn port<M: Message>(space: &Space, name: &RobotName) -> Result<Option<Publisher<M>>, PortError> {
    let port = match space.publisher::<M>(name) {
        Ok(port) => Some(port),
        Err(problem @ PortError::Full { .. }) => {
            warn!(
                "{name} is not told where it is seen until this robot is started again: {problem}"
            );
            None
        }
        Err(problem) => return Err(problem),
    };
    let _ = port.as_ref().map(Publisher::refresh);
    Ok(port)
}

/// By the number of the input; those without a name are zero.
fn bytes(health: [Health; Input::COUNT]) -> [u8; Input::PLACES] {
    let mut bytes = [0; Input::PLACES];
    for (byte, health) in bytes.iter_mut().zip(health) {
        *byte = health as u8;
    }
    bytes
}
