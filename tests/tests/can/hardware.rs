//! The tests that a robot builder runs on their own interface and wiring: `tests/hil/run --interface can0`.

use coloc_tests::faults::{Place, play_all};
use coloc_tests::rig::Line;

fn line() -> Line {
    let variable = |name| std::env::var(name).expect("tests/hil/run --interface sets it");
    Line::Hardware {
        receiver: variable("COLOC_HIL_INTERFACE"),
        sender: variable("COLOC_HIL_PEER"),
    }
}

#[test]
fn every_fault_that_can_be_made_on_hardware_is_as_the_table_says() {
    play_all(
        |fault| matches!(fault.place, Place::Anywhere | Place::Interface),
        |_| line(),
    );
}
