//! Every kind of frame from `cansend` to coloc, and from coloc to `candump`: both ends are not ours.

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use coloc_drivers::can::{ExtendedId, Filter, Frame, StandardId};

use super::support::{Interface, frames};

const FD_MTU: &str = "72";

/// As can-utils write it, and as it is.
fn kinds() -> [(String, Frame); 4] {
    [
        (
            "123#DEADBEEF".into(),
            Frame::data_frame(StandardId::new(0x123).unwrap(), &[0xDE, 0xAD, 0xBE, 0xEF]).unwrap(),
        ),
        (
            "1FFFFFFF#".into(),
            Frame::data_frame(ExtendedId::MAX, &[]).unwrap(),
        ),
        (
            "000#R8".into(),
            Frame::remote_frame(StandardId::ZERO, 8).unwrap(),
        ),
        (
            format!("12345678##0{}", "07".repeat(64)),
            Frame::fd_frame(ExtendedId::new(0x1234_5678).unwrap(), &[7; 64]).unwrap(),
        ),
    ]
}

fn with_fd(name: &'static str) -> Interface {
    let interface = Interface::new(name);
    interface.set(&["down"]);
    interface.set(&["mtu", FD_MTU]);
    interface.set(&["up"]);
    interface
}

#[test]
fn what_cansend_sends_is_received() {
    let interface = with_fd("vcan1");
    let mut bus = interface.bus(Filter::All);
    for (text, frame) in kinds() {
        let sent = Command::new("cansend").args(["vcan1", &text]).status();
        assert!(sent.expect("cansend, of the package can-utils").success());
        assert_eq!(frames(&mut bus, 1)[0].frame, frame, "{text}");
    }
}

#[test]
fn what_is_sent_candump_receives() {
    let interface = with_fd("vcan1");
    let listeners = listeners();
    let candump = Command::new("candump")
        .args(["-L", "-n", "4", "vcan1"])
        .stdout(Stdio::piped())
        .spawn()
        .expect("candump, of the package can-utils");
    let deadline = Instant::now() + Duration::from_secs(20);
    while self::listeners() == listeners {
        assert!(Instant::now() < deadline, "candump does not listen");
        std::thread::sleep(Duration::from_millis(1));
    }
    let mut sender = interface.sender();
    for (_, frame) in kinds() {
        sender.send(&frame).unwrap();
    }
    let output = String::from_utf8(candump.wait_with_output().unwrap().stdout).unwrap();
    // Newer kernels set a flag that says again that it is an FD frame.
    let output = output.replace("##4", "##0");
    let heard: Vec<_> = output
        .lines()
        .filter_map(|line| line.split(' ').nth(2))
        .collect();
    assert_eq!(heard, kinds().map(|(text, _)| text));
}

/// The kernel's list of those that want every frame.
fn listeners() -> String {
    std::fs::read_to_string("/proc/net/can/rcvlist_all").unwrap()
}
