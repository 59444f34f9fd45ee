//! `coloc eval --sightings recorded`: robots that localize one another by what their own cameras saw.

use std::path::{Path, PathBuf};

use coloc_sim::mrclam::Recording;
use coloc_sim::partial::Recorded;
use coloc_sim::partial::exchange::evaluate::{Config, Robot, Setting, evaluate};
use serde::Serialize;

use super::EvalCommandError;
use super::args::EvalArgs;
use super::number::{or_dash, percent, rad};
use super::progress::Bar;
use super::run::start_threads;
use super::setup::name_of;
use super::splice::Splice;
use super::table::Table;
use crate::output::print_line;
use crate::result_file::{ResultFile, WriteError};

/// The JSON: the same bytes for the same seed.
#[derive(Serialize)]
struct Document<'a> {
    version: &'static str,
    /// The recording's folder.
    world: &'a str,
    sightings: &'static str,
    runs: u16,
    seed: u64,
    seconds: f64,
    sightings_of_robots: usize,
    sightings_of_landmarks: usize,
    remarks: &'a [String],
    reports: &'a [Setting],
}

/// Where everything goes.
struct Outputs {
    json: Option<(PathBuf, ResultFile)>,
    markdown: Option<Splice>,
}

pub(super) fn run(args: &EvalArgs, folder: &Path) -> Result<(), EvalCommandError> {
    let unusable = |error| EvalCommandError::Unusable(folder.to_owned(), error);
    let recorded = Recorded::new(&Recording::load(folder)?).map_err(unusable)?;
    let world = name_of(folder);
    let outputs = Outputs::prepare(args, &world)?;
    start_threads(args)?;
    let config = Config {
        runs: args.runs(),
        seed: args.seed,
        seconds: args.seconds,
    };
    let bar = Bar::new("recorded sightings");
    let reports = evaluate(&recorded, &config, &|progress| bar.show(progress));
    drop(bar);
    let [of_robots, of_landmarks] = recorded.counts();
    let seconds = args.seconds.unwrap_or(f64::INFINITY);
    let document = Document {
        version: env!("CARGO_PKG_VERSION"),
        world: &world,
        sightings: "recorded",
        runs: config.runs,
        seed: config.seed,
        seconds: seconds.min(recorded.length_s()),
        sightings_of_robots: of_robots,
        sightings_of_landmarks: of_landmarks,
        remarks: &recorded.remarks,
        reports: &reports,
    };
    let table = table(&document);
    print_line(&format!("{}\n", heading(&document)));
    for remark in document.remarks {
        print_line(remark);
    }
    print_line(&table.text());
    outputs.write(&document, &table)
}

impl Outputs {
    /// Refuses what cannot be written.
    fn prepare(args: &EvalArgs, world: &str) -> Result<Self, WriteError> {
        let json = |path: &PathBuf| ResultFile::prepare(path).map(|file| (path.clone(), file));
        let splice = |path: &PathBuf| Splice::prepare(path, format!("{world} sightings"));
        let outputs = Self {
            json: args.json.as_ref().map(json).transpose()?,
            markdown: args.markdown.as_ref().map(splice).transpose()?,
        };
        if let (Some((_, json)), Some(markdown)) = (&outputs.json, &outputs.markdown) {
            markdown.file().check_apart(json)?;
        }
        Ok(outputs)
    }

    /// Writes everything, whatever became of the other; the first that failed is told.
    fn write(&self, document: &Document<'_>, table: &Table) -> Result<(), EvalCommandError> {
        let json = self.json.as_ref().map_or(Ok(()), |(path, file)| {
            let text =
                serde_json::to_string(document).map_err(|error| WriteError::new(path, &error));
            file.write((text? + "\n").as_bytes())
        });
        let markdown = self
            .markdown
            .as_ref()
            .map_or(Ok(()), |splice| splice.write(&table.markdown()));
        json.and(markdown).map_err(Into::into)
    }
}

fn heading(document: &Document<'_>) -> String {
    format!(
        "{}: {:.0} s, {} sightings of robots and {} of landmarks, {} runs, seed {}",
        document.world,
        document.seconds,
        document.sightings_of_robots,
        document.sightings_of_landmarks,
        document.runs,
        document.seed
    )
}

fn table(document: &Document<'_>) -> Table {
    let mut table = Table::new(
        "The robots' own cameras: RMS x/y, NEES outside of its 95 % bound (nominal 5 %), when all runs knew the heading; \
            beside it the same sightings as poses without a heading; expected: an independent implementation's",
        &[
            "scenario",
            "robot",
            "x/y [cm]",
            "heading [rad]",
            "outside [%]",
            "known by [s]",
            "expected [cm]",
            "as poses [cm]",
            "outside [%]",
            "expected [cm]",
        ],
    );
    for Setting {
        scenario, methods, ..
    } in document.reports
    {
        let (Some(coloc), before) = (methods.first(), methods.get(1)) else {
            continue;
        };
        for (index, robot) in coloc.robots.iter().enumerate() {
            let mut row = vec![(*scenario).into(), name_of_robot(robot)];
            row.extend(cells(robot));
            row.extend(cells_before(before.and_then(|it| it.robots.get(index))));
            table.rows.push(row);
        }
    }
    table
}

/// With a mark where it has a receiver.
fn name_of_robot(robot: &Robot) -> String {
    let mark = if robot.receiver { ", receiver" } else { "" };
    format!("{}{mark}", robot.name)
}

fn cells(robot: &Robot) -> [String; 5] {
    let [x, y, heading] = robot.rms;
    let known = or_dash(robot.found_by_s, |it| format!("{it:.0}"));
    [
        pair([x, y]),
        rad(heading),
        percent(robot.nees_outside),
        known,
        expected(robot),
    ]
}

fn cells_before(robot: Option<&Robot>) -> [String; 3] {
    robot.map_or(["–".into(), "–".into(), "–".into()], |robot| {
        let [x, y, _] = robot.rms;
        [pair([x, y]), percent(robot.nees_outside), expected(robot)]
    })
}

fn expected(robot: &Robot) -> String {
    robot.reference.map_or_else(|| "–".into(), pair)
}

/// Metres as centimetres.
fn pair([x, y]: [f64; 2]) -> String {
    if x.is_nan() || y.is_nan() {
        return "–".into();
    }
    format!("{:.1}/{:.1}", 100.0 * x, 100.0 * y)
}
