//! `coloc eval --sightings recorded`: a recording whose robots saw one another with cameras of their own.

use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;
use serde::Serialize;

use super::method::{
    BOTH_WAYS, FED_BY_TRACKS, Method, ONE_RECEIVER, Reference, TWO_RECEIVERS, WITH_LANDMARKS, Ways,
};
use super::team::{Draw, PROGRESS_EVERY, Sums, summed};
use crate::evaluate::Progress;
use crate::partial::recorded::{Recorded, steps_of};
use crate::random::Noise;

/// How much of it is done.
#[derive(Clone, Debug, PartialEq)]
pub struct Config {
    /// Draws of starts and fixes.
    pub runs: u16,
    /// Where all chance comes from.
    pub seed: u64,
    /// Stop after this time \[s\]; `None`: the whole recording.
    pub seconds: Option<f64>,
}

/// Who has what, and how it came out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Setting {
    /// A word.
    pub scenario: &'static str,
    /// A line.
    pub description: &'static str,
    /// What coloc does first; then what was done before there were sightings in part, where that can be.
    pub methods: Vec<Row>,
}

/// One way of using the sightings.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// `coloc`; `fed`: the same with poses of `coloc-track` in the place of sightings; or `poses`: every sighting as a relative pose with no heading, told to the robot that was seen.
    pub method: &'static str,
    /// In the order of the recording.
    pub robots: Vec<Robot>,
}

/// What came of one robot.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Robot {
    /// As in the recording's file names.
    pub name: String,
    /// Whether it has a receiver.
    pub receiver: bool,
    /// RMS over runs and time of x \[m\], y \[m\], heading \[rad\], while its truth is known and it knows its heading.
    pub rms: [f64; 3],
    /// Share of samples whose NEES is above its 95 % bound.
    pub nees_outside: f64,
    /// When it knew its heading in all runs \[s\]; `None` where there is one in which it never did.
    pub found_by_s: Option<f64>,
    /// Runs in which it never did.
    pub lost_runs: f64,
    /// How far off its heading was when it was found, in its own σ, at most.
    pub found_off_sigma: f64,
    /// What an independent implementation is known to come to: x and y \[m\].
    pub reference: Option<[f64; 2]>,
}

/// A setting before it is run.
struct Plan {
    scenario: &'static str,
    description: &'static str,
    method: Method,
    /// Of what was done before, where it can be; x and y \[cm\] as in [`Reference`].
    before: Option<Reference>,
    /// The same with poses of tracks in the place of sightings.
    fed: Option<Method>,
}

/// What was done before, of two receivers: the document's row "today".
const TODAY: Reference = [
    &[[60.9, 63.1], [38.4, 41.9], [54.8, 55.9]],
    &[[75.0, 94.7], [37.2, 25.3], [30.0, 53.3]],
];

const PLANS: [Plan; 5] = [
    Plan {
        scenario: "two receivers",
        description: "fixes on the first two robots",
        method: Method {
            reference: TWO_RECEIVERS,
            ..BOTH_WAYS
        },
        before: Some(TODAY),
        fed: Some(FED_BY_TRACKS),
    },
    Plan {
        scenario: "one receiver",
        description: "fixes on the first robot",
        method: Method {
            receivers: 1,
            reference: ONE_RECEIVER,
            ..BOTH_WAYS
        },
        before: Some(super::method::FREE),
        fed: None,
    },
    Plan {
        scenario: "landmarks",
        description: "fixes on the first two robots, landmarks as beacons whose place is known to 1 cm",
        method: Method {
            landmarks: true,
            reference: WITH_LANDMARKS,
            ..BOTH_WAYS
        },
        before: None,
        fed: None,
    },
    Plan {
        scenario: "two, lost",
        description: "fixes on the first two robots; the others do not know at the start which way they look",
        method: Method {
            lost: true,
            reference: TWO_RECEIVERS,
            ..BOTH_WAYS
        },
        before: None,
        fed: None,
    },
    Plan {
        scenario: "one, lost",
        description: "fixes on the first robot; the others do not know at the start which way they look",
        method: Method {
            receivers: 1,
            lost: true,
            reference: ONE_RECEIVER,
            ..BOTH_WAYS
        },
        before: None,
        fed: None,
    },
];

/// Runs every setting on rayon's current thread pool, to the same bits on any number of threads; `progress` is called from its threads.
#[must_use]
pub fn evaluate(
    recorded: &Recorded,
    config: &Config,
    progress: &(dyn Fn(Progress) + Sync),
) -> Vec<Setting> {
    let whole = recorded.steps;
    let asked = |seconds| steps_of(seconds, &recorded.world) + 1;
    let steps = config.seconds.map_or(whole, asked).min(whole);
    let others = |it: &Plan| u64::from(it.before.is_some()) + u64::from(it.fed.is_some());
    let rows = PLANS.iter().map(|it| 1 + others(it));
    let total = rows.sum::<u64>()
        * u64::from(config.runs)
        * (steps.saturating_sub(1) / PROGRESS_EVERY) as u64;
    let done = AtomicU64::new(0);
    let advance = |steps: u64| {
        let done = done.fetch_add(steps, Ordering::Relaxed) + steps;
        progress(Progress { done, total });
    };
    let run = |method: &Method| {
        let draws: Vec<Vec<Sums>> = (0..config.runs)
            .into_par_iter()
            .map(|draw| {
                let draw = Draw {
                    noise: Noise::new(config.seed, draw),
                    steps,
                    done: &advance,
                };
                draw.run(recorded, method)
            })
            .collect();
        summed(&draws)
    };
    PLANS
        .iter()
        .map(|plan| Setting {
            scenario: plan.scenario,
            description: plan.description,
            methods: rows_of(recorded, plan, &run),
        })
        .collect()
}

fn rows_of(recorded: &Recorded, plan: &Plan, run: &dyn Fn(&Method) -> Vec<Sums>) -> Vec<Row> {
    let row = |name, method: &Method| Row {
        method: name,
        robots: robots(recorded, method, &run(method)),
    };
    let before = plan.before.map(|reference| {
        let method = Method {
            ways: Ways::Poses,
            reference,
            ..plan.method
        };
        row("poses", &method)
    });
    let fed = plan.fed.as_ref().map(|method| row("fed", method));
    std::iter::once(row("coloc", &plan.method))
        .chain(fed)
        .chain(before)
        .collect()
}

fn robots(recorded: &Recorded, method: &Method, sums: &[Sums]) -> Vec<Robot> {
    let robot = |(robot, sum): (usize, &Sums)| Robot {
        name: recorded.name(robot),
        receiver: robot < method.receivers,
        rms: sum.rms(),
        nees_outside: sum.outside / sum.count,
        found_by_s: (sum.lost == 0.0).then_some(sum.latest_s),
        lost_runs: sum.lost,
        found_off_sigma: sum.farthest,
        reference: reference(recorded, method, robot),
    };
    sums.iter().enumerate().map(robot).collect()
}

fn reference(recorded: &Recorded, method: &Method, robot: usize) -> Option<[f64; 2]> {
    let at = match recorded.number? {
        1 => 0,
        _ => 1,
    };
    let known = method.reference[at].get(robot.checked_sub(method.receivers)?)?;
    Some(known.map(|cm| cm / 100.0))
}
