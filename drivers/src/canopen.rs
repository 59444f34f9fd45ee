//! CANopen drives that are mute until somebody starts them (`CiA` 301): NMT start, SYNC, heartbeats and boot-ups.
//!
//! | frame | identifier | data |
//! | --- | --- | --- |
//! | NMT start | 0x000 | 01, node |
//! | SYNC | 0x080 | none |
//! | heartbeat | 0x700 + node | state: 05 operational, 7F pre-operational, 04 stopped |
//! | boot-up | 0x700 + node | 00 |
//!
//! * A node is started at the beginning, at once when it says that it booted, and again every half second until its heartbeat
//!   says that it is operational; one that has no heartbeat is told so for ever, which changes nothing for it.
//! * SYNC is sent while nobody else sends it: who falls silent for three periods, or a fifth of a second, is stood in for, and has it
//!   back with its first SYNC. The kernel shows our own SYNC to us as well, each once.
//!
//! No clock, no bus and no allocation of its own: it is told what is heard and what time it is, and says what to send.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::can::{Frame, Id, StandardId};

/// CANopen drives on one of the buses. Without this section colocd sends nothing at all.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CanopenConfig {
    /// Their bus, by position in `odometry.buses`.
    #[serde(default)]
    pub bus: u8,
    /// Their node numbers, 1 to 127.
    #[schemars(length(min = 1, max = 16), inner(range(min = 1, max = 127)), example = example_nodes())]
    pub nodes: Vec<u8>,
    /// Start them (NMT), again whenever they have booted.
    #[serde(default)]
    pub start: bool,
    /// Send SYNC so often, while nobody else does; no oftener than once a tick, and with its jitter \[s\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1e-3, max = 10), example = 0.02)]
    pub sync_period_s: Option<f64>,
    /// A node whose heartbeat was heard once and not for so long is missing \[s\].
    #[serde(default = "default_heartbeat_s")]
    #[schemars(range(min = 0.01, max = 60))]
    pub heartbeat_s: f64,
}

fn example_nodes() -> [u8; 2] {
    [1, 2]
}

fn default_heartbeat_s() -> f64 {
    0.5
}

/// So many nodes one network of ours has at most.
pub const MAX_NODES: usize = 16;

/// From one start of a node to the next \[ns\].
const START_AGAIN_NS: i64 = 500_000_000;

/// Whoever sends SYNC is not silent before this \[ns\].
const LEAST_SILENCE_NS: i64 = 200_000_000;

/// What happened, for people.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum CanopenEvent {
    /// A node has booted; if that is configured, it is started.
    Booted(u8),
    /// A node's heartbeat says that it works.
    Operational(u8),
    /// A node's heartbeat says that it does not.
    NotOperational(u8),
    /// A node's heartbeat has not come for too long.
    Missing(u8),
    /// Nobody sends SYNC: we do.
    SyncTaken,
    /// Somebody else sends SYNC: we do not.
    SyncLeft,
}

/// Nodes and who sends SYNC.
#[derive(Clone, Debug)]
pub struct Canopen {
    bus: u8,
    start: bool,
    heartbeat_ns: i64,
    nodes: [Option<Node>; MAX_NODES],
    sync: Option<Sync>,
    boots: u64,
}

#[derive(Copy, Clone, Debug, Default)]
struct Node {
    number: u8,
    /// What has come since the last look: the newest state, and whether it booted.
    news: Option<u8>,
    booted: bool,
    state: State,
    heard_ns: i64,
    start_ns: Option<i64>,
}

#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
enum State {
    #[default]
    Unknown,
    Operational,
    Other,
    Missing,
}

#[derive(Copy, Clone, Debug)]
struct Sync {
    period_ns: i64,
    /// One of ours was sent and has not been heard yet.
    is_echo_due: bool,
    heard_other: bool,
    /// Since when nobody else was heard, if anybody looked.
    silent_since_ns: Option<i64>,
    is_ours: bool,
    next_ns: i64,
}

const BOOT_UP: u8 = 0x00;
const OPERATIONAL: u8 = 0x05;
const HEARTBEAT: u16 = 0x700;

const NMT_ID: StandardId = StandardId::ZERO;
const SYNC_ID: StandardId = match StandardId::new(0x080) {
    Some(id) => id,
    None => StandardId::MAX,
};

#[expect(
    clippy::cast_possible_truncation,
    reason = "a minute at most, by the description of the settings"
)]
fn nanos(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}

impl Canopen {
    /// Nodes beyond [`MAX_NODES`] are left out.
    #[must_use]
    pub fn new(config: &CanopenConfig) -> Self {
        let mut nodes = [None; MAX_NODES];
        for (place, &number) in nodes.iter_mut().zip(&config.nodes) {
            *place = Some(Node {
                number,
                ..Node::default()
            });
        }
        let sync = config.sync_period_s.map(|period_s| Sync {
            period_ns: nanos(period_s),
            is_echo_due: false,
            heard_other: false,
            silent_since_ns: None,
            is_ours: false,
            next_ns: i64::MIN,
        });
        Self {
            bus: config.bus,
            start: config.start,
            heartbeat_ns: nanos(config.heartbeat_s),
            nodes,
            sync,
            boots: 0,
        }
    }

    /// What has to be let in from its bus.
    pub fn wanted_ids(&self) -> impl Iterator<Item = Id> {
        let nodes = self.nodes.iter().flatten();
        let beats = nodes.filter_map(|node| StandardId::new(HEARTBEAT + u16::from(node.number)));
        let sync = self.sync.iter().map(|_| SYNC_ID);
        beats.chain(sync).map(Id::from)
    }

    /// The position of its bus.
    #[must_use]
    pub fn bus(&self) -> u8 {
        self.bus
    }

    /// Times that a node said that it booted.
    #[must_use]
    pub fn boots(&self) -> u64 {
        self.boots
    }

    /// Nodes whose heartbeat is missing now.
    #[must_use]
    pub fn missing(&self) -> u64 {
        let nodes = self.nodes.iter().flatten();
        nodes.filter(|node| node.state == State::Missing).count() as u64
    }

    /// Takes in a frame of its bus; whether it was one of its own kind.
    pub fn hear(&mut self, frame: &Frame) -> bool {
        let Some(Id::Standard(id)) = frame.id() else {
            return false;
        };
        if id == SYNC_ID {
            return self.sync.as_mut().is_some_and(Sync::hear);
        }
        let mut nodes = self.nodes.iter_mut().flatten();
        let own = |node: &&mut Node| HEARTBEAT + u16::from(node.number) == id.as_raw();
        let (Some(node), Some(&state)) = (nodes.find(own), frame.data().first()) else {
            return false;
        };
        if state == BOOT_UP {
            (node.booted, node.news) = (true, None);
            self.boots += 1;
        } else {
            // The topmost bit toggles with node guarding.
            node.news = Some(state & 0x7F);
        }
        true
    }

    /// What has become of that at `now_ns`, of a clock that nobody sets: frames to `send` and what to `tell`. `send` says whether the
    /// frame went out.
    pub fn look(
        &mut self,
        now_ns: i64,
        send: &mut impl FnMut(&Frame) -> bool,
        tell: &mut impl FnMut(CanopenEvent),
    ) {
        for node in self.nodes.iter_mut().flatten() {
            node.look(now_ns, self.heartbeat_ns, tell);
            if self.start && node.is_start_due(now_ns) {
                // One that did not go out is sent again with the others.
                let _ = send(&Frame::classic(NMT_ID.into(), [1, node.number]));
                node.start_ns = Some(now_ns);
            }
        }
        if let Some(sync) = &mut self.sync {
            sync.look(now_ns, send, tell);
        }
    }
}

impl Node {
    fn look(&mut self, now_ns: i64, heartbeat_ns: i64, tell: &mut impl FnMut(CanopenEvent)) {
        if std::mem::take(&mut self.booted) {
            // It is started at once.
            (self.state, self.heard_ns, self.start_ns) = (State::Other, now_ns, None);
            tell(CanopenEvent::Booted(self.number));
        }
        let is_late = now_ns.saturating_sub(self.heard_ns) > heartbeat_ns;
        let (state, event) = match self.news.take() {
            Some(OPERATIONAL) => (State::Operational, CanopenEvent::Operational as fn(u8) -> _),
            Some(_) => (State::Other, CanopenEvent::NotOperational as fn(u8) -> _),
            None if is_late && self.state != State::Unknown => {
                (State::Missing, CanopenEvent::Missing as fn(u8) -> _)
            }
            None => return,
        };
        if state != State::Missing {
            self.heard_ns = now_ns;
        }
        if std::mem::replace(&mut self.state, state) != state {
            tell(event(self.number));
        }
    }

    fn is_start_due(&self, now_ns: i64) -> bool {
        let again = |start_ns: i64| now_ns.saturating_sub(start_ns) >= START_AGAIN_NS;
        self.state != State::Operational && self.start_ns.is_none_or(again)
    }
}

impl Sync {
    /// Whether it was somebody else's or our own.
    fn hear(&mut self) -> bool {
        if !std::mem::take(&mut self.is_echo_due) {
            self.heard_other = true;
        }
        true
    }

    fn look(
        &mut self,
        now_ns: i64,
        send: &mut impl FnMut(&Frame) -> bool,
        tell: &mut impl FnMut(CanopenEvent),
    ) {
        let since_ns = *self.silent_since_ns.get_or_insert(now_ns);
        if std::mem::take(&mut self.heard_other) {
            self.silent_since_ns = Some(now_ns);
            if std::mem::take(&mut self.is_ours) {
                tell(CanopenEvent::SyncLeft);
            }
            return;
        }
        let patience_ns = self.period_ns.saturating_mul(3).max(LEAST_SILENCE_NS);
        if !self.is_ours {
            if now_ns.saturating_sub(since_ns) < patience_ns {
                return;
            }
            (self.is_ours, self.next_ns) = (true, now_ns);
            tell(CanopenEvent::SyncTaken);
        }
        // A tick that comes a little early is the one that is meant.
        if now_ns.saturating_add(self.period_ns / 8) < self.next_ns {
            return;
        }
        self.next_ns = self.next_ns.saturating_add(self.period_ns);
        if self.next_ns <= now_ns {
            self.next_ns = now_ns.saturating_add(self.period_ns);
        }
        self.is_echo_due = send(&Frame::classic(SYNC_ID.into(), []));
    }
}
