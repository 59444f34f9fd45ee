//! What the person sees.

use super::matching::Account;
use super::pass::Pass;
use super::percentiles::{Durations, Percentiles};
use super::report::Report;
use crate::output::print_line;

/// The figures of one way of waiting.
pub(crate) fn pass(pass: &Pass) {
    print_line(&table(pass));
}

fn table(pass: &Pass) -> String {
    let mut lines = vec![
        String::new(),
        format!("{} [µs]", pass.mode.describe()),
        format!(
            "{:<32} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>8}",
            "", "p50", "p90", "p99", "p99.9", "p99.99", "max", "count"
        ),
        row("frame due → estimate read", &pass.frames),
        row("frame in kernel → estimate read", &pass.from_kernel),
    ];
    let stages = pass.stages.iter();
    lines.extend(stages.map(|(name, durations)| row(&format!("  {name}"), durations)));
    lines.extend([
        row("floor: frame read", &pass.floors.frame),
        row("floor: transport", &pass.floors.transport),
        row("floor: clock read", &pass.floors.clock),
        to_the_floors(pass),
        account(pass),
        format!(
            "publication when a subscriber joins {}   the daemon's tick ran as {}   taken by the host {}",
            known(pass.join_ns.map(|ns| format!("{:.1} µs", micros(ns)))),
            pass.class,
            known(pass.stolen_ms.map(|ms| format!("{ms} ms"))),
        ),
    ]);
    lines.join("\n")
}

fn to_the_floors(pass: &Pass) -> String {
    if !pass.is_comparable() {
        return "frames wait for the next deadline: compare to the period, not to the floors"
            .into();
    }
    let ratio = |percentile| known(pass.ratio(percentile).map(|ratio| format!("{ratio:.2}")));
    let (p50, p99) = (ratio(|p| p.p50_ns), ratio(|p| p.p99_ns));
    format!("kernel → read, in multiples of the floors' sum   p50 {p50}   p99 {p99}")
}

/// Where every frame is, and every one that the floors were measured with.
fn account(pass: &Pass) -> String {
    let Account {
        sent,
        newest,
        with_newer,
        never_estimated,
        warm_up,
    } = pass.account;
    let floors = &pass.floors;
    let sent_to_floors = floors.sent;
    format!(
        "frames: {sent} sent = {newest} the newest of an estimate + {with_newer} with a newer one in it + \
         {never_estimated} in none + {warm_up} to warm up\n\
         floors: {} of {sent_to_floors} frames read, {} of {sent_to_floors} messages received",
        floors.frame.percentiles().count,
        floors.transport.percentiles().count,
    )
}

fn row(name: &str, durations: &Durations) -> String {
    let Percentiles {
        p50_ns,
        p90_ns,
        p99_ns,
        p99_9_ns,
        p99_99_ns,
        max_ns,
        count,
    } = durations.percentiles();
    let figures = [p50_ns, p90_ns, p99_ns, p99_9_ns, p99_99_ns, max_ns];
    let cell = |ns: Option<u64>| known(ns.map(|ns| format!("{:.2}", micros(ns))));
    let cells = figures.map(|ns| format!("{:>9}", cell(ns))).join(" ");
    format!("{name:<32} {cells} {count:>8}")
}

/// A dash for what is not known.
fn known(figure: Option<String>) -> String {
    figure.unwrap_or_else(|| "–".into())
}

/// Settings, the machine's facts, and how to read the tables.
pub(crate) fn end(report: &Report) {
    let settings = &report.settings;
    let facts = &report.facts;
    print_line(&format!(
        "\n{} s each at {} Hz, {} trigger, {} neighbours, {} bus ({}), {} busy threads beside it\n\
         {} × {}, Linux {}, preemption {}, governor {}, isolated cores {}, load before {}, coloc {}\n\
         Every frame is counted from when it was due: a stall is charged to each frame that it delayed.\n\
         transfer begins before publish and ends with the reader.\n\
         A dash: there were too few of them for that figure.",
        settings.seconds,
        settings.rate_hz,
        settings.trigger,
        settings.neighbours,
        settings.can,
        settings.can_because,
        settings.load_threads,
        facts.processors,
        facts.processor,
        facts.kernel,
        facts.preemption,
        facts.governor,
        facts.isolated,
        facts.load_average,
        facts.version
    ));
}

#[allow(clippy::cast_precision_loss)] // A minute in nanoseconds is far below 2^53.
fn micros(nanos: u64) -> f64 {
    nanos as f64 / 1e3
}
