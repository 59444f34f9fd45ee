//! The command line of `coloc latency`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use coloc_daemon::config::{Trigger, WaitMode};
use serde::Serialize;

use crate::args::seconds;

/// Starts a real `colocd`, sends it encoder frames, fixes, sightings and neighbours' poses whether it keeps up or not, and
/// reads its estimates in another process that sleeps until they come. The wheels' frames come one after the other, as a bus
/// carries them. Daemon and reader sleep in between, in real time where that is granted, as robots run it; with `--wait poll`
/// both poll at ordinary priority: what the program takes without the scheduler.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  coloc latency
  coloc latency --plain
  coloc latency --rate 1000 --seconds 20 --wait poll
  coloc latency --load 4 --json busy.json --plot busy.svg

Exit status: 0 done, 1 it could not be measured or written, 2 the arguments were not understood, \
130 it was interrupted (128 + the signal's number), 141 the reader of standard output went away.")]
pub(crate) struct LatencyArgs {
    /// How long each way of waiting is measured, in seconds; the floors take as long again
    #[arg(long, value_name = "S", default_value_t = 60.0, value_parser = seconds)]
    pub(crate) seconds: f64,
    /// Pairs of encoder frames, and ticks, per second
    #[arg(long, value_name = "HZ", default_value_t = 50.0, value_parser = rate)]
    pub(crate) rate: f64,
    /// How many neighbours speak, ten times a second
    #[arg(long, value_name = "K", default_value_t = 4, value_parser = clap::value_parser!(u16).range(0..=64))]
    pub(crate) neighbours: u16,
    /// What starts a tick
    #[arg(long, value_enum, default_value_t = TriggerArg::Auto)]
    pub(crate) trigger: TriggerArg,
    /// Which kind of CAN bus
    #[arg(long, value_enum, default_value_t = CanArg::Auto)]
    pub(crate) can: CanArg,
    /// From one wheel's frame to the other's, in microseconds, as a bus carries them; 0: back to back
    #[arg(long, value_name = "US", default_value_t = 250, value_parser = clap::value_parser!(u16).range(0..=10_000))]
    pub(crate) gap_us: u16,
    /// Each wheel on a bus of its own
    #[arg(long)]
    pub(crate) two_buses: bool,
    /// How far the clock of the encoders is off, in millionths
    #[arg(long, value_name = "PPM", default_value_t = 0, allow_negative_numbers = true, value_parser = clap::value_parser!(i32).range(-100_000..=100_000))]
    pub(crate) clock_ppm: i32,
    /// How is waited; several one after the other, as in `poll,sleep`
    #[arg(long, value_enum, value_delimiter = ',', default_value = "sleep")]
    pub(crate) wait: Vec<WaitArg>,
    /// How the reader waits for an estimate [default: as the daemon waits for frames]
    #[arg(long, value_enum)]
    pub(crate) reader: Option<WaitArg>,
    /// Busy threads beside it
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u16).range(0..=256))]
    pub(crate) load: u16,
    /// Beside it the least that a program in C can do: both frames, a Kalman filter of three states, a datagram; needs `cc`, and is
    /// measured where everybody sleeps
    #[arg(long)]
    pub(crate) plain: bool,
    /// The daemon of this program, `coloc` or `colocd`, in place of one's own: to compare two builds
    #[arg(long, value_name = "FILE")]
    pub(crate) colocd: Option<PathBuf>,
    /// Write all figures as JSON
    #[arg(long, value_name = "FILE")]
    pub(crate) json: Option<PathBuf>,
    /// Draw latency over percentiles as SVG
    #[arg(long, value_name = "FILE.svg")]
    pub(crate) plot: Option<PathBuf>,
}

/// What starts a tick, as in `robot.toml`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum TriggerArg {
    /// Frames where they come at the tick's rate, else deadlines right after them
    Auto,
    /// Absolute deadlines; frames wait for the next one
    Timer,
    /// The frames themselves
    Encoder,
}

impl TriggerArg {
    pub(crate) fn setting(self) -> Trigger {
        match self {
            Self::Auto => Trigger::Auto,
            Self::Timer => Trigger::Timer,
            Self::Encoder => Trigger::Encoder,
        }
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Timer => "timer",
            Self::Encoder => "encoder",
        }
    }
}

/// How a tick is waited for, as in `robot.toml`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum WaitArg {
    /// Busy, at ordinary priority
    Poll,
    /// Asleep, in real time where that is granted
    Sleep,
}

impl WaitArg {
    pub(crate) fn setting(self) -> WaitMode {
        match self {
            Self::Poll => WaitMode::Poll,
            Self::Sleep => WaitMode::Sleep,
        }
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Poll => "poll",
            Self::Sleep => "sleep",
        }
    }

    pub(crate) fn describe(self) -> &'static str {
        match self {
            Self::Poll => "polling",
            Self::Sleep => "sleeping",
        }
    }
}

/// Kinds of CAN buses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum CanArg {
    /// The kernel's where it can have them
    Auto,
    /// The kernel's virtual interfaces
    Vcan,
    /// Sockets in a directory
    Local,
}

/// What the reading process must know.
#[derive(Clone, Debug, Args)]
pub(crate) struct ReaderArgs {
    /// Root of the shared memory, or where the socket is to be
    #[arg(long)]
    pub(crate) root: PathBuf,
    /// Datagrams that begin with their stamp, on a socket of that name, in place of estimates
    #[arg(long)]
    pub(crate) datagrams: bool,
    /// Whose estimates
    #[arg(long)]
    pub(crate) robot: String,
    /// When to end, in nanoseconds of the monotonic clock
    #[arg(long)]
    pub(crate) until_ns: i64,
    /// About how many estimates there will be
    #[arg(long, default_value_t = 0)]
    pub(crate) expect: usize,
    /// How to wait for them
    #[arg(long, value_enum)]
    pub(crate) wait: WaitArg,
    /// Processors to run on
    #[arg(long, value_delimiter = ',')]
    pub(crate) cpus: Vec<usize>,
}

fn rate(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|rate| (1.0..=1000.0).contains(rate))
        .ok_or_else(|| "must be a number of frames per second, 1 to 1000".into())
}
