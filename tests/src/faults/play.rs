//! Puts a robot through a fault and holds every tick against the table.

use std::path::Path;

use coloc_counting::Calls;
use coloc_daemon::clock::TimeSource;
use coloc_shm_types::{BusState, Estimate, Health, Input, Status};

use super::script::COUNTERS;
use super::{Fault, Way, at};
use crate::rig::{Line, Rig, Stamps, Ticked};

/// Ticks before the fault: by then everything has its steady state, and memory is mapped.
const WARM_UP: u32 = 25;
/// Good ticks that are watched after it.
const AFTERWARDS: u32 = 25;

/// Plays `fault` on the bus that `line` makes, with frame stamps that are believed or not.
///
/// # Panics
/// At the first tick that is not as the table says.
pub fn play(fault: &Fault, line: impl FnOnce(&Path) -> Line, stamps: Stamps) {
    let mut rig = Rig::new(line, fault.first_ticks, stamps);
    for _ in 0..WARM_UP {
        good_tick(&mut rig);
    }
    let before = rig.status();
    assert_eq!(
        before.health_of(Input::Odometry),
        Health::Ok,
        "before the fault"
    );
    for tick in 1..=fault.ticks + AFTERWARDS {
        let ticked = fault_tick(fault, &mut rig, tick);
        check(fault, tick, &rig, &ticked);
    }
    check_counts(fault, &before, &rig.status());
}

fn good_tick(rig: &mut Rig) -> Ticked {
    let frames = rig.turn();
    rig.send(&frames);
    rig.tick()
}

fn fault_tick(fault: &Fault, rig: &mut Rig, tick: u32) -> Ticked {
    if tick == 1 {
        (fault.script.begin)(rig);
    }
    if tick == fault.ticks + 1 {
        (fault.script.end)(rig);
    }
    if tick > fault.ticks {
        return good_tick(rig);
    }
    (fault.script.each)(rig, tick);
    rig.tick()
}

fn check(fault: &Fault, tick: u32, rig: &Rig, ticked: &Ticked) {
    let (name, estimate, status) = (fault.name, &ticked.estimate, rig.status());
    assert_eq!(
        estimate.tick,
        u64::from(WARM_UP + tick - 1),
        "{name}: one publication a tick"
    );
    assert_eq!(
        ticked.calls,
        Calls::NONE,
        "{name}, tick {tick}: the allocator was called"
    );
    assert_eq!(
        estimate.header.stamp_ns,
        rig.clock.read().realtime_ns,
        "{name}, tick {tick}: the stamp is of the clock of the day, as it is now"
    );
    assert_sane(name, tick, estimate);
    assert_eq!(
        (estimate.health_of(Input::Odometry), status.bus_state()),
        (
            at(fault.health, tick, Health::Ok),
            at(fault.bus, tick, BusState::Active)
        ),
        "{name}, tick {tick}: health and bus; {:?}",
        status.can
    );
    let recovered = tick >= fault.ticks + fault.again;
    check_way(fault, tick, recovered, rig.wheels.way_m, estimate);
}

/// What holds whatever happens.
fn assert_sane(name: &str, tick: u32, estimate: &Estimate) {
    let total = estimate.total();
    let numbers = [
        &estimate.pose[..],
        &estimate.velocity,
        &total,
        &estimate.independent,
    ];
    assert!(
        numbers.concat().iter().all(|number| number.is_finite()),
        "{name}, tick {tick}: {estimate:?}"
    );
    let split = total
        .iter()
        .step_by(4)
        .zip(estimate.independent.iter().step_by(4));
    for (total, independent) in split {
        assert!(
            *independent >= 0.0 && total >= independent,
            "{name}, tick {tick}: {estimate:?}"
        );
    }
}

fn check_way(fault: &Fault, tick: u32, recovered: bool, way_m: f64, estimate: &Estimate) {
    let [x, y, phi] = estimate.pose;
    let sigma = estimate.total()[0].sqrt();
    match fault.estimate {
        Way::Kept => {
            let off = [x - way_m, y, phi];
            assert!(
                off[0].abs() <= 3.0 * sigma,
                "{}, tick {tick}: off by {off:?}, σ = {sigma}",
                fault.name
            );
            let exact = off.iter().all(|off| off.abs() < 1e-6);
            assert!(
                exact || !recovered,
                "{}, tick {tick}: off by {off:?} after recovery",
                fault.name
            );
        }
        Way::Turns(angle) if recovered => {
            assert!(
                (phi - angle).abs() < 1e-6,
                "{}, tick {tick}: φ = {phi}, not {angle}",
                fault.name
            );
        }
        Way::Turns(angle) => {
            let between = 0.0_f64.min(angle) - 1e-6..=0.0_f64.max(angle) + 1e-6;
            assert!(
                between.contains(&phi),
                "{}, tick {tick}: φ = {phi} on the way to {angle}",
                fault.name
            );
        }
    }
}

fn check_counts(fault: &Fault, before: &Status, after: &Status) {
    for unlisted in COUNTERS.map(|counter| counter(0)) {
        let listed = fault
            .counts
            .iter()
            .find(|listed| listed.name == unlisted.name);
        let count = listed.unwrap_or(&unlisted);
        let grown = (count.of)(&after.can) - (count.of)(&before.can);
        assert!(
            grown == count.by || count.or_more && grown > count.by,
            "{}: {} grew by {grown}, not {}; {:?}",
            fault.name,
            count.name,
            count.by,
            after.can
        );
    }
}
