//! Listening in on an interface whose wanted frames do not come.

use std::time::Duration;

use coloc_drivers::can::{Filter, Frame, StandardId, listen};

use super::support::Interface;

#[test]
fn what_the_kernel_filters_out_is_heard_by_who_listens_in() {
    let interface = Interface::new("vcan2");
    let [wanted, foreign] = [0x100, 0x200].map(|id| StandardId::new(id).unwrap());
    let mut bus = interface.bus(Filter::ids([wanted.into()]));
    let spec = interface.spec().parse().unwrap();
    let mut sender = interface.sender();
    let listening = std::thread::spawn(move || listen(&[spec], Duration::from_millis(400)));
    while !listening.is_finished() {
        let frame = Frame::data_frame(foreign, &[]).unwrap();
        sender.send(&frame).unwrap();
        std::thread::sleep(Duration::from_millis(5));
    }
    let heard = listening.join().unwrap().pop().unwrap().unwrap();
    assert!(
        heard.of(foreign.into()) > 0 && heard.of(wanted.into()) == 0,
        "{heard}"
    );
    bus.receive(&mut |received| panic!("{received:?} was not wanted"));
}

#[test]
fn an_interface_that_is_not_there_is_silent() {
    Interface::new("vcan0");
    let spec = "socketcan:nowhere0".parse().unwrap();
    let heard = listen(&[spec], Duration::from_millis(1))
        .pop()
        .unwrap()
        .unwrap();
    assert_eq!(heard.frames, 0);
}
