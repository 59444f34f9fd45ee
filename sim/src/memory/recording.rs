//! The recorded car of Victoria Park.

use std::fmt;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use flate2::read::GzDecoder;

/// Three numbers a line, the first of them seconds.
pub(super) type Row = [f64; 3];

/// What was recorded.
pub(super) struct Recording {
    /// Time \[s\], speed of the rear left wheel \[m/s\], steering \[rad\].
    pub(super) wheels: Vec<Row>,
    /// Time \[s\], east and north \[m\].
    pub(super) fixes: Vec<Row>,
}

impl Recording {
    /// Reads it.
    pub(super) fn read(folder: &Path) -> Result<Self, String> {
        let rows = |name: &str| {
            let path = folder.join("victoria_park").join(name);
            rows(&path).map_err(|error| format!("{}: {error}", path.display()))
        };
        Ok(Self {
            wheels: rows("dr.csv.gz")?,
            fixes: rows("gps.csv.gz")?,
        })
    }
}

fn rows(path: &Path) -> Result<Vec<Row>, String> {
    let said = |error: &dyn fmt::Display| error.to_string();
    let file = File::open(path).map_err(|error| said(&error))?;
    let mut rows: Vec<Row> = Vec::new();
    for (line, number) in BufReader::new(GzDecoder::new(file))
        .lines()
        .skip(1)
        .zip(2..)
    {
        let line = line.map_err(|error| said(&error))?;
        let row = row(&line).ok_or_else(|| format!("line {number} is not three numbers"))?;
        if rows.last().is_some_and(|last| last[0] >= row[0]) {
            return Err(format!("line {number} is not later than the one before"));
        }
        rows.push(row);
    }
    Ok(rows)
}

fn row(line: &str) -> Option<Row> {
    let numbers: Option<Vec<f64>> = line.split(',').map(|it| it.trim().parse().ok()).collect();
    let row: Row = numbers?.try_into().ok()?;
    row.iter().all(|it| it.is_finite()).then_some(row)
}
