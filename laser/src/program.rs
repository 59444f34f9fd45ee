//! The program `coloc-laser`.

use std::ffi::OsString;
use std::os::fd::BorrowedFd;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use coloc_daemon::config::Config;
use coloc_scan::Look;
use coloc_sensors::listen::{Listener, listen};
use coloc_sensors::program::{self, Other, Program, Start};
use coloc_sensors::{Driver, EndError, Input, InputSpec, Moment, Report, run};
use coloc_shm_types::{RobotName, Scan, Subscriber, boot};

use crate::beliefs::{Beliefs, mount};
use crate::driver::{FIGURES, LaserDriver, unlikely};
use crate::player::Player;
use crate::publish::Channels;
use crate::refusal::Refusal;
use crate::section::Laser;

const PLAYER: &str = "laser-play";
/// A server or device that is silent for so long is opened again.
const SILENCE: Duration = Duration::from_secs(10);

/// The whole program, from its arguments to its exit status.
pub fn main_from_args(args: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> ExitCode {
    program::main_from_args::<LaserProgram>(args)
}

struct LaserProgram;

/// Publish a CARMEN log on the channel `scan`, as if it were measured now.
#[derive(Debug, Args)]
struct Play {
    /// The robot's configuration.
    config: PathBuf,
    /// The log, plain or gzip.
    log: PathBuf,
    /// As fast as it can be read; who listens misses most of it.
    #[arg(long)]
    full_speed: bool,
}

impl Program for LaserProgram {
    const NAME: &'static str = "coloc-laser";
    const DRIVER: &'static str = "laser";
    const ABOUT: &'static str = "Laser scanners for coloc: other robots found in scans";
    const RUN: &'static str =
        "Publish the robots that scans show for colocd, until SIGINT or SIGTERM";
    const SECTION: &'static str = "laser";
    const HEARD: &'static str = "the scanner";
    const FIGURES: &'static [&'static str] = &FIGURES;
    type Settings = Laser;

    fn refusals() -> Vec<&'static str> {
        Refusal::ALL.map(Refusal::name).into()
    }

    fn load(path: &Path) -> Result<(Config, Laser), EndError> {
        Ok(Config::load_with(path)?)
    }

    fn source(section: &Laser) -> u16 {
        section.source
    }

    fn understood(config: &Config, section: &Laser) -> String {
        understood(config, section)
    }

    fn unlikely(config: &Config, section: &Laser) -> Vec<String> {
        unlikely(config, section)
    }

    fn run(start: Start<'_, Laser>) -> Result<(), EndError> {
        run_driver(start)
    }

    fn others() -> Vec<Other> {
        vec![Other::new("play", play)]
    }
}

fn run_driver(mut start: Start<'_, Laser>) -> Result<(), EndError> {
    let (config, section) = (start.config, &start.settings);
    let name = &config.robot.name;
    let spec = section.spec().map_err(EndError::Input)?;
    let listened_to = listened_to(config, section);
    let channels = Channels::open(start.space, name, section.source, &listened_to)?;
    let looks: Vec<_> = config
        .peers()
        .filter_map(|peer| Some((peer.id, section.look_of(peer.id)?)))
        .collect();
    let own_boot = boot();
    let mount = mount(config, section.source);
    let beliefs = Beliefs::new(own_boot, mount, section.change_m_s, &looks);
    let mut driver = LaserDriver::new(section, beliefs, own_boot, channels);
    if let Some(spec) = spec {
        let mut input = Input::new(start.below(spec), SILENCE);
        return run::run(&mut driver, &mut input, start.stop, &mut start.voice);
    }
    let scans = start.space.subscriber(name)?;
    let mut scanner = Scanner { driver, scans };
    listen(&mut scanner, run::IDLE, start.stop, &mut start.voice)
}

fn listened_to(config: &Config, section: &Laser) -> Vec<(u16, RobotName)> {
    let seen = config
        .peers()
        .filter(|peer| section.look_of(peer.id).is_some());
    seen.map(|peer| (peer.id, peer.name.clone())).collect()
}

/// The driver on the channel `scan`.
struct Scanner {
    driver: LaserDriver<Channels>,
    scans: Subscriber<Scan>,
}

impl Listener for Scanner {
    fn bell(&self) -> Result<Option<BorrowedFd<'_>>, EndError> {
        Ok(Some(self.scans.bell()?))
    }

    fn turn(&mut self) -> Result<u64, EndError> {
        hear(&mut self.driver, &self.scans)
    }

    fn report(&self) -> Report {
        self.driver.report()
    }

    fn remarks(&mut self) -> Vec<String> {
        self.driver.remarks()
    }
}

/// All scans that wait; of how many bytes they are.
fn hear(driver: &mut LaserDriver<Channels>, scans: &Subscriber<Scan>) -> Result<u64, EndError> {
    let mut bytes = 0;
    // What cannot be read is as if it had not come.
    while let Ok(Some(scan)) = scans.receive() {
        bytes += size_of::<Scan>() as u64;
        driver.scan(&scan, Moment::now())?;
    }
    driver.idle(Moment::now())?;
    Ok(bytes)
}

fn play(args: Play) -> Result<(), EndError> {
    let paced = !args.full_speed;
    let spec = InputSpec::File {
        path: args.log,
        paced,
    };
    program::begin::<LaserProgram>(&args.config, PLAYER, |mut start| {
        let (name, source) = (&start.config.robot.name, start.settings.source);
        let mut player = Player::open(start.space, name, source, paced)?;
        let mut input = Input::new(spec, SILENCE);
        run::run(&mut player, &mut input, start.stop, &mut start.voice)
    })
}

/// A configuration in words, a line a subject.
fn understood(config: &Config, section: &Laser) -> String {
    let (robot, source) = (&config.robot.name, section.source);
    let [x, y, turned] = mount(config, source);
    let input = match section.spec() {
        Ok(None) => "the channel scan".into(),
        Ok(Some(spec)) => spec.to_string(),
        Err(problem) => problem,
    };
    let mut lines = vec![
        format!("robot        {robot}, scanner {source}"),
        format!("input        {input}"),
        format!("mount        {x} m forward, {y} m left, turned {turned} rad to the left"),
        format!(
            "believed     ranges to {} m, angles to {} rad, sizes of robots to {} m",
            section.range_sigma_m, section.angle_sigma_rad, section.shape_sigma_m
        ),
    ];
    for peer in config.peers() {
        let look = section
            .look_of(peer.id)
            .map(|look| section.settings().looks[look]);
        let look = look.map_or_else(|| "is not looked for".into(), |look| shown(&look));
        lines.push(format!("robot {:<6} {}: {look}", peer.id, peer.name));
    }
    lines.join("\n") + "\n"
}

fn shown(look: &Look) -> String {
    match look {
        Look::Cylinder { radius_m } => {
            format!("a cylinder of radius {radius_m} m: range and bearing")
        }
        Look::Rectangle {
            length_m, width_m, ..
        } => format!("a rectangle, {length_m} m long, {width_m} m wide: position and heading"),
        Look::Marks(pattern) => format!(
            "{} reflective marks: position and heading",
            pattern.marks().len()
        ),
    }
}
