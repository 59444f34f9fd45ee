//! What the person sees.

use super::pass::Pass;
use super::percentiles::{Durations, Percentiles};
use super::report::Report;

/// The figures of one way of waiting.
pub(crate) fn pass(pass: &Pass) {
    println!();
    println!("{} [µs]", pass.mode.describe());
    println!(
        "{:<32} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>8}",
        "", "p50", "p90", "p99", "p99.9", "p99.99", "max", "count"
    );
    row("frame due → estimate read", &pass.frames);
    row("frame in kernel → estimate read", &pass.from_kernel);
    for (name, durations) in &pass.stages {
        row(&format!("  {name}"), durations);
    }
    row("floor: frame read", &pass.floors.frame);
    row("floor: transport", &pass.floors.transport);
    row("floor: clock read", &pass.floors.clock);
    match (pass.ratio(|p| p.p50_ns), pass.ratio(|p| p.p99_ns)) {
        (Some(p50), Some(p99)) => {
            println!("kernel → read, to the floors' sum   p50 {p50:.2}   p99 {p99:.2}");
        }
        _ => {
            println!("frames wait for the next deadline: compare to the period, not to the floors");
        }
    }
    println!(
        "frames lost {}   publication when a subscriber joins {:.1} µs   the daemon's tick ran as {}   taken by the host {} ms",
        pass.lost,
        micros(pass.join_ns),
        pass.class,
        pass.stolen_ms
    );
}

fn row(name: &str, durations: &Durations) {
    let Percentiles {
        p50_ns,
        p90_ns,
        p99_ns,
        p99_9_ns,
        p99_99_ns,
        max_ns,
        count,
    } = durations.percentiles();
    print!("{name:<32}");
    for value_ns in [p50_ns, p90_ns, p99_ns, p99_9_ns, p99_99_ns, max_ns] {
        print!(" {:>9.2}", micros(value_ns));
    }
    println!(" {count:>8}");
}

/// Settings, the machine's facts, and how to read the tables.
pub(crate) fn end(report: &Report) {
    let settings = &report.settings;
    let facts = &report.facts;
    println!();
    println!(
        "{} s each at {} Hz, {} trigger, {} neighbours, {} bus ({}), {} busy threads beside it",
        settings.seconds,
        settings.rate_hz,
        settings.trigger,
        settings.neighbours,
        settings.can,
        settings.can_because,
        settings.load_threads
    );
    println!(
        "{} × {}, Linux {}, preemption {}, governor {}, isolated cores {}, load before {}, coloc {}",
        facts.processors,
        facts.processor,
        facts.kernel,
        facts.preemption,
        facts.governor,
        facts.isolated,
        facts.load_average,
        facts.version
    );
    println!(
        "Every frame is counted from when it was due: a stall is charged to each frame that it delayed.\n\
         publish and account are those of the tick before; transfer begins before publish and ends with the reader."
    );
}

#[allow(clippy::cast_precision_loss)] // A minute in nanoseconds is far below 2^53.
fn micros(nanos: u64) -> f64 {
    nanos as f64 / 1e3
}
