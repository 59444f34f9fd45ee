//! What daemons have recorded, worked out anew in one process: what each believed at every tick, and what they told one another.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use coloc_daemon::config::Config;
use coloc_daemon::estimate::{Estimate, settings};
use coloc_daemon::record::{RecordedTick, Recording, Step};
use coloc_estimator::assist::assistant::{Ack, Carried, Message};
use coloc_estimator::assist::readings;
use coloc_estimator::{Belief, Stamp};

use super::bars::Bar;
use super::robot_file::name;

/// So much of what is wrong is told.
const MOST_TOLD: usize = 3;

/// A datum by who sends it, who it is for, its event, stamp and way; every number that it says.
type Data = BTreeMap<(u16, u16, i64, i64, Vec<u16>), Vec<u64>>;

/// What a robot saw by its event; every number that it says.
type Readings = BTreeMap<(u16, i64), Vec<u64>>;

/// An answer by who gives it, to whom, its event and leader, and whether the datum is used.
type Acks = BTreeMap<(u16, u16, i64, u16, bool), usize>;

/// What came of it.
#[derive(Debug, Default)]
pub(crate) struct Anew {
    /// Whose beliefs are the same bits.
    ticks: usize,
    /// That came as they were worked out.
    data: usize,
    acks: usize,
    readings: usize,
    /// That came from a daemon that was killed before it had recorded what they were made of.
    unrecorded: usize,
    wrong: [Vec<String>; 2],
}

/// All that was told, as it is worked out, and which robot's recordings go from when to when.
#[derive(Default)]
struct Told {
    data: Data,
    acks: Acks,
    readings: Readings,
    lives: Vec<(u16, [Stamp; 2])>,
}

/// Which promise is broken.
#[derive(Copy, Clone)]
enum Which {
    Beliefs,
    Words,
}

impl Anew {
    /// Of the robots with these configurations.
    pub(crate) fn of(files: &[PathBuf]) -> Self {
        let (mut anew, mut told, mut all) = (Self::default(), Told::default(), Vec::new());
        for file in files {
            match lives(file) {
                Ok((config, recordings)) => {
                    for recording in &recordings {
                        anew.play(&config, recording, &mut told);
                    }
                    all.extend(recordings);
                }
                Err(problem) => anew.complain(Which::Beliefs, problem),
            }
        }
        for recording in &all {
            recording
                .ticks
                .iter()
                .for_each(|tick| anew.compare(recording.robot, tick, &told));
        }
        anew
    }

    fn complain(&mut self, which: Which, problem: String) {
        let told = &mut self.wrong[which as usize];
        if told.len() < MOST_TOLD {
            told.push(problem);
        }
    }

    /// Through one life of a daemon, up to the first tick that is missing.
    fn play(&mut self, config: &Config, recording: &Recording, told: &mut Told) {
        let robot = recording.robot;
        let mut estimate = Estimate::with(
            settings(config),
            config.history.capacity,
            recording.stamp,
            &recording.start,
        )
        .with_part(config.assistant());
        let mut expected = recording.ticks.first().map_or(0, |tick| tick.tick);
        let mut until = recording.stamp;
        for tick in &recording.ticks {
            if tick.tick > expected {
                let problem = format!("{}: tick {expected} is missing", name(robot.into()));
                self.complain(Which::Beliefs, problem);
                break;
            }
            expected = tick.tick + u64::from(tick.step != Step::Ahead);
            let belief = step(&mut estimate, tick, robot, told);
            if bits(&belief) == bits(&tick.belief) {
                self.ticks += 1;
            } else {
                let problem = format!("{}: tick {} is another", name(robot.into()), tick.tick);
                self.complain(Which::Beliefs, problem);
            }
            until = tick.stamp;
        }
        told.lives.push((robot, [recording.stamp, until]));
    }

    /// What came to a robot in a tick with what it was when it was sent.
    fn compare(&mut self, robot: u16, tick: &RecordedTick, told: &Told) {
        for heard in &tick.data {
            let sender = heard.origin.source;
            let (key, said) = datum(sender, robot, &heard.message);
            let same = told.data.get(&key).map(|worked_out| *worked_out == said);
            self.count(same, (sender, robot), heard.message.stamp, tick, told);
            self.data += usize::from(same == Some(true));
        }
        for ack in &tick.acks {
            let same = told.acks.contains_key(&answer(ack.robot.0, robot, ack));
            let same = same.then_some(true);
            self.count(same, (ack.robot.0, robot), ack.stamp, tick, told);
            self.acks += usize::from(same == Some(true));
        }
        for heard in &tick.readings {
            let sender = heard.origin.source;
            let (key, said) = saw(sender, &heard.readings);
            let same = told
                .readings
                .get(&key)
                .map(|worked_out| *worked_out == said);
            self.count(same, (sender, robot), heard.readings.stamp, tick, told);
            self.readings += usize::from(same == Some(true));
        }
    }

    fn count(
        &mut self,
        same: Option<bool>,
        (sender, robot): (u16, u16),
        stamp: Stamp,
        tick: &RecordedTick,
        told: &Told,
    ) {
        let is_recorded = |(whose, [from, until]): &(u16, [Stamp; 2])| {
            *whose == sender && *from <= stamp && tick.stamp <= *until
        };
        match same {
            Some(true) => {}
            None if !told.lives.iter().any(is_recorded) => self.unrecorded += 1,
            _ => {
                let at = stamp.as_nanos();
                let [sender, robot] = [sender, robot].map(|it| name(it.into()));
                self.complain(Which::Words, format!("{sender} to {robot}, {at} ns"));
            }
        }
    }

    /// What is promised of it, and whether that is kept.
    pub(crate) fn bars(self) -> [Bar; 2] {
        let [beliefs, words] = self.wrong;
        let none = |count, what: &str| (count == 0).then(|| format!("no {what} at all"));
        let readings = match self.readings {
            0 => String::new(),
            count => format!(", {count} times what a robot saw"),
        };
        let kept = match self.unrecorded {
            0 => String::new(),
            count => format!("; {count} of a killed daemon's last are not in its recording"),
        };
        [
            Bar {
                promise: "worked out anew: every belief, bit by bit".into(),
                seen: format!("{} ticks", self.ticks),
                broken_by: beliefs
                    .into_iter()
                    .chain(none(self.ticks, "tick"))
                    .collect(),
            },
            Bar {
                promise: "worked out anew: all that was told, bit by bit".into(),
                seen: format!("{} data, {} answers{readings}{kept}", self.data, self.acks),
                broken_by: words.into_iter().chain(none(self.data, "datum")).collect(),
            },
        ]
    }
}

/// The configuration, and what each life of the daemon has recorded.
fn lives(file: &Path) -> Result<(Config, Vec<Recording>), String> {
    let config = Config::load(file).map_err(|error| error.to_string())?;
    let first = &config.telemetry.record;
    let numbered = |number: usize| match number {
        0 => first.clone(),
        _ => PathBuf::from(format!("{}.{number}", first.display())),
    };
    let files = (0..).map(numbered).take_while(|path| path.exists());
    let recordings = files.map(|path| Recording::read(&path).map_err(|error| error.to_string()));
    let recordings = recordings.collect::<Result<_, _>>()?;
    Ok((config, recordings))
}

/// What the robot believes after a tick; what it tells is noted.
fn step(estimate: &mut Estimate, tick: &RecordedTick, robot: u16, told: &mut Told) -> Belief {
    let inputs = tick.inputs();
    match tick.step {
        Step::Ahead => estimate.step(&inputs).estimate.belief,
        Step::Behind => estimate.idle(&inputs).estimate.belief,
        Step::Own => {
            let (outputs, carried) = estimate.step_among(&inputs, &tick.words());
            told.note(robot, &carried);
            outputs.estimate.belief
        }
    }
}

impl Told {
    fn note(&mut self, robot: u16, carried: &Carried<'_>) {
        let data = carried.data.iter();
        self.data
            .extend(data.map(|it| datum(robot, it.to.0, &it.message)));
        self.readings
            .extend(carried.readings.iter().map(|it| saw(robot, it)));
        for ack in carried.acks {
            *self
                .acks
                .entry(answer(robot, ack.robot.0, ack))
                .or_default() += 1;
        }
    }
}

fn answer(from: u16, to: u16, ack: &Ack) -> (u16, u16, i64, u16, bool) {
    (from, to, ack.slot.0, ack.leader.0, ack.taken)
}

type Datum = ((u16, u16, i64, i64, Vec<u16>), Vec<u64>);

fn datum(from: u16, to: u16, message: &Message) -> Datum {
    let Message { said, word, .. } = message;
    let poses = [said.pose, word.leader.pose].map(|it| [it.x, it.y, it.phi]);
    let covariances = [
        said.parts.independent,
        said.parts.dependent,
        word.leader.covariance,
    ];
    let numbers = poses.into_iter().flatten();
    let numbers = numbers.chain(covariances.into_iter().flat_map(|it| it.to_row_major()));
    let transitions = word.past.transitions.into_iter().flatten().flatten();
    let numbers = numbers.chain(transitions.map(f64::from));
    let way = message.robots().iter().map(|it| it.0).collect();
    let key = (from, to, message.slot.0, message.stamp.as_nanos(), way);
    (key, numbers.map(f64::to_bits).collect())
}

fn saw(from: u16, readings: &readings::Readings) -> ((u16, i64), Vec<u64>) {
    let sights = readings.sights().iter();
    let sights = sights.map(|it| (it.reading.relative, it.reading.covariance));
    let trail = readings.trail.iter();
    let ends = trail.clone().flat_map(|it| it.ends);
    let poses = sights.clone().map(|it| it.0).chain(ends);
    let covariances = sights.map(|it| it.1).chain(trail.map(|it| it.noise));
    let numbers = poses.flat_map(|it| [it.x, it.y, it.phi]);
    let numbers = numbers.chain(covariances.flat_map(|it| it.to_row_major()));
    let numbers = numbers.chain(readings.trace).map(f64::to_bits).collect();
    ((from, readings.slot.0), numbers)
}

fn bits(belief: &Belief) -> Vec<u64> {
    let parts = [belief.parts.independent, belief.parts.dependent];
    let numbers = [belief.pose.x, belief.pose.y, belief.pose.phi].into_iter();
    let numbers = numbers.chain(parts.into_iter().flat_map(|it| it.to_row_major()));
    numbers.map(f64::to_bits).collect()
}
