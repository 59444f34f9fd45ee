//! The course of the demo: set up, wait until everybody speaks, drive, end everybody, say what it came to.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

use super::bars::bars;
use super::bus::Buses;
use super::console::Console;
use super::show::{Ended, Show};
use super::summary::{RobotSummary, Summary};
use super::world::Stage;
use super::{DemoError, out};
use crate::args::DemoArgs;
use crate::output::print_line;

/// Runs the demo to its end.
pub(crate) fn run(args: &DemoArgs, console: &mut Console) -> Result<(), DemoError> {
    let interrupted = interruptible()?;
    let stage = Arc::new(Stage::new(args)?);
    let folder = out::folder(args.out.as_deref())?;
    let home = tempfile::Builder::new().prefix("coloc-demo-").tempdir();
    let home = home.map_err(|error| DemoError::files(Path::new("a temporary folder"), &error))?;
    let buses = Buses::choose(stage.robots(), &home.path().join("buses"));
    console.say(&format!(
        "{} robots, {}; CAN: {} ({})",
        stage.robots(),
        stage.description(),
        buses.kind,
        buses.reason
    ));
    let mut show = Show::set_up(&stage, args.seconds, home.path(), &buses, &folder)?;
    show.wait_for_everybody(console, &interrupted)?;
    show.drive(console, &interrupted)?;
    let ended = show.end(console)?;
    let summary = summarise(&stage, buses, &folder, ended)?;
    report(args, console, &folder, &summary)
}

fn summarise(
    stage: &Stage,
    buses: Buses,
    folder: &Path,
    ended: Ended,
) -> Result<Summary, DemoError> {
    let heard = ended.records.iter().zip(ended.up).enumerate();
    let robots: Vec<_> = heard
        .map(|(robot, (record, up))| RobotSummary::of(robot, record, up))
        .collect();
    let bars = bars(&robots);
    Ok(Summary {
        passed: ended.left.is_empty() && bars.iter().all(|bar| bar.broken_by.is_empty()),
        seconds: ended.seconds,
        world: stage.description().to_owned(),
        bus: buses.kind,
        bus_reason: buses.reason,
        robots,
        bars,
        left_in_shared_memory: ended.left,
        pictures: out::draw(folder, stage.description(), &ended.records)?,
    })
}

fn report(
    args: &DemoArgs,
    console: &mut Console,
    folder: &Path,
    summary: &Summary,
) -> Result<(), DemoError> {
    let json = out::write_summary(folder, summary)?;
    console.say(&summary.lines().join("\n"));
    console.say(&format!(
        "pictures, summary and logs are in {}",
        folder.display()
    ));
    if args.json {
        print_line(&json);
    }
    summary
        .complaint()
        .map_or(Ok(()), |complaint| Err(DemoError::Missed(complaint)))
}

/// Set by Ctrl-C and the like.
fn interruptible() -> Result<Arc<AtomicBool>, DemoError> {
    let flag = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM, SIGHUP] {
        signal_hook::flag::register(signal, Arc::clone(&flag))
            .map_err(|error| DemoError::Spawn(error.to_string()))?;
    }
    Ok(flag)
}
