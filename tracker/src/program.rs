//! The program `coloc-track`.

use std::ffi::OsString;
use std::os::fd::BorrowedFd;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use coloc_daemon::config::Config;
use coloc_sensors::listen::{Listener, listen};
use coloc_sensors::program::{self, Program, Start};
use coloc_sensors::{EndError, Moment, Report, run};

use crate::publish::Channels;
use crate::refusal::Refusal;
use crate::section::Track;
use crate::tracker::{FIGURES, Tracker};

/// The whole program, from its arguments to its exit status.
pub fn main_from_args(args: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> ExitCode {
    program::main_from_args::<TrackProgram>(args)
}

struct TrackProgram;

impl Program for TrackProgram {
    const NAME: &'static str = "coloc-track";
    const DRIVER: &'static str = "track";
    const ABOUT: &'static str = "Where the neighbours are, of what is seen of them in part";
    const RUN: &'static str = "Track the neighbours, until SIGINT or SIGTERM";
    const SECTION: &'static str = "track";
    const HEARD: &'static str = "what is heard";
    const FIGURES: &'static [&'static str] = &FIGURES;
    type Settings = Track;

    fn refusals() -> Vec<&'static str> {
        Refusal::ALL.map(Refusal::name).into()
    }

    fn load(path: &Path) -> Result<(Config, Track), EndError> {
        Ok(Config::load_with(path)?)
    }

    fn understood(config: &Config, section: &Track) -> String {
        understood(config, section)
    }

    fn unlikely(config: &Config, _: &Track) -> Vec<String> {
        unlikely(config)
    }

    fn run(mut start: Start<'_, Track>) -> Result<(), EndError> {
        let mut life = Life {
            tracker: Tracker::new(start.config, &start.settings),
            channels: Channels::open(start.space, start.config)?,
            period_s: start.settings.period_s,
            told: Instant::now(),
        };
        listen(&mut life, run::IDLE, start.stop, &mut start.voice)
    }
}

struct Life {
    tracker: Tracker,
    channels: Channels,
    period_s: f64,
    /// When tracks were last published.
    told: Instant,
}

impl Listener for Life {
    /// `colocd` rings at every tick; without it there is still a look from time to time.
    fn bell(&self) -> Result<Option<BorrowedFd<'_>>, EndError> {
        self.channels.bell().map(Some)
    }

    fn turn(&mut self) -> Result<u64, EndError> {
        let now = Moment::now();
        let bytes = self.channels.hear(&mut self.tracker, now);
        if let Some(moved) = self.tracker.moved() {
            self.channels.tell_moved(&moved, &mut self.tracker, now);
        }
        self.tracker.step(now);
        self.channels.feed(&mut self.tracker);
        if self.told.elapsed().as_secs_f64() >= self.period_s {
            self.told = Instant::now();
            self.channels.tell_tracks(&mut self.tracker);
        }
        Ok(bytes)
    }

    fn report(&self) -> Report {
        self.tracker.report()
    }

    fn remarks(&mut self) -> Vec<String> {
        self.tracker.remarks()
    }
}

/// A configuration in words, a line a subject.
fn understood(config: &Config, section: &Track) -> String {
    let [x, y, turned] = config.sighting.mount;
    let mut lines = vec![
        format!("robot        {}", config.robot.name),
        format!("mount        {x} m forward, {y} m left, turned {turned} rad to the left"),
        format!(
            "tracks       {} s behind the present, published every {} s",
            section.delay_s, section.period_s
        ),
        format!(
            "believed     after {} sightings; coasted after {} s, given up after {} s unseen or beyond σ = {} m",
            section.confirm_hits, section.coast_s, section.delete_s, section.most_sigma_m
        ),
    ];
    let feeds = if config.sighting.through_track {
        "colocd hears of other robots by way of it: sighting.through_track"
    } else {
        "nothing for colocd, which hears the same sightings"
    };
    lines.push(format!("feeds        {feeds}"));
    let peers = config.peers();
    lines.extend(peers.map(|peer| format!("robot {:<6} {}", peer.id, peer.name)));
    lines.join("\n") + "\n"
}

/// What is allowed in the file and was hardly meant.
#[must_use]
pub fn unlikely(config: &Config) -> Vec<String> {
    let is_alone = config.peers().next().is_none();
    let alone =
        is_alone.then(|| "[[team]] names no other robot: there is nobody to be tracked".to_owned());
    alone.into_iter().collect()
}
