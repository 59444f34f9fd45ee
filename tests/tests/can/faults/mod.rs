//! Everything that goes wrong on a bus, by the table.

mod stage;
mod table;

use coloc_shm_types::{BusState, Health};

use stage::{Seen, Stage};
use table::{Estimate, FAULTS, Fault};

/// Rounding, of metres.
const EXACT_M: f64 = 1e-9;

#[test]
fn every_fault_shows_in_its_tick_and_is_over_in_its_time() {
    let complaints: Vec<String> = FAULTS
        .iter()
        .filter_map(|fault| play(fault).err())
        .collect();
    assert!(
        complaints.is_empty(),
        "{} of {} faults:\n{}",
        complaints.len(),
        FAULTS.len(),
        complaints.join("\n")
    );
}

fn play(fault: &Fault) -> Result<(), String> {
    let mut stage = Stage::new("vcan2");
    (0..10).for_each(|_| _ = stage.drive());
    stage.tick = 0;
    let suffered = (1..=fault.lasts).try_for_each(|tick| {
        let seen = stage.tick_with(&mut |stage, pair| (fault.happen)(stage, pair));
        check(fault, tick, seen).map_err(|wrong| format!("{}, tick {tick}: {wrong}", fault.name))
    });
    (fault.end)(&mut stage); // Also after a complaint: the next fault wants the interface whole.
    suffered?;
    let last = (0..fault.recovers).map(|_| stage.drive()).last();
    match last {
        Some(seen) if is_well(fault, seen) => Ok(()),
        last => Err(format!(
            "{}: not recovered in {} ticks; {last:?}",
            fault.name, fault.recovers
        )),
    }
}

fn is_well(fault: &Fault, seen: Seen) -> bool {
    let exact = seen.error_m < EXACT_M || matches!(fault.estimate, Estimate::Believes);
    seen.health == Health::Ok && seen.bus == BusState::Active && exact
}

/// What health, bus and the pose's error must be in this tick of the fault.
fn check(fault: &Fault, tick: u32, seen: Seen) -> Result<(), String> {
    let health = expected(fault.health, tick, Health::Ok);
    let bus = expected(fault.bus, tick, BusState::Active);
    let bound_m = match fault.estimate {
        Estimate::Exact => EXACT_M,
        Estimate::Predicts(bound_m) => bound_m,
        Estimate::Believes => f64::MAX,
    };
    let bounded = seen.error_m <= bound_m; // which a NaN is not
    if seen.health == health && seen.bus == bus && bounded {
        Ok(())
    } else {
        Err(format!(
            "should be {health}, {bus:?} and at most {bound_m} m wrong; is {seen:?}"
        ))
    }
}

fn expected<T: Copy>(change: Option<(T, u32)>, tick: u32, before: T) -> T {
    match change {
        Some((after, since)) if tick >= since => after,
        _ => before,
    }
}
