//! The most likely robot, how surely it is that one, and what the drive does not show.
//!
//! A parameter counts from where it is configured, in units of how far off a configuration may be ([`Parameter::width`]). First all
//! are searched for, each held by a Gaussian of that width. What the drive has then not told at least [`SHOWN`] times as well as
//! that is not shown: it stays as configured, and all others are marginalised over its Gaussian. The others are searched for
//! again, with nothing that holds them: maximum likelihood, by scoring within a trust region. Who then goes off without end was
//! held by the Gaussian alone, such as a noise that is too small to be seen, and is not shown either.

use rayon::prelude::*;

use crate::drive::Drive;
use crate::likelihood::Innovations;
use crate::parameter::{Counted, Parameter};
use crate::robot::Robot;
use crate::slope::{Score, score};
use crate::start::guess;
use crate::symmetric::Cholesky;

/// What is shown is known so many times as well as before.
const SHOWN: f64 = 3.0;

/// Of a normal distribution, both sides of 95 %.
const SIDES_95: f64 = 1.959_963_984_540_054;

/// Of a difference that stands for a slope, in widths: a hundredth of the surest standard deviation.
const STEP: f64 = 1e-5;

/// The search ends where so little more likelihood is to be expected.
const LITTLE: f64 = 1e-4;

/// What a drive shows is held so little that it moves less than so many widths when it is let go.
const AWAY: f64 = 1.5;

const MOST_ROUNDS: usize = 60;

/// Farther than so many widths nothing goes at once.
const FARTHEST: f64 = 2.0;

/// What a drive says of one parameter.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Found {
    /// Of what.
    pub parameter: Parameter,
    /// As configured.
    pub before: f64,
    /// As found; as configured if it is not shown.
    pub after: f64,
    /// Where it is with 95 % confidence.
    pub interval: [f64; 2],
    /// Standard deviation after the drive over the one before.
    pub left: f64,
    /// Whether the drive shows it.
    pub shown: bool,
}

/// What a drive says of a robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// As configured, but for what the drive shows.
    pub robot: Robot,
    /// The most likely one, also in what is not shown.
    pub likely: Robot,
    /// Its parameters, one after another.
    pub found: Vec<Found>,
    /// How much more likely the drive is than as configured: logarithm of the ratio.
    pub gain: f64,
}

/// Why nothing can be said.
#[derive(Copy, Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoFit {
    /// No likelihood at all.
    #[error("with this configuration the drive is impossible: is it of this robot?")]
    Impossible,
    /// The matrix gives out.
    #[error("the search for the most likely robot came to nothing: is the configuration far off?")]
    Lost,
}

/// How far the search is: goes from 0 to 1.
pub type Progress<'a> = &'a (dyn Fn(f64) + Sync);

/// The robot that makes `drive` most likely, searched for from `start`.
///
/// # Errors
/// If there is none near it.
pub fn fit(drive: &Drive, start: &Robot, progress: Progress) -> Result<Fit, NoFit> {
    let all = Parameter::all(start, drive);
    let search = Search {
        drive,
        start,
        all: &all,
        progress,
    };
    let before = Innovations::of(drive, start).ok_or(NoFit::Impossible)?;
    let mut hold: Vec<Hold> = all.iter().map(|it| Hold::at_first(*it)).collect();
    let guess = guess(drive, start);
    let u = all
        .iter()
        .map(|it| (it.of(&guess) - it.of(start)) / it.width());
    let held = search.climb(u.collect(), &hold, [0.0, 0.6])?;
    for (index, hold) in hold.iter_mut().enumerate() {
        if held.sigma(index) * SHOWN <= 1.0 {
            *hold = Hold::Free;
        }
    }
    let at = search.let_go(&held, &mut hold)?;
    progress(1.0);
    Ok(search.told(&at, &hold, before.log_likelihood()))
}

/// How well `drive` can show the parameters `shown` of a robot that is `truth`, at best: the Cramér–Rao bound of each of their
/// standard deviations, in widths. The others are held as what is not shown.
#[must_use]
pub fn bound(drive: &Drive, truth: &Robot, shown: &[Parameter]) -> Option<Vec<f64>> {
    let all = Parameter::all(truth, drive);
    let search = Search {
        drive,
        start: truth,
        all: &all,
        progress: &|_| {},
    };
    let hold: Vec<Hold> = all
        .iter()
        .map(|it| {
            if it.is_of_the_drive() || shown.contains(it) {
                Hold::Free
            } else {
                Hold::Prior
            }
        })
        .collect();
    let at = search.place(vec![0.0; all.len()], &hold)?;
    let step = Step::new(&search.score(&at)?, &at.u, &hold);
    let top = Top {
        covariance: step.covariance()?,
        u: at.u,
        likelihood: at.likelihood,
    };
    let place = |it: &Parameter| all.iter().position(|other| other == it);
    shown.iter().map(|it| Some(top.sigma(place(it)?))).collect()
}

/// What holds a parameter where it is configured.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
enum Hold {
    /// A Gaussian as wide as the configuration may be off.
    Prior,
    /// Nothing.
    Free,
}

impl Hold {
    fn at_first(parameter: Parameter) -> Self {
        if parameter.is_of_the_drive() {
            Self::Free
        } else {
            Self::Prior
        }
    }

    fn information(self) -> f64 {
        match self {
            Self::Prior => 1.0,
            Self::Free => 0.0,
        }
    }
}

struct Search<'a> {
    drive: &'a Drive,
    start: &'a Robot,
    all: &'a [Parameter],
    progress: Progress<'a>,
}

/// Where a search is.
struct Place {
    /// In widths from the start.
    u: Vec<f64>,
    innovations: Innovations,
    likelihood: f64,
}

/// Where a search has ended.
struct Top {
    u: Vec<f64>,
    likelihood: f64,
    /// Row-major, in widths.
    covariance: Vec<f64>,
}

impl Top {
    fn sigma(&self, index: usize) -> f64 {
        self.covariance[index * (self.u.len() + 1)].sqrt()
    }
}

impl Search<'_> {
    fn robot(&self, u: &[f64]) -> Robot {
        let mut robot = self.start.clone();
        for (parameter, u) in self.all.iter().zip(u) {
            let value = parameter.of(self.start);
            let moved = match parameter.counted() {
                Counted::Plain => value + parameter.width() * u,
                Counted::Log => value * (parameter.width() * u).exp(),
            };
            if *u != 0.0 {
                parameter.set(&mut robot, moved);
            }
        }
        robot
    }

    fn innovations(&self, u: &[f64]) -> Option<Innovations> {
        Innovations::of(self.drive, &self.robot(u))
    }

    fn place(&self, u: Vec<f64>, hold: &[Hold]) -> Option<Place> {
        let innovations = self.innovations(&u)?;
        let held = u
            .iter()
            .zip(hold)
            .map(|(u, hold)| hold.information() * u * u);
        let likelihood = innovations.log_likelihood() - 0.5 * held.sum::<f64>();
        likelihood.is_finite().then_some(Place {
            u,
            innovations,
            likelihood,
        })
    }

    /// Gradient and information of all parameters.
    fn score(&self, at: &Place) -> Option<Score> {
        let ahead = |index: usize| {
            let mut u = at.u.clone();
            u[index] += STEP;
            self.innovations(&u)
        };
        let ahead: Option<Vec<Innovations>> =
            (0..self.all.len()).into_par_iter().map(ahead).collect();
        Some(score(&at.innovations, &ahead?, STEP))
    }

    /// From where all are held to where those that are shown are free. Who goes off is held again.
    fn let_go(&self, held: &Top, hold: &mut [Hold]) -> Result<Top, NoFit> {
        loop {
            let free = |index: &usize| hold[*index] == Hold::Free && !self.is_of_the_drive(*index);
            let free: Vec<usize> = (0..hold.len()).filter(free).collect();
            let top = self.climb(held.u.clone(), hold, [0.6, 1.0]);
            let gone = |index: &usize| match &top {
                Ok(top) => {
                    (top.u[*index] - held.u[*index]).abs() > AWAY || top.sigma(*index) * SHOWN > 1.1
                }
                Err(_) => false,
            };
            let mut gone: Vec<usize> = free.iter().copied().filter(gone).collect();
            if gone.is_empty() && top.is_err() {
                let least = |a: &usize, b: &usize| held.sigma(*a).total_cmp(&held.sigma(*b));
                gone.extend(free.into_iter().max_by(least));
            }
            if gone.is_empty() {
                return top;
            }
            for index in gone {
                hold[index] = Hold::Prior;
            }
        }
    }

    fn is_of_the_drive(&self, index: usize) -> bool {
        self.all[index].is_of_the_drive()
    }

    /// From `u` to where it is most likely.
    fn climb(&self, u: Vec<f64>, hold: &[Hold], [from, to]: [f64; 2]) -> Result<Top, NoFit> {
        let begin = u.clone();
        let mut at = self.place(u, hold).ok_or(NoFit::Impossible)?;
        let mut damping = 1e-6;
        for round in 0..MOST_ROUNDS {
            let done = 1.0 - 0.75_f64.powi(i32::try_from(round).unwrap_or(i32::MAX));
            (self.progress)(from + (to - from) * done);
            let score = self.score(&at).ok_or(NoFit::Lost)?;
            let step = Step::new(&score, &at.u, hold);
            let (next, expected) = self.better(&at, &step, hold, &mut damping);
            let ended = expected < LITTLE || next.is_none();
            if let Some(next) = next {
                at = next;
            }
            if ended || self.is_away(&begin, &at.u, hold) {
                break;
            }
        }
        let score = self.score(&at).ok_or(NoFit::Lost)?;
        let covariance = Step::new(&score, &at.u, hold).covariance();
        Ok(Top {
            covariance: covariance.ok_or(NoFit::Lost)?,
            u: at.u,
            likelihood: at.likelihood,
        })
    }

    /// Whether something that nothing holds has gone off.
    fn is_away(&self, begin: &[f64], u: &[f64], hold: &[Hold]) -> bool {
        let gone = |index: usize| {
            let of_robot = hold[index] == Hold::Free && !self.is_of_the_drive(index);
            of_robot && (u[index] - begin[index]).abs() > AWAY
        };
        (0..u.len()).any(gone)
    }

    /// A place that is better, and how much better it was expected to be.
    fn better(
        &self,
        at: &Place,
        step: &Step,
        hold: &[Hold],
        damping: &mut f64,
    ) -> (Option<Place>, f64) {
        let mut most = 0.0;
        for _ in 0..MOST_TRIES {
            let Some((moved, expected)) = step.moved(*damping) else {
                *damping = (*damping * 10.0).max(1e-6);
                continue;
            };
            most = f64::max(most, expected);
            let u = at.u.iter().zip(&moved).map(|(u, moved)| u + moved);
            let next = self.place(u.collect(), hold);
            if let Some(next) = next.filter(|next| next.likelihood > at.likelihood) {
                *damping *= 0.1;
                return (Some(next), expected);
            }
            if expected < LITTLE {
                break;
            }
            *damping = (*damping * 10.0).max(1e-4);
        }
        (None, most)
    }

    fn told(&self, top: &Top, hold: &[Hold], before: f64) -> Fit {
        let shown = |index: usize| hold[index] == Hold::Free;
        let written = (0..top.u.len()).map(|it| if shown(it) { top.u[it] } else { 0.0 });
        let robot = self.robot(&written.collect::<Vec<f64>>());
        let of_robot = (0..top.u.len()).filter(|index| !self.is_of_the_drive(*index));
        let found = of_robot.map(|index| {
            let parameter = self.all[index];
            let sigma = top.sigma(index);
            let end = |side: f64| {
                let mut u = top.u.clone();
                u[index] += side * SIDES_95 * sigma;
                parameter.of(&self.robot(&u))
            };
            Found {
                parameter,
                before: parameter.of(self.start),
                after: parameter.of(&robot),
                interval: [end(-1.0), end(1.0)],
                left: sigma,
                shown: shown(index),
            }
        });
        Fit {
            found: found.collect(),
            likely: self.robot(&top.u),
            gain: top.likelihood - before,
            robot,
        }
    }
}

const MOST_TRIES: usize = 12;

/// The system of equations of a step.
struct Step {
    gradient: Vec<f64>,
    information: Vec<f64>,
}

impl Step {
    fn new(score: &Score, u: &[f64], hold: &[Hold]) -> Self {
        let size = u.len();
        let mut information = score.information.clone();
        for (index, hold) in hold.iter().enumerate() {
            information[index * (size + 1)] += hold.information();
        }
        let gradient = score.gradient.iter().zip(u).zip(hold);
        Self {
            gradient: gradient
                .map(|((slope, u), hold)| slope - hold.information() * u)
                .collect(),
            information,
        }
    }

    fn covariance(&self) -> Option<Vec<f64>> {
        let size = self.gradient.len();
        Some(Cholesky::new(&self.information, size)?.inverse())
    }

    /// The step, and the likelihood that it gains if all is as it seems.
    fn moved(&self, damping: f64) -> Option<(Vec<f64>, f64)> {
        let size = self.gradient.len();
        let mut matrix = self.information.clone();
        for index in 0..size {
            matrix[index * (size + 1)] *= 1.0 + damping;
            matrix[index * (size + 1)] += damping;
        }
        let mut moved = Cholesky::new(&matrix, size)?.solve(&self.gradient);
        let farthest = moved.iter().fold(0.0, |most: f64, it| most.max(it.abs()));
        if farthest > FARTHEST {
            for it in &mut moved {
                *it *= FARTHEST / farthest;
            }
        }
        let expected: f64 = moved.iter().zip(&self.gradient).map(|(a, b)| a * b).sum();
        Some((moved, 0.5 * expected))
    }
}
