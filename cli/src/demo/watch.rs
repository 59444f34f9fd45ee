//! Listening to what every daemon publishes, and comparing it with the truth at the moment it speaks of.

use std::path::PathBuf;
use std::sync::Arc;

use coloc_estimator::Pose;
use coloc_shm_types::{
    Clock, Estimate, Message, RelativePose, RobotName, Sighting, Space, Status, Subscriber, Timing,
};

use super::clock::{wall_ahead_ns, world_time_s};
use super::record::Record;
use super::robot_file::name;
use super::scene::Eyes;
use super::wheels::WheelsAlone;
use super::world::Stage;
use super::{DemoError, spaces};
use crate::comparison::{Comparison, Moment, nees};

/// Everybody's estimates and counters.
pub(crate) struct Watch {
    stage: Arc<Stage>,
    /// Each robot's.
    spaces: Vec<Space>,
    /// By how much stamps of the shared clock are ahead of the demo's \[ns\].
    wall_ahead_ns: i64,
    ears: Vec<Ears>,
    records: Vec<Record>,
    /// The world runs from 0 to this \[s\].
    seconds: f64,
}

struct Ears {
    estimates: Subscriber<Estimate>,
    timings: Subscriber<Timing>,
    statuses: Subscriber<Status>,
    /// What its coloc-laser finds, if it has one.
    found: Option<(Subscriber<RelativePose>, Subscriber<Sighting>)>,
    wheels: WheelsAlone,
}

impl Watch {
    /// Listens to every robot of the stage.
    pub(crate) fn open(
        stage: Arc<Stage>,
        roots: &[PathBuf],
        seconds: f64,
    ) -> Result<Self, DemoError> {
        let spaces = spaces::enter(roots, "coloc-demo-watch")?;
        let ears = spaces
            .iter()
            .enumerate()
            .map(|(robot, space)| Ears::open(space, robot, stage.eyes()))
            .collect::<Result<Vec<_>, _>>()?;
        let records = ears.iter().map(|_| Record::new()).collect();
        Ok(Self {
            stage,
            spaces,
            ears,
            wall_ahead_ns: wall_ahead_ns(),
            records,
            seconds,
        })
    }

    /// Takes in whatever was published since the last call. `start_ns` is when the world started, if it has.
    pub(crate) fn listen(&mut self, start_ns: Option<i64>) -> Result<(), DemoError> {
        let period_ns = self.stage.step_ns().unsigned_abs();
        for (robot, (ears, record)) in self.ears.iter_mut().zip(&mut self.records).enumerate() {
            let wall_ahead_ns = self.wall_ahead_ns;
            while let Some(mut estimate) = ears.estimates.receive().map_err(DemoError::shm)? {
                by_own_clock(&mut estimate, wall_ahead_ns);
                let comparison = start_ns.and_then(|start_ns| {
                    compare(&self.stage, self.seconds, robot, &estimate, start_ns)
                });
                let moment = comparison.map(|comparison| Moment {
                    comparison,
                    covariance: of_place(&estimate),
                    nees: nees(comparison.error(), &estimate.total()),
                    state: estimate.state(),
                    by_wheels: ears.wheels.follow(&estimate, &comparison.truth),
                });
                record.hear_estimate(&estimate, moment);
            }
            while let Some(mut timing) = ears.timings.receive().map_err(DemoError::shm)? {
                by_own_clock(&mut timing, wall_ahead_ns);
                record.hear_timing(&timing, period_ns);
            }
            while let Some(mut status) = ears.statuses.receive().map_err(DemoError::shm)? {
                by_own_clock(&mut status, wall_ahead_ns);
                if let Some(start_ns) = start_ns {
                    let time_s = world_time_s(status.header.stamp_ns, start_ns);
                    let rows = status.sources().filter(|(_, row)| row.is_against());
                    rows.for_each(|(input, row)| record.hear_against((input, row.source), time_s));
                    if self.stage.is_cut(time_s) {
                        record.told.pass_over();
                    } else {
                        record.told.hear_status(&status, time_s);
                    }
                }
                record.hear_status(&status);
            }
            if let (Some(found), Some(start_ns)) = (&ears.found, start_ns) {
                hear_found(found, record, start_ns)?;
            }
        }
        Ok(())
    }

    /// What was heard, in the order of the robots.
    pub(crate) fn records(&self) -> &[Record] {
        &self.records
    }

    /// Whether every robot has been heard.
    pub(crate) fn all_heard(&self) -> bool {
        self.records.iter().all(|record| record.latest.is_some())
    }

    /// How every file of each robot's space in `/dev/shm` begins.
    pub(crate) fn full_prefixes(&self) -> Vec<String> {
        let prefixes = self
            .spaces
            .iter()
            .map(|space| space.full_prefix().to_owned());
        prefixes.collect()
    }

    /// Stops listening; what was heard remains.
    pub(crate) fn close(self) -> Vec<Record> {
        self.records
    }
}

impl Ears {
    fn open(space: &Space, robot: usize, eyes: &Eyes) -> Result<Self, DemoError> {
        let robot = RobotName::new(&name(robot + 1)).map_err(DemoError::shm)?;
        let found = match eyes {
            Eyes::Scans(_) => Some((
                space.subscriber(&robot).map_err(DemoError::shm)?,
                space.subscriber(&robot).map_err(DemoError::shm)?,
            )),
            Eyes::Poses | Eyes::Camera(_) => None,
        };
        Ok(Self {
            found,
            estimates: space.subscriber(&robot).map_err(DemoError::shm)?,
            timings: space.subscriber(&robot).map_err(DemoError::shm)?,
            statuses: space.subscriber(&robot).map_err(DemoError::shm)?,
            wheels: WheelsAlone::default(),
        })
    }
}

/// Which robots a coloc-laser has found, with or without a heading.
fn hear_found(
    (poses, parts): &(Subscriber<RelativePose>, Subscriber<Sighting>),
    record: &mut Record,
    start_ns: i64,
) -> Result<(), DemoError> {
    let mut note = |stamp_ns, observed: u16| {
        let robot = usize::from(observed).saturating_sub(1);
        record.hear_seen(world_time_s(stamp_ns, start_ns), robot);
    };
    while let Some(it) = poses.receive().map_err(DemoError::shm)? {
        note(it.header.stamp_ns, it.observed);
    }
    while let Some(it) = parts.receive().map_err(DemoError::shm)? {
        note(it.header.stamp_ns, it.observed);
    }
    Ok(())
}

/// The stamp by the demo's clock, where it is of the shared one.
fn by_own_clock<M: Message>(message: &mut M, wall_ahead_ns: i64) {
    let header = message.header_mut();
    if header.clock() == Ok(Clock::Realtime) {
        header.stamp_ns = header.stamp_ns.saturating_sub(wall_ahead_ns);
        header.clock = Clock::Boottime as u8;
    }
}

/// `None` before the world starts, after it ends, and where nobody knows the truth.
fn compare(
    stage: &Stage,
    seconds: f64,
    robot: usize,
    estimate: &Estimate,
    start_ns: i64,
) -> Option<Comparison> {
    let time_s = world_time_s(estimate.header.stamp_ns, start_ns);
    if !(0.0..=seconds).contains(&time_s) {
        return None;
    }
    let [x, y, phi] = estimate.pose;
    Some(Comparison {
        time_s,
        truth: stage.truth_at(robot, time_s)?,
        estimate: Pose::new(x, y, phi),
        sigma: sigma(estimate),
    })
}

/// Standard deviations of x, y, φ.
pub(crate) fn sigma(estimate: &Estimate) -> [f64; 3] {
    let total = estimate.total();
    [0, 4, 8].map(|diagonal| total[diagonal].max(0.0).sqrt())
}

/// `[xx, xy, yy]` of the covariance.
fn of_place(estimate: &Estimate) -> [f64; 3] {
    let total = estimate.total();
    [0, 1, 4].map(|entry| total[entry])
}
