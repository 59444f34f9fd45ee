//! From a drive to landmarks.

use std::collections::{BTreeMap, BTreeSet};

use coloc_estimator::angle::wrap;
use nalgebra::{Matrix2, Vector2};

use super::model::{self, Equation, Errors, Slowness, Spread, State, of_fix, of_sighting};
use super::normal::{NODE, Place, PlaceBlock, Solution, System};
use super::path::{Increment, increments, node_of, times};
use super::{Enough, Found, Journey, Leg, NoSurvey, Sighting, Slow, Survey, Unfit};

/// Rounds at most with soft weights, and then with what is far off left out.
const SOFT: usize = 12;
const HARD: usize = 6;

/// Nothing moves farther in a round: done \[m\].
const STILL_M: f64 = 1e-4;

/// A d² of this has half the weight, while weights are soft: what one in twenty would exceed.
const HALF_WEIGHT: f64 = 6.0;

/// χ² with two degrees of freedom: 99.9 %, and the middle.
const FAR: f64 = 13.815_510_557_964_274;
const MIDDLE: f64 = 1.386_294_361_119_891;

/// So many fixes at least.
const FIXES: usize = 10;

/// Finds the landmarks of a drive; `progress` is told the part that is done.
///
/// # Errors
/// What is missing in it.
pub fn survey(
    journey: &Journey,
    enough: &Enough,
    progress: &dyn Fn(f64),
) -> Result<Survey, NoSurvey> {
    let mut problem = Problem::new(journey)?;
    let rounds = f64::from(u16::try_from(SOFT + HARD).unwrap_or(u16::MAX));
    let mut done = 0.0;
    let mut covariances = Vec::new();
    for (limit, is_soft) in [(SOFT, true), (HARD, false)] {
        for round in 0..limit {
            problem.weigh(is_soft);
            let solution = problem.system().solve().ok_or(NoSurvey::Unsolvable)?;
            let moved = problem.step(&solution);
            covariances = solution.covariances;
            progress((done + f64::from(u16::try_from(round + 1).unwrap_or(u16::MAX))) / rounds);
            // Once more where weights were soft a round ago, so that what is left out is.
            if moved < STILL_M && round > 0 {
                break;
            }
        }
        done += f64::from(u16::try_from(limit).unwrap_or(u16::MAX));
    }
    Ok(problem.told(&covariances, enough))
}

/// What is measured at a node.
struct Measured {
    node: usize,
    of: Of,
    /// Of its weight, what is left to it.
    part: f64,
}

#[derive(Copy, Clone)]
enum Of {
    Fix(super::Fix),
    /// Of the landmark with that index.
    Sighting(super::Sighting, usize, Spread),
}

struct Problem {
    times: Vec<f64>,
    increments: Vec<Increment>,
    slowness: Slowness,
    spell_s: f64,
    slow: [Slow; 2],
    stays: [f64; 2],
    measured: Vec<Measured>,
    numbers: Vec<u16>,
    states: Vec<State>,
    places: Vec<Place>,
    /// What the sensor errs by for the whole drive: a part of the range, and of the bearing \[rad\].
    sensor: Place,
    /// Of sightings and fixes, variances: by so much larger than they say.
    larger: [f64; 2],
}

impl Problem {
    fn new(journey: &Journey) -> Result<Self, NoSurvey> {
        if journey.fixes.len() < FIXES {
            return Err(NoSurvey::Fixes(journey.fixes.len()));
        }
        if journey.sightings.is_empty() {
            return Err(NoSurvey::Sightings);
        }
        let sights = journey.sightings.iter().map(|it| it.stamp_s);
        let times = times(
            sights
                .chain(journey.fixes.iter().map(|it| it.stamp_s))
                .collect(),
        );
        let mut legs: Vec<Leg> = journey.legs.clone();
        legs.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
        let numbers: BTreeSet<u16> = journey.sightings.iter().map(|it| it.landmark).collect();
        let numbers: Vec<u16> = numbers.into_iter().collect();
        let states = beginning(journey, &times)?;
        let index = |number: u16| numbers.partition_point(|it| *it < number);
        let measured = |stamp_s, of| Measured {
            node: node_of(&times, stamp_s),
            of,
            part: 1.0,
        };
        let errors = Errors {
            own: journey.own,
            stays: journey.stays,
        };
        let seen = (journey.sightings.iter().zip(repeats(journey))).map(|(it, repeats)| {
            let spread = Spread::of(it, &errors, repeats);
            measured(it.stamp_s, Of::Sighting(*it, index(it.landmark), spread))
        });
        let fixed = journey
            .fixes
            .iter()
            .map(|it| measured(it.stamp_s, Of::Fix(*it)));
        let measured: Vec<Measured> = seen.chain(fixed).collect();
        let spell_s = journey
            .sighting_slow
            .iter()
            .fold(1.0, |most: f64, it| most.max(it.time_s));
        Ok(Self {
            increments: increments(&times, &legs),
            slowness: Slowness::of(journey.sighting_slow, journey.fix_slow),
            spell_s,
            slow: journey.sighting_slow,
            stays: journey.stays,
            sensor: Place::zeros(),
            places: places(&measured, &states, numbers.len()),
            measured,
            numbers,
            states,
            larger: [1.0; 2],
            times,
        })
    }

    fn equation(&self, it: &Measured) -> Equation {
        let state = &self.states[it.node];
        match &it.of {
            Of::Fix(fix) => of_fix(fix, state),
            Of::Sighting(sighting, landmark, spread) => {
                let place = (*landmark, &self.places[*landmark]);
                of_sighting(sighting, place, &self.sensor, state, spread)
            }
        }
    }

    /// How much larger the errors are than they say, by their middle, and what weight is left to each that is far off.
    fn weigh(&mut self, is_soft: bool) {
        let distances: Vec<f64> = self
            .measured
            .iter()
            .map(|it| self.equation(it).distance())
            .collect();
        let of_kind = |kind: usize| {
            let all = self.measured.iter().zip(&distances);
            all.filter(|(it, _)| it.of.kind() == kind)
                .map(|(_, it)| *it)
                .collect()
        };
        self.larger = [0, 1].map(|kind| (median(of_kind(kind)) / MIDDLE).max(1.0));
        for (it, distance) in self.measured.iter_mut().zip(distances) {
            let off = distance / self.larger[it.of.kind()];
            it.part = if is_soft {
                1.0 / (1.0 + off / HALF_WEIGHT)
            } else {
                f64::from(u8::from(off <= FAR))
            };
        }
    }

    fn system(&self) -> System {
        let mut system = System::new(self.times.len(), self.numbers.len());
        model::anywhere(&mut system, &self.sensor, self.slow);
        self.slowness.begin(&mut system, &self.states[0]);
        for (at, said) in self.increments.iter().enumerate() {
            let states = [&self.states[at], &self.states[at + 1]];
            let dt_s = self.times[at + 1] - self.times[at];
            model::drive(&mut system, at, states, said);
            self.slowness.over(&mut system, at, states, dt_s);
        }
        for it in &self.measured {
            self.equation(it).add(&mut system, it.node, self.factor(it));
        }
        system
    }

    fn factor(&self, it: &Measured) -> f64 {
        it.part / self.larger[it.of.kind()]
    }

    /// How far anything moved \[m\].
    fn step(&mut self, solution: &Solution) -> f64 {
        let mut moved: f64 = 0.0;
        for (state, step) in self.states.iter_mut().zip(&solution.nodes) {
            *state += step;
            state[2] = wrap(state[2]);
            moved = moved.max(step[0].hypot(step[1]));
        }
        for (place, step) in self.places.iter_mut().zip(&solution.landmarks) {
            *place += step;
            moved = moved.max(step.norm());
        }
        self.sensor += solution.landmarks[self.places.len()];
        moved
    }

    fn told(&self, covariances: &[PlaceBlock], enough: &Enough) -> Survey {
        let found = |index: usize| {
            self.found(
                index,
                covariances[index] + self.of_what_stays(index),
                enough,
            )
        };
        let stray = |it: &&Measured| it.of.kind() == 1 && it.part <= 0.0;
        Survey {
            landmarks: (0..self.numbers.len()).map(found).collect(),
            larger: self.larger.map(f64::sqrt),
            stray_fixes: self.measured.iter().filter(stray).count(),
        }
    }

    /// What a landmark's place errs by because the sensor errs about it for the whole drive: nothing where it is seen from all sides.
    fn of_what_stays(&self, index: usize) -> Matrix2<f64> {
        let own = self
            .measured
            .iter()
            .filter(|it| it.of.landmark() == Some(index));
        let terms = own.filter_map(|it| self.equation(it).of_place(self.factor(it)));
        let [whole, pull] = terms.fold([PlaceBlock::zeros(); 2], |[a, b], [c, d]| [a + c, b + d]);
        let moved = whole.try_inverse().unwrap_or_else(PlaceBlock::zeros) * pull;
        let variances = Place::from(self.stays.map(|it| it * it));
        moved * PlaceBlock::from_diagonal(&variances) * moved.transpose()
    }

    fn found(&self, index: usize, covariance: Matrix2<f64>, enough: &Enough) -> Found {
        let own = || {
            self.measured
                .iter()
                .filter(|it| it.of.landmark() == Some(index))
        };
        let agree = || own().filter(|it| it.part > 0.0);
        let mut spells: Vec<f64> = Vec::new();
        for it in agree() {
            let stamp_s = self.times[it.node];
            if spells
                .iter()
                .all(|begun| (stamp_s - begun).abs() > self.spell_s)
            {
                spells.push(stamp_s);
            }
        }
        let found = Found {
            landmark: self.numbers[index],
            position: [self.places[index][0], self.places[index][1]],
            covariance,
            sightings: [agree().count(), own().count() - agree().count()],
            unfit: None,
        };
        Found {
            unfit: unfit(&found, spells.len(), enough),
            ..found
        }
    }
}

impl Of {
    /// 0 of a sighting, 1 of a fix.
    fn kind(&self) -> usize {
        match self {
            Self::Sighting(..) => 0,
            Self::Fix(_) => 1,
        }
    }

    fn landmark(&self) -> Option<usize> {
        match self {
            Self::Sighting(_, landmark, _) => Some(*landmark),
            Self::Fix(_) => None,
        }
    }
}

#[allow(clippy::cast_precision_loss)] // Far below 2^53.
fn unfit(found: &Found, spells: usize, enough: &Enough) -> Option<Unfit> {
    let [agree, stray] = found.sightings;
    let part = stray as f64 / (agree + stray).max(1) as f64;
    let sigma_m = found.sigma_m();
    if part > enough.stray {
        Some(Unfit::Stray { part })
    } else if agree < enough.sightings {
        Some(Unfit::Few {
            sightings: agree,
            needed: enough.sightings,
        })
    } else if spells < enough.spells {
        Some(Unfit::Brief {
            spells,
            needed: enough.spells,
        })
    } else if sigma_m > enough.sigma_m {
        Some(Unfit::Vague { sigma_m })
    } else {
        None
    }
}

/// How many sightings of its landmark share the errors of each, by how long range and bearing err the same.
fn repeats(journey: &Journey) -> Vec<[f64; 2]> {
    let mut stamps: BTreeMap<u16, Vec<f64>> = BTreeMap::new();
    for it in &journey.sightings {
        stamps.entry(it.landmark).or_default().push(it.stamp_s);
    }
    let shared = |it: &Sighting, slow: Slow| {
        let apart_s = stamps[&it.landmark]
            .iter()
            .map(|other| (other - it.stamp_s).abs());
        apart_s.map(|apart_s| (-apart_s / slow.time_s).exp()).sum()
    };
    let of = |it: &Sighting| journey.sighting_slow.map(|slow| shared(it, slow));
    journey.sightings.iter().map(of).collect()
}

/// As it was believed at each node, with sensors that do not err.
fn beginning(journey: &Journey, times: &[f64]) -> Result<Vec<State>, NoSurvey> {
    let mut believed = journey.believed.clone();
    believed.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let stamps: Vec<f64> = believed.iter().map(|(stamp_s, _)| *stamp_s).collect();
    if believed.is_empty() {
        return Err(NoSurvey::Path);
    }
    let state = |time_s: &f64| {
        let (_, [x, y, heading]) = believed[node_of(&stamps, *time_s)];
        let mut numbers = [0.0; NODE];
        numbers[..3].copy_from_slice(&[x, y, heading]);
        State::from_column_slice(&numbers)
    };
    Ok(times.iter().map(state).collect())
}

/// Each in the middle of where it was seen from the path as it was believed.
fn places(measured: &[Measured], states: &[State], count: usize) -> Vec<Place> {
    let mut points: BTreeMap<usize, [Vec<f64>; 2]> = BTreeMap::new();
    for it in measured {
        if let Of::Sighting(sighting, landmark, _) = it.of {
            let state = &states[it.node];
            let mount = super::path::rotation(state[2]) * Vector2::from(sighting.mount);
            let (sin, cos) = (state[2] + sighting.bearing_rad).sin_cos();
            let [xs, ys] = points.entry(landmark).or_default();
            xs.push(state[0] + mount.x + sighting.range_m * cos);
            ys.push(state[1] + mount.y + sighting.range_m * sin);
        }
    }
    let middle = |index: usize| {
        let [xs, ys] = points.remove(&index).unwrap_or_default();
        Place::new(median(xs), median(ys))
    };
    (0..count).map(middle).collect()
}

fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers.get(numbers.len() / 2).copied().unwrap_or_default()
}
