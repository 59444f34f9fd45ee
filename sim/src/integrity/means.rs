//! Which promise of means do honest robots keep, and how soon does each find a fix that goes away slowly?
//!
//! Many promises are looked at in one drive, of which the monitor itself believes none. One whose rows the truth satisfies fits: the linear program
//! is asked only where that is not so. One that is wider than another that fits, fits too.

use std::collections::VecDeque;
use std::f64::consts::TAU;

use coloc_bounds::mean::{Memory, Promise, projection};
use coloc_bounds::monitor::{Monitor, SLACK_M, Standing};
use coloc_bounds::{Arena, Measurement, Projection};
use rayon::prelude::*;

use super::Form;
use super::bar::{Bars, found, quantile, wilson};
use super::faults::PATIENCE;
use super::setting::{SLOT_S, Setting, monitor};
use super::slots::{Drive, Fault, Lie, Source, direction};
use crate::campaign::Finding;
use crate::honest::table::Table;
use crate::method::Kind;
use crate::mrclam::GridWorld;
use crate::random::Noise;

/// Slots, share of fixes, share of sightings.
const PROMISES: [(usize, f64, f64); 20] = [
    (8, 0.28, 0.28),
    (8, 0.30, 0.30),
    (8, 0.32, 0.32),
    (8, 0.34, 0.34),
    (8, 0.36, 0.36),
    (6, 0.33, 0.33),
    (6, 0.36, 0.36),
    (6, 0.39, 0.39),
    (12, 0.24, 0.24),
    (12, 0.26, 0.26),
    (12, 0.28, 0.28),
    (8, 0.15, 0.34),
    (8, 0.15, 0.36),
    (8, 0.15, 0.38),
    (8, 0.15, 0.40),
    (8, 0.20, 0.34),
    (8, 0.20, 0.36),
    (8, 0.20, 0.38),
    (8, 0.20, 0.40),
    (6, 0.24, 0.40),
];

/// Drifts of these are looked for \[m/s\].
const DRIFT: f64 = 0.05;
/// Robots with receivers.
const RECEIVERS: [usize; 2] = [0, 1];
/// Half of the middle of what the specification measured, 12 to 17 s.
const BAR_S: f64 = 7.5;

fn promise((slots, fixes, sightings): (usize, f64, f64)) -> Promise {
    Promise {
        slots,
        fixes,
        sightings,
    }
}

/// Whether whatever keeps `a` keeps `b`.
fn is_wider(b: Promise, a: Promise) -> bool {
    a.slots == b.slots && a.fixes <= b.fixes && a.sightings <= b.sightings
}

/// What each promise remembers, and where all truly were.
#[derive(Clone)]
struct Probe {
    memories: Vec<Memory>,
    truths: VecDeque<Vec<Option<[f64; 2]>>>,
    arena: Arena,
}

impl Probe {
    fn new() -> Self {
        let memories = PROMISES.map(|it| Memory::new(promise(it)));
        Self {
            memories: memories.into(),
            truths: VecDeque::new(),
            arena: monitor(Setting::FORGETFUL.means).arena,
        }
    }

    /// A slot goes by.
    fn hear(&mut self, measurements: &[Measurement], truth: Vec<Option<[f64; 2]>>) {
        for memory in &mut self.memories {
            memory.hear(measurements, truth.len());
        }
        self.truths.push_back(truth);
        if self.truths.len() > 12 {
            self.truths.pop_front();
        }
    }

    /// Whether each promise fits, of those that are `wanted`; the others count as fitting.
    fn fits(&self, measurements: &[Measurement], wanted: &[bool]) -> Vec<bool> {
        let robots = self.truths.back().map_or(0, Vec::len);
        let mut fits: Vec<Option<bool>> = vec![None; self.memories.len()];
        for (place, memory) in self.memories.iter().enumerate() {
            if !wanted[place] {
                continue;
            }
            let known = self.memories.iter().zip(&fits).any(|(other, fits)| {
                *fits == Some(true) && is_wider(memory.promise, other.promise)
            });
            let fit = known
                || self.is_kept(memory, measurements)
                || memory
                    .judge(measurements, robots, self.arena, SLACK_M)
                    .is_ok_and(|it| it.is_none());
            fits[place] = Some(fit);
        }
        fits.into_iter().map(|it| it.unwrap_or(true)).collect()
    }

    /// Whether the truth satisfies every row; not if it is not known.
    fn is_kept(&self, memory: &Memory, measurements: &[Measurement]) -> bool {
        let all = measurements.iter().filter_map(projection);
        all.into_iter().all(|of| {
            let Some(mean) = memory.mean(of) else {
                return true;
            };
            let Some([x, y]) = self.truth(of, memory.promise.slots) else {
                return false;
            };
            let mut supports = (0_u32..).zip(&mean);
            #[allow(clippy::cast_precision_loss)] // Sixteen.
            supports.all(|(k, support)| {
                let (sin, cos) = (TAU * f64::from(k) / mean.len() as f64).sin_cos();
                cos * x + sin * y <= *support
            })
        })
    }

    /// In the mean of so many slots.
    #[allow(clippy::cast_precision_loss)] // A dozen.
    fn truth(&self, of: Projection, slots: usize) -> Option<[f64; 2]> {
        let mut sum = [0.0; 2];
        for truth in self.truths.iter().rev().take(slots) {
            let at = match of {
                Projection::Robot(robot) => truth[robot]?,
                Projection::Difference(to, from) => {
                    let (to, from) = (truth[to]?, truth[from]?);
                    [to[0] - from[0], to[1] - from[1]]
                }
            };
            sum = [sum[0] + at[0], sum[1] + at[1]];
        }
        Some(sum.map(|it| it / slots as f64))
    }
}

fn truth(drive: &Drive, number: usize) -> Vec<Option<[f64; 2]>> {
    let all = drive.slots[number].truth.iter();
    all.map(|it| it.map(|it| [it.x, it.y])).collect()
}

/// How many slots of a run each promise was not kept in, and the number of slots; and, where `begins` says so, a probe before the slot.
type Begun = Vec<(usize, Monitor, Probe)>;

fn honest(
    drive: &Drive,
    begins: impl Fn(usize) -> bool,
    count: bool,
) -> ([usize; PROMISES.len()], Begun) {
    let mut monitor = drive.monitor();
    let mut probe = Probe::new();
    let (mut broken, mut begun) = ([0; PROMISES.len()], Vec::new());
    for number in 0..drive.slots.len() {
        if begins(number) {
            begun.push((number, monitor.clone(), probe.clone()));
        }
        let outcome = drive.close(&mut monitor, number, None);
        probe.hear(&outcome.measurements, truth(drive, number));
        if count {
            let fits = probe.fits(&outcome.measurements, &[true; PROMISES.len()]);
            for (broken, fits) in broken.iter_mut().zip(fits) {
                *broken += usize::from(!fits);
            }
        }
    }
    (broken, begun)
}

/// Slots until each promise finds a fault; `None`: not in time.
fn follow(
    drive: &Drive,
    (first, monitor, probe): &(usize, Monitor, Probe),
    fault: &Fault,
) -> [Option<usize>; PROMISES.len()] {
    let (mut monitor, mut probe) = (monitor.clone(), probe.clone());
    let mut alarms = [None; PROMISES.len()];
    for number in *first..(first + PATIENCE).min(drive.slots.len()) {
        let since = number - first;
        let outcome = drive.close(&mut monitor, number, Some((fault, since)));
        let is_violated = outcome.standing == Standing::Violated;
        let wanted = alarms.map(|it| it.is_none() && !is_violated);
        probe.hear(&outcome.measurements, truth(drive, number));
        let fits = probe.fits(&outcome.measurements, &wanted);
        for (alarm, fits) in alarms.iter_mut().zip(fits) {
            if alarm.is_none() && (is_violated || !fits) {
                *alarm = Some(since + 1);
            }
        }
        if alarms.iter().all(Option::is_some) {
            break;
        }
    }
    alarms
}

/// Times to the alarm in one recording and of one receiver, for each promise \[s\]; infinite: not in time.
#[allow(clippy::cast_precision_loss)] // Slots.
fn drifts(form: &Form, world: &GridWorld) -> [Vec<Vec<f64>>; RECEIVERS.len()] {
    let noise = Noise::new(form.seed, 0);
    let drive = Drive::new(
        world,
        Setting::FORGETFUL,
        Kind::Sl,
        [form.seed, 0],
        form.slots,
    );
    let last = drive.slots.len().saturating_sub(PATIENCE);
    let every = form.every(last);
    let begins = |number: usize| number < last && number % every == every / 2;
    let (_, begun) = honest(&drive, begins, false);
    RECEIVERS.map(|robot| {
        let of_one = |begin: &(usize, Monitor, Probe)| {
            let fault = Fault {
                source: Source::Fix(robot),
                direction_rad: direction(&noise, begin.0, 40 + robot),
                lie: Lie::Off {
                    metres: 0.0,
                    drift: DRIFT,
                },
            };
            follow(&drive, begin, &fault)
        };
        let all: Vec<_> = begun.par_iter().map(of_one).collect();
        let of_promise = |place: usize| {
            let times = all.iter().map(|it| it[place]);
            times
                .map(|it| it.map_or(f64::INFINITY, |it| it as f64 * SLOT_S))
                .collect()
        };
        (0..PROMISES.len()).map(of_promise).collect()
    })
}

/// What is found.
#[must_use]
pub fn find(form: &Form) -> Finding {
    found("Promises of means", form, |worlds, bars| {
        let mut broken = [0; PROMISES.len()];
        let mut slots = 0;
        for (_, world) in worlds {
            let runs = 0..form.runs;
            let of = |run: u16| {
                let seed = [form.seed, u64::from(run)];
                let drive = Drive::new(world, Setting::FORGETFUL, Kind::Sl, seed, form.slots);
                (drive.slots.len(), honest(&drive, |_| false, true).0)
            };
            let all: Vec<_> = runs.into_par_iter().map(of).collect();
            for (count, of_run) in all {
                slots += count;
                for (all, more) in broken.iter_mut().zip(of_run) {
                    *all += more;
                }
            }
        }
        let drifts: Vec<_> = worlds
            .iter()
            .map(|(number, world)| (*number, drifts(form, world)))
            .collect();
        table(&broken, slots, drifts, bars);
    })
}

type Drifts = Vec<(u32, [Vec<Vec<f64>>; RECEIVERS.len()])>;

#[allow(clippy::cast_precision_loss)] // Hundreds.
fn table(broken: &[usize], slots: usize, mut drifts: Drifts, bars: &mut Bars) {
    let mut table = Table::new([
        "mean of slots",
        "of a fix's bound",
        "of a sighting's",
        "honest slots that did not keep it",
        "at most",
        "alarm after so long at 0.05 m/s, s: median of R1, R2 in MR.CLAM 1, 6",
        "90 % of all",
        "not within 30 s",
    ]);
    let mut good = Vec::new();
    for (place, (count, fixes, sightings)) in PROMISES.into_iter().enumerate() {
        let mut medians = Vec::new();
        let mut all = Vec::new();
        for times in drifts.iter_mut().flat_map(|it| &mut it.1) {
            medians.push(quantile(&mut times[place], 0.5));
            all.extend(times[place].iter().copied());
        }
        let most = medians.iter().copied().fold(0.0, f64::max);
        if broken[place] == 0 && most <= BAR_S {
            good.push(format!("{count} slots, {fixes:.2}, {sightings:.2}"));
        }
        let late = all.iter().filter(|it| it.is_infinite()).count();
        let words: Vec<_> = medians.iter().map(|it| format!("{it:.1}")).collect();
        table.row([
            count.to_string(),
            format!("{fixes:.2}"),
            format!("{sightings:.2}"),
            format!("{} of {slots}", broken[place]),
            format!("{:.4} %", 100.0 * wilson(broken[place], slots)[1]),
            words.join(" "),
            format!("{:.1}", quantile(&mut all, 0.9)),
            late.to_string(),
        ]);
    }
    bars.table(&table.text());
    bars.hold(
        !good.is_empty(),
        &format!("kept in all {slots} honest slots, and a median of {BAR_S} s at most wherever it was measured (half of the specification's 12 to 17 s): {}", good.join("; ")),
    );
}
