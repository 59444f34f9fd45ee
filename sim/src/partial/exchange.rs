//! Five robots that tell one another what their cameras saw: who is seen, where it must be, and who sees, where the other believes to be.

pub mod evaluate;
mod feed;
pub mod ideas;
mod method;
mod team;

use std::fmt::Write as _;

use rayon::prelude::*;

use method::{FED, METHODS, Method};
use team::{Draw, Sums, summed};

use super::Form;
use super::recorded::Recorded;
use crate::campaign::Finding;
use crate::honest::table::{Table, digits, percent};
use crate::random::Noise;

/// More than a row has of x and y is missed: of ten draws, and of fewer, which are up to 15 % off.
const ALLOWED: f64 = 1.10;
const ALLOWED_OF_FEW: f64 = 1.25;
const MANY: u16 = 10;
/// A robot is outside of its 95 % for no more of the time.
const MOST_OUTSIDE: f64 = 0.05;
/// Who finds its heading is not farther off than this, in its own σ.
const FARTHEST: f64 = 4.0;

/// Runs all rows.
#[must_use]
pub fn find(form: &Form) -> Finding {
    let title = "Sightings of one another, used both ways (MR.CLAM, the robots' own cameras)";
    rows(form, title, &METHODS, |_, _| ())
}

/// "Not worse" is missed by so large a share, as docs/sensors.md says with what was tried; no more than that is passed over.
const MISSED_BY: f64 = 0.02;

/// The exchange by itself, and fed by tracks. Fed it is worse off if it is so in the mean of the draws, by more than that is uncertain.
#[must_use]
pub fn find_fed(form: &Form) -> Finding {
    let title = "The same with `coloc-track` feeding `colocd`";
    let mut all: Vec<(String, Vec<f64>)> = Vec::new();
    let mut finding = rows(form, title, &FED, |recorded, draws| {
        let off = draws.iter().map(|it| off(it, FED[0].receivers));
        all.push((recorded.title(), off.collect()));
    });
    for pair in all.chunks_exact(2) {
        let (recording, without, fed) = (&pair[0].0, &pair[0].1, &pair[1].1);
        let more: Vec<f64> = fed.iter().zip(without).map(|(a, b)| a - b).collect();
        let ([without, _], [more, uncertain]) = (mean(without), mean(&more));
        let line = format!(
            "recording {recording}: position of those without a receiver {:.2} cm, fed {:.2} ± {:.2} cm more",
            100.0 * without,
            100.0 * more,
            100.0 * uncertain
        );
        let _ = write!(finding.text, "\n* {line}");
        if more > MISSED_BY * without {
            finding.missed.push(line);
        } else if more > 2.0 * uncertain {
            finding.text.push_str(" (MISSED, as is known)");
        }
    }
    finding.text.push('\n');
    finding
}

/// RMS of the position of those without a receiver, in a draw \[m\].
fn off(sums: &[Sums], receivers: usize) -> f64 {
    let squares = sums.iter().skip(receivers).map(|it| {
        let [x, y, _] = it.rms();
        x * x + y * y
    });
    let [mean, _] = mean(&squares.collect::<Vec<_>>());
    mean.sqrt()
}

/// Mean, and its standard error.
#[allow(clippy::cast_precision_loss)] // Some draws.
fn mean(of: &[f64]) -> [f64; 2] {
    let count = of.len() as f64;
    let mean = of.iter().sum::<f64>() / count;
    let squares: f64 = of.iter().map(|it| (it - mean) * (it - mean)).sum();
    [mean, (squares / (count * (count - 1.0))).sqrt()]
}

fn rows(
    form: &Form,
    title: &str,
    methods: &[Method],
    mut each: impl FnMut(&Recorded, &[Vec<Sums>]),
) -> Finding {
    let recordings = match form.recordings(title) {
        Ok(recordings) => recordings,
        Err(finding) => return finding,
    };
    let mut table = Table::new([
        "recording",
        "method",
        "x/y of those without a receiver, cm",
        "φ, rad",
        "outside, R1…R5",
        "all found by, s",
    ]);
    let mut missed = Vec::new();
    let allowed = if form.draws < MANY {
        ALLOWED_OF_FEW
    } else {
        ALLOWED
    };
    for (index, recorded) in recordings.iter().enumerate() {
        for method in methods {
            let draws: Vec<Vec<Sums>> = (0..form.draws)
                .into_par_iter()
                .map(|draw| {
                    let draw = Draw {
                        noise: Noise::new(form.seed, draw),
                        steps: recorded.steps,
                        done: &|_| (),
                    };
                    draw.run(recorded, method)
                })
                .collect();
            let sums = summed(&draws);
            judge(recorded, method, (index, allowed), &sums, &mut missed);
            each(recorded, &draws);
            table.row(row(recorded, method, &sums));
        }
    }
    Finding {
        title: title.into(),
        text: table.text(),
        missed,
    }
}

fn judge(
    recorded: &Recorded,
    method: &Method,
    (index, allowed): (usize, f64),
    sums: &[Sums],
    missed: &mut Vec<String>,
) {
    let reference = method.reference[index];
    if reference.is_empty() {
        return;
    }
    for (robot, sum) in sums.iter().enumerate() {
        let outside = sum.outside / sum.count;
        let name = format!(
            "recording {}, {}, R{}",
            recorded.title(),
            method.name,
            robot + 1
        );
        if sum.lost > 0.0 || sum.farthest > FARTHEST {
            let (lost, off) = (sum.lost, sum.farthest);
            missed.push(format!(
                "{name}: lost in {lost} draws, found {off:.1} σ off at most"
            ));
        }
        if outside > MOST_OUTSIDE {
            missed.push(format!("{name}: outside {}", percent(outside)));
        }
    }
    for (robot, (sum, known)) in sums
        .iter()
        .skip(method.receivers)
        .zip(reference)
        .enumerate()
    {
        let [x, y, _] = sum.rms().map(|it| 100.0 * it);
        if x > allowed * known[0] || y > allowed * known[1] {
            let robot = method.receivers + robot + 1;
            let name = format!("recording {}, {}, R{robot}", recorded.title(), method.name);
            missed.push(format!(
                "{name}: {x:.1}/{y:.1} cm for {}/{}",
                known[0], known[1]
            ));
        }
    }
}

fn row(recorded: &Recorded, method: &Method, sums: &[Sums]) -> [String; 6] {
    let (mut positions, mut headings, mut outside) = (Vec::new(), Vec::new(), Vec::new());
    for sum in sums.iter().skip(method.receivers) {
        let [x, y, phi] = sum.rms();
        positions.push(format!("{:.1}/{:.1}", 100.0 * x, 100.0 * y));
        headings.push(digits(phi));
    }
    for sum in sums {
        outside.push(format!("{:.1}", 100.0 * sum.outside / sum.count));
    }
    let latest_s = sums.iter().fold(0.0, |latest, it| it.latest_s.max(latest));
    let found = if method.lost {
        format!("{latest_s:.0}")
    } else {
        "–".into()
    };
    [
        recorded.title(),
        method.name.into(),
        positions.join(", "),
        headings.join(" "),
        outside.join(" "),
        found,
    ]
}
