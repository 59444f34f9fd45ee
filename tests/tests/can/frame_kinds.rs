//! Standard and extended identifiers, remote and FD frames: each arrives as what it was sent.

use coloc_drivers::can::{ExtendedId, Filter, Frame, StandardId};

use super::support::{Interface, frames};

/// Largest packet of an interface that carries FD frames, `sizeof(struct canfd_frame)`.
const FD_MTU: &str = "72";

#[test]
fn every_kind_of_frame_arrives_as_it_was_sent() {
    let interface = Interface::new("vcan1");
    interface.set(&["down"]);
    interface.set(&["mtu", FD_MTU]);
    interface.up();
    let (mut bus, mut sender) = (interface.bus(Filter::All), interface.sender());
    let sent = [
        Frame::data_frame(StandardId::MAX, &[0xff; 8]).unwrap(),
        Frame::data_frame(ExtendedId::MAX, &[]).unwrap(),
        Frame::remote_frame(StandardId::ZERO, 8).unwrap(),
        Frame::fd_frame(ExtendedId::new(0x1234_5678).unwrap(), &[7; 64]).unwrap(),
    ];
    for frame in &sent {
        sender.send(frame).unwrap();
    }
    let received: Vec<Frame> = frames(&mut bus, sent.len())
        .iter()
        .map(|received| received.frame)
        .collect();
    assert_eq!(received, sent);
    assert_eq!(bus.health().counters.malformed, 0);
}
