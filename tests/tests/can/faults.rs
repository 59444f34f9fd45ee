//! Every fault on a CAN interface of the kernel, or of the robot builder.

use coloc_tests::faults::play_all;
use coloc_tests::rig::Line;

#[test]
fn every_fault_is_as_the_table_says() {
    play_all(|_| true, |_| Line::Virtual("vcan0".into()));
}
