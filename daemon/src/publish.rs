//! Step 4 of the tick: the estimate to anyone, and to each robot that was seen what is known about it.

use coloc_estimator::{Estimate, OutgoingPose};
use coloc_shm_types::{
    self as shm, BeliefState, Health, Input, Neighbour, PortError, Publisher, RobotName, Sender,
    Space,
};

use crate::clock::Moment;
use crate::config::Config;
use crate::health::belief_state;

/// The ports, all opened at start: a peer that is missing does not matter, its service waits for it.
#[derive(Debug)]
pub struct Publish {
    sender: Sender,
    estimates: Publisher<shm::Estimate>,
    peers: Vec<Peer>,
    /// Messages that did not reach everybody; they are not sent again, the next tick's are newer.
    pub undelivered: u64,
}

#[derive(Debug)]
struct Peer {
    id: u16,
    port: Publisher<Neighbour>,
    sender: Sender,
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
    pub fn open(config: &Config, space: &Space, sender: &Sender) -> Result<Self, PortError> {
        let estimates = space.publisher(&config.robot.name)?;
        // Whom this does not reach now the first message will.
        let _ = estimates.refresh();
        let peers = config
            .peers()
            .map(|peer| Peer::open(space, peer.id, &peer.name, sender.beside()))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            sender: sender.beside(),
            estimates,
            peers,
            undelivered: 0,
        })
    }

    /// Sends the estimate.
    pub fn estimate(&mut self, estimate: &Estimate, with: &Circumstances, moment: &Moment) {
        let message = self.message(estimate, with, moment);
        self.undelivered += u64::from(self.estimates.send(message).is_err());
    }

    /// Does in advance what sending the estimate would take beside the message.
    pub fn rehearse(&self) {
        self.estimates.rehearse();
    }

    /// Tells the robots that were seen.
    pub fn neighbours(&mut self, outgoing: &[OutgoingPose], moment: &Moment) {
        for pose in outgoing {
            let Some(peer) = self.peers.iter_mut().find(|peer| peer.id == pose.to.0) else {
                continue;
            };
            let stamp_ns = moment.on(self.sender.clock().into(), pose.stamp.as_nanos());
            self.undelivered += u64::from(!peer.send(stamp_ns, pose));
        }
    }

    fn message(
        &mut self,
        estimate: &Estimate,
        with: &Circumstances,
        moment: &Moment,
    ) -> shm::Estimate {
        let on = |inner_ns| moment.on(self.sender.clock().into(), inner_ns);
        let (stamp_ns, boot_ns) = (on(estimate.stamp.as_nanos()), estimate.stamp.as_nanos());
        let frame_stamp_ns = match with.frame_stamp_ns {
            0 => 0,
            inner_ns => on(inner_ns),
        };
        let belief = &estimate.belief;
        let parts = belief.parts();
        let state = belief_state(with.health);
        shm::Estimate {
            header: self.sender.header(stamp_ns),
            boot_ns,
            tick: with.tick,
            frame_stamp_ns,
            latency_ns: with.latency_ns,
            lateness_ns: with.lateness_ns,
            collect_ns: with.stages.collect_ns,
            estimate_ns: with.stages.estimate_ns,
            publish_ns: with.stages.publish_ns,
            account_ns: with.stages.account_ns,
            pose: [belief.pose.x, belief.pose.y, belief.pose.phi],
            velocity: estimate.velocity,
            independent: parts.independent.to_row_major(),
            dependent: parts.dependent.to_row_major(),
            velocity_covariance: estimate.velocity_covariance.to_row_major(),
            health: bytes(with.health),
            state: state as u8,
            fit: u8::from(state == BeliefState::Ok),
            ..shm::Estimate::default()
        }
    }
}

impl Peer {
    fn open(space: &Space, id: u16, name: &RobotName, sender: Sender) -> Result<Self, PortError> {
        let port = space.publisher(name)?;
        let _ = port.refresh();
        Ok(Self { id, port, sender })
    }

    fn send(&mut self, stamp_ns: i64, pose: &OutgoingPose) -> bool {
        let message = Neighbour {
            header: self.sender.header(stamp_ns),
            pose: [pose.pose.x, pose.pose.y, pose.pose.phi],
            independent: pose.parts.independent.to_row_major(),
            dependent: pose.parts.dependent.to_row_major(),
        };
        self.port.send(message).is_ok()
    }
}

/// By the number of the input; those without a name are zero.
fn bytes(health: [Health; Input::COUNT]) -> [u8; Input::PLACES] {
    let mut bytes = [0; Input::PLACES];
    for (byte, health) in bytes.iter_mut().zip(health) {
        *byte = health as u8;
    }
    bytes
}
