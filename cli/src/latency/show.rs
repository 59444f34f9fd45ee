//! What the person sees.

use super::matching::Account;
use super::pass::{Pass, Worst};
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
        row("frame in kernel → estimate ready", &pass.ready),
    ];
    let stages = pass.stages.iter();
    lines.extend(stages.map(|(name, durations)| row(&format!("  {name}"), durations)));
    lines.extend([
        row("floor: frame read", &pass.floors.frame),
        row("floor: transport", &pass.floors.transport),
        row("floor: clock read", &pass.floors.clock),
    ]);
    lines.extend(pass.plain.as_ref().map(|it| row("plain program in C", it)));
    lines.push(to_the_floors(pass));
    lines.extend(pass.plain.is_some().then(|| to_the_plain_program(pass)));
    lines.extend(pass.worst.as_ref().map(worst));
    lines.extend([
        account(pass),
        format!(
            "publication when a subscriber joins {}   the daemon's tick ran as {}",
            known(pass.join_ns.map(|ns| format!("{:.1} µs", micros(ns)))),
            pass.class,
        ),
        pass.busy.describe(),
        verdict(&pass.objections()),
    ]);
    lines.join("\n")
}

/// Whether to believe the figures.
fn verdict(objections: &[&str]) -> String {
    match objections {
        [] => "these figures are worth comparing with those of another such run".into(),
        _ => format!(
            "these figures are worth little but beside others of this very run: {}",
            objections.join("; ")
        ),
    }
}

#[allow(clippy::cast_precision_loss)] // A minute in nanoseconds is far below 2^53.
fn worst(worst: &Worst) -> String {
    let us = |ns: i64| ns as f64 / 1e3;
    format!(
        "slowest frame, kernel → read {:.0} µs: wake-up {:.0}, collect {:.0}, estimate {:.0}, publish {:.0}, transfer {:.0}",
        us(worst.from_kernel_ns),
        us(worst.wake_up_ns),
        us(worst.collect_ns.into()),
        us(worst.estimate_ns.into()),
        us(worst.publish_ns.into()),
        us(worst.transfer_ns),
    )
}

fn to_the_plain_program(pass: &Pass) -> String {
    let ratio = |percentile| known(pass.ratio_to_plain(percentile).map(|it| format!("{it:.2}")));
    let (p50, p99) = (ratio(|p| p.p50_ns), ratio(|p| p.p99_ns));
    format!("kernel → read, in multiples of the plain program's   p50 {p50}   p99 {p99}")
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
        "\n{} s each at {} Hz, the frames {} µs apart on {}, {} trigger, {} neighbours, {} bus ({}), {} busy threads beside it\n\
         {} × {}, Linux {}, preemption {}, governor {}, isolated cores {}, load before {}, coloc {}\n\
         Every frame is counted from when it was due: a stall is charged to each frame that it delayed.\n\
         transfer begins before publish and ends with the reader.\n\
         The floor of transport is a Unix datagram of as many bytes where the reader sleeps, shared memory where it polls.\n\
         A dash: there were too few of them for that figure.",
        settings.seconds,
        settings.rate_hz,
        settings.gap_us,
        if settings.buses == 1 {
            "one bus"
        } else {
            "two buses"
        },
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
