//! What can be known: the same robots with a filter that is as good as exact.
//!
//! It is told when the robot was carried. From then on there are as many Gaussians as headings, narrow enough that each is linear;
//! those that the fixes refute are left out. *Found* is a second after σ of the heading has come to 0.25 rad, as for the product; from then on
//! the NEES of the pose's mean and covariance is taken in every tick for a minute. Nothing is refused and nothing is voted on.
//! In the rows *as one Gaussian* what is known at that moment is replaced by one of the same mean and covariance, as an estimator of
//! fixed memory has to.

use coloc_estimator::angle::wrap;
use coloc_estimator::{Measurement, Motion};
use nalgebra::{Matrix2x3, Matrix3, Vector2, Vector3};
use rayon::prelude::*;

use super::Form;
use super::experiment::{Event, Experiment};
use super::outcome::{MOMENTS_S, Outcome, WRONG};
use super::report::Row;
use super::robot::beginning;
use super::rows;
use super::world::{World, seconds, ticks};
use crate::honest::increment::Place;
use crate::random::{Noise, Purpose};

/// So many headings at first.
const HEADINGS: u32 = 240;

/// What is less likely than the likeliest by so much in its logarithm is left out.
const REFUTED: f64 = 20.0;

/// A heading known as well as that is found \[rad\].
const RESOLVED: f64 = 0.25;

/// And published so much later: by then an input has left the history of the product \[s\].
const SETTLES_S: f64 = 1.0;

/// For so long each is watched once it was found \[s\].
const AFTER_S: f64 = 60.1;

/// What is done with the mixture.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
enum Kept {
    /// Nothing.
    All,
    /// It becomes one Gaussian when it is found.
    One,
}

/// What is known if the heading is about so and so.
#[derive(Clone, Debug)]
struct Narrow {
    likelihood: f64,
    mean: Vector3<f64>,
    covariance: Matrix3<f64>,
}

/// All that is known.
#[derive(Clone, Debug)]
struct Exact {
    parts: Vec<Narrow>,
}

impl Exact {
    /// Where the first fix is, looking anywhere.
    fn beginning([x, y]: [f64; 2], variance: f64) -> Self {
        let width = std::f64::consts::TAU / f64::from(HEADINGS);
        let narrow = |k: u32| Narrow {
            likelihood: 0.0,
            mean: Vector3::new(x, y, wrap(width * f64::from(k))),
            covariance: Matrix3::from_diagonal(&Vector3::new(variance, variance, width * width)),
        };
        Self {
            parts: (0..HEADINGS).map(narrow).collect(),
        }
    }

    fn drive(&mut self, [v, omega]: [f64; 2], noise: Vector3<f64>, dt_s: f64) {
        if v == 0.0 && omega == 0.0 {
            return; // It stands: nothing moves, and nothing is uncertain of that.
        }
        for part in &mut self.parts {
            part.drive([v * dt_s, omega * dt_s], noise * dt_s);
        }
    }

    fn hear(&mut self, position: [f64; 2], variance: f64) {
        for part in &mut self.parts {
            part.hear(position, variance);
        }
        let most = self.parts.iter().map(|it| it.likelihood);
        let most = most.fold(f64::NEG_INFINITY, f64::max);
        self.parts.retain(|it| it.likelihood > most - REFUTED);
        self.parts.iter_mut().for_each(|it| it.likelihood -= most);
    }

    fn moments(&self) -> (Vector3<f64>, Matrix3<f64>) {
        if let [only] = &self.parts[..] {
            return (only.mean, only.covariance);
        }
        let likely = |a: &&Narrow, b: &&Narrow| a.likelihood.total_cmp(&b.likelihood);
        let origin = self.parts.iter().max_by(likely);
        let origin = origin.map_or_else(Vector3::zeros, |it| it.mean);
        let (mut sum, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
        for part in &self.parts {
            let (weight, apart) = (part.likelihood.exp(), apart(&part.mean, &origin));
            sum += weight;
            first += weight * apart;
            second += weight * (part.covariance + apart * apart.transpose());
        }
        let mean = first / sum;
        (origin + mean, second / sum - mean * mean.transpose())
    }

    /// One Gaussian of the same moments.
    fn merge(&mut self) {
        let (mean, covariance) = self.moments();
        self.parts = vec![Narrow {
            likelihood: 0.0,
            mean,
            covariance,
        }];
    }

    fn nees(&self, place: &Place) -> f64 {
        let (mean, covariance) = self.moments();
        let [x, y] = place.position;
        let apart = apart(&Vector3::new(x, y, place.heading), &mean);
        let solved = covariance.cholesky().map(|it| it.solve(&apart));
        solved.map_or(f64::INFINITY, |solved| apart.dot(&solved))
    }

    fn is_found(&self) -> bool {
        self.moments().1.m33 <= RESOLVED * RESOLVED
    }
}

impl Narrow {
    fn drive(&mut self, [way, turn]: [f64; 2], noise: Vector3<f64>) {
        let (sin, cos) = (self.mean.z + 0.5 * turn).sin_cos();
        let moved = Matrix3::new(1.0, 0.0, -way * sin, 0.0, 1.0, way * cos, 0.0, 0.0, 1.0);
        let turned = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
        let added = turned * Matrix3::from_diagonal(&noise) * turned.transpose();
        self.mean += Vector3::new(way * cos, way * sin, turn);
        self.covariance = moved * self.covariance * moved.transpose() + added;
    }

    fn hear(&mut self, [x, y]: [f64; 2], variance: f64) {
        let innovation = Vector2::new(x - self.mean.x, y - self.mean.y);
        let mut spread = self.covariance.fixed_view::<2, 2>(0, 0).into_owned();
        spread.m11 += variance;
        spread.m22 += variance;
        let Some(inverse) = spread.try_inverse() else {
            return;
        };
        let d2 = innovation.dot(&(inverse * innovation));
        self.likelihood -= 0.5 * (d2 + spread.determinant().ln());
        let seen = Matrix2x3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0);
        let gain = self.covariance * seen.transpose() * inverse;
        let left = Matrix3::identity() - gain * seen;
        self.mean += gain * innovation;
        self.covariance =
            left * self.covariance * left.transpose() + variance * gain * gain.transpose();
    }
}

fn apart(a: &Vector3<f64>, b: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(a.x - b.x, a.y - b.y, wrap(a.z - b.z))
}

/// One robot.
fn run(experiment: &Experiment, form: &Form, number: usize, kept: Kept) -> Outcome {
    let noise = Noise::new(form.seed, super::robot::run_of(&experiment.name));
    let mut chance = noise.draws(Purpose::Start, 0, number, 0);
    let (_, place) = beginning(experiment.start, &mut chance);
    let mut world = World::new(experiment, &noise, number, place);
    let event = ticks(experiment.event_s);
    let (mut exact, mut watch): (Option<Exact>, _) = (None, Watch::default());
    let mut words = Vec::new();
    let ends = event + ticks(experiment.watched_s);
    for tick in (0..ends).step_by(form.stride as usize) {
        let (before, now) = (tick, tick + form.stride);
        let driven = world.advance(before, form.stride);
        if let (Some(exact), Measurement::Odometry(sample)) = (&mut exact, &driven)
            && let Motion::Holonomic { velocity, noise } = &sample.motion
        {
            let [v, _, omega] = *velocity;
            // The noise of a sample is that of a tick's mean velocity.
            let rates = Vector3::from(noise.variances()) * super::world::TICK.as_seconds();
            exact.drive([v, omega], rates, seconds(form.stride));
        }
        if matches!(experiment.event, Event::Carried(_)) && now == event {
            world.suffer(&experiment.event, now, &mut chance);
        }
        words.clear();
        world.words(now, &mut words);
        for word in words.iter().filter(|_| now >= event) {
            let Measurement::Fix(fix) = word else {
                continue;
            };
            let [variance, _] = fix.covariance.variances();
            match &mut exact {
                Some(exact) => exact.hear(fix.position, variance),
                none => *none = Some(Exact::beginning(fix.position, variance)),
            }
        }
        let Some(exact) = &mut exact else {
            continue;
        };
        if watch.found.is_none() && !words.is_empty() && exact.is_found() {
            if kept == Kept::One {
                exact.merge();
            }
            watch.found = Some(now + ticks(SETTLES_S));
        }
        if watch.is_over(now) {
            break;
        }
        if !watch.is_due(now) {
            continue;
        }
        watch.see(now, event, form.stride, exact.nees(&world.place));
    }
    watch.outcome
}

/// What comes of it.
#[derive(Clone, Debug, Default)]
struct Watch {
    found: Option<u32>,
    wrong_since: Option<u32>,
    outcome: Outcome,
}

impl Watch {
    fn is_due(&self, now: u32) -> bool {
        self.found.is_some_and(|it| now >= it)
    }

    fn is_over(&self, now: u32) -> bool {
        self.found.is_some_and(|it| now > it + ticks(AFTER_S))
    }

    fn see(&mut self, now: u32, event: u32, stride: u32, nees: f64) {
        let Some(found) = self.found else {
            return;
        };
        let (outcome, since_s) = (&mut self.outcome, seconds(now - event));
        let is_wrong = nees > WRONG;
        if now == found {
            outcome.followed = 1;
            outcome.wrongly = u32::from(is_wrong);
            outcome.found_s = Some(since_s);
        }
        for (moment, sample) in MOMENTS_S.iter().zip(&mut outcome.nees) {
            let due = found + ticks(f64::from(*moment));
            if (due..due + stride).contains(&now) {
                *sample = Some(nees);
            }
        }
        if is_wrong {
            let since = *self.wrong_since.get_or_insert(now - stride);
            outcome.wrong_longest_s = outcome.wrong_longest_s.max(seconds(now - since));
            outcome.wrong_s += seconds(stride);
            outcome.wrong_last_s = since_s;
        } else {
            self.wrong_since = None;
        }
    }
}

/// Robots that were carried while they stood, and such that know nothing; of each what is known if all headings are kept, or one Gaussian.
pub(super) fn rows(form: &Form) -> Vec<Row> {
    let wanted = rows::for_exact().into_iter();
    let wanted = wanted.filter(|it| form.wants(&it.name));
    wanted.flat_map(|it| rows_of(&it, form)).collect()
}

fn rows_of(experiment: &Experiment, form: &Form) -> Vec<Row> {
    let kinds: [(Kept, &str); 2] = [(Kept::All, "all headings"), (Kept::One, "as one Gaussian")];
    let robots = form.robots(experiment.robots);
    let row = |(kept, words): (Kept, &str)| Row {
        name: format!("{}: {words}", experiment.name),
        outcomes: (0..robots)
            .into_par_iter()
            .map(|number| run(experiment, form, number, kept))
            .collect(),
        bars: Vec::new(),
        document: String::new(),
        beyond: true,
    };
    kinds.map(row).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcomes(kept: Kept) -> Vec<Outcome> {
        let starts = rows::for_exact();
        let start = Experiment {
            watched_s: 20.0,
            ..starts[0].clone()
        };
        let form = Form::short(1);
        (0..60).map(|at| run(&start, &form, at, kept)).collect()
    }

    #[test]
    fn it_finds_all_and_is_as_sure_as_it_may_be() {
        let found = outcomes(Kept::All);
        assert!(found.iter().all(|it| it.found_s.is_some_and(|s| s < 5.0)));
        let nees = found.iter().flat_map(|it| it.nees).flatten();
        let (sum, count) = nees.fold((0.0, 0.0), |(sum, count), it| (sum + it, count + 1.0));
        let mean: f64 = sum / count;
        assert!((2.4..3.6).contains(&mean), "{mean}");
    }

    #[test]
    fn one_gaussian_is_found_at_the_same_moment_and_knows_less() {
        let (all, one) = (outcomes(Kept::All), outcomes(Kept::One));
        let times = |of: &[Outcome]| of.iter().map(|it| it.found_s).collect::<Vec<_>>();
        assert_eq!(times(&all), times(&one));
        assert_ne!(all, one);
    }
}
