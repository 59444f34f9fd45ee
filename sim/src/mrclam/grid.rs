//! A recording on a 50 Hz grid.

use coloc_estimator::Pose;
use coloc_estimator::angle::wrap;

use super::recording::{OdometryRow, Recording, RobotRecord, TruthRow};
use crate::world::World;

/// Step of the grid.
const DT_S: f64 = 0.02;

/// Truth is not interpolated over longer silences of the tracking system: a straight line is not where it was.
const LONGEST_TRUTH_GAP_S: f64 = 0.5;

/// Rows this close to a moment of the grid are taken as they are: the files round to 1 ms, the grid to 0.2 µs.
const SAME_TIME_S: f64 = 1e-5;

/// A recording at 50 Hz: a [`World`].
#[derive(Clone, Debug)]
pub struct GridWorld {
    start_s: f64,
    steps: usize,
    robots: Vec<RobotGrid>,
}

#[derive(Clone, Debug)]
struct RobotGrid {
    number: u32,
    odometry: Vec<[f64; 2]>,
    truth: Vec<Option<Pose>>,
}

impl Recording {
    /// Puts the recording on a 50 Hz grid.
    ///
    /// Odometry comes from the `_50Hz` files if every robot has one. Otherwise it is made as the collection's
    /// own sampler does: linear interpolation, zero before the first and from the last row on. The true pose is
    /// interpolated along the shorter arc; before the first row the robot stands where it will be found, in
    /// gaps longer than half a second and after the last row nobody knows.
    #[must_use]
    pub fn resample(&self) -> GridWorld {
        self.resample_bridging(LONGEST_TRUTH_GAP_S)
    }

    /// [`Self::resample`] with the truth interpolated over gaps of up to `longest_gap_s`.
    #[must_use]
    pub fn resample_bridging(&self, longest_gap_s: f64) -> GridWorld {
        let (start_s, steps) = self.given_grid().unwrap_or_else(|| self.spanning_grid());
        let robots = self
            .robots
            .iter()
            .map(|robot| RobotGrid::new(robot, start_s, steps, longest_gap_s))
            .collect();
        GridWorld {
            start_s,
            steps,
            robots,
        }
    }

    fn given_grid(&self) -> Option<(f64, usize)> {
        let grids = self
            .robots
            .iter()
            .map(|robot| robot.odometry_50hz.as_deref());
        let grids: Vec<&[OdometryRow]> = grids.collect::<Option<_>>()?;
        let first = grids.first()?;
        let start_s = first.first()?.time_s;
        let same = grids
            .iter()
            .all(|grid| grid.len() == first.len() && is_grid(grid, start_s));
        same.then_some((start_s, first.len()))
    }

    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // A recording is hours at most.
    fn spanning_grid(&self) -> (f64, usize) {
        let odometry = self
            .robots
            .iter()
            .flat_map(|robot| [robot.odometry.first(), robot.odometry.last()]);
        let truth = self
            .robots
            .iter()
            .flat_map(|robot| [robot.truth.first(), robot.truth.last()]);
        let odometry = odometry.flatten().map(|row| row.time_s);
        let times = odometry.chain(truth.flatten().map(|row| row.time_s));
        let (start, end) = times.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), time| {
            (low.min(time), high.max(time))
        });
        let steps = ((end - start) / DT_S + SAME_TIME_S).floor();
        (
            start,
            if steps.is_finite() {
                steps.clamp(0.0, 1e8) as usize + 1
            } else {
                0
            },
        )
    }
}

fn is_grid(rows: &[OdometryRow], start_s: f64) -> bool {
    rows.iter()
        .enumerate()
        .all(|(step, row)| (row.time_s - moment(start_s, step)).abs() < 1e-3)
}

#[allow(clippy::cast_precision_loss)] // Steps are far below 2^53.
fn moment(start_s: f64, step: usize) -> f64 {
    start_s + step as f64 * DT_S
}

impl RobotGrid {
    fn new(record: &RobotRecord, start_s: f64, steps: usize, longest_gap_s: f64) -> Self {
        let given = record
            .odometry_50hz
            .as_ref()
            .filter(|rows| rows.len() == steps && is_grid(rows, start_s));
        let odometry = given.map_or_else(
            || {
                resample(
                    &record.odometry,
                    |row| row.time_s,
                    start_s,
                    steps,
                    odometry_between,
                )
            },
            |rows| rows.iter().map(|row| row.velocity).collect(),
        );
        let truth = resample(
            &record.truth,
            |row| row.time_s,
            start_s,
            steps,
            |between| truth_between(between, longest_gap_s),
        );
        Self {
            number: record.number,
            odometry,
            truth,
        }
    }
}

impl RobotRecord {
    /// Where the robot is at `time_s`, interpolated as in [`Recording::resample`].
    #[must_use]
    pub fn truth_at(&self, time_s: f64) -> Option<Pose> {
        let value = |between: Between<'_, TruthRow>| truth_between(between, LONGEST_TRUTH_GAP_S);
        resample(&self.truth, |row| row.time_s, time_s, 1, value).pop()?
    }
}

/// What a moment lies between.
#[derive(Copy, Clone)]
enum Between<'a, R> {
    Before(&'a R),
    /// The two rows around it and how far it is from the first to the second.
    Rows(&'a R, &'a R, f64),
    After,
}

fn resample<R, T>(
    rows: &[R],
    time_s: impl Fn(&R) -> f64,
    start_s: f64,
    steps: usize,
    value: impl Fn(Between<'_, R>) -> T,
) -> Vec<T> {
    let mut next = 0;
    let mut at = |step| {
        let now = moment(start_s, step);
        next += rows[next..]
            .iter()
            .take_while(|row| time_s(row) <= now + SAME_TIME_S)
            .count();
        let (Some(after), Some(before)) = (rows.get(next), rows[..next].last()) else {
            return value(match (rows.first(), rows.last()) {
                (Some(first), _) if next == 0 => Between::Before(first),
                (_, Some(last)) if (time_s(last) - now).abs() <= SAME_TIME_S => {
                    Between::Rows(last, last, 0.0)
                }
                _ => Between::After,
            });
        };
        let part = (now - time_s(before)) / (time_s(after) - time_s(before));
        value(Between::Rows(
            before,
            after,
            if now - time_s(before) <= SAME_TIME_S {
                0.0
            } else {
                part
            },
        ))
    };
    (0..steps).map(&mut at).collect()
}

fn odometry_between(between: Between<'_, OdometryRow>) -> [f64; 2] {
    match between {
        Between::Rows(a, b, part) => {
            [0, 1].map(|i| a.velocity[i] + part * (b.velocity[i] - a.velocity[i]))
        }
        Between::Before(_) | Between::After => [0.0; 2],
    }
}

fn truth_between(between: Between<'_, TruthRow>, longest_gap_s: f64) -> Option<Pose> {
    match between {
        Between::Before(first) => Some(pose(first)),
        Between::Rows(row, _, 0.0) => Some(pose(row)),
        Between::Rows(a, b, part) if b.time_s - a.time_s <= longest_gap_s => {
            Some(interpolate(a, b, part))
        }
        Between::Rows(..) | Between::After => None,
    }
}

fn pose(row: &TruthRow) -> Pose {
    let [x, y, phi] = row.pose;
    Pose::new(x, y, phi)
}

fn interpolate(a: &TruthRow, b: &TruthRow, part: f64) -> Pose {
    let [x, y] = [0, 1].map(|i| a.pose[i] + part * (b.pose[i] - a.pose[i]));
    Pose::new(x, y, a.pose[2] + part * wrap(b.pose[2] - a.pose[2]))
}

impl GridWorld {
    /// Time of step 0, seconds since 1970.
    #[must_use]
    pub fn start_s(&self) -> f64 {
        self.start_s
    }

    /// Time of `step`, seconds since 1970.
    #[must_use]
    pub fn time_s(&self, step: usize) -> f64 {
        moment(self.start_s, step)
    }

    /// The number that the robot has in the recording's file names.
    #[must_use]
    pub fn number(&self, robot: usize) -> Option<u32> {
        self.robots.get(robot).map(|robot| robot.number)
    }
}

impl World for GridWorld {
    fn dt_s(&self) -> f64 {
        DT_S
    }

    fn steps(&self) -> usize {
        self.steps
    }

    fn robots(&self) -> usize {
        self.robots.len()
    }

    fn truth(&self, step: usize, robot: usize) -> Option<Pose> {
        *self.robots.get(robot)?.truth.get(step)?
    }

    fn odometry(&self, step: usize, robot: usize) -> [f64; 2] {
        self.robots
            .get(robot)
            .and_then(|robot| robot.odometry.get(step))
            .copied()
            .unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::f64::consts::PI;

    use super::*;

    fn recording(odometry: &[[f64; 3]], truth: &[[f64; 4]]) -> Recording {
        let odometry = odometry
            .iter()
            .map(|&[time_s, v, w]| OdometryRow {
                time_s,
                velocity: [v, w],
            })
            .collect();
        let truth = truth
            .iter()
            .map(|&[time_s, x, y, phi]| TruthRow {
                time_s,
                pose: [x, y, phi],
            })
            .collect();
        let robot = RobotRecord {
            number: 1,
            odometry,
            odometry_50hz: None,
            truth,
            measurements: Vec::new(),
        };
        Recording {
            robots: vec![robot],
            barcodes: BTreeMap::new(),
            landmarks: Vec::new(),
        }
    }

    #[test]
    fn velocities_are_interpolated_and_zero_outside() {
        let world = recording(
            &[[0.03, 1.0, 0.0], [0.07, 2.0, 4.0]],
            &[[0.0; 4], [0.1, 0.0, 0.0, 0.0]],
        )
        .resample();
        let velocities: Vec<[f64; 2]> = (0..world.steps())
            .map(|step| world.odometry(step, 0))
            .collect();
        assert_eq!(velocities.len(), 6);
        for (found, expected) in velocities.iter().zip([0.0, 0.0, 1.25, 1.75, 0.0, 0.0]) {
            assert!((found[0] - expected).abs() < 1e-12, "{velocities:?}");
        }
    }

    #[test]
    fn headings_take_the_shorter_arc() {
        let world = recording(
            &[[0.0; 3]],
            &[[0.0, 0.0, 0.0, PI - 0.1], [0.04, 2.0, 0.0, -PI + 0.1]],
        )
        .resample();
        let middle = world.truth(1, 0).expect("between two rows");
        assert!((middle.x - 1.0).abs() < 1e-12);
        assert!((middle.phi.abs() - PI).abs() < 1e-12);
    }

    #[test]
    fn nobody_knows_in_long_gaps_and_after_the_end() {
        let truth = [
            [0.1, 1.0, 0.0, 0.0],
            [0.2, 1.0, 0.0, 0.0],
            [0.9, 9.0, 0.0, 0.0],
        ];
        let world = recording(&[[0.0; 3], [2.0, 0.0, 0.0]], &truth).resample();
        assert!(
            world.truth(0, 0).is_some(),
            "before the first row it stands there already"
        );
        assert!(world.truth(10, 0).is_some());
        assert!(
            (11..45).all(|step| world.truth(step, 0).is_none()),
            "0.7 s without tracking"
        );
        assert!(world.truth(45, 0).is_some());
        assert!((46..world.steps()).all(|step| world.truth(step, 0).is_none()));
    }
}
