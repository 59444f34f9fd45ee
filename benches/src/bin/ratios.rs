//! Writes the table of `benches/README.md`, or of another file that is named, from what criterion measured last: run
//! `cargo bench -p coloc-benches` first.
//!
//! Ratios are of medians of one run, so that they hold where nanoseconds do not.

#![warn(clippy::print_stdout, clippy::print_stderr)]

use std::error::Error;
use std::fmt::Write;
use std::fs::{read_to_string, write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use coloc_tests::output::{end, print_line};
use serde_json::Value;

const README: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/README.md");
const BEGIN: &str = "<!-- begin of what `ratios` writes -->\n";
const END: &str = "<!-- end of what `ratios` writes -->";

/// Group, function, and what it is divided by.
const ROWS: [(&str, &str, &[&str]); 15] = [
    ("propagate", "coloc", &["floor", "naive"]),
    ("convert", "coloc", &["floor", "naive"]),
    ("split-ci trace", "coloc, middle", &["naive"]),
    ("split-ci trace", "coloc, own all dependent", &["naive"]),
    ("split-ci trace", "coloc, own all independent", &["naive"]),
    ("position fix", "coloc", &["naive"]),
    ("one message", "split-ci", &["nb", "ci", "ei"]),
    ("decode", "two wheels", &[]),
    ("validate", "neighbour", &[]),
    ("daemon, hot", "frames", &[]),
    ("daemon, hot", "4 neighbours and a fix", &[]),
    ("daemon, hot", "and 4 sightings", &[]),
    ("daemon, 500 Hz", "frames", &[]),
    ("daemon, 500 Hz", "4 neighbours and a fix", &[]),
    ("daemon, 500 Hz", "and 4 sightings", &[]),
];

const NEIGHBOURS: [u16; 5] = [0, 1, 4, 16, 64];

fn main() -> ExitCode {
    end("ratios", run().map(|()| ExitCode::SUCCESS))
}

fn run() -> Result<(), Box<dyn Error>> {
    let table = table(&criterion_directory())?;
    print_line(table.trim_end());
    let path = std::env::args_os().nth(1).unwrap_or_else(|| README.into());
    let trouble = |error| format!("{}: {error}", Path::new(&path).display());
    let readme = read_to_string(&path).map_err(trouble)?;
    let (before, rest) = readme
        .split_once(BEGIN)
        .ok_or("README.md has lost its marks")?;
    let (_, after) = rest.split_once(END).ok_or("README.md has lost its marks")?;
    write(&path, format!("{before}{BEGIN}{table}{END}{after}")).map_err(trouble)?;
    Ok(())
}

fn criterion_directory() -> PathBuf {
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../target"),
        PathBuf::from,
    );
    target.join("criterion")
}

fn table(directory: &Path) -> Result<String, Box<dyn Error>> {
    let mut text = String::new();
    writeln!(text, "| function | median | beside |\n| --- | --- | --- |")?;
    for (group, function, others) in ROWS {
        let own = median_ns(directory, &[group, function])?;
        let mut beside = Vec::new();
        for other in others {
            let ratio = own / median_ns(directory, &[group, other])?;
            beside.push(if ratio < 1.0 {
                format!("{other}: {:.1} times faster", 1.0 / ratio)
            } else {
                format!("{other}: {ratio:.2} times as long")
            });
        }
        writeln!(
            text,
            "| {group}, {function} | {own:.0} ns | {} |",
            beside.join("; ")
        )?;
    }
    let points = NEIGHBOURS.map(|count| {
        Ok((
            f64::from(count),
            median_ns(directory, &["tick", "neighbours", &count.to_string()])?,
        ))
    });
    let points: Vec<(f64, f64)> = points.into_iter().collect::<Result<_, Box<dyn Error>>>()?;
    for (count, median) in &points {
        writeln!(text, "| step, {count} neighbours | {median:.0} ns | |")?;
    }
    let (slope, intercept) = line(&points);
    let (of_4, of_64) = (points[2].1, points[4].1);
    writeln!(
        text,
        "\nA step costs {intercept:.0} ns and {slope:.0} ns for each neighbour; 64 neighbours cost {:.1} times what 4 do.\n",
        of_64 / of_4
    )?;
    writeln!(text, "Machine: {}.", machine())?;
    Ok(text)
}

fn median_ns(directory: &Path, names: &[&str]) -> Result<f64, Box<dyn Error>> {
    let path = names
        .iter()
        .fold(directory.to_owned(), |path, name| path.join(name));
    let path = path.join("new/estimates.json");
    let text = read_to_string(&path).map_err(|error| {
        format!(
            "{}: {error}; run `cargo bench -p coloc-benches`",
            path.display()
        )
    })?;
    let estimates: Value = serde_json::from_str(&text)?;
    let median = estimates["median"]["point_estimate"].as_f64();
    Ok(median.ok_or_else(|| format!("{}: no median", path.display()))?)
}

/// Slope and intercept by least squares of relative errors, so that the smallest count counts as much as the largest.
fn line(points: &[(f64, f64)]) -> (f64, f64) {
    let sum = |f: fn(f64, f64) -> f64| points.iter().map(|&(x, y)| f(x, y) / (y * y)).sum::<f64>();
    let (one, x, y) = (sum(|_, _| 1.0), sum(|x, _| x), sum(|_, y| y));
    let (xx, xy) = (sum(|x, _| x * x), sum(|x, y| x * y));
    let slope = (one * xy - x * y) / (one * xx - x * x);
    (slope, (y - slope * x) / one)
}

fn machine() -> String {
    let line = |path: &str, key: &str| {
        let text = read_to_string(path).unwrap_or_default();
        let line = text
            .lines()
            .find(|line| line.starts_with(key))
            .unwrap_or("unknown")
            .to_owned();
        line.rsplit(": ").next().unwrap_or_default().to_owned()
    };
    format!(
        "{} × {}, Linux {}, load {}",
        std::thread::available_parallelism().map_or(1, usize::from),
        line("/proc/cpuinfo", "model name"),
        line("/proc/sys/kernel/osrelease", ""),
        line("/proc/loadavg", "")
    )
}
