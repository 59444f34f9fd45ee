//! Step 4 of the tick: the estimate to anyone, and to each robot that was seen what is known about it.

use coloc_estimator::{Estimate, OutgoingPose};
use coloc_shm_types::{
    self as shm, Header, Health, Input, Neighbour, PortError, Publisher, RobotName, Space,
};

use crate::clock::Moment;
use crate::config::{ClockSource, Config};

/// The ports, all opened at start: a peer that is missing does not matter, its service waits for it.
#[derive(Debug)]
pub struct Publish {
    robot: u16,
    /// Of the stamps.
    clock: ClockSource,
    session_ns: i64,
    estimates: Publisher<shm::Estimate>,
    sequence: u64,
    peers: Vec<Peer>,
    /// Messages that did not reach everybody; they are not sent again, the next tick's are newer.
    pub undelivered: u64,
}

#[derive(Debug)]
struct Peer {
    id: u16,
    port: Publisher<Neighbour>,
    sequence: u64,
}

/// What accompanies the belief of a tick.
#[derive(Copy, Clone, Debug, Default)]
pub struct Circumstances {
    /// Ticks since the start.
    pub tick: u64,
    /// When the newest encoder frame in the estimate came \[ns of the inner clock\]; 0 if there was none.
    pub frame_stamp_ns: i64,
    /// Since the tick's stamp \[ns\].
    pub latency_ns: u64,
    /// Of the wake-up \[ns\].
    pub lateness_ns: u64,
    /// Where the time went.
    pub stages: Stages,
    /// By [`Input`].
    pub health: [Health; Input::COUNT],
}

/// Durations of a tick's stages, each as the last tick that knows it took \[ns\].
#[derive(Copy, Clone, Debug, Default)]
pub struct Stages {
    /// From the wake-up until all inputs were there.
    pub collect_ns: u32,
    /// The estimator's step.
    pub estimate_ns: u32,
    /// Sending.
    pub publish_ns: u32,
    /// Counting.
    pub account_ns: u32,
}

impl Publish {
    /// Opens a port for the estimate and one for each peer; whoever listens already is connected before the first tick.
    ///
    /// # Errors
    /// If a port cannot be opened.
    pub fn open(config: &Config, space: &Space, session_ns: i64) -> Result<Self, PortError> {
        let estimates = space.publisher(&config.robot.name)?;
        // Whom this does not reach now the first message will.
        let _ = estimates.refresh();
        let peers = config
            .peers()
            .map(|peer| Peer::open(space, peer.id, &peer.name))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            robot: config.robot.id,
            clock: config.clock.source,
            session_ns,
            estimates,
            sequence: 0,
            peers,
            undelivered: 0,
        })
    }

    /// Sends the estimate.
    pub fn estimate(&mut self, estimate: &Estimate, with: &Circumstances, moment: &Moment) {
        let message = self.message(estimate, with, moment);
        self.sequence += 1;
        self.undelivered += u64::from(self.estimates.send(message).is_err());
    }

    /// Does in advance what sending the estimate would take beside the message.
    pub fn rehearse(&self) {
        self.estimates.rehearse();
    }

    /// Tells the robots that were seen.
    pub fn neighbours(&mut self, outgoing: &[OutgoingPose], moment: &Moment) {
        for pose in outgoing {
            let (robot, session_ns) = (self.robot, self.session_ns);
            let Some(peer) = self.peers.iter_mut().find(|peer| peer.id == pose.to.0) else {
                continue;
            };
            let stamp_ns = moment.on(self.clock, pose.stamp.as_nanos());
            self.undelivered += u64::from(!peer.send(robot, stamp_ns, session_ns, pose));
        }
    }

    fn message(&self, estimate: &Estimate, with: &Circumstances, moment: &Moment) -> shm::Estimate {
        let belief = &estimate.belief;
        shm::Estimate {
            header: Header {
                stamp_ns: moment.on(self.clock, estimate.stamp.as_nanos()),
                session_ns: self.session_ns,
                sequence: self.sequence,
            },
            tick: with.tick,
            frame_stamp_ns: match with.frame_stamp_ns {
                0 => 0,
                inner_ns => moment.on(self.clock, inner_ns),
            },
            latency_ns: with.latency_ns,
            lateness_ns: with.lateness_ns,
            collect_ns: with.stages.collect_ns,
            estimate_ns: with.stages.estimate_ns,
            publish_ns: with.stages.publish_ns,
            account_ns: with.stages.account_ns,
            pose: [belief.pose.x, belief.pose.y, belief.pose.phi],
            velocity: estimate.velocity,
            total: belief.total.to_row_major(),
            independent: belief.independent.to_row_major(),
            health: with.health.map(|health| health as u8),
            robot: self.robot,
            ..shm::Estimate::default()
        }
    }
}

impl Peer {
    fn open(space: &Space, id: u16, name: &RobotName) -> Result<Self, PortError> {
        let port = space.publisher(name)?;
        let _ = port.refresh();
        Ok(Self {
            id,
            port,
            sequence: 0,
        })
    }

    fn send(&mut self, sender: u16, stamp_ns: i64, session_ns: i64, pose: &OutgoingPose) -> bool {
        let message = Neighbour {
            header: Header {
                stamp_ns,
                session_ns,
                sequence: self.sequence,
            },
            sender,
            pose: [pose.pose.x, pose.pose.y, pose.pose.phi],
            total: pose.total.to_row_major(),
            independent: pose.independent.to_row_major(),
            ..Neighbour::default()
        };
        self.sequence += 1;
        self.port.send(message).is_ok()
    }
}
