//! Interfaces that are switched off or taken away: health says so, and frames come again when they are back.

use coloc_drivers::can::{Bus, BusState, Filter, Frame, StandardId};

use super::support::{Interface, frames};

/// A tick of the supervision's clock, which the tests run by hand.
const TICK_NS: i64 = 20_000_000;
/// Ten seconds: more than the longest back-off.
const TICKS: usize = 500;

/// Supervises until `bus` is in `state`, with time running fast; how many ticks it took.
fn supervise_until(state: BusState, bus: &mut Bus, now_ns: &mut i64) -> usize {
    for tick in 1..=TICKS {
        *now_ns += TICK_NS;
        bus.receive(&mut |_| {});
        bus.supervise(*now_ns);
        if bus.health().state == state {
            return tick;
        }
    }
    panic!("{:?} after {TICKS} ticks, not {state:?}", bus.health());
}

fn prove_reception(interface: &Interface, bus: &mut Bus) {
    let frame = Frame::data_frame(StandardId::new(0x100).unwrap(), &[42]).unwrap();
    interface.sender().send(&frame).unwrap();
    assert_eq!(frames(bus, 1)[0].frame, frame);
}

#[test]
fn an_interface_switched_off_and_on_is_used_again() {
    let interface = Interface::new("vcan2");
    let (mut bus, mut now_ns) = (interface.bus(Filter::All), 0);
    prove_reception(&interface, &mut bus);

    interface.set(&["down"]);
    assert_eq!(
        supervise_until(BusState::Down, &mut bus, &mut now_ns),
        1,
        "the socket tells at once"
    );
    interface.up();
    assert_eq!(
        supervise_until(BusState::Up, &mut bus, &mut now_ns),
        1,
        "and a bus that is down is looked at in every tick"
    );
    prove_reception(&interface, &mut bus);
    assert_eq!(
        bus.health().counters.reopen_attempts,
        0,
        "the socket survives it"
    );
}

#[test]
fn an_interface_deleted_and_made_again_is_opened_again() {
    let interface = Interface::new("vcan3");
    let (mut bus, mut now_ns) = (interface.bus(Filter::All), 0);
    prove_reception(&interface, &mut bus);

    interface.delete();
    supervise_until(BusState::Gone, &mut bus, &mut now_ns);
    interface.create();
    supervise_until(BusState::Up, &mut bus, &mut now_ns);
    prove_reception(&interface, &mut bus);
    assert_eq!(bus.health().counters.reopened, 1);
}

#[test]
fn an_interface_that_comes_late_is_waited_for() {
    let interface = Interface::new("vcan3");
    interface.delete();
    let (mut bus, mut now_ns) = (interface.bus(Filter::All), 0);
    assert_eq!(bus.health().state, BusState::Gone);
    interface.create();
    supervise_until(BusState::Up, &mut bus, &mut now_ns);
    prove_reception(&interface, &mut bus);
}
