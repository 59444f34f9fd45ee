//! The program `coloc-gnss`.

use std::ffi::OsString;
use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use coloc_daemon::config::Config;
use coloc_sensors::input::Step;
use coloc_sensors::program::{self, Other, Program, Start};
use coloc_sensors::{EndError, Input, InputSpec, Moment, Stop, run};
use coloc_shm_types::places;
use coloc_shm_types::private::{OwnFile, PrivateDirectory};
use serde_json::json;

use crate::datum::Origin;
use crate::driver::{FIGURES, GnssDriver, unlikely};
use crate::publish::Channels;
use crate::receiver::{Counts, Event, Receiver};
use crate::refusal::Refusal;
use crate::section::Gnss;
use crate::stamp::Stamper;
use crate::utc::iso;

/// The whole program, from its arguments to its exit status.
pub fn main_from_args(args: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> ExitCode {
    program::main_from_args::<GnssProgram>(args)
}

struct GnssProgram;

/// Print what a receiver or a recording says, a line of JSON for each fix and heading.
#[derive(Debug, Args)]
struct Fixes {
    /// As `input` in [gnss]; a path alone is a file, read as fast as it can be.
    input: String,
}

impl Program for GnssProgram {
    const NAME: &'static str = "coloc-gnss";
    const DRIVER: &'static str = "gnss";
    const ABOUT: &'static str = "Satellite receivers for coloc: NMEA 0183 and UBX, from a serial device, TCP, gpsd, a file or standard input";
    const RUN: &'static str = "Publish the receiver's fixes for colocd, until SIGINT or SIGTERM";
    const SECTION: &'static str = "gnss";
    const HEARD: &'static str = "the receiver";
    const FIGURES: &'static [&'static str] = &FIGURES;
    type Settings = Gnss;

    fn refusals() -> Vec<&'static str> {
        Refusal::ALL.map(Refusal::name).into()
    }

    fn load(path: &Path) -> Result<(Config, Gnss), EndError> {
        Ok(Config::load_with(path)?)
    }

    fn source(section: &Gnss) -> u16 {
        section.source
    }

    fn understood(config: &Config, section: &Gnss) -> String {
        understood(config, section)
    }

    fn unlikely(config: &Config, section: &Gnss) -> Vec<String> {
        unlikely(config, section)
    }

    fn run(mut start: Start<'_, Gnss>) -> Result<(), EndError> {
        let section = start.settings.clone();
        let spec = start.below(section.spec().map_err(EndError::Input)?);
        let origin = origin(start.config, &section, start.path)?;
        let stamper = stamper(&section, &spec);
        let name = &start.config.robot.name;
        let channels = Channels::open(start.space, name, section.source, stamper.clock())?;
        let mut input = Input::new(spec, Duration::from_secs_f64(section.silence_s));
        let mut driver = GnssDriver::new(section, origin, channels, stamper);
        run::run(&mut driver, &mut input, start.stop, &mut start.voice)
    }

    fn others() -> Vec<Other> {
        vec![Other::new("fixes", fixes)]
    }
}

fn stamper(section: &Gnss, spec: &InputSpec) -> Stamper {
    let latency_ns = nanos(section.latency_s);
    if spec.is_recording() {
        Stamper::recording(spec.is_paced(), latency_ns)
    } else {
        Stamper::live(section.stamp, latency_ns, nanos(section.clock_off_s))
    }
}

#[allow(clippy::cast_possible_truncation)] // Of at most an hour.
fn nanos(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}

fn origin(config: &Config, section: &Gnss, path: &Path) -> Result<Origin, EndError> {
    let is_configured = section.datum.latitude_deg.is_some();
    let file = (!is_configured).then(|| datum_file(config, section, path));
    Origin::begin(&section.datum, file.transpose()?)
        .map_err(|problem| EndError::Input(problem.to_string()))
}

fn datum_file(config: &Config, section: &Gnss, path: &Path) -> Result<OwnFile, EndError> {
    let configured = &section.datum.file;
    if configured.as_os_str().is_empty() {
        let directory = PrivateDirectory::make(&places::state_directory()?, |_| true)?;
        return Ok(directory.file(&format!("{}.datum.toml", config.robot.name))?);
    }
    let directory = path.parent().unwrap_or(Path::new(""));
    Ok(OwnFile::named(&directory.join(configured))?)
}

/// A configuration in words, a line a subject.
fn understood(config: &Config, section: &Gnss) -> String {
    let spec = section
        .spec()
        .map_or_else(|problem| problem, |spec| spec.to_string());
    let datum = &section.datum;
    let datum = match datum.latitude_deg.zip(datum.longitude_deg) {
        Some((latitude, longitude)) => {
            format!("{latitude}° north, {longitude}° east, {} m", datum.height_m)
        }
        None => format!("the mean of the first {} good fixes, saved", datum.fixes),
    };
    let stamp = match section.stamp {
        crate::section::Stamp::Fix => format!(
            "its own time, at most {} s from the computer's",
            section.clock_off_s
        ),
        crate::section::Stamp::Arrival => "when it came".into(),
    };
    let floors = [1, 2, 3, 4, 5].map(|quality| {
        let floor = section.floor(quality).map(|floor| {
            format!(
                "{} m new, {} m for {} s",
                floor.sigma_m, floor.slow_sigma_m, floor.slow_time_s
            )
        });
        format!("quality {quality}: {}", floor.unwrap_or_default())
    });
    let (robot, source) = (&config.robot.name, section.source);
    let begin = [
        format!("robot        {robot}, receiver {source}"),
        format!("input        {spec}"),
        format!("stamp        {stamp}, {} s earlier", section.latency_s),
        format!("datum        {datum}"),
    ];
    let floors = floors.map(|floor| format!("believed     {floor}"));
    let lines: Vec<_> = begin.into_iter().chain(floors).collect();
    lines.join("\n") + "\n"
}

fn fixes(Fixes { input }: Fixes) -> Result<(), EndError> {
    let stop = Stop::on_signals().map_err(EndError::of("signals cannot be handled"))?;
    let is_path = !input.contains(':') && input != "stdin";
    let text = if is_path {
        format!("file:{input}?speed=full")
    } else {
        input
    };
    let spec = text.parse().map_err(EndError::Input)?;
    let mut input = Input::new(spec, Duration::from_secs(10));
    let mut receiver = Receiver::new(None);
    let mut out = io::BufWriter::new(io::stdout().lock());
    let mut events = Vec::new();
    loop {
        let is_over = hear(&mut input, &stop, &mut receiver, &mut events)?;
        let mut lines = events.drain(..).filter_map(shown);
        let written = lines.try_for_each(|line| writeln!(out, "{line}"));
        let is_live = !input.spec().is_recording();
        let flushed = match written {
            Ok(()) if is_live || is_over => out.flush(),
            written => written,
        };
        match flushed {
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => return Ok(()),
            Err(error) => return Err(EndError::of("standard output cannot be written")(error)),
            Ok(()) if is_over => break,
            Ok(()) => {}
        }
    }
    say(&summary(receiver.counts()));
    Ok(())
}

/// What comes next of a receiver; whether that is all.
fn hear(
    input: &mut Input,
    stop: &Stop,
    receiver: &mut Receiver,
    events: &mut Vec<Event>,
) -> Result<bool, EndError> {
    let step = input.step(stop, run::IDLE);
    let mut note = |event| events.push(event);
    match step.map_err(EndError::of("it cannot be waited"))? {
        Step::Bytes => receiver.take(input.bytes(), Moment::now(), &mut note),
        Step::Unreadable(why) => return Err(EndError::Input(why)),
        Step::Lost(why) => say(&why),
        Step::Quiet if !input.spec().is_recording() => receiver.pause(&mut note),
        Step::Quiet | Step::Opened => {}
        Step::End | Step::Stop => {
            receiver.cut(Moment::now(), &mut note);
            return Ok(true);
        }
    }
    Ok(false)
}

fn summary(counts: Counts) -> String {
    let Counts {
        whole,
        broken_lines,
        broken_frames,
        malformed,
        proprietary,
        foreign_bytes,
    } = counts;
    format!(
        "{whole} sentences and messages; broken: {broken_lines} lines, {broken_frames} frames; malformed: {malformed}; \
         proprietary: {proprietary}; {foreign_bytes} other bytes"
    )
}

fn say(text: &str) {
    // If this fails there is nowhere left to say so.
    let _ = io::stderr().write_all(format!("{}: {text}\n", GnssProgram::NAME).as_bytes());
}

/// An event as a line; that there is no fix is none.
fn shown(event: Event) -> Option<serde_json::Value> {
    match event {
        Event::Fix(fix, _) => (fix.quality > 0).then(|| {
            json!({
                "time": fix.utc_ns.map(iso), "latitude_deg": fix.place[0], "longitude_deg": fix.place[1],
                "height_m": fix.height_m, "quality": fix.quality, "satellites": fix.satellites, "hdop": fix.hdop,
                "stated_m": fix.stated_m, "speed_m_s": fix.speed_m_s, "course_deg": fix.course_deg,
            })
        }),
        Event::Heading(heading, _) => Some(json!({
            "time": heading.utc_ns.map(iso), "heading_deg": heading.degrees, "stated_deg": heading.stated_deg,
            "quality": heading.quality,
        })),
    }
}
