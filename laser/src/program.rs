//! The program `coloc-laser`.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::{Parser, Subcommand};
use coloc_daemon::config::Config;
use coloc_scan::Look;
use coloc_sensors::page::{self, Names};
use coloc_sensors::run::{self, Outlet as Life};
use coloc_sensors::status::{Line, Reporter};
use coloc_sensors::stop::Woken;
use coloc_sensors::teller::Teller;
use coloc_sensors::{Driver, EndError, Input, InputSpec, Moment, Stop, end};
use coloc_shm_types::{RobotName, Scan, Subscriber, boot};

use crate::beliefs::{Beliefs, mount};
use crate::driver::{FIGURES, LaserDriver, unlikely};
use crate::player::Player;
use crate::publish::Channels;
use crate::refusal::Refusal;
use crate::section::Laser;

const NAME: &str = "coloc-laser";
const DRIVER: &str = "laser";
const PLAYER: &str = "laser-play";
/// A server or device that is silent for so long is opened again.
const SILENCE: Duration = Duration::from_secs(10);

/// Laser scanners for coloc: other robots found in scans.
#[derive(Debug, Parser)]
#[command(name = NAME, version, arg_required_else_help = true)]
struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Publish the robots that scans show for colocd, until SIGINT or SIGTERM.
    Run {
        /// The robot's configuration, with a section [laser].
        config: PathBuf,
    },
    /// Read a configuration, say what it means and what is unlikely about it, open nothing.
    Check {
        /// The robot's configuration.
        config: PathBuf,
        /// End with status 1 if anything is unlikely.
        #[arg(long)]
        strict: bool,
    },
    /// Publish a CARMEN log on the channel `scan`, as if it were measured now.
    Play {
        /// The robot's configuration.
        config: PathBuf,
        /// The log, plain or gzip.
        log: PathBuf,
        /// As fast as it can be read; who listens misses most of it.
        #[arg(long)]
        full_speed: bool,
    },
    /// Print the status of the coloc-laser that runs with this configuration, once.
    Status {
        /// The robot's configuration.
        config: PathBuf,
    },
}

/// The whole program, from its arguments to its exit status.
pub fn main_from_args<I, T>(args: I) -> ExitCode
where
    I: IntoIterator<Item = T>,
    T: Into<OsString> + Clone,
{
    coloc_daemon::file_size::let_writers_see_the_limit();
    let result = match Args::try_parse_from(args) {
        Ok(Args { command }) => match command {
            Command::Run { config } => run(&config),
            Command::Check { config, strict } => check(&config, strict),
            Command::Play {
                config,
                log,
                full_speed,
            } => play(&config, log, full_speed),
            Command::Status { config } => status(&config),
        },
        Err(answer) => {
            // If nobody reads it, nobody is left to tell.
            let _ = answer.print();
            return ExitCode::from(u8::from(answer.use_stderr()) * 2);
        }
    };
    end::finish(NAME, result)
}

fn run(path: &Path) -> Result<(), EndError> {
    let stop = Stop::on_signals().map_err(EndError::of("signals cannot be handled"))?;
    let (config, section) = Config::load_with::<Laser>(path)?;
    let name = &config.robot.name;
    let space = config.open_space(NAME)?;
    let spec = section.spec().map_err(EndError::Input)?;
    let channels = Channels::open(
        &space,
        name,
        section.source,
        &listened_to(&config, &section),
    )?;
    let looks: Vec<_> = config
        .peers()
        .filter_map(|peer| Some((peer.id, section.look_of(peer.id)?)))
        .collect();
    let own_boot = boot();
    let mount = mount(&config, section.source);
    let beliefs = Beliefs::new(own_boot, mount, section.change_m_s, &looks);
    let mut driver = LaserDriver::new(&section, beliefs, own_boot, channels);
    let mut life = Life {
        space: &space,
        reporter: Reporter::open(&space, name, DRIVER, section.source)?,
    };
    let mut teller = Teller::new(NAME);
    match spec {
        Some(spec) => {
            let spec = spec.below(path.parent().unwrap_or(Path::new("")));
            let mut input = Input::new(spec, SILENCE);
            run::run(&mut driver, &mut input, &stop, &mut life, &mut teller)
        }
        None => listen(
            &mut driver,
            &space.subscriber(name)?,
            &stop,
            &mut life,
            &mut teller,
        ),
    }
}

fn listened_to(config: &Config, section: &Laser) -> Vec<(u16, RobotName)> {
    let seen = config
        .peers()
        .filter(|peer| section.look_of(peer.id).is_some());
    seen.map(|peer| (peer.id, peer.name.clone())).collect()
}

/// Looks through the scans of the channel until asked to end.
fn listen(
    driver: &mut LaserDriver<Channels>,
    scans: &Subscriber<Scan>,
    stop: &Stop,
    life: &mut Life<'_>,
    teller: &mut Teller,
) -> Result<(), EndError> {
    let mut line = Line {
        is_open: true,
        opened: 1,
        bytes: 0,
    };
    let mut health = None;
    loop {
        let bell = scans.bell()?;
        let woken = stop
            .wait(Some(bell), run::IDLE)
            .map_err(EndError::of("it cannot be waited"))?;
        if woken == Woken::Stop {
            teller.finish();
            return Ok(());
        }
        line.bytes += hear(driver, scans)?;
        driver
            .remarks()
            .into_iter()
            .for_each(|it| teller.remark(it));
        if let Some(now) = life.reporter.report(line, &driver.report()) {
            if health.replace(now) != Some(now) {
                teller.remark(format!("the scanner is {now}"));
            }
            life.space.check()?;
        }
        teller.tell(Instant::now());
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

fn play(path: &Path, log: PathBuf, full_speed: bool) -> Result<(), EndError> {
    let stop = Stop::on_signals().map_err(EndError::of("signals cannot be handled"))?;
    let (config, section) = Config::load_with::<Laser>(path)?;
    let space = config.open_space(NAME)?;
    let name = &config.robot.name;
    let mut player = Player::open(&space, name, section.source, !full_speed)?;
    let mut life = Life {
        space: &space,
        reporter: Reporter::open(&space, name, PLAYER, section.source)?,
    };
    let spec = InputSpec::File {
        path: log,
        paced: !full_speed,
    };
    let mut input = Input::new(spec, SILENCE);
    run::run(
        &mut player,
        &mut input,
        &stop,
        &mut life,
        &mut Teller::new(NAME),
    )
}

fn check(path: &Path, strict: bool) -> Result<(), EndError> {
    let (config, section) = Config::load_with::<Laser>(path)?;
    let warnings = unlikely(&config, &section);
    page::check(understood(&config, &section), &warnings, strict)
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

fn status(path: &Path) -> Result<(), EndError> {
    let (config, section) = Config::load_with::<Laser>(path)?;
    let names = Names {
        program: NAME,
        driver: DRIVER,
        source: section.source,
        refusals: &Refusal::ALL.map(Refusal::name),
        figures: &FIGURES,
    };
    page::status(&config.open_space(NAME)?, &config.robot.name, &names)
}
