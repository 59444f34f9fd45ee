//! The command line.

use std::ffi::OsString;
use std::io::{Write, stdout};
use std::path::PathBuf;

use clap::{Args, CommandFactory, Parser, Subcommand};
use coloc_daemon::config::AssistMode;

use crate::calibrate::CalibrateArgs;
use crate::demo::scene::SceneName;
use crate::eval::EvalArgs;
use crate::first_robot::FirstRobotArgs;
use crate::latency::{LatencyArgs, ReaderArgs};
use crate::leaders::LeadersArgs;
use crate::list::ListArgs;
use crate::listen::ListenArgs;
use crate::observable::ObservableArgs;
use crate::output::note;
use crate::pose::PoseArgs;
use crate::status::Status;
use crate::survey::SurveyArgs;

/// Cooperative localization: robots that tell one another where they are.
#[derive(Debug, Parser)]
#[command(
    name = "coloc",
    version,
    arg_required_else_help = true,
    after_help = "Examples:
  coloc demo                            five robots for half a minute, here and now
  coloc eval                            how accurate is it, and does it know?
  coloc latency                         how soon is a new estimate in your hands?
  coloc list                            who runs here, and where is it?
  coloc listen robot1                   where is it from moment to moment?
  coloc pose robot1 12.5 -3 1.57        tell it where it is
  coloc calibrate drive.jsonl           what does a recorded drive say of my robot?
  coloc survey drive.jsonl              where do landmarks stand that it has seen?
  coloc observable --robots 3 --fixes 1 can a team know where it is at all?
  coloc check robot.toml                what does this configuration mean?
  coloc colocd run robot.toml           run the daemon of one robot"
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Watch a team of robots localize one another, live
    Demo(DemoArgs),
    /// Show who runs on this computer, and where it is
    List(ListArgs),
    /// Print the estimates of a robot that runs on this computer: as a table, JSON, CSV or a trajectory
    Listen(ListenArgs),
    /// Tell a robot that runs on this computer where it is
    Pose(PoseArgs),
    /// Find the numbers of a robot in a drive that its daemon has recorded: scales, noises, offsets, and how surely
    Calibrate(CalibrateArgs),
    /// Learn where landmarks stand from a drive with fixes that a daemon has recorded, and how surely
    Survey(SurveyArgs),
    /// Find out how accurate and how honest the estimators are, over many runs
    Eval(Box<EvalArgs>),
    /// Say whether a team of robots can know where it is at all; if not, who has to move or needs a receiver
    Observable(ObservableArgs),
    /// Find out how soon a new estimate is in other programs' hands, and where the time goes
    Latency(LatencyArgs),
    /// Draw the pictures of docs/first-robot.md
    #[command(hide = true)]
    FirstRobot(FirstRobotArgs),
    /// Draw the pictures of docs/leaders.md
    #[command(hide = true)]
    Leaders(LeadersArgs),
    /// The process in which `coloc latency` reads the estimates
    #[command(hide = true)]
    LatencyReader(ReaderArgs),
    /// Read a robot's configuration, say what it means and what is unlikely about it, open nothing
    Check {
        /// The robot's configuration
        config: PathBuf,
        /// End with status 1 if anything is unlikely
        #[arg(long)]
        strict: bool,
    },
    /// The process in which the demo looks through a robot's scans
    #[command(name = "coloc-laser", hide = true, disable_help_flag = true)]
    Laser {
        /// As those of the program coloc-laser
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        args: Vec<OsString>,
    },
    /// Be the daemon of one robot (see `coloc colocd --help`)
    #[command(name = "colocd", disable_help_flag = true)]
    Colocd {
        /// As those of the program colocd
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        args: Vec<OsString>,
    },
}

/// Starts a real `colocd` for every robot, sends each the CAN frames of its wheel encoders, gives them relative poses and
/// satellite fixes over shared memory, and compares what they publish with the truth, and with what their wheels alone would say.
///
/// Ends by itself; Ctrl-C ends it early, with what was seen until then and no verdict. While it runs, kill a daemon and start it again
/// with the command that the table shows.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  coloc demo
  coloc demo --robots 3 --seconds 60 --seed 7 --out pictures
  coloc demo --scene lost
  coloc demo --laser
  coloc demo --camera
  coloc demo --leaders 2
  coloc demo --leaders 2 --mode full
  coloc demo --data ../shared/data/mrclam1 --seconds 120
  coloc demo --json > summary.json

In the scene meet robots whose wheels skid drive figures that turn and cross, and see
one another up to 4 m. Who is seen learns from who sees it. Two have a satellite receiver.
The last one, of four or more, has none, is seen like the others, and is told nothing:
beside it one sees what help is worth.

In the scene lost nobody sees anybody. Robot 1 does not know where it starts. Robot 2 is
carried 10 m away and turned after 10 s, and its wheels do not feel it: it waits 12 s before
it follows its receiver. Of robot 3's two receivers one jumps by 10 m. Robot 4 has one, which
jumps, and is told to doubt it (trust_jump). What is promised is judged as far as it is due
by the end: within 15 s robot 1 is found; within 2.5 s robot 2 notices, within 20 s it is ok
again; robot 3 stays ok and names the liar; robot 4 says contradicted, and its ellipse holds
both places; and the truth is inside all ellipses, but for 2 s after it happens.

In the scene laser nobody is told where others are. Each robot has a laser scanner and runs
coloc-laser, which finds the others in its scans: three rectangles, whose heading is seen,
and two cylinders, of which range and bearing are. In the scene camera robots have a camera
each that looks ahead and sees range and bearing alone. Two robots have a satellite receiver.

With --leaders N the first N robots have a receiver and a compass and lead ([assist]); the others
have wheels alone, and are told where they are by a leader that sees them, or by way of others. The
last one is never seen by a leader: it is too far off, or, where robots are recorded, leaders look
at the others alone. The first leader is killed (SIGKILL) after a third of the time and started
again at half. In the end all of it is worked out anew from what the daemons recorded: beliefs, and
what robots told one another, have to be the same bits.

What is expected of every robot, whatever the seed:
                    error, mean over time     inside its own 3σ
  with a receiver   0.10 m, 0.10 m, 0.15 rad  75 % of the time
  told by others    0.80 m, 0.80 m, 0.30 rad  75 %
  told nothing      none: it drifts           45 %
  by laser, camera  none                      99 %
  leaders, children none                      99 %
and of recorded robots:
  5 or more         0.10 m, 0.10 m, 0.10 rad  99 %
  2 to 4            0.20 m, 0.20 m, 0.25 rad  95 %: for a while a robot may see nobody
  1                 0.10 m, 0.10 m, 0.30 rad  90 %: fixes hardly say where it looks

Exit status: 0 every bar was met, 1 one was missed, or the demo could not run or not write something, 2 the arguments were \
not understood, 130 it was interrupted (128 + the signal's number), 141 the reader of standard output went away.")]
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is an option of its own"
)]
pub(crate) struct DemoArgs {
    /// How many robots [default: 5, or all that were recorded]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=32))]
    pub(crate) robots: Option<u16>,
    /// How long, in seconds [default: 30, of the scene lost 40]
    #[arg(long, value_name = "S", value_parser = seconds)]
    pub(crate) seconds: Option<f64>,
    /// Where all randomness comes from
    #[arg(long, value_name = "K", default_value_t = 1)]
    pub(crate) seed: u64,
    /// What is played
    #[arg(long, value_enum, default_value_t = SceneName::Meet)]
    pub(crate) scene: SceneName,
    /// Robots of a recording in MR.CLAM's format, rather than a scene
    #[arg(long, value_name = "DIR", conflicts_with = "scene")]
    pub(crate) data: Option<PathBuf>,
    /// As --scene laser
    #[arg(long, conflicts_with_all = ["scene", "data", "camera"])]
    pub(crate) laser: bool,
    /// As --scene camera
    #[arg(long, conflicts_with_all = ["scene", "data"])]
    pub(crate) camera: bool,
    /// So many of the robots lead, and carry the others, of whom one is seen by no leader
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=2), conflicts_with_all = ["scene", "laser", "camera"])]
    pub(crate) leaders: Option<u16>,
    /// With --leaders: how what leaders say gets around, full, bounded-instant or bounded-delayed
    #[arg(long, value_name = "MODE", default_value = "bounded-instant", requires = "leaders", value_parser = mode)]
    pub(crate) mode: AssistMode,
    /// Each robot in a shared memory of its own, as on a computer of its own, and coloc-link between them
    #[arg(long, conflicts_with = "laser")]
    pub(crate) fleet: bool,
    /// With --fleet: each robot in a network namespace of its own, with a TUN device (for root, or below `unshare -Ur`)
    #[arg(long, requires = "fleet")]
    pub(crate) namespaces: bool,
    /// With --fleet: this part of all packets is lost, each way
    #[arg(long, value_name = "P", default_value_t = 0.0, requires = "fleet", value_parser = part)]
    pub(crate) loss: f64,
    /// With --fleet: packets are late by up to this, each by another time
    #[arg(long, value_name = "MS", default_value_t = 0.0, requires = "fleet", value_parser = delay_ms)]
    pub(crate) delay_ms: f64,
    /// With --fleet: from one second to the other nobody reaches anybody
    #[arg(long, value_name = "FROM,UNTIL", requires = "fleet", value_parser = partition)]
    pub(crate) partition: Option<[f64; 2]>,
    /// With --fleet: the clock of one robot is off by so many seconds, and gains so many ppm, from so many seconds after its link has started
    #[arg(long, value_name = "ROBOT,OFFSET,DRIFT,AFTER", requires = "fleet", value_parser = wrong_clock)]
    pub(crate) wrong_clock: Option<WrongClock>,
    /// With --fleet: links correct stamps of clocks that are off, rather than refuse them
    #[arg(long, requires = "fleet")]
    pub(crate) correct_offset: bool,
    /// Where to write pictures, summary and logs [default: demo-out, or the first demo-out-N that is free]
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Print the summary as JSON on standard output, everything else on standard error
    #[arg(long)]
    pub(crate) json: bool,
}

/// As `assist.mode` has it.
fn mode(text: &str) -> Result<AssistMode, String> {
    serde_json::from_value(text.into()).map_err(|error| error.to_string())
}

impl DemoArgs {
    /// How long the robots drive \[s\].
    pub(crate) fn length_s(&self) -> f64 {
        self.seconds.unwrap_or_else(|| self.played().length_s())
    }

    /// The scene that was asked for, by either name.
    pub(crate) fn played(&self) -> SceneName {
        match (self.laser, self.camera) {
            (true, _) => SceneName::Laser,
            (_, true) => SceneName::Camera,
            _ => self.scene,
        }
    }
}

/// Whose clock is wrong, and how its link is told.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct WrongClock {
    /// From 1.
    pub(crate) robot: u16,
    /// `OFFSET,DRIFT,AFTER` in s, ppm and s.
    pub(crate) how: String,
}

fn wrong_clock(text: &str) -> Result<WrongClock, String> {
    let (robot, how) = text.split_once(',').unwrap_or_default();
    let numbers = how.split(',').map(str::parse::<f64>);
    let count = numbers.flatten().filter(|it| it.is_finite()).count();
    let robot = robot.parse().ok().filter(|_| count == 3);
    let how = how.into();
    robot
        .map(|robot| WrongClock { robot, how })
        .ok_or_else(|| "must be a robot, seconds, ppm and seconds, as in 2,1,200,10".into())
}

pub(crate) fn part(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|part| (0.0..1.0).contains(part))
        .ok_or_else(|| "must be a part, 0 to less than 1".into())
}

fn delay_ms(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|delay| (0.0..=60_000.0).contains(delay))
        .ok_or_else(|| "must be a number of milliseconds, 0 to 60000".into())
}

fn partition(text: &str) -> Result<[f64; 2], String> {
    let ends = text.split_once(',');
    let ends = ends.and_then(|(from, until)| Some([from.parse().ok()?, until.parse().ok()?]));
    ends.filter(|[from, until]: &[f64; 2]| 0.0 <= *from && from < until)
        .ok_or_else(|| "must be two numbers of seconds, the earlier one first, as in 10,20".into())
}

pub(crate) fn seconds(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|seconds| (1.0..=86_400.0).contains(seconds))
        .ok_or_else(|| "must be a number of seconds, 1 to 86400".into())
}

/// The command, or how it ends once help, version or the mistake has been printed.
pub(crate) fn parse(args: impl Iterator<Item = OsString>) -> Result<Command, Status> {
    Cli::try_parse_from(args)
        .and_then(checked)
        .map_err(|error| answer(&error))
}

/// What no single option can know.
fn checked(cli: Cli) -> Result<Command, clap::Error> {
    if let Command::Eval(args) = &cli.command {
        args.check(&mut Cli::command())?;
    }
    Ok(cli.command)
}

fn answer(error: &clap::Error) -> Status {
    let printed = error.print().and_then(|()| stdout().flush());
    if error.use_stderr() {
        // Nobody is left to tell if standard error is closed.
        return Status::NotUnderstood;
    }
    note(printed);
    Status::Done
}

#[cfg(test)]
mod tests {
    use super::*;

    fn demo(args: &[&str]) -> Result<DemoArgs, clap::Error> {
        let all = ["coloc", "demo"].iter().chain(args);
        Cli::try_parse_from(all).map(|cli| match cli.command {
            Command::Demo(args) => args,
            other => panic!("not a demo: {other:?}"),
        })
    }

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn an_evaluation_knows_its_methods_and_scenarios() {
        let parse =
            |args: &[&str]| Cli::try_parse_from(["coloc", "eval"].iter().chain(args)).map(|_| ());
        assert!(
            parse(&[]).is_ok()
                && parse(&["--scenario", "one-way", "--methods", "coloc,ccl"]).is_ok()
        );
        assert!(
            parse(&["--scenario", "none"]).is_err()
                && parse(&["--methods", "coloc,guess"]).is_err()
        );
    }

    #[test]
    fn a_demo_needs_no_arguments_and_ends_within_a_minute() {
        let args = demo(&[]).unwrap();
        assert!(args.length_s() < 60.0 && args.robots.is_none() && args.data.is_none());
    }

    #[test]
    fn what_makes_no_sense_is_refused() {
        for wrong in [
            ["--robots", "0"],
            ["--robots", "33"],
            ["--seconds", "0"],
            ["--seconds", "NaN"],
            ["--seed", "-1"],
            ["--scene", "nothing"],
        ] {
            assert!(demo(&wrong).is_err(), "{wrong:?}");
        }
        assert!(demo(&["--data", "recording"]).is_ok());
        assert!(demo(&["--data", "recording", "--scene", "meet"]).is_err());
        assert!(demo(&["--laser", "--camera"]).is_err());
        assert!(demo(&["--camera", "--scene", "meet"]).is_err());
    }

    #[test]
    fn a_scene_has_a_short_name() {
        let played = |args: &[&str]| demo(args).unwrap().played();
        assert_eq!(played(&["--laser"]), SceneName::Laser);
        assert_eq!(played(&["--camera"]), SceneName::Camera);
        assert_eq!(played(&["--scene", "laser"]), SceneName::Laser);
        assert_eq!(played(&[]), SceneName::Meet);
    }
}
