//! The bars, and how they are met.

use coloc_calibrate::{Fit, Found, NoFit, Parameter, Robot, bound, fit};
use rayon::prelude::*;

use super::world::{Course, configured, drive};
use crate::campaign::Finding;
use crate::honest::table::{Table, digits, percent};

/// How much of it is done.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Form {
    /// Where all chance comes from.
    pub seed: u64,
    /// Drives of each course.
    pub drives: u16,
}

/// A drive, the truth and what was found.
struct Case {
    truth: Robot,
    fit: Fit,
    /// Of what is shown, in widths.
    bounds: Vec<(Parameter, f64)>,
}

fn case(course: &Course, seed: u64, run: u16) -> Result<Case, NoFit> {
    let (truth, drive) = drive(course, seed, run);
    let fit = fit(&drive, &configured(course), &|_| {})?;
    let shown = fit.found.iter().filter(|it| it.shown);
    let shown: Vec<Parameter> = shown.map(|it| it.parameter).collect();
    let bounds = bound(&drive, &truth, &shown).unwrap_or_default();
    Ok(Case {
        truth,
        fit,
        bounds: shown.into_iter().zip(bounds).collect(),
    })
}

fn cases(course: &Course, form: &Form) -> Vec<Result<Case, NoFit>> {
    let runs = (0..form.drives).into_par_iter();
    runs.map(|run| case(course, form.seed, run)).collect()
}

/// Of one parameter, over drives.
#[derive(Default)]
struct Tally {
    shown: usize,
    inside: usize,
    /// Standard deviations over their bounds.
    ratios: Vec<f64>,
    left: Vec<f64>,
}

impl Tally {
    fn take(&mut self, found: &Found, case: &Case) {
        if !found.shown {
            return;
        }
        let [low, high] = found.interval;
        let truth = found.parameter.of(&case.truth);
        self.shown += 1;
        self.inside += usize::from(low <= truth && truth <= high);
        let of = |it: &&(Parameter, f64)| it.0 == found.parameter;
        self.ratios.extend(
            case.bounds
                .iter()
                .find(of)
                .map(|(_, bound)| found.left / bound),
        );
        self.left.push(found.left);
    }
}

fn median(mut all: Vec<f64>) -> f64 {
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied().unwrap_or(f64::NAN)
}

#[allow(clippy::cast_precision_loss)] // Hundreds.
fn share(part: usize, all: usize) -> f64 {
    part as f64 / all as f64
}

/// Whether intervals hold the truth as often as they say, and are no wider than they must be.
#[must_use]
pub fn coverage(form: &Form) -> Finding {
    let course = Course::whole();
    let cases = cases(&course, form);
    let found: Vec<&Case> = cases.iter().filter_map(|it| it.as_ref().ok()).collect();
    let mut table = Table::new([
        "parameter",
        "shown",
        "inside its 95 % interval",
        "σ over its bound, median",
        "σ after over σ before",
    ]);
    let mut missed = Vec::new();
    if found.len() < cases.len() {
        missed.push(format!(
            "{} drives found nothing",
            cases.len() - found.len()
        ));
    }
    let parameters = found.first().map_or(0, |it| it.fit.found.len());
    for index in 0..parameters {
        let mut tally = Tally::default();
        for case in &found {
            tally.take(&case.fit.found[index], case);
        }
        let parameter = found[0].fit.found[index].parameter;
        let (inside, ratio) = (share(tally.inside, tally.shown), median(tally.ratios));
        table.row([
            parameter.to_string(),
            format!("{} of {}", tally.shown, cases.len()),
            percent(inside),
            digits(ratio),
            digits(median(tally.left)),
        ]);
        if 2 * tally.shown > cases.len() && !form.holds(inside) {
            missed.push(format!("{parameter}: {} inside", percent(inside)));
        }
        if ratio > 1.5 {
            missed.push(format!("{parameter}: {} times its bound", digits(ratio)));
        }
    }
    Finding {
        title: format!("{} drives, each of another robot", form.drives),
        text: table.text(),
        missed,
    }
}

impl Form {
    /// 91 to 98.5 % of 200, and what is as likely of fewer.
    fn holds(&self, share: f64) -> bool {
        let wider = (200.0 / f64::from(self.drives)).sqrt().max(1.0);
        (0.95 - 0.04 * wider..=0.95 + 0.035 * wider).contains(&share)
    }
}

/// Whether what a drive cannot show is refused.
#[must_use]
pub fn refusals(form: &Form) -> Finding {
    let wheels = vec![Parameter::Scale, Parameter::Difference, Parameter::Track];
    let absolute = vec![Parameter::Scale, Parameter::Track, Parameter::GyroScale];
    let all = [
        (Course::straight(), vec![Parameter::Track]),
        (Course::never_still(), vec![Parameter::Standstill]),
        (Course::without_fixes(), absolute),
        (Course::alone(), wheels),
    ];
    let mut table = Table::new(["drive", "cannot show", "refused"]);
    let mut missed = Vec::new();
    for (course, hidden) in all {
        let cases = cases(&course, form);
        for parameter in hidden {
            let refused = |it: &&Result<Case, NoFit>| {
                let found = it
                    .as_ref()
                    .map(|it| it.fit.found.as_slice())
                    .unwrap_or_default();
                found
                    .iter()
                    .any(|it| it.parameter == parameter && !it.shown)
            };
            let refused = cases.iter().filter(refused).count();
            table.row([
                course.name.to_owned(),
                parameter.to_string(),
                format!("{refused} of {}", cases.len()),
            ]);
            if refused < cases.len() {
                missed.push(format!("{}: {parameter} shown", course.name));
            }
        }
    }
    Finding {
        title: format!("{} drives each that cannot show it", form.drives),
        text: table.text(),
        missed,
    }
}
