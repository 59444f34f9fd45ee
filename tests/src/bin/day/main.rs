//! A day of NMEA at full speed: sentences a second, and the memory at the end beside that after the first hour.
#![allow(clippy::unwrap_used)] // What fails here fails the run.

mod bursts;

use std::process::ExitCode;
use std::time::{Duration, Instant};

use coloc_gnss::driver::Outlet;
use coloc_sensors::{Driver, Moment};
use coloc_shm_types::{Heading, Position};

/// What a robot's computer must manage.
const LEAST_PER_S: f64 = 1e5;
const DAY_S: u32 = 86_400;

#[derive(Debug, Default)]
struct Ears(u64);

impl Outlet for Ears {
    fn position(&mut self, _: i64, _: Position) -> bool {
        self.0 += 1;
        true
    }

    fn heading(&mut self, _: i64, _: Heading) -> bool {
        true
    }
}

fn main() -> ExitCode {
    let mut driver = bursts::driver(Ears::default());
    let (mut burst, mut spent, mut early_kib) = (String::new(), Duration::ZERO, 0);
    for second in 0..DAY_S {
        bursts::write(second, &mut burst);
        let begin = Instant::now();
        driver.take(burst.as_bytes(), Moment::default()).unwrap();
        spent += begin.elapsed();
        if second == 3600 {
            early_kib = resident_kib();
        }
    }
    let per_s = f64::from(DAY_S * bursts::SENTENCES) / spent.as_secs_f64();
    let grown_kib = resident_kib().saturating_sub(early_kib);
    println!(
        "a day: {} sentences, {} fixes; {per_s:.0} sentences a second; {early_kib} KiB after an hour, {grown_kib} KiB more at the end",
        driver.report().whole,
        driver.outlet().0,
    );
    ExitCode::from(u8::from(per_s < LEAST_PER_S || grown_kib > 64))
}

fn resident_kib() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.unwrap()
        .split_whitespace()
        .next()
        .unwrap()
        .parse()
        .unwrap()
}
