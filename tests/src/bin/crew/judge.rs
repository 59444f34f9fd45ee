//! What was heard on the channels, and what the recordings have to say to it.

use std::collections::HashMap;
use std::fmt;
use std::time::{Duration, Instant};

use coloc_daemon::estimate::{places, settings};
use coloc_daemon::record::{Recording, Step};
use coloc_estimator::{Belief, Deed, Estimator, Kind, Measurement, Verdict, step};
use coloc_shm_types::{Estimate, Round, Shared, Subscriber};

use crate::stage::{Problem, ROBOTS, Stage, name, truth};

/// χ² with three degrees of freedom, one in a hundred thousand.
const FAR: f64 = 25.9;

/// Bits of a pose and of P.
type Bits = [u64; 12];

/// What was heard.
pub(crate) struct Overheard {
    rounds: Vec<Subscriber<Round>>,
    shared: Vec<Subscriber<Shared>>,
    estimates: Vec<Subscriber<Estimate>>,
    /// Of each robot and slot, every correction that any round has for it.
    said: HashMap<(usize, u64), Vec<Bits>>,
    newest: Vec<Option<Shared>>,
    beliefs: Vec<Option<Estimate>>,
}

fn bits(pose: [f64; 3], covariance: &[f64; 9]) -> Bits {
    let mut all = [0; 12];
    for (place, number) in all.iter_mut().zip(pose.iter().chain(covariance)) {
        *place = number.to_bits();
    }
    all
}

impl Overheard {
    pub(crate) fn new(stage: &Stage) -> Result<Self, Problem> {
        let space = stage.space();
        let mut heard = Self {
            rounds: Vec::new(),
            shared: Vec::new(),
            estimates: Vec::new(),
            said: HashMap::new(),
            newest: vec![None; ROBOTS],
            beliefs: vec![None; ROBOTS],
        };
        for robot in 0..ROBOTS {
            let name = name(robot)?;
            heard.rounds.push(space.subscriber(&name)?);
            heard.shared.push(space.subscriber(&name)?);
            heard.estimates.push(space.subscriber(&name)?);
        }
        Ok(heard)
    }

    pub(crate) fn listen(&mut self) {
        for port in &self.rounds {
            while let Ok(Some(round)) = port.receive() {
                for (robot, it) in round.entries.iter().take(ROBOTS).enumerate() {
                    if it.is_there == 0 {
                        continue;
                    }
                    let told = bits(it.pose, &it.covariance);
                    let all = self.said.entry((robot, it.slot)).or_default();
                    if !all.contains(&told) {
                        all.push(told);
                    }
                }
            }
        }
        for (robot, port) in self.shared.iter().enumerate() {
            while let Ok(Some(shared)) = port.receive() {
                self.newest[robot] = Some(shared);
            }
        }
        for (robot, port) in self.estimates.iter().enumerate() {
            while let Ok(Some(estimate)) = port.receive() {
                self.beliefs[robot] = Some(estimate);
            }
        }
    }

    pub(crate) fn listen_for(&mut self, wait_ms: u64) {
        let until = Instant::now() + Duration::from_millis(wait_ms);
        while Instant::now() < until {
            self.listen();
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// What was heard of the present.
    pub(crate) fn forget(&mut self) {
        self.newest = vec![None; ROBOTS];
    }

    /// Each has followed a round of the last slots.
    pub(crate) fn all_are_with_their_team(&self) -> bool {
        let is_with = |it: &Option<Shared>| {
            it.is_some_and(|it| it.standing == Shared::SINCE && it.since + 3 >= it.slot)
        };
        self.newest.iter().all(is_with)
    }

    pub(crate) fn beliefs(&self) -> Vec<Option<Estimate>> {
        self.beliefs.clone()
    }
}

/// What the recordings held.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct Judged {
    lives: u64,
    ticks: u64,
    taken: u64,
    refused: u64,
    unheard: u64,
}

impl fmt::Display for Judged {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            lives,
            ticks,
            taken,
            refused,
            unheard,
        } = self;
        write!(
            f,
            "{lives} lives of daemons, {ticks} ticks to the bit; {taken} corrections taken, each a whole one, {refused} refused, of {unheard} the round \
             was not overheard"
        )
    }
}

/// Plays all of them again.
pub(crate) fn recordings(stage: &Stage, overheard: &Overheard) -> Result<Judged, Problem> {
    let mut judged = Judged::default();
    for robot in 0..ROBOTS {
        let config = stage.config(robot)?;
        for path in stage.recordings(robot) {
            // One that was killed before it wrote anything left nothing.
            let Ok(recording) = Recording::read(&path) else {
                continue;
            };
            judged.lives += 1;
            let settings = settings(&config);
            let places = places(&settings, config.history.capacity);
            let start = &recording.start;
            let mut estimator = Estimator::starting(settings, recording.stamp, start, places);
            for tick in &recording.ticks {
                let inputs = tick.inputs();
                let (played, verdicts) = match tick.step {
                    Step::Behind => (estimator.extrapolated(tick.stamp), Vec::new()),
                    Step::Own | Step::Ahead => {
                        let outputs = step(&mut estimator, &inputs);
                        let of_rounds = outputs.reports.iter();
                        let of_rounds = of_rounds.filter(|it| it.source.kind == Kind::Round);
                        (outputs.estimate, of_rounds.map(|it| it.verdict).collect())
                    }
                };
                if same(&played.belief) != same(&tick.belief) {
                    return Err(format!("{}: tick {} is another", path.display(), tick.tick).into());
                }
                judged.ticks += 1;
                let deeds = tick.measurements.iter().filter_map(|it| match it {
                    Measurement::Round(word) if !matches!(word.deed, Deed::Share(_)) => {
                        Some(word.deed)
                    }
                    _ => None,
                });
                for (deed, verdict) in deeds.zip(verdicts) {
                    judged.take(robot, &deed, verdict, overheard)?;
                }
            }
        }
    }
    if judged.taken == 0 {
        return Err("no correction was taken".into());
    }
    Ok(judged)
}

impl Judged {
    fn take(
        &mut self,
        robot: usize,
        deed: &Deed,
        verdict: Verdict,
        overheard: &Overheard,
    ) -> Result<(), Problem> {
        let Deed::Correct {
            slot,
            pose,
            covariance,
            ..
        } = deed
        else {
            return Ok(());
        };
        if verdict != Verdict::Heard {
            self.refused += 1;
            return Ok(());
        }
        self.taken += 1;
        let told = bits(pose.to_vector().into(), &covariance.to_row_major());
        match overheard.said.get(&(robot, *slot)) {
            Some(all) if all.contains(&told) => Ok(()),
            Some(_) => Err(format!("robot {}: slot {slot}: a part of a round", robot + 1).into()),
            // Its leader was killed between telling its own daemon and the others.
            None => {
                self.unheard += 1;
                Ok(())
            }
        }
    }
}

fn same(belief: &Belief) -> [Bits; 2] {
    let pose = belief.pose.to_vector().into();
    let parts = &belief.parts;
    [
        bits(pose, &parts.independent.to_row_major()),
        bits(pose, &parts.dependent.to_row_major()),
    ]
}

/// That nobody lies about where it is.
pub(crate) fn errors(beliefs: &[Option<Estimate>]) -> Result<(), Problem> {
    for (robot, belief) in beliefs.iter().enumerate() {
        let Some(belief) = belief else {
            return Err(format!("robot {} is silent", robot + 1).into());
        };
        let variance = |at: usize| belief.independent[at] + belief.dependent[at];
        let [x, y, phi] = truth(robot, belief.boot_ns);
        let off = [
            belief.pose[0] - x,
            belief.pose[1] - y,
            coloc_estimator::angle::wrap(belief.pose[2] - phi),
        ];
        let far = [0, 4, 8]
            .into_iter()
            .zip(off)
            .any(|(at, off)| off * off > FAR * variance(at));
        if far {
            return Err(format!("robot {} is off by {off:?}", robot + 1).into());
        }
    }
    Ok(())
}
