//! To which tracks the sightings belong of which nobody knows whom they show.

use super::{MOST_TRACKS, Manager, Seen, Sighting, Status, Track, Verdict};
use crate::reading::Reading;
use crate::rules::{Rules, distance};

/// Sightings without identity of one stamp; of more no more are looked at.
const MOST_UNKNOWN: usize = 32;

/// How badly each sighting fits each track, `d² + ln det S`; infinite where it does not.
#[derive(Clone, Debug)]
pub(super) struct Unknown {
    costs: [[f64; MOST_TRACKS]; MOST_UNKNOWN],
    d2: [[f64; MOST_TRACKS]; MOST_UNKNOWN],
}

impl Default for Unknown {
    fn default() -> Self {
        Self {
            costs: [[f64::INFINITY; MOST_TRACKS]; MOST_UNKNOWN],
            d2: [[f64::INFINITY; MOST_TRACKS]; MOST_UNKNOWN],
        }
    }
}

impl Unknown {
    /// The pair that fits best: of equal ones the first sighting, then the lowest number.
    fn best(&self, rows: usize, tracks: &[Option<Track>]) -> Option<(usize, usize)> {
        let number = |column: usize| tracks[column].map(|it| it.id);
        let count = tracks.len();
        let pairs = (0..rows).flat_map(|row| (0..count).map(move |column| (row, column)));
        let there = pairs.filter(|&(row, column)| self.costs[row][column] < f64::INFINITY);
        there.min_by(|&(a, b), &(c, d)| {
            let costs = self.costs[a][b].total_cmp(&self.costs[c][d]);
            costs.then(a.cmp(&c)).then(number(b).cmp(&number(d)))
        })
    }

    /// Whether another pair of the same sighting or the same track fits nearly as well.
    fn is_ambiguous(&self, rows: usize, (row, column): (usize, usize), margin: f64) -> bool {
        let limit = self.costs[row][column] + margin;
        let same_sighting = (0..MOST_TRACKS).map(|other| (row, other));
        let same_track = (0..rows).map(|other| (other, column));
        let mut others = same_sighting
            .chain(same_track)
            .filter(|&it| it != (row, column));
        others.any(|(a, b)| self.costs[a][b] <= limit)
    }

    fn drop_sighting(&mut self, row: usize) {
        self.costs[row] = [f64::INFINITY; MOST_TRACKS];
    }

    fn drop_track(&mut self, column: usize) {
        for row in &mut self.costs {
            row[column] = f64::INFINITY;
        }
    }
}

impl<S: AsRef<[Option<Track>]> + AsMut<[Option<Track>]>, R: Rules> Manager<S, R> {
    /// The best pair again and again, unless another is nearly as good.
    pub(super) fn assign(&mut self, image: &[Sighting], tell: &mut impl FnMut(&Sighting, Verdict)) {
        let nth = |row: usize| image.iter().filter(|it| it.is_unknown()).nth(row);
        let rows = self.weigh(image);
        let mut verdicts = [Verdict::Unassigned; MOST_UNKNOWN];
        while let Some((row, column)) = self.unknown.best(rows, self.places()) {
            let is_ambiguous = self
                .unknown
                .is_ambiguous(rows, (row, column), self.config.margin);
            let d2 = self.unknown.d2[row][column];
            self.unknown.drop_sighting(row);
            if is_ambiguous {
                verdicts[row] = Verdict::Ambiguous;
                continue;
            }
            self.unknown.drop_track(column);
            if let Some(sighting) = nth(row) {
                verdicts[row] = self.taken(sighting, column, d2);
            }
        }
        let beyond = core::iter::repeat(Verdict::Unassigned);
        let unknown = image.iter().filter(|it| it.is_unknown());
        for (sighting, verdict) in unknown.zip(verdicts.into_iter().chain(beyond)) {
            tell(sighting, verdict);
        }
    }

    /// How each sighting fits each track, and how many sightings these are.
    fn weigh(&mut self, image: &[Sighting]) -> usize {
        let mut rows = 0;
        for sighting in image.iter().filter(|it| it.is_unknown()).take(MOST_UNKNOWN) {
            for (column, place) in self.tracks.as_ref().iter().take(MOST_TRACKS).enumerate() {
                let fit = place
                    .as_ref()
                    .filter(|it| it.status != Status::Tentative && !it.identified)
                    .and_then(|track| self.fit(sighting, track));
                let (cost, d2) = fit.unwrap_or((f64::INFINITY, f64::INFINITY));
                self.unknown.costs[rows][column] = cost;
                self.unknown.d2[rows][column] = d2;
            }
            rows += 1;
        }
        rows
    }

    fn fit(&self, sighting: &Sighting, track: &Track) -> Option<(f64, f64)> {
        let (sensor, position) = both_numbers(sighting)?;
        let gate = self.config.gates.two;
        let it = distance(&track.state, position, &self.sensors, sensor, gate)?;
        Some((it.d2 + it.log_determinant, it.d2))
    }

    fn taken(&mut self, sighting: &Sighting, column: usize, d2: f64) -> Verdict {
        let (
            Some(track),
            Seen::Neighbour {
                reading, sensor, ..
            },
        ) = (&mut self.tracks.as_mut()[column], &sighting.seen)
        else {
            return Verdict::Unassigned;
        };
        let (sensor, gates) = (usize::from(*sensor), &self.config.gates);
        self.rules
            .update(&mut track.state, reading, &self.sensors, sensor, gates);
        track.accept(sighting.stamp, &self.config);
        Verdict::Accepted { id: track.id, d2 }
    }
}

/// Range, bearing and their white variances.
type Both = (f64, f64, [f64; 2]);

/// Sensor, and range and bearing of a sighting that has both.
fn both_numbers(sighting: &Sighting) -> Option<(usize, Both)> {
    match sighting.seen {
        Seen::Neighbour {
            sensor,
            reading:
                Reading::RangeBearing {
                    range_m,
                    bearing_rad,
                    white,
                },
            ..
        } => Some((usize::from(sensor), (range_m, bearing_rad, white))),
        Seen::Neighbour { .. } | Seen::Reciprocal { .. } => None,
    }
}
