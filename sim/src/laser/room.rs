//! Recorded rooms, one scan each.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use coloc_scan::View;
use coloc_scan::carmen::{FrontLaser, Line};
use coloc_scan::view::Met;
use flate2::read::MultiGzDecoder;

/// A room as one scan of a scanner has it.
#[derive(Clone, Debug)]
pub(super) struct Room {
    /// Of the first beam \[rad\].
    pub(super) angle_min: f64,
    /// From one beam to the next \[rad\].
    pub(super) step: f64,
    /// What each beam met, infinite where it met nothing \[m\].
    pub(super) ranges: Vec<f64>,
    /// Where they ended.
    points: Vec<[f64; 2]>,
}

/// The surface goes on between two beams whose ranges differ by no more, for each metre \[m\].
const GOES_ON: f64 = 0.1;

impl Room {
    fn of(view: &View<'_>) -> Self {
        let raw = view.raw();
        let range = |place| match view.met(place) {
            Met::Surface(range) => range,
            Met::Nothing | Met::Unknown => f64::INFINITY,
        };
        Self::new(
            raw.angle_min_rad.into(),
            raw.angle_increment_rad.into(),
            (0..raw.ranges.len()).map(range).collect(),
        )
    }

    fn new(angle_min: f64, step: f64, ranges: Vec<f64>) -> Self {
        let mut angle = angle_min - step;
        let point = |range: &f64| {
            angle += step;
            [range * angle.cos(), range * angle.sin()]
        };
        let points = ranges.iter().map(point).filter(|it| it[0].is_finite());
        Self {
            points: points.collect(),
            angle_min,
            step,
            ranges,
        }
    }

    /// The same room, as a scanner with so many times as many beams would have it.
    pub(super) fn finer(&self, times: u32) -> Self {
        let mut ranges = Vec::new();
        for pair in self.ranges.windows(2) {
            let goes_on = (pair[0] - pair[1]).abs() <= GOES_ON * pair[0].min(pair[1]);
            for part in 0..times {
                let part = f64::from(part) / f64::from(times);
                ranges.push(match () {
                    () if goes_on => pair[0] + part * (pair[1] - pair[0]),
                    () if part < 0.5 => pair[0],
                    () => pair[1],
                });
            }
        }
        Self::new(self.angle_min, self.step / f64::from(times), ranges)
    }

    /// Of the beam in that place \[rad\].
    #[allow(clippy::cast_precision_loss)] // Some hundreds.
    pub(super) fn angle(&self, place: usize) -> f64 {
        self.angle_min + place as f64 * self.step
    }

    /// How far the room goes into a direction; none beyond what was scanned.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // Checked before.
    pub(super) fn range(&self, angle: f64) -> Option<f64> {
        let place = ((angle - self.angle_min) / self.step).round();
        (place >= 0.0)
            .then_some(place as usize)
            .and_then(|it| self.ranges.get(it).copied())
    }

    /// The points that the scan has of it.
    pub(super) fn points(&self) -> &[[f64; 2]] {
        &self.points
    }
}

/// A recording's rooms.
pub(super) struct Recording {
    pub(super) name: String,
    pub(super) rooms: Vec<Room>,
}

/// All recordings of a folder, in the order of their names.
pub(super) fn read_all(folder: &Path) -> Result<Vec<Recording>, String> {
    let said = |error: std::io::Error| format!("{}: {error}", folder.display());
    let mut paths = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(said)? {
        let path = entry.map_err(said)?.path();
        let name = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        if let Some(name) = name.strip_suffix(".log.gz") {
            paths.push((name.to_owned(), path));
        }
    }
    paths.sort();
    let read = |(name, path): &(String, PathBuf)| {
        let rooms = read(path)?;
        Ok(Recording {
            name: name.clone(),
            rooms,
        })
    };
    paths.iter().map(read).collect()
}

fn read(path: &Path) -> Result<Vec<Room>, String> {
    let said = |error: std::io::Error| format!("{}: {error}", path.display());
    let file = File::open(path).map_err(said)?;
    let mut rooms = Vec::new();
    let mut scan = FrontLaser::default();
    for (line, number) in BufReader::new(MultiGzDecoder::new(file)).lines().zip(1..) {
        match scan.read(&line.map_err(said)?) {
            Line::Scan => {
                let view = View::check(scan.raw());
                let view = view.map_err(|error| format!("{}:{number}: {error}", path.display()))?;
                rooms.push(Room::of(&view));
            }
            Line::Other => {}
            Line::Broken => return Err(format!("{}:{number} is no scan", path.display())),
        }
    }
    Ok(rooms)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_finer_scan_has_the_same_walls_and_jumps_where_they_do() {
        let room = Room::new(0.0, 0.1, vec![1.0, 1.05, 3.0, f64::INFINITY]);
        let finer = room.finer(2);
        assert_eq!(finer.ranges[..4], [1.0, 1.025, 1.05, 3.0]);
        assert_eq!(finer.range(0.05), Some(1.025));
        assert_eq!((finer.range(-0.1), finer.range(1.0)), (None, None));
        assert_eq!(finer.points().len(), 5);
    }
}
