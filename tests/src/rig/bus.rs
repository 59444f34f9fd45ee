//! The bus between the rig and the robot: sockets of this machine, or a CAN interface.

use std::path::PathBuf;
use std::process::Command;

use coloc_drivers::can::{Bus, BusSpec, Filter, Frame, Kind, Sender};
use rustix::event::{PollFd, PollFlags, Timespec, poll};

/// Where a rig's frames travel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Line {
    /// A local bus in this directory.
    Local(PathBuf),
    /// A CAN interface that the tests may take away.
    Virtual(String),
    /// CAN hardware: `sender` is wired to `receiver`; they may be the same, where something else acknowledges.
    Hardware {
        /// The robot's interface.
        receiver: String,
        /// The rig's.
        sender: String,
    },
}

/// A bus with an ear on it, so that the rig knows what has crossed it.
pub(super) struct Bench {
    line: Line,
    sender: Option<Sender>,
    /// Nothing is needed on a local bus: there a frame has arrived when the call that sent it returns.
    witness: Option<Bus>,
}

/// Longer than anything here takes on the slowest machine; only a failure waits it out.
pub(super) const PATIENCE: Timespec = Timespec {
    tv_sec: 20,
    tv_nsec: 0,
};

impl Line {
    /// What the robot opens.
    #[must_use]
    pub fn spec(&self) -> BusSpec {
        match self {
            Self::Local(directory) => BusSpec::Local {
                directory: directory.clone(),
            },
            Self::Virtual(name) | Self::Hardware { receiver: name, .. } => BusSpec::SocketCan {
                interface: name.clone(),
            },
        }
    }

    /// What the rig sends on.
    #[must_use]
    pub fn sending_spec(&self) -> BusSpec {
        match self {
            Self::Hardware { sender, .. } => BusSpec::SocketCan {
                interface: sender.clone(),
            },
            _ => self.spec(),
        }
    }
}

impl Bench {
    pub(super) fn new(line: Line) -> Self {
        let mut bench = Self {
            line,
            sender: None,
            witness: None,
        };
        bench.connect();
        bench
    }

    /// Again, after the line was taken away.
    fn connect(&mut self) {
        self.sender = Some(Sender::open(&self.line.sending_spec()).unwrap());
        self.witness = match &self.line {
            Line::Local(_) => None,
            line => Some(Bus::open(&line.spec(), 0, Filter::All).unwrap()),
        };
    }

    /// Returns when the frame has arrived where the robot listens.
    pub(super) fn send(&mut self, frame: &Frame) {
        if let Line::Local(_) = self.line {
            // A sender looks for newcomers now and then only, and the robot may have opened another socket.
            self.connect();
        }
        let sender = self.sender.as_mut().expect("the line is there");
        sender.send(frame).unwrap();
        if let Some(witness) = &mut self.witness {
            wait_for(witness, frame);
        }
    }

    /// `ip link set … down` or `up`; hardware needs the right to.
    pub(super) fn switch(&mut self, on: bool) {
        let (Line::Virtual(name) | Line::Hardware { receiver: name, .. }) = &self.line else {
            panic!("a local bus has no switch")
        };
        ip(&["set", name, if on { "up" } else { "down" }]);
        if on {
            self.connect();
        } else {
            (self.sender, self.witness) = (None, None);
        }
    }

    /// Takes the interface away, or makes it again.
    pub(super) fn exist(&mut self, exists: bool) {
        let Line::Virtual(name) = &self.line else {
            panic!("only a virtual interface can be deleted")
        };
        if exists {
            ip(&["add", name, "type", "vcan"]);
            ip(&["set", name, "up"]);
            self.connect();
        } else {
            ip(&["del", name]);
            (self.sender, self.witness) = (None, None);
        }
    }
}

fn wait_for(witness: &mut Bus, frame: &Frame) {
    let mut seen = false;
    while !seen {
        let ready = poll(&mut [PollFd::new(witness, PollFlags::IN)], Some(&PATIENCE)).unwrap();
        assert_eq!(ready, 1, "a frame was sent and did not arrive: {frame:?}");
        witness.receive(&mut |received| {
            // Interfaces complete error frames with what they know.
            seen |= received.frame == *frame || received.frame.kind() == Kind::Error;
        });
    }
}

fn ip(arguments: &[&str]) {
    let status = Command::new("ip").arg("link").args(arguments).status();
    let status = status.expect("ip, of the package iproute2");
    assert!(status.success(), "ip link {arguments:?}");
}
