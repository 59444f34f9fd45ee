//! Frames that come while nobody takes them are kept for as long as was asked, and what is not kept is counted.

use coloc_drivers::can::{Bus, Filter, Frame, StandardId};

use super::support::{Interface, frames};

/// A minute of two encoders at 50 Hz.
const MINUTE: usize = 2 * 50 * 60;

fn frame(number: usize) -> Frame {
    let data = u32::try_from(number).unwrap().to_le_bytes();
    Frame::data_frame(StandardId::new(0x100).unwrap(), &data).unwrap()
}

fn drain(bus: &mut Bus) -> Vec<Frame> {
    let mut all = Vec::new();
    while bus.receive(&mut |received| all.push(received.frame)).more {}
    all
}

#[test]
fn a_minute_of_frames_is_kept_where_that_was_asked() {
    let interface = Interface::new("vcan1");
    let [mut asked, mut usual] = [0, 1].map(|_| interface.bus(Filter::All));
    assert_eq!(
        asked.keep(MINUTE),
        None,
        "the superuser gets what it asks for"
    );
    let sent: Vec<Frame> = (0..MINUTE).map(frame).collect();
    let mut sender = interface.sender();
    for frame in &sent {
        sender.send(frame).unwrap();
    }
    let kept = drain(&mut asked);
    assert!(kept == sent, "{} of {MINUTE}", kept.len());
    assert_eq!(asked.health().counters.receive_drops, 0);

    // Nobody asked for this one: what it lost the next frame tells.
    let kept = drain(&mut usual).len();
    assert!((1..MINUTE).contains(&kept), "{kept}");
    sender.send(&frame(MINUTE)).unwrap();
    frames(&mut usual, 1);
    let lost = u64::try_from(MINUTE - kept).unwrap();
    assert_eq!(usual.health().counters.receive_drops, lost);
}

#[test]
fn a_bus_that_was_lost_keeps_as_much_again() {
    let interface = Interface::new("vcan4");
    let mut bus = interface.bus(Filter::All);
    assert_eq!(bus.keep(MINUTE), None);
    interface.delete();
    let mut now_ns = 0;
    let mut supervise = |bus: &mut Bus| {
        for _ in 0..500 {
            now_ns += 20_000_000;
            bus.receive(&mut |_| {});
            bus.supervise(now_ns);
        }
    };
    supervise(&mut bus);
    interface.create();
    supervise(&mut bus);
    drain(&mut bus);
    let mut sender = interface.sender();
    for number in 0..MINUTE {
        sender.send(&frame(number)).unwrap();
    }
    assert_eq!(drain(&mut bus).len(), MINUTE);
}
