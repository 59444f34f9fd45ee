//! Every fault that needs no CAN in the kernel, on a local bus.

use coloc_tests::faults::{Place, play_all};
use coloc_tests::rig::Line;

#[test]
fn every_fault_is_as_the_table_says() {
    play_all(
        |fault| matches!(fault.place, Place::Anywhere | Place::NoHardware),
        |directory| Line::Local(directory.join("bus")),
    );
}
