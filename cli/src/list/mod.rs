//! `coloc list`: who runs here, and where it is.

mod hear;
mod row;

use clap::Args;

use self::hear::{Word, hear};
use crate::demo::interrupt::Interrupt;
use crate::listen::{doubted, why_unfit};
use crate::output::{complain, print_line};
use crate::place::{Found, Looked, Place, PlaceArgs, look};
use crate::status::Status;

/// The robots whose daemon runs on this computer, as this user, a line each; and those of others that a group of this user's may
/// read (`[shm] group` of their robot.toml; docs/channels.md).
///
/// Takes a listener's place of each robot for as long as it takes to hear one estimate, at most a second.
#[derive(Clone, Debug, Args)]
#[command(after_help = "\
belief    finding, ok, contradicted or lost; unfit: ok, and yet not good enough to drive on, for the reason below the table;
          starting: not heard so far; silent: it runs, and said nothing for a second
odometry  never_seen, ok, stale, faulty or refused
x, y, φ   where it is, in the common frame

Exit status: 0 done, whether anybody runs or not; 1 it could not look everywhere or not hear every robot, \
2 the arguments were not understood, 130 it was interrupted (128 + the signal's number), \
141 the reader of standard output went away.")]
pub(crate) struct ListArgs {
    #[command(flatten)]
    place: PlaceArgs,
}

/// The whole command.
pub(crate) fn command(args: &ListArgs) -> Status {
    let interrupt = match Interrupt::catch() {
        Ok(interrupt) => interrupt,
        Err(error) => return failed(&format!("cannot handle signals: {error}")),
    };
    let looked = look(&args.place);
    let status = list(args, &looked, &interrupt);
    interrupt.signal().map_or(status, Status::Interrupted)
}

fn failed(why: &str) -> Status {
    complain(&format!("coloc: {why}"));
    Status::Failed
}

fn list(args: &ListArgs, looked: &Looked, interrupt: &Interrupt) -> Status {
    let mut status = Status::Done;
    let inhabited = |found: &&Found| !found.robots.is_empty();
    let here = looked.here.as_ref().ok().filter(inhabited);
    match &looked.here {
        Err(error) => status = failed(&error.to_string()),
        Ok(found) if here.is_none() && looked.elsewhere.is_empty() => {
            say_nobody(&found.place, args.place.root.is_some());
        }
        Ok(_) => {}
    }
    for found in here.into_iter().chain(&looked.elsewhere) {
        if here.is_none() || !looked.elsewhere.is_empty() {
            print_line(&format!("in {}:", found.place));
        }
        status = worse(status, show(found, interrupt));
    }
    status
}

fn say_nobody(place: &Place, is_named: bool) {
    let (robot, elsewhere) = if is_named {
        ("no robot runs", "without --root every place is looked at")
    } else {
        (
            "no robot of this user runs",
            "nor is there one in any other place",
        )
    };
    complain(&format!(
        "coloc: {robot} in {place}, {elsewhere}. Start one: colocd run robot.toml, or coloc demo"
    ));
}

fn worse(one: Status, other: Status) -> Status {
    if one == Status::Done { other } else { one }
}

fn show(found: &Found, interrupt: &Interrupt) -> Status {
    let words = hear(found, interrupt);
    let width = row::name_width(&found.robots);
    print_line(&row::heading(width));
    for (robot, word) in found.robots.iter().zip(&words) {
        print_line(&row::row(robot, word, width));
    }
    let mut status = Status::Done;
    for (robot, word) in found.robots.iter().zip(&words) {
        match word {
            Word::Refused(why) => status = failed(why),
            Word::Estimate(estimate) => {
                if let Some(why) = why_unfit(estimate) {
                    print_line(&format!("{} {why}", robot.robot));
                }
                if let Some(doubt) = doubted(estimate) {
                    print_line(&format!("{} {doubt}", robot.robot));
                }
            }
            Word::Starting | Word::Silent => {}
        }
    }
    status
}
