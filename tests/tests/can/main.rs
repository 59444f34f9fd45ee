//! coloc on the kernel's own CAN: one test binary, so that one virtual machine is booted for all of it.
//!
//! Run by `tests/run`, or alone by `tests/hil/with-vcan -i 5 -- cargo test -p coloc-tests --features vcan --test can --
//! --test-threads=1`. Every test has an interface of its own; one that takes an interface away brings it back.
#![allow(
    clippy::unwrap_used,
    reason = "a test fails by panicking, also in its helpers"
)]

mod backlog;
mod bus_lost;
mod can_utils;
mod canopen;
mod car;
mod clock_step;
mod daemon;
mod faults;
mod fleet;
mod frame_kinds;
mod hardware;
mod kept;
mod kernel_filter;
mod kernel_stamp;
mod listen;
mod load;
mod mute_drive;
mod outage;
mod recorded;
mod robot;
mod support;
mod wheels;

#[test]
fn the_kernel_says_how_an_interface_is_run() {
    let interface = support::Interface::new("vcan1");
    let here = || {
        coloc_drivers::can::Controller::of("vcan1")
            .unwrap()
            .unwrap()
    };
    assert_eq!(here().to_string(), "up");
    interface.set(&["down"]);
    assert_eq!(here().to_string(), "down");
    interface.up();
}

#[test]
fn a_canopen_drive_is_started_and_given_sync() {
    let interface = support::Interface::new("vcan1");
    canopen::a_drive_that_has_to_be_started(&interface.spec());
}
