//! A frame carries the time of its arrival in the kernel, not that of its reading.

use coloc_drivers::can::{Filter, Frame, StandardId};

use super::support::{Interface, frames, realtime_ns, wait};

#[test]
fn a_frame_that_waited_to_be_read_has_the_stamp_of_its_arrival() {
    let interface = Interface::new("vcan0");
    let (mut bus, mut sender) = (interface.bus(Filter::All), interface.sender());
    let frame = Frame::data_frame(StandardId::new(0x100).unwrap(), &[1, 2, 3]).unwrap();

    let before = realtime_ns();
    sender.send(&frame).unwrap();
    wait(&bus);
    let after = realtime_ns();
    while realtime_ns() < after + 5_000_000 {
        std::hint::spin_loop();
    }
    let received = frames(&mut bus, 1);

    assert_eq!(received[0].frame, frame);
    let stamp = received[0].stamp_ns;
    assert!(
        (before..=after).contains(&stamp),
        "{stamp} is not in {before}..={after}"
    );
}

#[test]
fn frames_keep_their_order_and_their_stamps_never_decrease() {
    let interface = Interface::new("vcan0");
    let (mut bus, mut sender) = (interface.bus(Filter::All), interface.sender());
    let id = StandardId::new(0x101).unwrap();
    for k in 0..200_u8 {
        sender.send(&Frame::data_frame(id, &[k]).unwrap()).unwrap();
    }
    let received = frames(&mut bus, 200);
    assert!(
        received
            .iter()
            .zip(0..)
            .all(|(received, k)| received.frame.data() == [k])
    );
    assert!(received.is_sorted_by_key(|received| received.stamp_ns));
}
