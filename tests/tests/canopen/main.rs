//! The same drive as in `can/canopen.rs`, on a local bus, for machines without CAN.
#![allow(
    clippy::unwrap_used,
    reason = "a test fails by panicking, also in its helpers"
)]

#[path = "../can/canopen.rs"]
mod canopen;
#[path = "../can/mute_drive.rs"]
mod mute_drive;
#[path = "../can/robot.rs"]
#[expect(dead_code, reason = "other tests use the rest of it")]
mod robot;

#[test]
fn a_drive_on_a_local_bus_is_started_and_given_sync() {
    let directory = tempfile::tempdir().unwrap();
    canopen::a_drive_that_has_to_be_started(&format!("local:{}", directory.path().display()));
}
