//! A CANopen drive on a bus, with both wheels: mute until it is started, and silent without SYNC. And another who sends SYNC.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use coloc_drivers::can::{Bus, BusSpec, Filter, Frame, Sender, StandardId};
use coloc_drivers::encoder::WheelFrames;

use super::robot::METRES_PER_TICK;

pub(crate) const NODE: u8 = 5;
const HEARTBEAT: Duration = Duration::from_millis(100);
const SYNC_PERIOD: Duration = Duration::from_millis(20);

/// What the test has it do.
#[derive(Default)]
struct Orders {
    reset: AtomicBool,
    produce: AtomicBool,
    end: AtomicBool,
}

pub(crate) struct MuteDrive {
    orders: Arc<Orders>,
    thread: Option<JoinHandle<()>>,
}

impl MuteDrive {
    /// It has booted before anybody listened.
    pub(crate) fn on(spec: &str) -> Self {
        let spec: BusSpec = spec.parse().unwrap();
        let orders = Arc::new(Orders::default());
        let own = Arc::clone(&orders);
        let thread = std::thread::spawn(move || live(&spec, &own));
        Self {
            orders,
            thread: Some(thread),
        }
    }

    /// It boots again.
    pub(crate) fn reset(&self) {
        self.orders.reset.store(true, Ordering::Relaxed);
    }

    /// Whether another node sends SYNC.
    pub(crate) fn produce(&self, produce: bool) {
        self.orders.produce.store(produce, Ordering::Relaxed);
    }
}

impl Drop for MuteDrive {
    fn drop(&mut self) {
        self.orders.end.store(true, Ordering::Relaxed);
        let _ = self.thread.take().map(JoinHandle::join); // Its panic has been printed.
    }
}

fn frame(id: u16, data: &[u8]) -> Frame {
    Frame::data_frame(StandardId::new(id).unwrap(), data).unwrap()
}

fn live(spec: &BusSpec, orders: &Orders) {
    let mut bus = Bus::open(spec, 0, Filter::All).unwrap();
    let mut sender = Sender::open(spec).unwrap();
    let mut wheels = WheelFrames::new(METRES_PER_TICK);
    let own = 0x700 + u16::from(NODE);
    let is = |frame: &Frame, id: u16| frame.id() == Some(StandardId::new(id).unwrap().into());
    let (mut operational, mut beat, mut sync) = (false, Instant::now(), Instant::now());
    while !orders.end.load(Ordering::Relaxed) {
        let (mut started, mut syncs) = (false, 0);
        bus.receive(&mut |received| {
            let frame = &received.frame;
            started |= is(frame, 0x000) && frame.data() == [1, NODE];
            syncs += u32::from(is(frame, 0x080));
        });
        operational |= started;
        if orders.reset.swap(false, Ordering::Relaxed) {
            operational = false;
            sender.send(&frame(own, &[0])).unwrap();
        }
        if Instant::now() >= beat {
            beat += HEARTBEAT;
            let state = if operational { 0x05 } else { 0x7F };
            sender.send(&frame(own, &[state])).unwrap();
        }
        if orders.produce.load(Ordering::Relaxed) && Instant::now() >= sync {
            sync = Instant::now() + SYNC_PERIOD;
            sender.send(&frame(0x080, &[])).unwrap();
        }
        if operational && syncs > 0 {
            for frame in wheels.encode(0.0, 0.0) {
                sender.send(&frame).unwrap();
            }
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}
