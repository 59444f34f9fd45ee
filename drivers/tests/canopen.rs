//! A drive that is mute until it is started, in simulated time: it boots late, is reset, loses who sends SYNC, falls silent.
#![allow(clippy::unwrap_used, reason = "a test")]

use coloc_drivers::can::{Frame, Received, StandardId};
use coloc_drivers::canopen::{Canopen, CanopenConfig, CanopenEvent};
use coloc_drivers::encoder::{OdometryConfig, OdometryDecoder, WheelFrames};

const MS: i64 = 1_000_000;
const TICK_MS: i64 = 20;
const NODE: u8 = 5;

fn frame(id: u16, data: &[u8]) -> Frame {
    Frame::data_frame(StandardId::new(id).unwrap(), data).unwrap()
}

fn is(frame: &Frame, id: u16) -> bool {
    frame.id() == Some(StandardId::new(id).unwrap().into())
}

/// What is on the bus, and who listens.
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is one thing that can fail"
)]
struct World {
    now_ms: i64,
    canopen: Canopen,
    decoder: OdometryDecoder,
    wheels: WheelFrames,
    powered: bool,
    operational: bool,
    /// Somebody else sends SYNC.
    producer: bool,
    /// Our own SYNC, which the kernel shows to us.
    echo: bool,
    sent_syncs: u32,
    events: Vec<(i64, CanopenEvent)>,
    sample_ms: Option<i64>,
}

impl World {
    fn new(lines: &str) -> Self {
        let config: CanopenConfig = toml::from_str(lines).unwrap();
        let odometry = OdometryConfig::differential("local:/x".parse().unwrap(), 0.3, 1e-4, 2.0);
        Self {
            now_ms: 0,
            canopen: Canopen::new(&config),
            decoder: OdometryDecoder::new(&odometry).unwrap(),
            wheels: WheelFrames::new(1e-4),
            powered: true,
            operational: false,
            producer: false,
            echo: false,
            sent_syncs: 0,
            events: Vec::new(),
            sample_ms: None,
        }
    }

    fn hear(&mut self, frame: Frame) {
        if !self.canopen.hear(&frame) {
            let received = Received {
                frame,
                stamp_ns: self.now_ms * MS,
                bus: 0,
            };
            if self.decoder.push(&received).unwrap().is_some() {
                self.sample_ms = Some(self.now_ms);
            }
        }
    }

    /// The drive answers SYNC while it is operational.
    fn sync(&mut self) {
        if self.powered && self.operational {
            for frame in self.wheels.encode(0.0, 0.0) {
                self.hear(frame);
            }
        }
    }

    fn tick(&mut self) {
        self.now_ms += TICK_MS;
        if std::mem::take(&mut self.echo) {
            self.hear(frame(0x080, &[]));
        }
        if self.powered && self.now_ms % 100 == 0 {
            let state = if self.operational { 0x05 } else { 0x7F };
            self.hear(frame(0x700 + u16::from(NODE), &[state]));
        }
        if self.producer {
            self.hear(frame(0x080, &[]));
            self.sync();
        }
        let (mut sent, mut events) = (Vec::new(), Vec::new());
        let mut send = |frame: &Frame| {
            sent.push(*frame);
            true
        };
        self.canopen
            .look(self.now_ms * MS, &mut send, &mut |event| events.push(event));
        let stamped = events.into_iter().map(|event| (self.now_ms, event));
        self.events.extend(stamped);
        for frame in sent {
            if is(&frame, 0x000) && self.powered {
                assert_eq!(frame.data(), [1, NODE]);
                self.operational = true;
            }
            if is(&frame, 0x080) {
                assert!(frame.data().is_empty());
                (self.echo, self.sent_syncs) = (true, self.sent_syncs + 1);
                self.sync();
            }
        }
    }

    fn run(&mut self, ms: i64) {
        (0..ms / TICK_MS).for_each(|_| self.tick());
    }

    /// What was told since then.
    fn told(&mut self) -> Vec<CanopenEvent> {
        std::mem::take(&mut self.events)
            .into_iter()
            .map(|(_, event)| event)
            .collect()
    }

    fn boot(&mut self) {
        (self.powered, self.operational) = (true, false);
        self.hear(frame(0x700 + u16::from(NODE), &[0]));
    }

    fn has_odometry(&self) -> bool {
        self.sample_ms.is_some_and(|ms| ms >= self.now_ms - 100)
    }
}

const BOTH: &str = "nodes = [5]\nstart = true\nsync_period_s = 0.02";

use CanopenEvent::{Booted, Missing, NotOperational, Operational, SyncLeft, SyncTaken};

#[test]
fn a_mute_drive_is_started_and_given_sync_within_a_second() {
    let mut world = World::new(BOTH);
    world.run(1000);
    assert!(world.has_odometry());
    assert_eq!(world.told(), [Operational(NODE), SyncTaken]);
}

#[test]
fn a_drive_that_was_reset_is_started_at_once() {
    let mut world = World::new(BOTH);
    world.run(2000);
    world.told();
    world.boot();
    world.tick();
    assert!(world.operational, "at the next tick");
    world.run(1000);
    assert!(world.has_odometry());
    assert_eq!(world.told(), [Booted(NODE), Operational(NODE)]);
    assert_eq!(world.canopen.boots(), 1);
}

#[test]
fn a_drive_that_was_stopped_without_a_word_is_started_again() {
    let mut world = World::new(BOTH);
    world.run(2000);
    world.told();
    world.operational = false;
    world.run(1000);
    assert!(world.has_odometry());
    assert_eq!(world.told(), [NotOperational(NODE), Operational(NODE)]);
}

#[test]
fn sync_is_sent_while_nobody_else_does() {
    let mut world = World::new(BOTH);
    world.producer = true;
    world.run(2000);
    assert!(world.has_odometry());
    assert_eq!(
        (world.sent_syncs, world.told()),
        (0, vec![Operational(NODE)])
    );
    world.producer = false;
    world.run(1000);
    assert!(world.has_odometry());
    assert_eq!(world.told(), [SyncTaken]);
    let of_a_second = world.sent_syncs;
    assert!((35..=50).contains(&of_a_second), "{of_a_second}");
    world.producer = true;
    world.run(1000);
    assert!(world.has_odometry());
    assert_eq!(world.told(), [SyncLeft]);
    assert!(world.sent_syncs <= of_a_second + 2);
}

#[test]
fn a_silent_node_is_named_until_it_is_back() {
    let mut world = World::new(BOTH);
    world.run(2000);
    world.told();
    world.powered = false;
    world.run(1000);
    assert_eq!(world.told(), [Missing(NODE)]);
    assert_eq!(world.canopen.missing(), 1);
    world.run(5000);
    assert_eq!(world.told(), [], "said once");
    world.boot();
    world.run(1000);
    assert!(world.has_odometry());
    assert_eq!(world.told(), [Booted(NODE), Operational(NODE)]);
    assert_eq!(world.canopen.missing(), 0);
}

#[test]
fn who_is_asked_for_nothing_sends_nothing() {
    let mut world = World::new("nodes = [5]");
    world.run(3000);
    assert_eq!((world.operational, world.sent_syncs), (false, 0));
    assert_eq!(world.told(), [NotOperational(NODE)]);
}
