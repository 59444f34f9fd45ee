//! Half an hour without a fix.
//!
//! A cell is a noise, a way of turning and how well the heading was known at the start. All robots of it are told the same
//! motion, so that each filter runs once. A heading that is wrong from the start turns the whole of a true way about where it
//! began: the robots of a noise and a turning are those of all its six cells.

mod page;

use std::f64::consts::PI;

use coloc_estimator::{Belief, Covariance3, Pose};
use rayon::prelude::*;

use super::Form;
use super::filter::Filter;
use super::increment::{Increment, Place};
use super::score::{Score, nees};
use super::sort::Sort;
use super::turning::{STRETCH_S, Turning};
use crate::random::{Noise, Purpose};

pub use page::find;

/// When it is looked \[s\].
pub const LOOKS_S: [u32; 4] = [30, 90, 600, 1800];

/// Standard deviation of the heading at the start \[rad\].
pub const STARTS: [f64; 6] = [0.0, 0.02, 0.3, 1.0, 1.8, PI];

/// What robots are told.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct World {
    /// Their noise.
    pub sort: Sort,
    /// Their turns.
    pub turning: Turning,
}

/// What came of a cell.
#[derive(Clone, Debug)]
pub struct Cell {
    /// Which noise and which turns.
    pub world: World,
    /// σ of the heading at the start \[rad\].
    pub start: f64,
    /// At each look.
    pub looks: [Look; LOOKS_S.len()],
}

/// At one time.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Look {
    /// σ of the heading \[rad\].
    pub heading: f64,
    /// Of each of [`Filter::ALL`].
    pub scores: [Score; Filter::ALL.len()],
}

impl Look {
    /// Of the estimator.
    #[must_use]
    pub fn own(&self) -> &Score {
        &self.scores[Filter::ALL.len() - 1]
    }
}

/// Every cell of the form.
#[must_use]
pub fn cells(form: &Form) -> Vec<Cell> {
    worlds()
        .enumerate()
        .flat_map(|(number, world)| world.cells(form, number))
        .collect()
}

/// Every noise with every turning.
fn worlds() -> impl Iterator<Item = World> {
    let with = |sort| Turning::ALL.map(|turning| World { sort, turning });
    Sort::ALL.into_iter().flat_map(with)
}

impl World {
    /// Its cells, one for each of [`STARTS`]; `number` is that of the world.
    fn cells(&self, form: &Form, number: usize) -> Vec<Cell> {
        let noise = Noise::new(form.seed, 0);
        let rates = self.rates(&noise, number);
        let ways = self.ways(form, &noise, &rates, number);
        STARTS
            .par_iter()
            .map(|&start| self.cell(form, start, &rates, &ways))
            .collect()
    }

    /// The turning rate of every stretch.
    fn rates(&self, noise: &Noise, number: usize) -> Vec<f64> {
        let stretches = LOOKS_S.into_iter().max().unwrap_or(0) / STRETCH_S;
        (0..stretches as usize)
            .map(|stretch| self.turning.rate(noise, stretch, number))
            .collect()
    }

    /// Of every robot: where it is at each look if it began at the origin, along x; and how wrong its heading was in units of
    /// its standard deviation.
    fn ways(&self, form: &Form, noise: &Noise, rates: &[f64], number: usize) -> Vec<Way> {
        let dt_s = form.dt_s();
        let variances = self.sort.per_second().map(|it| it * dt_s);
        let increments: Vec<_> = rates
            .iter()
            .map(|rate| Increment::new([dt_s, 0.0, rate * dt_s], variances))
            .collect();
        let ticks = form.rate_hz * STRETCH_S;
        (0..form.robots)
            .into_par_iter()
            .map(|robot| Way {
                wrong: noise.draws(Purpose::Start, 0, robot, number).normal(),
                places: places(&increments, ticks, noise, [robot, number]),
            })
            .collect()
    }

    fn cell(&self, form: &Form, start: f64, rates: &[f64], ways: &[Way]) -> Cell {
        let mut looks = [Look::default(); LOOKS_S.len()];
        for (filter, kind) in Filter::ALL.into_iter().enumerate() {
            let beliefs = self.beliefs(kind, form, start, rates);
            for (index, (look, belief)) in looks.iter_mut().zip(&beliefs).enumerate() {
                let errors = ways.iter().map(|way| way.error(start, index, &belief.pose));
                let total = belief.total();
                errors.for_each(|error| look.scores[filter].add(nees(error, &total)));
                look.heading = total.variances()[2].sqrt();
            }
        }
        Cell {
            world: *self,
            start,
            looks,
        }
    }

    /// What the filter believes at each look.
    fn beliefs(&self, filter: Filter, form: &Form, start: f64, rates: &[f64]) -> Vec<Belief> {
        let covariance = Covariance3::diagonal([0.0, 0.0, start * start]).unwrap_or_default();
        let mut belief = Belief::independent(Pose::default(), covariance);
        let mut beliefs = Vec::new();
        for (stretch, &rate) in (1..).zip(rates) {
            let motion = self.sort.motion(rate, form.dt_s());
            for _ in 0..form.rate_hz * STRETCH_S {
                belief = filter.step(&belief, &motion, form.dt_s());
            }
            if LOOKS_S.contains(&(stretch * STRETCH_S)) {
                beliefs.push(belief);
            }
        }
        beliefs
    }
}

/// A robot's.
#[derive(Copy, Clone, Debug)]
struct Way {
    wrong: f64,
    places: [[f64; 2]; LOOKS_S.len()],
}

impl Way {
    /// What `mean` is off by, if the robot started as wrong as that.
    fn error(&self, start: f64, look: usize, mean: &Pose) -> [f64; 2] {
        let [x, y] = self.places[look];
        let (sin, cos) = libm::sincos(start * self.wrong);
        [cos * x - sin * y - mean.x, sin * x + cos * y - mean.y]
    }
}

/// At each look; a stretch of each of `increments`, of so many ticks.
fn places(
    increments: &[Increment],
    ticks: u32,
    noise: &Noise,
    [robot, number]: [usize; 2],
) -> [[f64; 2]; LOOKS_S.len()] {
    let mut draws = noise.draws(Purpose::TrueWay, 0, robot, number);
    let mut places = [[0.0; 2]; LOOKS_S.len()];
    let mut place = Place::default();
    for (stretch, increment) in (1..).zip(increments) {
        (0..ticks).for_each(|_| increment.drive(&mut place, &mut draws));
        if let Some(look) = LOOKS_S.iter().position(|&s| s == stretch * STRETCH_S) {
            places[look] = place.position;
        }
    }
    places
}

#[cfg(test)]
mod tests {
    use super::page::missed;
    use super::*;

    fn form() -> Form {
        Form {
            robots: 2000,
            rate_hz: 2,
            ..Form::short(1)
        }
    }

    fn straight(sort: Sort) -> Vec<Cell> {
        let turning = Turning::Steady(0.0);
        World { sort, turning }.cells(&form(), 0)
    }

    /// The same bars: what forgets the bend at every step is found out, what carries it is not.
    #[test]
    fn whoever_forgets_the_bend_is_found_dishonest() {
        for cell in straight(Sort::Paper).iter().chain(&straight(Sort::Sane)) {
            assert_eq!(missed(cell), Vec::<String>::new());
            let forgets_late =
                cell.start < 1.5 && !(cell.start < 0.1 && cell.world.sort == Sort::Sane);
            for (rival, score) in Filter::ALL.iter().zip(&cell.looks[2].scores).take(3) {
                assert!(
                    !(forgets_late && score.is_honest()),
                    "{rival:?} at {}: {score:?}",
                    cell.start
                );
            }
        }
    }

    #[test]
    fn threads_change_nothing() {
        let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let run = |threads| {
            let small = Form {
                robots: 50,
                ..form()
            };
            let world = World {
                sort: Sort::Sideways,
                turning: Turning::Random,
            };
            let pool = pool(threads).expect("threads");
            pool.install(|| format!("{:?}", world.cells(&small, 3)))
        };
        assert_eq!(run(1), run(3));
    }
}
