//! The recordings of a team, gone through again in one process by what `coloc eval` runs as `coloc-step`.

use std::collections::BTreeMap;

use coloc_daemon::estimate::settings;
use coloc_daemon::record::{RecordedTick, Recording, Step};
use coloc_estimator::partial::SplitPosition;
use coloc_estimator::{
    Belief, Decision, FindingState, Measurement, NeighbourPose, PartialSighting, RobotId, Sighting,
    SightingId, Stamp, TrackPose,
};
use coloc_shm_types::Estimate;
use coloc_sim::{Fleet, Letter, Note};

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
    /// How many of what was seen in part was told, and how many answers came.
    pub(crate) parts: [usize; 2],
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

/// By sender, receiver, and the sensor's session and sequence of the sighting: what is told, and what is answered.
type Notes = [BTreeMap<(usize, usize, u64, u64), Measurement>; 2];

/// All that was sent so far.
#[derive(Default)]
struct Mail {
    letters: Letters,
    notes: Notes,
}

impl Mail {
    fn put(&mut self, from: usize, note: Note) {
        let Some((kind, id)) = part(&note.word) else {
            panic!("{note:?}");
        };
        self.notes[kind].insert((from, note.to, id.session, id.sequence), note.word);
    }

    /// What was worked out here of what came over shared memory; `None` if it was not sent yet.
    fn note(&self, recorded: &Measurement, robot: usize) -> Option<Measurement> {
        let (kind, id) = part(recorded)?;
        let key = (index(id.robot), robot, id.session, id.sequence);
        let sent = self.notes[kind].get(&key)?;
        assert_eq!(bits(recorded), bits(sent), "{key:?}");
        Some(*sent)
    }
}

/// Whether it is told or answered, and of which sighting.
fn part(word: &Measurement) -> Option<(usize, SightingId)> {
    match word {
        Measurement::Seen(seen) => Some((0, seen.sighting)),
        Measurement::Answer(answer) => Some((1, answer.sighting)),
        _ => None,
    }
}

/// All that it says.
fn bits(word: &Measurement) -> (i64, Vec<u64>, bool) {
    let numbers = |place: &SplitPosition| {
        let parts = [place.independent, place.dependent].map(|it| it.to_row_major());
        let all = place
            .position
            .into_iter()
            .chain(parts.into_iter().flatten());
        all.map(f64::to_bits).collect()
    };
    let (place, asks) = match word {
        Measurement::Seen(seen) => (seen.place, seen.asks),
        Measurement::Answer(answer) => (Some(answer.place), false),
        _ => (None, false),
    };
    let numbers = place.as_ref().map(numbers).unwrap_or_default();
    (word.stamp().as_nanos(), numbers, asks)
}

/// Goes through the ticks in an order in which every message has been sent before it is received.
pub(crate) fn replay(team: &Team, recordings: &[Recording]) -> Played {
    let config = team.config(0);
    let beginnings: Vec<_> = recordings.iter().map(|r| (r.stamp, r.start)).collect();
    let mut fleet = Fleet::starting(settings(&config), &beginnings, config.history.capacity);
    let mut mail = Mail::default();
    let mut played = Played {
        ticks: (0..ROBOTS).map(|_| Vec::new()).collect(),
        messages: [[0; ROBOTS]; ROBOTS],
        parts: [0; 2],
    };
    let mut waiting = true;
    while waiting {
        waiting = false;
        for (robot, recording) in recordings.iter().enumerate() {
            while let Some(tick) = recording.ticks.get(played.ticks[robot].len()) {
                let Some(measurements) = received(tick, robot, &mail) else {
                    break;
                };
                for sender in senders(&measurements) {
                    played.messages[sender][robot] += 1;
                }
                for (kind, _) in measurements.iter().filter_map(part) {
                    played.parts[kind] += 1;
                }
                let tick = play(&mut fleet, robot, tick, measurements, &mut mail);
                played.ticks[robot].push(tick);
                waiting = true;
            }
        }
    }
    played
}

/// What this robot took in at this tick, its neighbours' poses as they were worked out here; `None` while some of
/// them were not sent yet.
fn received(tick: &RecordedTick, robot: usize, mail: &Mail) -> Option<Vec<Measurement>> {
    let sent = |recorded: &NeighbourPose| {
        let sender = index(recorded.sender());
        let sent = mail
            .letters
            .get(&(sender, robot, recorded.origin.sequence))?;
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
            Measurement::Track(track) => Measurement::Track(TrackPose(Sighting {
                observed: number(index(track.0.observed)),
                ..track.0
            })),
            Measurement::Neighbour(neighbour) => sent(neighbour)?.into(),
            Measurement::Partial(sighting) => Measurement::Partial(PartialSighting {
                observed: number(index(sighting.observed)),
                ..*sighting
            }),
            Measurement::Seen(_) | Measurement::Answer(_) => mail.note(measurement, robot)?,
            Measurement::Ask(_) | Measurement::Assist(_) => panic!("it comes with what is told"),
            Measurement::Odometry(_)
            | Measurement::Heading(_)
            | Measurement::Fix(_)
            | Measurement::Pose(_)
            | Measurement::Landmark(_)
            | Measurement::Round(_)
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
    mail: &mut Mail,
) -> PlayedTick {
    assert_ne!(tick.step, Step::Behind, "robot {robot} had no time");
    let own = RecordedTick {
        measurements,
        ..tick.clone()
    };
    let mut notes = Vec::new();
    let letters = &mut mail.letters;
    let mut post = |letter: Letter| {
        letters.insert((robot, letter.to, letter.pose.origin.sequence), letter.pose);
    };
    let mut pass = |note| notes.push(note);
    fleet.tick_with(robot, &own.inputs(), &mut post, &mut pass, &mut |_| ());
    for note in notes {
        mail.put(robot, note);
    }
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
