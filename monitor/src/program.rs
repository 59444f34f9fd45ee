//! The program `coloc-bounds`.

use std::ffi::OsString;
use std::os::fd::BorrowedFd;
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

use coloc_daemon::config::Config;
use coloc_sensors::listen::{Listener, listen};
use coloc_sensors::program::{self, Program, Start};
use coloc_sensors::{EndError, Moment, Report};
use coloc_shm_types::Integrity as Word;

use crate::publish::{Channels, FIGURES};
use crate::refusal::Refusal;
use crate::section::{Bounds, Integrity};
use crate::watch::{Said, Watch};

/// From one look at the channels and the buses to the next.
const LOOK: Duration = Duration::from_millis(20);

/// The whole program, from its arguments to its exit status.
pub fn main_from_args(args: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> ExitCode {
    program::main_from_args::<BoundsProgram>(args)
}

struct BoundsProgram;

impl Program for BoundsProgram {
    const NAME: &'static str = "coloc-bounds";
    const DRIVER: &'static str = "bounds";
    const ABOUT: &'static str = "Where the robot must be if all errors are within their bounds, and whether its estimate can be right";
    const RUN: &'static str = "Watch over the robot, until SIGINT or SIGTERM";
    const SECTION: &'static str = "bounds";
    const HEARD: &'static str = "what is heard";
    const FIGURES: &'static [&'static str] = &FIGURES;
    type Settings = (Bounds, Integrity);

    fn refusals() -> Vec<&'static str> {
        Refusal::ALL.map(Refusal::name).into()
    }

    /// Both sections; `[integrity]` need not be there.
    fn load(path: &Path) -> Result<(Config, Self::Settings), EndError> {
        let (config, bounds) = Config::load_with::<Bounds>(path)?;
        let integrity = if config.integrity.is_there {
            Config::load_with::<Integrity>(path)?.1
        } else {
            Integrity::default()
        };
        Ok((config, (bounds, integrity)))
    }

    fn understood(config: &Config, (bounds, integrity): &Self::Settings) -> String {
        understood(config, bounds, *integrity)
    }

    fn unlikely(config: &Config, (bounds, _): &Self::Settings) -> Vec<String> {
        unlikely(config, bounds)
    }

    fn run(mut start: Start<'_, Self::Settings>) -> Result<(), EndError> {
        let (config, (bounds, integrity)) = (start.config, &start.settings);
        let others: Vec<u16> = config.peers().map(|it| it.id).collect();
        let mut life = Life {
            watch: Watch::new(config.robot.id, &others, bounds, *integrity),
            channels: Channels::open(start.space, config, bounds)?,
            state: None,
            remarks: Vec::new(),
        };
        listen(&mut life, LOOK, start.stop, &mut start.voice)
    }
}

struct Life {
    watch: Watch,
    channels: Channels,
    /// Of the last word.
    state: Option<u8>,
    remarks: Vec<String>,
}

impl Listener for Life {
    /// Buses have none.
    fn bell(&self) -> Result<Option<BorrowedFd<'_>>, EndError> {
        Ok(None)
    }

    fn turn(&mut self) -> Result<u64, EndError> {
        let now = Moment::now();
        let bytes = self.channels.hear(&mut self.watch, now);
        let said = self.watch.step(self.channels.common_ns(now));
        self.channels.tell_all(&said);
        for word in &said {
            if let Said::Integrity(word) = word {
                self.remark(word);
            }
        }
        Ok(bytes)
    }

    fn report(&self) -> Report {
        self.channels.report(&self.watch)
    }

    fn remarks(&mut self) -> Vec<String> {
        std::mem::take(&mut self.remarks)
    }
}

impl Life {
    /// A change is said once.
    fn remark(&mut self, word: &Word) {
        if self.state.replace(word.state) != Some(word.state) {
            self.remarks.push(spoken(word));
        }
    }
}

/// What a word says, for the log.
fn spoken(word: &Word) -> String {
    let named = word.conflicts().iter().map(|it| {
        use coloc_shm_types::Suspect as S;
        let robot = it.robot;
        match it.kind {
            S::FIX => format!("the fixes of robot {robot}"),
            S::SIGHTINGS => format!("all that robot {robot} sees"),
            S::SIGHTING => format!("where robot {robot} sees robot {}", it.other),
            S::COMPASS => format!("the compass of robot {robot}"),
            _ => format!("how robot {robot} moved"),
        }
    });
    let named: Vec<_> = named.collect();
    match word.state {
        Word::OK => "the estimate can be right".into(),
        Word::ESTIMATE_OUTSIDE => format!(
            "the estimate cannot be right: it is {:.2} m outside of where the robot must be",
            word.distance_m
        ),
        Word::BOUNDS_VIOLATED if named.is_empty() => {
            "what was measured cannot all be within its bounds: more than one thing is wrong".into()
        }
        Word::BOUNDS_VIOLATED => format!(
            "what was measured cannot all be within its bounds: without {} it could",
            named.join(", or without ")
        ),
        Word::NOT_OBSERVABLE => "nothing bounds where the robot is".into(),
        Word::STALE => "slots were not closed in time; it begins anew".into(),
        _ => "it begins".into(),
    }
}

/// A configuration in words, a line a subject.
fn understood(config: &Config, bounds: &Bounds, integrity: Integrity) -> String {
    let from_sigmas = |given: f64, unit: &str| {
        if given > 0.0 {
            format!("{given} {unit}")
        } else {
            format!("{} standard deviations", bounds.sigmas)
        }
    };
    let compass = if bounds.compass_rad > 0.0 {
        format!("within {} rad", bounds.compass_rad)
    } else {
        "none that can be relied on".into()
    };
    let means = if bounds.mean_share < 1.0 {
        format!(
            "of {} slots within {} of these bounds, of sightings within {}",
            bounds.mean_slots,
            bounds.mean_share,
            bounds.means_of_sightings()
        )
    } else {
        "nothing is promised".into()
    };
    let mut lines = vec![
        format!("robot        {}", config.robot.name),
        format!(
            "slots        of {} s, closed {} s after their end",
            bounds.slot_s, bounds.grace_s
        ),
        format!(
            "sightings    within {}, {}",
            from_sigmas(bounds.sighting_m, "m"),
            from_sigmas(bounds.sighting_rad, "rad")
        ),
        format!("fixes        within {}", from_sigmas(bounds.fix_m, "m")),
        format!(
            "wheels       within {} m/s forward, {} m/s to the side, {} rad/s",
            bounds.speed_mps, bounds.sideways_mps, bounds.turn_radps
        ),
        format!("compass      {compass}"),
        format!("means        {means}"),
        format!(
            "alarm        after {} slots outside, over after {} inside",
            integrity.alarm_slots, integrity.clear_slots
        ),
    ];
    let peers = config.peers();
    lines.extend(peers.map(|peer| format!("robot {:<6} {}", peer.id, peer.name)));
    lines.join("\n") + "\n"
}

/// What is allowed in the file and was hardly meant.
#[must_use]
pub fn unlikely(config: &Config, bounds: &Bounds) -> Vec<String> {
    let mut warnings = Vec::new();
    if config.odometry.is_none() {
        warnings.push(
            "there is no [odometry]: the robot may have driven at bounds.max_speed_mps all the time"
                .to_owned(),
        );
    }
    let limit = config.odometry.as_ref().map(|it| it.max_speed_mps);
    if let Some(limit) = limit.filter(|it| *it > bounds.max_speed_mps) {
        warnings.push(format!(
            "bounds.max_speed_mps = {}: odometry.max_speed_mps allows {limit}, so this robot may break it",
            bounds.max_speed_mps
        ));
    }
    if bounds.compass_rad == 0.0 {
        warnings.push(
            "bounds.compass_rad = 0: without a compass the regions of robots that have no fixes are many times as large"
                .to_owned(),
        );
    }
    if bounds.sigmas < 3.0 {
        warnings.push(format!(
            "bounds.sigmas = {}: Gaussian noise breaks that many times a minute",
            bounds.sigmas
        ));
    }
    warnings
}
