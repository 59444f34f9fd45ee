//! Fixes that say next to nothing, all the way, and all of them taken.
//!
//! Each is a measurement; a filter that forgets at every measurement how the distribution bends forgets at their rate.

use coloc_estimator::{Belief, Covariance2, Covariance3, Pose, fix};
use rayon::prelude::*;

use super::filter::{Filter, straightened};
use super::increment::{Increment, Place};
use super::score::{Score, nees};
use super::sort::Sort;
use super::table::{Table, digits, percent};
use super::{Finding, Form};
use crate::random::{Draws, Noise, Purpose};

/// Of a fix \[m\].
const SIGMA_M: f64 = 30.0;

/// Fixes in a second.
const RATE_HZ: u32 = 10;

/// Of x and y at the start \[m\].
const START_M: f64 = 0.1;

/// When it is looked \[s\].
const LOOKS_S: [u32; 2] = [30, 100];

/// The highest mean NEES after 30 s, where the heading was known to [`HELD_RAD`].
const BAR: f64 = 2.4;
const HELD_RAD: f64 = 0.3;

/// What an independent implementation of the same equations found at each look, for each of [`Rival::ALL`], where it says so.
type Document = [[Option<&'static str>; 3]; LOOKS_S.len()];

/// How well the heading was known at the start \[rad\].
const STARTS: [(f64, Document); 2] = [
    (
        HELD_RAD,
        [[Some("22"), Some("24"), Some("2.04")], [None; 3]],
    ),
    (
        1.0,
        [
            [Some("121"), Some("207"), Some("4.2")],
            [None, None, Some("33")],
        ],
    ),
];

/// Who is told of them.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
enum Rival {
    Cubature,
    /// The estimator, its bend dropped at every fix.
    Zeroed,
    Estimator,
}

impl Rival {
    const ALL: [Self; 3] = [Self::Cubature, Self::Zeroed, Self::Estimator];

    fn propagation(self) -> Filter {
        match self {
            Self::Cubature => Filter::Cubature,
            Self::Zeroed | Self::Estimator => Filter::Carried,
        }
    }

    fn told(self, belief: &Belief, position: [f64; 2], noise: &Covariance2) -> Belief {
        let after = fix::update(belief, position, noise, f64::INFINITY).belief;
        match self {
            Self::Zeroed => straightened(&after),
            Self::Cubature | Self::Estimator => after,
        }
    }
}

/// One robot with one filter.
struct Robot {
    rival: Rival,
    belief: Belief,
    place: Place,
    way: Draws,
    fixes: Draws,
}

impl Robot {
    fn new(rival: Rival, start: f64, noise: &Noise, robot: usize) -> Self {
        let [x, y, phi] = noise.draws(Purpose::Start, 0, robot, 0).normals();
        let variances = [START_M, START_M, start].map(|it| it * it);
        Self {
            rival,
            belief: Belief::independent(
                Pose::default(),
                Covariance3::diagonal(variances).unwrap_or_default(),
            ),
            place: Place {
                position: [START_M * x, START_M * y],
                heading: start * phi,
            },
            way: noise.draws(Purpose::TrueWay, 0, robot, 0),
            fixes: noise.draws(Purpose::Fix, 0, robot, 0),
        }
    }

    /// eᵀ P⁻¹ e at each look that `seconds` reach.
    fn run(mut self, rate_hz: u32, seconds: u32) -> Vec<f64> {
        let dt_s = 1.0 / f64::from(rate_hz);
        let increment = Increment::new(
            [dt_s, 0.0, 0.0],
            Sort::Sane.per_second().map(|it| it * dt_s),
        );
        let (filter, motion) = (self.rival.propagation(), Sort::Sane.motion(0.0, dt_s));
        let mut looks = Vec::new();
        for tick in 1..=rate_hz * seconds {
            increment.drive(&mut self.place, &mut self.way);
            self.belief = filter.step(&self.belief, &motion, dt_s);
            if tick.is_multiple_of(rate_hz / RATE_HZ) {
                self.fix();
            }
            if LOOKS_S.iter().any(|look| look * rate_hz == tick) {
                looks.push(self.nees());
            }
        }
        looks
    }

    fn fix(&mut self) {
        let variance = SIGMA_M * SIGMA_M;
        let noise = Covariance2::diagonal([variance, variance]).unwrap_or_default();
        let [x, y] = self.place.position;
        let [a, b] = self.fixes.normals();
        let position = [x + SIGMA_M * a, y + SIGMA_M * b];
        self.belief = self.rival.told(&self.belief, position, &noise);
    }

    fn nees(&self) -> f64 {
        let [x, y] = self.place.position;
        let pose = self.belief.pose;
        nees([pose.x - x, pose.y - y], &self.belief.total())
    }
}

/// At each look.
fn scores(form: &Form, rival: Rival, start: f64) -> Vec<Score> {
    let noise = Noise::new(form.seed, 1);
    let robots: Vec<_> = (0..form.robots)
        .into_par_iter()
        .map(|robot| Robot::new(rival, start, &noise, robot).run(form.rate_hz, form.weak_seconds))
        .collect();
    let looks = robots.first().map_or(0, Vec::len);
    let mut scores = vec![Score::default(); looks];
    for nees in &robots {
        scores
            .iter_mut()
            .zip(nees)
            .for_each(|(score, &nees)| score.add(nees));
    }
    scores
}

/// Runs it and holds it to its bar.
#[must_use]
pub fn find(form: &Form) -> Finding {
    let mut table = Table::new([
        "heading before",
        "after",
        "cubature",
        "bend dropped at a fix",
        "coloc",
    ]);
    let mut missed = Vec::new();
    for (start, elsewhere) in STARTS {
        let found = Rival::ALL.map(|rival| scores(form, rival, start));
        for (look, seconds) in (0..found[2].len()).zip(LOOKS_S) {
            let scores = found.each_ref().map(|scores| scores[look]);
            table.row(row(start, seconds, &scores, &elsewhere[look]));
        }
        missed.extend(missed_bar(start, &found[2]));
    }
    Finding {
        title: format!(
            "Fixes that say little: 30 m at 10 Hz, sane noise, straight, {} robots, {} Hz",
            form.robots, form.rate_hz
        ),
        text: format!(
            "Mean NEES (in brackets what another implementation found) / share outside:\n\n{}",
            table.text()
        ),
        missed,
    }
}

fn row(
    start: f64,
    seconds: u32,
    scores: &[Score; 3],
    elsewhere: &[Option<&str>; 3],
) -> [String; 5] {
    let [a, b, c] = [0, 1, 2].map(|rival| {
        let theirs = elsewhere[rival].map_or(String::new(), |it| format!(" ({it})"));
        let (nees, outside) = (scores[rival].nees(), scores[rival].outside());
        format!("{}{theirs} / {}", digits(nees), percent(outside))
    });
    [format!("{start} rad"), format!("{seconds} s"), a, b, c]
}

fn missed_bar(start: f64, own: &[Score]) -> Option<String> {
    let nees = own.first()?.nees();
    let holds = start > HELD_RAD || nees <= BAR;
    (!holds).then(|| {
        format!("heading known to {start} rad, 30 s: mean NEES {nees:.3}, more than {BAR}")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whoever_drops_the_bend_at_every_fix_is_found_out() {
        let form = Form {
            robots: 500,
            weak_seconds: 30,
            ..Form::short(1)
        };
        let at_30 = |rival| scores(&form, rival, HELD_RAD);
        assert_eq!(missed_bar(HELD_RAD, &at_30(Rival::Estimator)), None);
        for rival in [Rival::Zeroed, Rival::Cubature] {
            assert!(missed_bar(HELD_RAD, &at_30(rival)).is_some(), "{rival:?}");
        }
    }
}
