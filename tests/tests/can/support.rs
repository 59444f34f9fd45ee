//! What the tests share: their interfaces, and waiting for a descriptor instead of sleeping.

use std::os::fd::AsFd;
use std::process::Command;

use coloc_drivers::can::{Bus, Filter, Frame, Received, Sender, StandardId};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::time::{ClockId, clock_gettime};

/// Longer than anything here takes on the slowest machine; only a failure waits it out.
const PATIENCE: Timespec = Timespec {
    tv_sec: 20,
    tv_nsec: 0,
};

/// A CAN interface that exists for this run only.
pub(crate) struct Interface(&'static str);

impl Interface {
    /// # Panics
    /// Without the machine that `with-vcan` makes: nobody's own interfaces are touched.
    pub(crate) fn new(name: &'static str) -> Self {
        assert!(
            std::env::var_os("WITH_VCAN").is_some(),
            "these tests need tests/hil/with-vcan to run them"
        );
        Self(name)
    }

    pub(crate) fn name(&self) -> &str {
        self.0
    }

    pub(crate) fn bus(&self, filter: Filter) -> Bus {
        Bus::open(&self.spec().parse().unwrap(), 0, filter).unwrap()
    }

    pub(crate) fn sender(&self) -> Sender {
        Sender::open(&self.spec().parse().unwrap()).unwrap()
    }

    pub(crate) fn spec(&self) -> String {
        format!("socketcan:{}", self.0)
    }

    pub(crate) fn set(&self, what: &[&str]) {
        self.ip(&["set", self.0], what);
    }

    pub(crate) fn delete(&self) {
        self.ip(&["del", self.0], &[]);
    }

    pub(crate) fn create(&self) {
        self.ip(&["add", self.0, "type", "vcan"], &[]);
        self.up();
    }

    /// Switches it on and waits until frames cross it: the kernel sees to that a little later.
    pub(crate) fn up(&self) {
        self.set(&["up"]);
        let (witness, mut sender) = (self.bus(Filter::All), self.sender());
        let probe = Frame::data_frame(StandardId::MAX, &[]).unwrap();
        let crossed = (0..1000).any(|_| {
            sender.send(&probe).unwrap();
            ready(
                &witness,
                &Timespec {
                    tv_sec: 0,
                    tv_nsec: 20_000_000,
                },
            ) == 1
        });
        assert!(crossed, "no frame crosses {}", self.0);
    }

    fn ip(&self, what: &[&str], more: &[&str]) {
        let status = Command::new("ip")
            .arg("link")
            .args(what)
            .args(more)
            .status()
            .expect("ip, of the package iproute2");
        assert!(status.success(), "ip link {what:?} {more:?} on {}", self.0);
    }
}

/// Waits until `bus` has something to do.
pub(crate) fn wait(bus: &Bus) {
    assert_eq!(ready(bus, &PATIENCE), 1, "nothing came");
}

/// Whether `bus` would wake who waits for it.
pub(crate) fn wakes(bus: &Bus) -> bool {
    ready(
        bus,
        &Timespec {
            tv_sec: 0,
            tv_nsec: 0,
        },
    ) == 1
}

fn ready(bus: &Bus, timeout: &Timespec) -> usize {
    let fd = bus.as_fd();
    poll(&mut [PollFd::new(&fd, PollFlags::IN)], Some(timeout)).unwrap()
}

/// Waits for `count` frames and returns them.
pub(crate) fn frames(bus: &mut Bus, count: usize) -> Vec<Received> {
    let mut received = Vec::new();
    while received.len() < count {
        wait(bus);
        bus.receive(&mut |frame| received.push(*frame));
    }
    received
}

/// `CLOCK_REALTIME` \[ns\].
pub(crate) fn realtime_ns() -> i64 {
    let now = clock_gettime(ClockId::Realtime);
    now.tv_sec * 1_000_000_000 + now.tv_nsec
}
