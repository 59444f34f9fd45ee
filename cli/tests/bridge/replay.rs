//! The recordings of a team, gone through again in one process by what `coloc eval` runs as `coloc-step`.

use std::collections::BTreeMap;

use coloc_daemon::estimate::settings;
use coloc_daemon::record::{RecordedTick, Recording, Step};
use coloc_estimator::{
    Belief, Decision, FindingState, Measurement, NeighbourPose, RobotId, Sighting, Stamp,
};
use coloc_shm_types::Estimate;
use coloc_sim::{Fleet, Letter};

use crate::team::{ROBOTS, Team};

/// An estimate, compared bit for bit.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) struct Published {
    pub(crate) stamp_ns: i64,
    pose: [u64; 3],
    independent: [u64; 9],
    dependent: [u64; 9],
}

impl Published {
    pub(crate) fn new(stamp: Stamp, belief: &Belief) -> Self {
        let parts = &belief.parts;
        Self {
            stamp_ns: stamp.as_nanos(),
            pose: [belief.pose.x, belief.pose.y, belief.pose.phi].map(f64::to_bits),
            independent: parts.independent.to_row_major().map(f64::to_bits),
            dependent: parts.dependent.to_row_major().map(f64::to_bits),
        }
    }

    pub(crate) fn heard(estimate: &Estimate) -> Self {
        Self {
            stamp_ns: estimate.header.stamp_ns,
            pose: estimate.pose.map(f64::to_bits),
            independent: estimate.independent.map(f64::to_bits),
            dependent: estimate.dependent.map(f64::to_bits),
        }
    }

    fn message(pose: &NeighbourPose) -> Self {
        Self::new(pose.stamp, &Belief::gaussian(pose.pose, pose.parts))
    }
}

/// What came out.
pub(crate) struct Played {
    /// By robot, in the order of the recording.
    pub(crate) ticks: Vec<Vec<PlayedTick>>,
    /// How many went from robot to robot: by sender, then by receiver.
    pub(crate) messages: [[usize; ROBOTS]; ROBOTS],
}

/// What a robot believed, and what became of it. Sources are numbered as in the fleet.
pub(crate) struct PlayedTick {
    pub(crate) published: Published,
    pub(crate) belief: Belief,
    pub(crate) state: FindingState,
    pub(crate) decided: Vec<Decision>,
}

/// By sender, receiver and the sender's count.
type Letters = BTreeMap<(usize, usize, u64), NeighbourPose>;

/// Goes through the ticks in an order in which every message has been sent before it is received.
pub(crate) fn replay(team: &Team, recordings: &[Recording]) -> Played {
    let config = team.config(0);
    let beginnings: Vec<_> = recordings.iter().map(|r| (r.stamp, r.start)).collect();
    let mut fleet = Fleet::starting(settings(&config), &beginnings, config.history.capacity);
    let mut letters = Letters::new();
    let mut played = Played {
        ticks: (0..ROBOTS).map(|_| Vec::new()).collect(),
        messages: [[0; ROBOTS]; ROBOTS],
    };
    let mut waiting = true;
    while waiting {
        waiting = false;
        for (robot, recording) in recordings.iter().enumerate() {
            while let Some(tick) = recording.ticks.get(played.ticks[robot].len()) {
                let Some(measurements) = received(tick, robot, &letters) else {
                    break;
                };
                for sender in senders(&measurements) {
                    played.messages[sender][robot] += 1;
                }
                let tick = play(&mut fleet, robot, tick, measurements, &mut letters);
                played.ticks[robot].push(tick);
                waiting = true;
            }
        }
    }
    played
}

/// What this robot took in at this tick, its neighbours' poses as they were worked out here; `None` while some of
/// them were not sent yet.
fn received(tick: &RecordedTick, robot: usize, letters: &Letters) -> Option<Vec<Measurement>> {
    let sent = |recorded: &NeighbourPose| {
        let sender = index(recorded.sender());
        let sent = letters.get(&(sender, robot, recorded.origin.sequence))?;
        // It went through shared memory as it was worked out.
        assert_eq!(
            Published::message(recorded),
            Published::message(sent),
            "from {sender} to {robot}"
        );
        Some(*sent)
    };
    let renumbered = |measurement: &Measurement| {
        Some(match measurement {
            Measurement::Sighting(sighting) => Measurement::Sighting(Sighting {
                observed: number(index(sighting.observed)),
                ..*sighting
            }),
            Measurement::Neighbour(neighbour) => sent(neighbour)?.into(),
            Measurement::Odometry(_)
            | Measurement::Heading(_)
            | Measurement::Fix(_)
            | Measurement::Pose(_)
            | Measurement::Gyro(_) => *measurement,
        })
    };
    tick.measurements.iter().map(renumbered).collect()
}

/// Whose poses are among them.
fn senders(measurements: &[Measurement]) -> impl Iterator<Item = usize> {
    measurements.iter().filter_map(|it| match it {
        Measurement::Neighbour(neighbour) => Some(usize::from(neighbour.origin.source)),
        _ => None,
    })
}

fn play(
    fleet: &mut Fleet,
    robot: usize,
    tick: &RecordedTick,
    measurements: Vec<Measurement>,
    letters: &mut Letters,
) -> PlayedTick {
    assert_ne!(tick.step, Step::Behind, "robot {robot} had no time");
    let own = RecordedTick {
        measurements,
        ..tick.clone()
    };
    let mut post = |letter: Letter| {
        letters.insert((robot, letter.to, letter.pose.origin.sequence), letter.pose);
    };
    fleet.tick(robot, &own.inputs(), &mut post, &mut |_| ());
    let (estimate, finding) = (
        fleet.estimate(robot).unwrap(),
        fleet.finding(robot).unwrap(),
    );
    PlayedTick {
        published: Published::new(estimate.stamp, &estimate.belief),
        belief: estimate.belief,
        state: finding.state,
        decided: finding.decisions().iter().map(|(_, it)| *it).collect(),
    }
}

/// Daemons are numbered from 1, the fleet's robots from 0.
fn index(id: RobotId) -> usize {
    usize::from(id.0) - 1
}

fn number(robot: usize) -> RobotId {
    coloc_sim::fleet::id(robot)
}
