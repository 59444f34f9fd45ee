//! A program that listens to robots: says `ready` at its first estimate, and what it hears if it is asked to.

use std::error::Error;
use std::thread::sleep;
use std::time::Duration;

use clap::Args;
use coloc_shm_types::{Estimate, Input, Message, RobotName, Space, Status, Subscriber};
use rustix::time::{ClockId, clock_gettime};

use super::Place;
use coloc_tests::output::print_line;

#[derive(Args)]
pub(crate) struct ReaderArgs {
    /// One line for each message.
    #[arg(long)]
    report: bool,
    #[command(flatten)]
    place: Place,
}

const PAUSE: Duration = Duration::from_millis(1);

pub(crate) fn read(args: &ReaderArgs) -> Result<(), Box<dyn Error>> {
    let Place {
        root,
        prefix,
        robots,
    } = &args.place;
    let space = Space::open(root, prefix, "reader")?;
    let ears = robots
        .iter()
        .map(|robot| Ear::open(&space, robot))
        .collect::<Result<Vec<_>, _>>()?;
    if args.report {
        print_line("ready");
    }
    let mut is_ready = args.report;
    loop {
        for (robot, ear) in ears.iter().enumerate() {
            let heard = ear.listen(|line| {
                if args.report {
                    print_line(&format!("{robot} {line}"));
                }
            });
            if heard && !is_ready {
                print_line("ready");
                is_ready = true;
            }
        }
        sleep(PAUSE);
    }
}

/// Both channels of a robot.
struct Ear {
    estimates: Subscriber<Estimate>,
    statuses: Subscriber<Status>,
}

impl Ear {
    fn open(space: &Space, robot: &str) -> Result<Self, Box<dyn Error>> {
        let robot = RobotName::new(robot)?;
        Ok(Self {
            estimates: space.subscriber(&robot)?,
            statuses: space.subscriber(&robot)?,
        })
    }

    /// Takes in what has come; whether an estimate was among it.
    fn listen(&self, tell: impl Fn(String)) -> bool {
        let heard = drain(&self.estimates, &tell, |estimate| {
            let Estimate { header, tick, .. } = estimate;
            format!(
                "estimate {} {tick} {} {}",
                header.session.cast_signed(),
                header.stamp_ns,
                monotonic_ns()
            )
        });
        drain(&self.statuses, &tell, |status| {
            format!(
                "status {} {}",
                status.header.session.cast_signed(),
                status.accepted_of(Input::Position)
            )
        });
        heard
    }
}

fn drain<M: Message>(
    port: &Subscriber<M>,
    tell: &impl Fn(String),
    describe: impl Fn(&M) -> String,
) -> bool {
    let mut any = false;
    loop {
        match port.receive() {
            Ok(Some(message)) => {
                any = true;
                tell(describe(&message));
            }
            Ok(None) => return any,
            Err(problem) => {
                tell(format!("refused {problem}"));
                return any;
            }
        }
    }
}

/// Of the whole machine \[ns\].
pub(crate) fn monotonic_ns() -> i64 {
    let now = clock_gettime(ClockId::Monotonic);
    now.tv_sec * 1_000_000_000 + now.tv_nsec
}
