//! The program `coloc-rounds`.

use std::ffi::OsString;
use std::os::fd::BorrowedFd;
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

use coloc_daemon::config::Config;
use coloc_estimator::Span;
use coloc_estimator::gate::{CHI2_1_99, CHI2_2_99};
use coloc_rounds::{Rules, Standing};
use coloc_sensors::listen::{Listener, listen};
use coloc_sensors::program::{self, Program, Start};
use coloc_sensors::{EndError, Moment, Report};

use crate::channels::{Channels, FIGURES, team};
use crate::refusal::Refusal;
use coloc_rounds::seat::{Deed, Seat};

/// From one look at the channels to the next.
const LOOK: Duration = Duration::from_millis(5);

/// Of the deadline the robots that are there are waited for in so much; then everybody shares.
const HELLO: f64 = 0.4;

/// A robot whose last round nobody knows any more joins anew after so many slots.
const PATIENCE: u32 = 4;

/// The whole program, from its arguments to its exit status.
pub fn main_from_args(args: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> ExitCode {
    program::main_from_args::<RoundsProgram>(args)
}

/// One joint filter of the team, in rounds. While it runs the robot takes part.
struct RoundsProgram;

impl Program for RoundsProgram {
    const NAME: &'static str = "coloc-rounds";
    const DRIVER: &'static str = "rounds";
    const ABOUT: &'static str =
        "One joint filter of the team, in rounds. While it runs the robot takes part";
    const RUN: &'static str = "Make rounds with the others, until SIGINT or SIGTERM";
    const SECTION: &'static str = "fusion";
    const HEARD: &'static str = "what the others say";
    const FIGURES: &'static [&'static str] = &FIGURES;
    type Settings = ();

    fn refusals() -> Vec<&'static str> {
        Refusal::ALL.map(Refusal::name).into()
    }

    fn load(path: &Path) -> Result<(Config, ()), EndError> {
        Ok((Config::load(path)?, ()))
    }

    fn understood(config: &Config, (): &()) -> String {
        understood(config)
    }

    fn unlikely(config: &Config, (): &()) -> Vec<String> {
        unlikely(config)
    }

    fn run(mut start: Start<'_, ()>) -> Result<(), EndError> {
        let config = start.config;
        let Some(seat) = seat(config) else {
            return Ok(()); // A robot is always of its own team.
        };
        let mut life = Life {
            seat,
            channels: Channels::open(start.space, config)?,
            was_with: None,
            remarks: unlikely(config),
        };
        let ended = listen(&mut life, LOOK, start.stop, &mut start.voice);
        life.channels.correct(&Deed::Leave, Moment::now());
        ended
    }
}

/// The seat of the robot of a configuration.
#[must_use]
pub fn seat(config: &Config) -> Option<Seat> {
    let team = team(config);
    let rounds = &config.rounds;
    let nanos = |seconds| Span::from_seconds(seconds).as_nanos();
    let rules = Rules {
        robots: team.numbers().len(),
        hello_ns: nanos(rounds.deadline_s * HELLO),
        deadline_ns: nanos(rounds.deadline_s),
        patience: PATIENCE,
        gates: [CHI2_1_99, CHI2_2_99, config.fusion.neighbour_gate],
    };
    let me = team.place(config.robot.id)?;
    Some(Seat::new(me, rules, nanos(rounds.skew_s)))
}

struct Life {
    seat: Seat,
    channels: Channels,
    /// Whether the robot's last round was one of the team, as it was last said.
    was_with: Option<bool>,
    remarks: Vec<String>,
}

impl Listener for Life {
    /// Slots of the clock are looked for, whoever speaks.
    fn bell(&self) -> Result<Option<BorrowedFd<'_>>, EndError> {
        Ok(None)
    }

    fn turn(&mut self) -> Result<u64, EndError> {
        let now = Moment::now();
        let (words, bytes) = self.channels.hear(&mut self.seat, now);
        self.channels.say(&words, now);
        self.remark();
        Ok(bytes)
    }

    fn report(&self) -> Report {
        self.channels.report(&self.seat)
    }

    fn remarks(&mut self) -> Vec<String> {
        std::mem::take(&mut self.remarks)
    }
}

impl Life {
    /// A change is said once.
    fn remark(&mut self) {
        let is_with = match self.seat.standing() {
            Some(Standing::Since(_)) => true,
            Some(Standing::Joining(_)) => false,
            None => return,
        };
        if self.was_with.replace(is_with) != Some(is_with) {
            let said = if is_with {
                "the robot is with its team"
            } else {
                "the robot joins its team"
            };
            self.remarks.push(said.to_owned());
        }
    }
}

/// A configuration in words, a line a subject.
fn understood(config: &Config) -> String {
    let rounds = &config.rounds;
    let mut lines = vec![
        format!("robot        {}", config.robot.name),
        format!(
            "rounds       {} a second, made {} s after their slot",
            rounds.rate_hz, rounds.deadline_s
        ),
        format!("sightings    within {} s of a slot", rounds.skew_s),
    ];
    let peers = config.peers();
    lines.extend(peers.map(|peer| format!("robot {:<6} {}", peer.id, peer.name)));
    lines.join("\n") + "\n"
}

/// What is allowed in the file and was hardly meant.
#[must_use]
pub fn unlikely(config: &Config) -> Vec<String> {
    let mut warnings = Vec::new();
    if !config.makes_rounds() {
        warnings.push("fusion.mode is not \"rounds\": colocd takes no part".to_owned());
    }
    if config.peers().count() == 0 {
        warnings.push("[[team]] has nobody else: there is nobody to make rounds with".to_owned());
    }
    warnings
}
