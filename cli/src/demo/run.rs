//! The course of the demo: set up, wait until everybody speaks, drive, end everybody, say what it came to.

use std::sync::Arc;
use std::time::Duration;

use super::anew::Anew;
use super::bus::Buses;
use super::bystanders::stalled_ns;
use super::console::Console;
use super::interrupt::Interrupt;
use super::links::Plan;
use super::out::Out;
use super::record::Record;
use super::scene::Part;
use super::show::{Ended, Show};
use super::summary::{Facts, RobotSummary, Summary, Verdict, robots};
use super::world::Stage;
use super::{DemoError, HOME};
use crate::args::DemoArgs;
use crate::home::{Home, sweep};
use crate::output::{complain, print_line};
use crate::status::Status;

/// Runs the demo to its end.
pub(crate) fn run(args: &DemoArgs, console: &mut Console) -> Result<Status, DemoError> {
    let interrupt = Interrupt::catch().map_err(DemoError::spawn)?;
    let stage = Arc::new(Stage::new(args)?);
    let plan = Plan::of(args, stage.robots())?;
    let out = Out::prepare(args.out.as_deref())?;
    let home = home(console)?;
    let (robots_buses, apart) = (home.path().join("buses"), args.namespaces);
    let buses = if apart {
        let reason = "each robot is in a network of its own".into();
        Buses::local(stage.robots(), &robots_buses, reason)
    } else {
        Buses::choose(stage.robots(), &robots_buses)
    };
    buses.check(&home)?;
    console.say(&format!(
        "{}, {}; CAN: {} ({})",
        robots(stage.robots()),
        stage.description(),
        buses.kind,
        buses.reason
    ));
    console.say(&stage.story_in_lines());
    if let Some(plan) = &plan {
        console.say(&plan.words());
    }
    let mut show = Show::set_up(
        &stage,
        args.length_s(),
        &home,
        &buses,
        &out.logs(),
        plan.as_ref(),
    )?;
    show.wait_for_everybody(console, &interrupt)?;
    let broke_down = show.drive(console, &interrupt).err();
    let ended = show.end(console);
    if !ended.links.is_empty() {
        console.say(&ended.links.join("\n"));
    }
    let (facts, records) = facts(&stage, buses, ended, broke_down, plan.is_some());
    let summary = Summary::of(facts, interrupt.is_there());
    Ok(report(
        args, console, &out, &stage, summary, &records, &interrupt,
    ))
}

/// A place to work in, once what demos that were killed have left is gone.
fn home(console: &mut Console) -> Result<Home, DemoError> {
    let place = std::env::temp_dir();
    for left in sweep(HOME, &place) {
        console.say(&format!(
            "removed what a demo that was killed had left: {}",
            left.display()
        ));
    }
    Ok(Home::make(HOME, &place)?)
}

fn facts(
    stage: &Stage,
    buses: Buses,
    ended: Ended,
    broke_down: Option<DemoError>,
    in_spaces: bool,
) -> (Facts, Vec<Record>) {
    let heard = stage.parts().iter().zip(&ended.records).zip(ended.up);
    let robot = |(robot, ((part, record), up)): (usize, ((&Part, &Record), bool))| {
        RobotSummary::of(robot, *part, record, up, &ended.stalls)
    };
    let robots: Vec<_> = heard.enumerate().map(robot).collect();
    let bars = match (stage.lead(), in_spaces) {
        (Some(lead), _) => {
            let anew = Anew::of(&ended.files).bars();
            std::iter::once(lead.bar(&robots)).chain(anew).collect()
        }
        // Nobody leads: beliefs are all that can be worked out anew.
        (None, true) => Anew::of(&ended.files).bars().into_iter().take(1).collect(),
        (None, false) => Vec::new(),
    };
    let facts = Facts {
        robots,
        bars,
        links: ended.links,
        seconds: ended.seconds,
        world: stage.description().to_owned(),
        bus: buses.kind,
        bus_reason: buses.reason,
        left: ended.left,
        machine_stood_still_ms: Duration::from_nanos(
            stalled_ns(&ended.stalls, i64::MIN, i64::MAX).unsigned_abs(),
        )
        .as_secs_f64()
            * 1e3,
        broke_down: broke_down.or(ended.trouble).map(|error| error.to_string()),
    };
    (facts, ended.records)
}

/// The verdict comes first: pictures take a while, and may fail.
fn report(
    args: &DemoArgs,
    console: &mut Console,
    out: &Out,
    stage: &Stage,
    mut summary: Summary,
    records: &[Record],
    interrupt: &Interrupt,
) -> Status {
    console.say(&summary.lines().join("\n"));
    let (pictures, drawn) = out.draw(stage, records);
    summary.pictures = pictures;
    let (json, written) = out.write_summary(&summary);
    if args.json {
        print_line(&json);
    }
    let failures = [drawn.err(), written.err()].into_iter().flatten();
    let complaints: Vec<String> = failures.map(|error| error.to_string()).collect();
    for what in &complaints {
        complain(&format!("coloc: {what}"));
    }
    if complaints.is_empty() {
        let folder = out.folder().display();
        console.say(&format!("pictures, summary and logs are in {folder}"));
    }
    match interrupt.signal() {
        _ if !complaints.is_empty() => Status::Failed,
        Some(signal) => Status::Interrupted(signal),
        None => judged(&summary),
    }
}

fn judged(summary: &Summary) -> Status {
    if summary.verdict == Verdict::Passed {
        return Status::Done;
    }
    if let Some(complaint) = summary.complaint() {
        complain(&format!("coloc: {complaint}"));
    }
    Status::Failed
}
