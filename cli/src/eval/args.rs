//! What `coloc eval` can be asked.

use std::fmt::Write;
use std::path::PathBuf;

use clap::error::ErrorKind;
use clap::{Args, Command, ValueEnum};
use coloc_sim::Scenario;
use coloc_sim::method::Kind;
use coloc_sim::scale::NEIGHBOURS;

/// Runs every method on the same noisy sensors, many times over, and says how far each is off, whether its uncertainty
/// is honest, what it costs, and whether differences are more than luck.
///
/// The same seed gives the same JSON, byte for byte, on any number of threads. All cores are used; --threads N or
/// RAYON_NUM_THREADS=N uses N.
#[derive(Clone, Debug, Args)]
#[allow(clippy::doc_markdown)] // Printed as they are.
#[command(after_help = reference())]
pub(crate) struct EvalArgs {
    /// A recording in MR.CLAM's format: RobotN_Odometry.dat and RobotN_Groundtruth.dat, plain or gzipped
    #[arg(long, value_name = "DIR", conflicts_with = "synthetic")]
    pub(crate) data: Option<PathBuf>,
    /// A world made up from the seed, with the noise that the filters assume [the default]
    #[arg(long)]
    pub(crate) synthetic: bool,
    /// Which estimators, with commas between
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = method,
        default_value = "sl,nb,ei,ci,split-ci,coloc,ccl")]
    pub(crate) methods: Vec<Kind>,
    /// How many runs, each with other noise [default: 20, or 10 with --sightings recorded]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) runs: Option<u16>,
    /// Where all randomness comes from
    #[arg(long, value_name = "K", default_value_t = 1)]
    pub(crate) seed: u64,
    /// Stop after this so many seconds of the world's time; without it the whole recording, or 1500, or 600 with --robots
    #[arg(long, visible_alias = "duration", value_name = "S", value_parser = seconds)]
    pub(crate) seconds: Option<f64>,
    /// What a robot costs: so many robots on a field, each with --neighbours others in range on average; several numbers with commas
    /// between
    #[arg(long, value_name = "N", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=65_536),
        conflicts_with_all = ["data", "methods", "runs", "scenario", "promises"])]
    pub(crate) robots: Vec<u32>,
    /// With --robots: so many others are in range of a robot, on average; it speaks to the nearest eight
    #[arg(long, value_name = "N", default_value_t = NEIGHBOURS, requires = "robots", value_parser = neighbours)]
    pub(crate) neighbours: f64,
    /// With --robots: this part of all messages is lost
    #[arg(long, value_name = "P", default_value_t = 0.0, requires = "robots", value_parser = crate::args::part)]
    pub(crate) loss: f64,
    /// With --robots: messages are late by up to this, each by another time
    #[arg(long, value_name = "MS", default_value_t = 0.0, requires = "robots", value_parser = delay_ms)]
    pub(crate) delay_ms: f64,
    /// What robots see of one another: made from the truth, or recorded by their own cameras (with --data)
    #[arg(long, value_name = "WHICH", value_enum, default_value_t = Sightings::Made)]
    pub(crate) sightings: Sightings,
    /// How many threads compute [default: one for each core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(crate) threads: Option<u16>,
    /// In which circumstances: a name from below, or `all`
    #[arg(long, value_name = "NAME", default_value = "paper", value_parser = scenario)]
    pub(crate) scenario: Choice,
    /// Hold the promises of docs/accuracy.md against these runs; the recording must be the first of MR.CLAM
    #[arg(long, requires = "data", conflicts_with_all = ["synthetic", "methods", "seconds", "scenario", "json", "plots"])]
    pub(crate) promises: bool,
    /// Write everything that was found, with what is plotted
    #[arg(long, value_name = "FILE")]
    pub(crate) json: Option<PathBuf>,
    /// Write the tables as Markdown; a file with `<!-- coloc eval: NAME -->` and `<!-- end -->` gets them between these
    #[arg(long, value_name = "FILE")]
    pub(crate) markdown: Option<PathBuf>,
    /// Draw the pictures as SVG into this folder
    #[arg(long, value_name = "DIR")]
    pub(crate) plots: Option<PathBuf>,
    /// Draw them as PNG too, where coloc was built with `--features png`
    #[arg(long, requires = "plots")]
    pub(crate) png: bool,
}

/// What robots see of one another.
#[derive(Copy, Clone, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Sightings {
    /// Relative poses, made from the truth
    Made,
    /// Range and bearing, by the robots' own cameras
    Recorded,
}

impl EvalArgs {
    /// How many runs, where nothing else is said.
    pub(crate) fn runs(&self) -> u16 {
        self.runs.unwrap_or(match self.sightings {
            Sightings::Made => 20,
            Sightings::Recorded => 10,
        })
    }

    /// What no single option can know.
    pub(crate) fn check(&self, command: &mut Command) -> Result<(), clap::Error> {
        if self.promises && self.runs() < 2 {
            let reason = "--promises needs at least --runs 2: one run has no confidence interval";
            return Err(command.error(ErrorKind::ValueValidation, reason));
        }
        self.check_recorded(command)
    }

    /// Recorded sightings are one evaluation with methods and settings of its own.
    fn check_recorded(&self, command: &mut Command) -> Result<(), clap::Error> {
        let refused = [
            ("--promises", self.promises),
            ("--robots", !self.robots.is_empty()),
            ("--plots", self.plots.is_some()),
        ];
        let refused = refused.iter().find(|(_, is_given)| *is_given);
        let reason = match (self.sightings, &self.data, refused) {
            (Sightings::Made, ..) | (_, Some(_), None) => return Ok(()),
            (_, None, _) => {
                "--sightings recorded needs --data, a recording in MR.CLAM's format".into()
            }
            (.., Some((option, _))) => format!("--sightings recorded has no {option}"),
        };
        Err(command.error(ErrorKind::ArgumentConflict, reason))
    }
}

/// One scenario or all of them.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Choice {
    One(Box<Scenario>),
    All,
}

fn method(name: &str) -> Result<Kind, String> {
    let names = || Kind::ALL.map(Kind::name).join(", ");
    Kind::named(name).ok_or_else(|| format!("the methods are {}", names()))
}

fn scenario(name: &str) -> Result<Choice, String> {
    if name == "all" {
        return Ok(Choice::All);
    }
    let names = || {
        Scenario::all()
            .iter()
            .map(|scenario| scenario.name)
            .collect::<Vec<_>>()
            .join(", ")
    };
    let found = Scenario::named(name).map(|scenario| Choice::One(Box::new(scenario)));
    found.ok_or_else(|| format!("the scenarios are {}, all", names()))
}

/// Longer than that is older than a message may be.
fn delay_ms(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|delay| (0.0..=900.0).contains(delay))
        .ok_or_else(|| "must be a number of milliseconds, 0 to 900".into())
}

fn neighbours(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|neighbours| (0.1..=8.0).contains(neighbours))
        .ok_or_else(|| "must be a number of robots, 0.1 to 8".into())
}

fn seconds(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|seconds| (0.1..=1e6).contains(seconds))
        .ok_or_else(|| "must be a number of seconds, 0.1 to 1000000".into())
}

/// Everything that has a name, for `--help`.
fn reference() -> String {
    let mut text = String::from("Methods:\n");
    let mut line = |name: &str, description: &str| {
        let _ = writeln!(text, "  {name:<14}{description}"); // Strings take everything.
    };
    for kind in Kind::ALL {
        line(kind.name(), kind.description());
    }
    line("", "");
    let mut scenarios = text.trim_end().to_owned() + "\n\nScenarios:\n";
    for Scenario {
        name, description, ..
    } in Scenario::all()
    {
        let _ = writeln!(scenarios, "  {name:<14}{description}");
    }
    scenarios
        + "  all           every one of these, with a summary

With --sightings recorded the robots localize one another by what their own cameras saw, through the estimator's step: with two
receivers, with one, with landmarks as beacons, and with headings unknown at the start. Beside it stands what came of the same
sightings as relative poses without a heading. --methods and --scenario are not used.

Examples:
  coloc eval                                           the synthetic world, the paper's sensors
  coloc eval --data ../shared/data/mrclam1 --plots pictures --json accuracy.json
  coloc eval --data ../shared/data/mrclam1 --scenario one-way --methods split-ci,coloc
  coloc eval --data ../shared/data/mrclam1 --promises
  coloc eval --data ../shared/data/mrclam1 --sightings recorded
  coloc eval --scenario all --runs 5 --methods split-ci,coloc
  coloc eval --synthetic --robots 1000 --duration 600  a thousand robots for ten minutes
  coloc eval --robots 10,100,1000,10000 --duration 60 --markdown docs/scale.md --plots docs/scale

Exit status: 0 done, 1 it could not be done or written or a promise was broken, 2 the arguments were not understood, \
141 the reader of standard output went away."
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_in_the_help_with_its_meaning() {
        let text = reference();
        for scenario in Scenario::all() {
            assert!(
                text.contains(scenario.name) && text.contains(scenario.description),
                "{}",
                scenario.name
            );
        }
        for kind in Kind::ALL {
            assert!(
                text.contains(&format!("  {:<14}{}", kind.name(), kind.description())),
                "{kind:?}"
            );
        }
    }

    #[test]
    fn an_unknown_name_is_answered_with_the_known_ones() {
        assert!(method("kalman").unwrap_err().contains("damped, coloc"));
        assert!(scenario("rain").unwrap_err().contains("one-way"));
        assert_eq!(scenario("all"), Ok(Choice::All));
    }
}
