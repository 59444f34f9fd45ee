//! Which CAN buses the demo uses: the kernel's virtual ones where it can have them, else local ones.

use std::num::NonZeroU32;
use std::path::Path;

use coloc_drivers::can::BusSpec;
use rustix::io::Errno;
use rustix::net::{AddressFamily, Protocol, SocketType, socket};
use rustix::thread::UnshareFlags;
use socketcan::CanInterface;

use crate::home::{Home, NoHome};

/// One bus for each robot.
pub(crate) struct Buses {
    /// In the order of the robots.
    pub(crate) specs: Vec<BusSpec>,
    /// `vcan` or `local`.
    pub(crate) kind: &'static str,
    /// Why this kind.
    pub(crate) reason: String,
    /// The interfaces are visible to this process and its children only.
    pub(crate) private: bool,
}

impl Buses {
    /// Buses for so many robots. `directory` is where local ones would be.
    ///
    /// Call it while the process has one thread: it may move into a network of its own, which only the calling thread and
    /// those that it starts later share.
    pub(crate) fn choose(robots: usize, directory: &Path) -> Self {
        Self::kernels(robots).unwrap_or_else(|reason| Self::local(robots, directory, reason))
    }

    /// The kernel's buses, or why there are none. As [`Self::choose`]: while there is one thread.
    pub(crate) fn kernels(robots: usize) -> Result<Self, String> {
        private_vcan(robots).or_else(|reason| existing_vcan(robots).ok_or(reason))
    }

    /// Whether those that are below `home` have room for their sockets there.
    pub(crate) fn check(&self, home: &Home) -> Result<(), NoHome> {
        self.specs.iter().try_for_each(|bus| match bus {
            BusSpec::Local { directory } => home.check_sockets(directory),
            _ => Ok(()),
        })
    }

    /// Local buses below `directory`.
    pub(crate) fn local(robots: usize, directory: &Path, reason: String) -> Self {
        let specs = (1..=robots).map(|robot| BusSpec::Local {
            directory: directory.join(format!("can{robot}")),
        });
        Self {
            specs: specs.collect(),
            kind: "local",
            reason,
            private: false,
        }
    }

    fn of_interfaces(names: impl Iterator<Item = String>, reason: &str, private: bool) -> Self {
        let specs = names
            .map(|interface| BusSpec::SocketCan { interface })
            .collect();
        Self {
            specs,
            kind: "vcan",
            reason: reason.into(),
            private,
        }
    }
}

/// Virtual interfaces in a network namespace of our own: the kernel removes them with the last process in it.
fn private_vcan(robots: usize) -> Result<Buses, String> {
    kernel_has_can()?;
    enter_own_network().map_err(|error| format!("making vcan interfaces was refused: {error}"))?;
    let names = || (1..=robots).map(|robot| format!("vcan{robot}"));
    for name in names() {
        let made =
            CanInterface::create_vcan(&name, None).and_then(|interface| interface.bring_up());
        made.map_err(|error| format!("the kernel makes no vcan interface: {error}"))?;
    }
    Ok(Buses::of_interfaces(
        names(),
        "made for this run, in a network of its own",
        true,
    ))
}

fn kernel_has_can() -> Result<(), String> {
    let can_raw = Protocol::from_raw(NonZeroU32::MIN); // CAN_RAW is 1.
    match socket(AddressFamily::CAN, SocketType::RAW, Some(can_raw)) {
        Err(Errno::AFNOSUPPORT | Errno::PROTONOSUPPORT) => {
            Err("this kernel has no SocketCAN".into())
        }
        _ => Ok(()),
    }
}

#[allow(unsafe_code)] // Not offered safely, because of flags that are not used here.
fn enter_own_network() -> rustix::io::Result<()> {
    // SAFETY: only UnshareFlags::FILES breaks what other code may rely on (its file descriptors).
    unsafe { rustix::thread::unshare_unsafe(UnshareFlags::NEWNET) }
}

/// Interfaces that somebody else has made and brought up.
fn existing_vcan(robots: usize) -> Option<Buses> {
    let entries = std::fs::read_dir("/sys/class/net").ok()?;
    let names = entries
        .flatten()
        .filter_map(|entry| entry.file_name().into_string().ok());
    let mut up: Vec<String> = names
        .filter(|name| name.starts_with("vcan") && is_up(name))
        .collect();
    up.sort();
    up.truncate(robots);
    (up.len() == robots)
        .then(|| Buses::of_interfaces(up.into_iter(), "those that are up on this machine", false))
}

fn is_up(name: &str) -> bool {
    let flags = std::fs::read_to_string(format!("/sys/class/net/{name}/flags")).unwrap_or_default();
    let flags = u32::from_str_radix(flags.trim().trim_start_matches("0x"), 16).unwrap_or(0);
    flags & 1 == 1 // IFF_UP
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_robot_has_a_bus_of_its_own_and_the_reason_is_said() {
        // On a thread of its own: choosing may move it into another network.
        let buses = std::thread::spawn(|| Buses::choose(3, Path::new("/tmp/buses")))
            .join()
            .unwrap();
        let mut names: Vec<String> = buses.specs.iter().map(ToString::to_string).collect();
        names.dedup();
        assert_eq!(names.len(), 3);
        assert!(!buses.reason.is_empty());
    }
}
