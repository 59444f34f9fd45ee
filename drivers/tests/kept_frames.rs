//! A listener that does not read for a minute loses nothing that the kernel was asked to keep, and says what it will not keep.
//!
//! The second of these is this binary again in a network namespace of its own, where it may set what the kernel allows.
#![allow(clippy::unwrap_used, reason = "a test")]

use std::path::Path;
use std::process::Command;

use coloc_drivers::can::{Bus, BusSpec, Filter, Frame, Received, Sender, StandardId};

const PART: &str = "COLOC_TEST_PART";
const QUEUE: &str = "/proc/sys/net/unix/max_dgram_qlen";

/// A minute of two encoders at 50 Hz.
const MINUTE: usize = 2 * 50 * 60;

fn spec(directory: &Path) -> BusSpec {
    BusSpec::Local {
        directory: directory.to_owned(),
    }
}

fn frame(number: usize) -> Frame {
    let data = u32::try_from(number).unwrap().to_le_bytes();
    Frame::data_frame(StandardId::new(0x100).unwrap(), &data).unwrap()
}

/// All that waits.
fn drain(bus: &mut Bus) -> Vec<Frame> {
    let mut all = Vec::new();
    let mut take = |received: &Received| all.push(received.frame);
    while bus.receive(&mut take).more {}
    all
}

#[test]
fn what_a_local_bus_cannot_keep_is_said_with_what_gives_more() {
    let directory = tempfile::tempdir().unwrap();
    let mut bus = Bus::open(&spec(directory.path()), 0, Filter::All).unwrap();
    let limit: usize = std::fs::read_to_string(QUEUE)
        .unwrap()
        .trim()
        .parse()
        .unwrap();
    assert_eq!(bus.keep(limit + 1), None);
    let shortage = bus.keep(limit + 2).unwrap();
    assert_eq!((shortage.kept, shortage.wanted), (limit + 1, limit + 2));
    let said = shortage.to_string();
    let remedy = format!("sysctl -w net.unix.max_dgram_qlen={}", limit + 2);
    assert!(said.ends_with(&remedy), "{said}");
}

#[test]
fn a_local_bus_keeps_a_minute_where_the_kernel_may() {
    let set = format!("echo {MINUTE} > {QUEUE}");
    let ways = [vec!["--net"], vec!["--user", "--map-root-user", "--net"]];
    let works = |way: &&Vec<&str>| {
        let probe = Command::new("unshare")
            .args(way.iter())
            .args(["sh", "-c", &set])
            .output();
        probe.is_ok_and(|output| output.status.success())
    };
    let Some(way) = ways.iter().find(works) else {
        println!(
            "SKIPPED: a minute of frames on a local bus: no network namespace can be made here"
        );
        return;
    };
    let output = Command::new("unshare")
        .args(way)
        .args(["sh", "-c", &format!("{set} && exec \"$0\" \"$@\"")])
        .arg(std::env::current_exe().unwrap())
        .args(["--ignored", "--exact", "the_other_process", "--nocapture"])
        .env(PART, "minute")
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success() && text.contains("1 passed"),
        "{text}"
    );
}

#[test]
#[ignore = "not a test: the process that a test starts"]
fn the_other_process() {
    assert_eq!(std::env::var(PART).as_deref(), Ok("minute"));
    let directory = tempfile::tempdir().unwrap();
    let open = |number| Bus::open(&spec(directory.path()), number, Filter::All).unwrap();
    let (mut first, mut second) = (open(0), open(1));
    assert_eq!(first.keep(MINUTE), None);
    let mut sender = Sender::open(&spec(directory.path())).unwrap();
    let sent: Vec<Frame> = (0..MINUTE).map(frame).collect();
    for frame in &sent {
        sender.send(frame).unwrap();
    }
    // Neither has read: what waits for one takes nothing from the other.
    for bus in [&mut first, &mut second] {
        let kept = drain(bus);
        assert!(kept == sent, "{} of {MINUTE}", kept.len());
    }
    assert_eq!(sender.counters().full, 0);
}
