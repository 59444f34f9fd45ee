//! Frames of other nodes stay in the kernel: they wake nobody.

use coloc_drivers::can::{ExtendedId, Filter, Frame, Id, StandardId};

use super::support::{Interface, frames, wakes};

#[test]
fn what_is_not_wanted_never_wakes_the_reader() {
    let interface = Interface::new("vcan0");
    let wanted = StandardId::new(0x100).unwrap();
    let mut bus = interface.bus(Filter::ids([Id::from(wanted)]));
    let (mut witness, mut sender) = (interface.bus(Filter::All), interface.sender());

    let foreign = [
        Frame::data_frame(StandardId::new(0x101).unwrap(), &[1]).unwrap(),
        Frame::data_frame(ExtendedId::new(0x100).unwrap(), &[2]).unwrap(),
        Frame::remote_frame(wanted, 8).unwrap(),
    ];
    for frame in &foreign {
        sender.send(frame).unwrap();
    }
    let seen: Vec<Frame> = frames(&mut witness, foreign.len())
        .iter()
        .map(|received| received.frame)
        .collect();
    assert_eq!(seen, foreign, "everything crossed the bus");
    assert!(!wakes(&bus), "and none of it concerns the reader");

    let own = Frame::data_frame(wanted, &[3]).unwrap();
    sender.send(&own).unwrap();
    let received = frames(&mut bus, 1);
    assert_eq!(
        received
            .iter()
            .map(|received| received.frame)
            .collect::<Vec<_>>(),
        [own]
    );
    assert_eq!(
        bus.health().counters.unwanted,
        0,
        "the kernel did the filtering"
    );
}
