//! What a scan of 360 beams costs, with five robots in it: microseconds, the median of many.
//!
//! ```text
//! cargo run --release -p coloc-scan --example cost
//! cargo run --release -p coloc-scan --example cost -- 1000 rectangles      of fewer scans, of these rows alone
//! ```
//!
//! How many instructions that are: `laser-…` in benches/instructions.tsv.
#![allow(clippy::unwrap_used)] // What fails here fails the run.

mod office;

use std::io::Write;
use std::time::Instant;

use office::{LONG, Office, ROUND};

/// What a robot's computer must manage, in microseconds.
const MOST_US: f64 = 200.0;
const SCANS: usize = 20_000;

fn main() {
    let mut args = std::env::args().skip(1);
    let scans: usize = args.next().map_or(SCANS, |it| it.parse().unwrap());
    let only = args.next().unwrap_or_default();
    for (name, look, heading_sigma_rad) in [
        ("cylinders", ROUND, 0.0),
        ("rectangles", LONG, 0.0),
        ("cylinders, own heading known to 1°", ROUND, 0.017),
        ("cylinders, own heading known to 10°", ROUND, 0.17),
        ("rectangles, own heading known to 1°", LONG, 0.017),
        ("rectangles, own heading known to 10°", LONG, 0.17),
    ] {
        if !name.contains(&only) {
            continue;
        }
        let mut office = Office::new(look, heading_sigma_rad);
        let mut spent = Vec::with_capacity(scans);
        let mut seen = 0;
        for _ in 0..scans {
            let begin = Instant::now();
            seen = office.find().unwrap();
            spent.push(begin.elapsed().as_secs_f64() * 1e6);
        }
        spent.sort_by(f64::total_cmp);
        let (median, late) = (spent[scans / 2], spent[scans * 99 / 100]);
        // A busy machine is no fault of the program: it is said, and fails nothing.
        let judged = if median > MOST_US {
            format!("; MISSED: {MOST_US} µs are wanted")
        } else {
            String::new()
        };
        let text = format!(
            "360 beams, five {name}, {seen} seen: {median:.0} µs, one of a hundred {late:.0} µs{judged}\n"
        );
        std::io::stdout().write_all(text.as_bytes()).unwrap();
    }
}
