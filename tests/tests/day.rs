//! A day of a receiver: once it has begun, nothing is allocated any more, so nothing can grow.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use coloc_counting::{Calls, calls_during};
use coloc_gnss::driver::Outlet;
use coloc_sensors::{Driver, Moment};
use coloc_shm_types::{Heading, Position};

#[path = "../src/bin/day/bursts.rs"]
mod bursts;

/// Counts what is said.
#[derive(Debug, Default)]
struct Ears {
    positions: u64,
    headings: u64,
}

impl Outlet for Ears {
    fn position(&mut self, _: i64, position: Position) -> bool {
        self.positions += 1;
        position.position.iter().all(|it| it.is_finite())
    }

    fn heading(&mut self, _: i64, heading: Heading) -> bool {
        self.headings += 1;
        heading.heading.is_finite()
    }
}

#[test]
fn a_day_allocates_no_more_than_its_first_minutes() {
    let mut driver = bursts::driver(Ears::default());
    let mut burst = String::new();
    let mut play = |seconds: std::ops::Range<u32>| {
        let mut calls = Calls::default();
        for second in seconds {
            bursts::write(second, &mut burst);
            let at = Moment {
                boottime_ns: i64::from(second) * 1_000_000_000,
                realtime_ns: 0,
            };
            let (taken, during) = calls_during(|| driver.take(burst.as_bytes(), at));
            taken.unwrap();
            calls += during;
        }
        calls
    };
    play(0..120);
    assert_eq!(play(120..86_400), Calls::NONE);
    let (ears, report) = (driver.outlet(), driver.report());
    assert_eq!(
        (report.broken, report.whole),
        (0, 86_400 * u64::from(bursts::SENTENCES))
    );
    assert_eq!(ears.positions, 86_400);
    assert_eq!(report.refused, [0; 16]);
}
