//! Robots that see one another by laser scanners: whether all are found, nobody else is, each is who it is said to be, and the error is as
//! large as it is said to be.
//!
//! Recorded rooms, a scan each, with robots of known pose put into their free parts; rays are cast by this crate's own means. Priors are off
//! by draws of 0.3 m and 10°. One robot of ten is not where it is believed to be; in one scan of five there is one that looks alike and
//! is none of the team; one robot of five stands right beside or behind another. The scanner drives and turns while it scans. Ranges have noise
//! of 15 mm and come in centimetres; half of the beams that light up a rim give a range in between; robots are 5 mm larger or smaller
//! than they are said to be.

pub mod hall;
mod picture;
mod room;
mod scene;
mod score;
mod solid;

use std::path::PathBuf;

use coloc_scan::finder::Noise as ScanNoise;
use coloc_scan::shape::Pattern;
use coloc_scan::{Finder, Look, Settings};
use rayon::prelude::*;

pub use picture::picture;

use crate::campaign::Finding;
use crate::honest::table::{Table, digits, percent};
use crate::random::{Noise, Purpose};
use room::{Recording, Room, read_all};
use score::{Score, try_once};

/// How much of it is done.
#[derive(Clone, Debug, PartialEq)]
pub struct Form {
    /// Where all chance comes from.
    pub seed: u64,
    /// Where recordings are.
    pub data: Option<PathBuf>,
    /// Each room is used so often, for each row.
    pub draws: u16,
    /// Of the rooms, every so many.
    pub every: usize,
    /// Shares may be missed by so many σ of chance.
    pub chance: f64,
}

impl Form {
    /// The whole campaign.
    #[must_use]
    pub fn long(seed: u64, data: Option<PathBuf>) -> Self {
        Self {
            seed,
            data,
            draws: 8,
            every: 1,
            chance: 0.0,
        }
    }

    /// The same of fewer scans.
    #[must_use]
    pub fn short(seed: u64, data: Option<PathBuf>) -> Self {
        Self {
            draws: 1,
            every: 2,
            chance: 2.0,
            ..Self::long(seed, data)
        }
    }
}

/// Scans that differ in their chance alone.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    name: &'static str,
    /// The robots look like these in turn.
    looks: Vec<Look>,
    /// So many times as many beams as were recorded.
    finer: u32,
    /// The scanner's own heading is off as well, by a draw of 10°.
    turned: bool,
}

fn rows() -> Vec<Row> {
    let cylinder = |radius_m| Look::Cylinder { radius_m };
    let rectangle = Look::Rectangle {
        length_m: 0.7,
        width_m: 0.5,
        centre_m: [0.1, 0.0],
    };
    let marks = [[-0.25, 0.24], [0.28, -0.02], [0.3, -0.17], [0.24, 0.22]];
    let marks = Pattern::new(&marks, solid::MARK_M).map(Look::Marks);
    let row = |name, looks, finer| Row {
        name,
        looks,
        finer,
        turned: false,
    };
    let mut rows = vec![
        row("cylinder, radius 0.25 m", vec![cylinder(0.25)], 1),
        row("cylinder, radius 0.18 m", vec![cylinder(0.18)], 1),
        row("rectangle, 0.7 × 0.5 m", vec![rectangle], 1),
        row(
            "two cylinders and rectangles",
            vec![cylinder(0.25), rectangle],
            1,
        ),
    ];
    rows.extend(marks.map(|marks| row("four marks, beams 0.25° apart", vec![marks], 4)));
    rows.push(Row {
        turned: true,
        ..row(
            "cylinder, 0.25 m; own heading off by 10°",
            vec![cylinder(0.25)],
            1,
        )
    });
    rows
}

/// What is found with these settings.
fn settings(row: &Row) -> Settings {
    Settings {
        bright: 0.8,
        noise: ScanNoise {
            range_sigma_m: scene::RANGE_SIGMA_M,
            angle_sigma_rad: scene::ANGLE_SIGMA_RAD,
            shape_sigma_m: scene::SHAPE_SIGMA_M,
        },
        ..Settings::of(row.looks.clone())
    }
}

/// Plays all rows.
#[must_use]
pub fn find(form: &Form) -> Finding {
    let title = "Robots in recorded rooms".to_owned();
    let Some(data) = &form.data else {
        let text =
            "SKIPPED: no recordings; set COLOC_DATA to the folder that holds carmen_laser\n".into();
        return Finding {
            title,
            text,
            missed: Vec::new(),
        };
    };
    let recordings = match read_all(&data.join("carmen_laser")) {
        Ok(recordings) => recordings,
        Err(problem) => {
            return Finding {
                title,
                text: String::new(),
                missed: vec![problem],
            };
        }
    };
    let mut table = Table::new([
        "robots",
        "scans",
        "found",
        "named",
        "nobody",
        "wrong",
        "σ range mm, bearing mrad, heading mrad",
        "NEES/dim",
        "outside",
    ]);
    let mut missed = Vec::new();
    for (number, row) in rows().iter().enumerate() {
        let score = played(&recordings, row, form, number);
        table.row(told(row, &score));
        missed.extend(bars(row, &score, form.chance));
    }
    let names: Vec<_> = recordings
        .iter()
        .map(|it| format!("{} ({})", it.name, it.rooms.len()))
        .collect();
    let text = format!("Rooms: {}.\n\n{}", names.join(", "), table.text());
    Finding {
        title,
        text,
        missed,
    }
}

fn played(recordings: &[Recording], row: &Row, form: &Form, number: usize) -> Score {
    let rooms = recordings
        .iter()
        .flat_map(|it| &it.rooms)
        .step_by(form.every);
    let rooms: Vec<Room> = rooms
        .map(|room| {
            if row.finer > 1 {
                room.finer(row.finer)
            } else {
                room.clone()
            }
        })
        .collect();
    let jobs: Vec<(usize, u16)> = (0..rooms.len())
        .flat_map(|room| (0..form.draws).map(move |draw| (room, draw)))
        .collect();
    let play = |finder: &mut Finder, (room, draw): &(usize, u16)| {
        let mut draws = Noise::new(form.seed, *draw).draws(Purpose::Laser, 0, *room, number);
        try_once(&rooms[*room], row, finder, &mut draws)
    };
    let scores = jobs
        .par_iter()
        .map_init(|| Finder::new(settings(row)), play);
    // Sums of whole numbers and of floats in the order of the scans: the same on any number of threads.
    scores
        .collect::<Vec<_>>()
        .into_iter()
        .fold(Score::default(), |all, it| all.and(&it))
}

#[allow(clippy::cast_precision_loss)] // Counts.
fn share(part: u64, whole: u64) -> f64 {
    part as f64 / whole.max(1) as f64
}

/// Mean NEES over the number of dimensions, and the share outside.
#[allow(clippy::cast_precision_loss)] // Counts.
fn honesty(score: &Score) -> (f64, f64, u64) {
    let [(flat, flat_sum, flat_out), (full, full_sum, full_out)] = score.nees;
    let mean = (flat_sum / 2.0 + full_sum / 3.0) / (flat + full).max(1) as f64;
    (mean, share(flat_out + full_out, flat + full), flat + full)
}

#[allow(clippy::cast_precision_loss)] // Counts.
fn told(row: &Row, score: &Score) -> [String; 9] {
    let (mean, outside, count) = honesty(score);
    let root =
        |place: usize, count: u64| 1000.0 * (score.squares[place] / count.max(1) as f64).sqrt();
    let heading = if score.headings == 0 {
        "–".into()
    } else {
        digits(root(2, score.headings))
    };
    [
        row.name.into(),
        score.scans.to_string(),
        format!(
            "{} of {}",
            percent(share(score.found, score.visible)),
            score.visible
        ),
        percent(share(score.told, score.visible)),
        format!("{:.2} in 100 scans", 100.0 * share(score.none, score.scans)),
        score.wrong.to_string(),
        format!(
            "{}, {}, {heading}",
            digits(root(0, count)),
            digits(root(1, count))
        ),
        digits(mean),
        percent(outside),
    ]
}

/// Every bar that was missed, in a line.
#[allow(clippy::cast_precision_loss)] // Counts.
fn bars(row: &Row, score: &Score, chance: f64) -> Vec<String> {
    let mut missed = Vec::new();
    let mut hold = |holds: bool, what: String| {
        if !holds {
            missed.push(format!("{}: {what}", row.name));
        }
    };
    let slack = |share: f64, of: u64| chance * (share * (1.0 - share) / of.max(1) as f64).sqrt();
    let found = share(score.found, score.visible);
    hold(
        found >= 0.95 - slack(0.95, score.visible),
        format!("{} found, at least 95 % are asked for", percent(found)),
    );
    let none = share(score.none, score.scans);
    hold(
        none <= 0.01 + slack(0.01, score.scans),
        format!(
            "{:.2} false ones in 100 scans, at most 1 is allowed",
            100.0 * none
        ),
    );
    hold(
        score.wrong == 0,
        format!("{} wrong names, none is allowed", score.wrong),
    );
    let (mean, outside, count) = honesty(score);
    hold(
        outside <= 0.07 + slack(0.07, count),
        format!(
            "{} of NEES outside of 95 %, at most 7 % are allowed",
            percent(outside)
        ),
    );
    hold(
        (0.7..=1.3).contains(&mean),
        format!("NEES is {mean:.2} × its dimension, 0.7 to 1.3 are allowed"),
    );
    missed
}
