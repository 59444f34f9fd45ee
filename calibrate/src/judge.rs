//! Whether a robot explains a part of a drive that it was not fitted to: fixes are withheld for a while, and the fix at the end
//! is compared with where the wheels alone have taken the robot.

use coloc_estimator::{Belief, Covariance3, Pose, honest};

use crate::drive::{Drive, Fix};
use crate::filter::{Filter, Innovation};
use crate::likelihood::Along;
use crate::robot::{Robot, Step};

/// χ² of two degrees of freedom at 95 %.
const OUTSIDE: f64 = 5.991_464_547_107_979;

/// How a robot did without fixes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Judgement {
    /// Squared distance from the fix at the end of each block, normalised: 2 on the average if all is as it says.
    pub nees: Vec<f64>,
    /// The same distances \[m\].
    pub off_m: Vec<f64>,
}

impl Judgement {
    /// Of blocks of `block_s` from `from_s` on.
    #[must_use]
    pub fn of(drive: &Drive, robot: &Robot, from_s: f64, block_s: f64) -> Self {
        let steps: Vec<Step> = drive.ways().iter().map(|way| robot.step(way)).collect();
        let mut filter = Filter::new(robot, drive);
        let mut alone: Option<(f64, Filter<'_>)> = None;
        let mut judgement = Self::default();
        let mut last_s = drive.begin_s();
        let along = Along::new(drive, robot, &steps);
        along.each(&mut filter, |filter, event| {
            let fix = &drive.fixes()[event.fix];
            if let Some((_, alone)) = &mut alone {
                follow(alone, drive, &steps, [last_s, event.time_s]);
            }
            last_s = event.time_s;
            let due = |(began_s, _): &(f64, Filter<'_>)| event.time_s - began_s >= block_s;
            if let Some((_, mut alone)) = alone.take_if(|it| due(it)) {
                judgement.add(&mut alone, fix, event.time_s);
            }
            // What it cannot take in, it goes on without.
            let _ = filter.correct(fix, event.time_s);
            if alone.is_none() && event.time_s >= from_s {
                alone = Some((event.time_s, filter.clone()));
            }
        });
        judgement
    }

    fn add(&mut self, alone: &mut Filter<'_>, fix: &Fix, time_s: f64) {
        let innovation: Innovation = alone.foresee(fix, time_s);
        if let Some(squared) = innovation.squared() {
            let [x, y] = innovation.off;
            self.nees.push(squared);
            self.off_m.push(libm::hypot(x, y));
        }
    }

    /// How many blocks there were.
    #[must_use]
    pub fn blocks(&self) -> usize {
        self.nees.len()
    }

    /// Mean of the normalised squared errors.
    #[must_use]
    pub fn mean_nees(&self) -> f64 {
        mean(&self.nees)
    }

    /// The part of the blocks outside of the ellipse for 95 %.
    #[must_use]
    pub fn outside(&self) -> f64 {
        let outside: Vec<f64> = self
            .nees
            .iter()
            .map(|it| f64::from(u8::from(*it > OUTSIDE)))
            .collect();
        mean(&outside)
    }

    /// Root mean square of the distances \[m\].
    #[must_use]
    pub fn rms_m(&self) -> f64 {
        let squares: Vec<f64> = self.off_m.iter().map(|it| it * it).collect();
        mean(&squares).sqrt()
    }
}

fn mean(all: &[f64]) -> f64 {
    let count = f64::from(u32::try_from(all.len()).unwrap_or(u32::MAX));
    all.iter().sum::<f64>() / count
}

/// Takes a filter from one moment to another by the wheels alone.
fn follow(filter: &mut Filter<'_>, drive: &Drive, steps: &[Step], [from_s, to_s]: [f64; 2]) {
    let first = drive.ways().partition_point(|way| way.end_s <= from_s);
    for (way, step) in drive.ways().iter().zip(steps).skip(first) {
        if way.start_s >= to_s {
            break;
        }
        let length_s = way.end_s.min(to_s) - way.start_s.max(from_s);
        if length_s > 0.0 {
            filter.advance(step, length_s / (way.end_s - way.start_s));
        }
    }
}

/// Where the wheels alone take a robot that is at `pose`, from one moment to another.
#[must_use]
pub fn dead_reckoning(drive: &Drive, robot: &Robot, [from_s, to_s]: [f64; 2], pose: Pose) -> Pose {
    let mut belief = Belief::independent(pose, Covariance3::ZERO);
    for way in drive.ways() {
        let length_s = way.end_s.min(to_s) - way.start_s.max(from_s);
        if length_s > 0.0 {
            let increments = robot
                .step(way)
                .certain(length_s / (way.end_s - way.start_s));
            belief = honest::advance(&belief, &increments).belief;
        }
    }
    belief.pose
}
