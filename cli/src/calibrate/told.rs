//! What was found, for people.

use std::fmt::Write as _;

use coloc_calibrate::{Drive, Found, Judgement, Parameter, SampleSize};

use super::read::Recorded;
use crate::eval::table::Table;

/// What is shown, and how surely.
pub(super) fn shown(found: &[Found], recorded: &Recorded, used: &Drive) -> String {
    let mut table = Table::new(
        "What the drive shows",
        &[
            "parameter",
            "unit",
            "before",
            "after",
            "95 % from",
            "to",
            "rests on",
        ],
    );
    for it in found.iter().filter(|it| it.shown) {
        let [low, high] = it.interval;
        let numbers = [it.before, it.after, low, high].map(digits);
        let mut row = vec![
            name(it.parameter, &recorded.sources),
            it.parameter.unit().into(),
        ];
        row.extend(numbers);
        row.push(rests_on(it.parameter, used));
        table.rows.push(row);
    }
    table.text()
}

/// What is not, and which drive would.
pub(super) fn refused(found: &[Found], recorded: &Recorded) -> String {
    let mut table = Table::new(
        "What it does not show; it stays as configured",
        &["parameter", "the drive that shows it"],
    );
    for it in found.iter().filter(|it| !it.shown) {
        let manoeuvre = it.parameter.manoeuvre().to_owned();
        table
            .rows
            .push(vec![name(it.parameter, &recorded.sources), manoeuvre]);
    }
    if table.rows.is_empty() {
        return String::new();
    }
    table.text()
}

/// The parameter, its receiver by the number on the channel.
fn name(parameter: Parameter, sources: &[u16]) -> String {
    let receiver = parameter.receiver().and_then(|it| sources.get(it));
    match receiver {
        Some(source) if sources.len() > 1 => format!("{parameter} (receiver {source})"),
        _ => parameter.to_string(),
    }
}

fn rests_on(parameter: Parameter, used: &Drive) -> String {
    match parameter {
        Parameter::Standstill => format!("{:.0} s of standing", used.stood_s()),
        Parameter::GyroScale | Parameter::GyroBias | Parameter::GyroNoise => "gyro, wheels".into(),
        _ => match parameter.receiver() {
            Some(it) => format!(
                "{} fixes",
                used.fixes().iter().filter(|fix| fix.receiver == it).count()
            ),
            None => format!("{} fixes", used.fixes().len()),
        },
    }
}

/// How much the fixes say.
pub(super) fn samples(sizes: &[SampleSize], sources: &[u16]) -> String {
    let mut text = String::new();
    for (size, source) in sizes.iter().zip(sources) {
        let SampleSize { fixes, effective } = size;
        // A string takes all.
        let _ = writeln!(
            text,
            "The {fixes} fixes of receiver {source} say as much of where it is as {effective:.1} independent ones."
        );
    }
    text
}

/// Before and after, on what was not used.
pub(super) fn judged(before: &Judgement, after: &Judgement, block_s: f64) -> String {
    if after.blocks() == 0 {
        return "The last third has too few fixes to try it on.\n".into();
    }
    let title = format!(
        "The last third, which was not used: {} times {block_s} s by the wheels alone, compared with the fix then",
        after.blocks()
    );
    let mut table = Table::new(
        title,
        &["", "", "NEES, 2 is right", "outside 95 %", "rms [m]"],
    );
    for (name, it) in [("before", before), ("after", after)] {
        table.rows.push(vec![
            name.into(),
            String::new(),
            format!("{:.2}", it.mean_nees()),
            format!("{:.0} %", 100.0 * it.outside()),
            format!("{:.3}", it.rms_m()),
        ]);
    }
    table.text()
}

/// Four digits.
fn digits(value: f64) -> String {
    let size = value.abs();
    if size > 0.0 && !(1e-3..1e4).contains(&size) {
        format!("{value:.2e}")
    } else {
        format!("{value:.4}")
    }
}
