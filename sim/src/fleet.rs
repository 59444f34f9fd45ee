//! The product's estimators of a whole team in one process: each ticks when it likes, and hands its messages over.
//!
//! What five daemons do over shared memory, without the shared memory: given the same ticks, the same bits.

use coloc_estimator::history::Slot;
use coloc_estimator::output::Report;
use coloc_estimator::{
    Answer, Belief, Estimate, Estimator, Finding, Measurement, NeighbourPose, Origin,
    OutgoingAnswer, OutgoingPose, OutgoingSeen, RobotId, SeenPart, Settings, SightingId, Stamp,
    Start, TickInputs, step,
};

/// A team of estimators. Robots are numbered from 0.
#[derive(Debug)]
pub struct Fleet {
    robots: Vec<Robot>,
}

#[derive(Debug)]
struct Robot {
    estimator: Estimator<Vec<Slot>>,
    estimate: Estimate,
    /// How many messages went to each robot.
    sent: Vec<u64>,
}

/// A message on its way.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Letter {
    /// Who was seen.
    pub to: usize,
    /// As the estimator of `to` takes it.
    pub pose: NeighbourPose,
}

/// What goes from robot to robot of a sighting that says a part only.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Note {
    /// For whom.
    pub to: usize,
    /// As the estimator of `to` takes it.
    pub word: Measurement,
}

impl Fleet {
    /// A robot for each beginning; `slots` is the history's capacity.
    #[must_use]
    pub fn new(settings: Settings, beginnings: &[(Stamp, Belief)], slots: usize) -> Self {
        let known = |&(stamp, belief)| (stamp, Start::Known(belief));
        let starts: Vec<_> = beginnings.iter().map(known).collect();
        Self::starting(settings, &starts, slots)
    }

    /// As [`Self::new`], of robots that may know less than a belief.
    #[must_use]
    pub fn starting(settings: Settings, starts: &[(Stamp, Start)], slots: usize) -> Self {
        let robot = |(stamp, start): &(Stamp, Start)| Robot {
            estimator: Estimator::starting(settings, *stamp, start, vec![Slot::default(); slots]),
            estimate: Estimate {
                stamp: *stamp,
                belief: start.belief(),
                ..Estimate::default()
            },
            sent: vec![0; starts.len()],
        };
        Self {
            robots: starts.iter().map(robot).collect(),
        }
    }

    /// What `robot` believed at its latest tick; `None` if there is no such robot.
    #[must_use]
    pub fn estimate(&self, robot: usize) -> Option<&Estimate> {
        self.robots.get(robot).map(|robot| &robot.estimate)
    }

    /// Whether `robot` knew where it was at its latest tick, and what was decided in it; `None` if there is no such robot.
    #[must_use]
    pub fn finding(&self, robot: usize) -> Option<&Finding> {
        self.robots
            .get(robot)
            .map(|robot| robot.estimator.finding())
    }

    /// A tick of `robot`: every message that it sends goes to `post`, every verdict to `log`.
    /// Robots that do not exist neither tick nor get messages.
    pub fn tick(
        &mut self,
        robot: usize,
        inputs: &TickInputs<'_>,
        post: &mut dyn FnMut(Letter),
        log: &mut dyn FnMut(&Report),
    ) {
        self.tick_with(robot, inputs, post, &mut |_| (), log);
    }

    /// As [`Self::tick`]; what goes out of sightings that say a part only goes to `pass`.
    pub fn tick_with(
        &mut self,
        robot: usize,
        inputs: &TickInputs<'_>,
        post: &mut dyn FnMut(Letter),
        pass: &mut dyn FnMut(Note),
        log: &mut dyn FnMut(&Report),
    ) {
        let Some(member) = self.robots.get_mut(robot) else {
            return;
        };
        let outputs = step(&mut member.estimator, inputs);
        for outgoing in outputs.outgoing {
            let to = usize::from(outgoing.to.0);
            if let Some(sent) = member.sent.get_mut(to) {
                let pose = neighbour(robot, *sent, outgoing);
                *sent += 1;
                post(Letter { to, pose });
            }
        }
        let seen = outputs.seen.iter().map(|it| seen(robot, it));
        let answers = outputs.answers.iter().map(|it| answer(robot, it));
        seen.chain(answers).for_each(pass);
        outputs.reports.iter().for_each(log);
        member.estimate = outputs.estimate;
    }
}

/// What was sent, as its receiver takes it.
pub(crate) fn neighbour(sender: usize, sequence: u64, outgoing: &OutgoingPose) -> NeighbourPose {
    NeighbourPose {
        stamp: outgoing.stamp,
        origin: Origin {
            source: id(sender).0,
            ..Origin::counted(sequence)
        },
        pose: outgoing.pose,
        parts: outgoing.parts,
    }
}

/// What robot `from` tells, as its receiver takes it.
fn seen(from: usize, outgoing: &OutgoingSeen) -> Note {
    Note {
        to: usize::from(outgoing.sighting.robot.0),
        word: Measurement::Seen(SeenPart {
            stamp: outgoing.stamp,
            sighting: named_by(from, outgoing.sighting),
            place: outgoing.place,
            asks: true,
        }),
    }
}

/// What robot `from` answers; likewise.
fn answer(from: usize, outgoing: &OutgoingAnswer) -> Note {
    Note {
        to: usize::from(outgoing.sighting.robot.0),
        word: Measurement::Answer(Answer {
            stamp: outgoing.stamp,
            sighting: named_by(from, outgoing.sighting),
            place: outgoing.place,
            reading: None,
        }),
    }
}

/// The sighting between two robots, as the other one names it.
fn named_by(from: usize, sighting: SightingId) -> SightingId {
    SightingId {
        robot: id(from),
        ..sighting
    }
}

/// The number of the robot with that index.
#[must_use]
#[allow(clippy::cast_possible_truncation)] // A team is far below 2^16 robots.
pub fn id(robot: usize) -> RobotId {
    RobotId(robot as u16)
}

#[cfg(test)]
mod tests {
    use coloc_estimator::{Covariance3, Pose, Sighting};

    use super::*;

    #[test]
    fn messages_are_counted_for_each_receiver() {
        let covariance = Covariance3::diagonal([0.01; 3]).expect("positive");
        let begin = (
            Stamp::from_nanos(0),
            Belief::independent(Pose::default(), covariance),
        );
        let mut fleet = Fleet::new(Settings::default(), &[begin; 3], 64);
        let mut sequences = Vec::new();
        for (nanos, observed) in [(1, 1), (2, 2), (3, 1), (4, 9)] {
            let stamp = Stamp::from_nanos(nanos);
            let sighting = Sighting {
                stamp,
                origin: Origin::default(),
                observed: RobotId(observed),
                relative: Pose::default(),
                covariance,
            };
            let inputs = TickInputs {
                stamp,
                measurements: &[sighting.into()],
            };
            let mut post =
                |letter: Letter| sequences.push((letter.to, letter.pose.origin.sequence));
            fleet.tick(0, &inputs, &mut post, &mut |_| ());
        }
        assert_eq!(sequences, [(1, 0), (2, 0), (1, 1)], "nobody is robot 9");
    }
}
