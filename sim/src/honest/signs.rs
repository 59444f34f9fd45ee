//! Beliefs through everything that can happen to them, at random: no part of a covariance loses its sign.
//!
//! Two robots drive, see one another, are told, and get fixes, in an order at random, with headings known to 1e-6 … 10 rad at
//! the start and covariances of any rank. After every operation the least eigenvalue of either part is compared with the part's
//! trace, and what is told goes through a peer's check.

use coloc_estimator::convert::tell;
use coloc_estimator::settings::Criterion;
use coloc_estimator::{
    Belief, Covariance2, Covariance3, FusionSettings, GlobalPose, Motion, Parts, Pose, Propagation,
    Settings, fix, fuse, propagate,
};
use nalgebra::{Matrix2, Matrix3, Matrix3x2};
use rayon::prelude::*;

use super::table::Table;
use super::{Finding, Form, lives};
use crate::random::{Draws, Noise, Purpose};

/// The least that an eigenvalue may be, of its part's trace.
const BAR: f64 = -1e-14;

/// After so many operations two robots begin again.
pub(super) const LIFE: u32 = 50;

/// What was done, and what came of it.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub(super) struct Tally {
    pub(super) steps: u64,
    pub(super) conversions: u64,
    pub(super) fixes: u64,
    pub(super) messages: u64,
    pub(super) refused: u64,
    /// The least eigenvalue of a part over its trace.
    least: f64,
    /// After which operation of which pair.
    place: [usize; 2],
}

impl Tally {
    pub(super) fn and(self, other: Self) -> Self {
        Self {
            steps: self.steps + other.steps,
            conversions: self.conversions + other.conversions,
            fixes: self.fixes + other.fixes,
            messages: self.messages + other.messages,
            refused: self.refused + other.refused,
            ..self.lesser(other.least, other.place)
        }
    }

    /// What is no number is the least of all.
    fn lesser(self, least: f64, place: [usize; 2]) -> Self {
        let least = if least.is_nan() {
            f64::NEG_INFINITY
        } else {
            least
        };
        if least < self.least {
            Self {
                least,
                place,
                ..self
            }
        } else {
            self
        }
    }

    pub(super) fn look(&mut self, parts: &Parts, place: [usize; 2]) {
        for part in [&parts.independent, &parts.dependent] {
            *self = self.lesser(least(part), place);
        }
    }
}

/// The least eigenvalue over the trace; nothing is 0.
fn least(part: &Covariance3) -> f64 {
    let matrix = part.matrix();
    let trace = matrix.trace();
    if trace == 0.0 && matrix.iter().all(|it| *it == 0.0) {
        return 0.0;
    }
    (matrix / trace).symmetric_eigenvalues().min()
}

/// Two robots.
struct Pair {
    draws: Draws,
    beliefs: [Belief; 2],
    tally: Tally,
    /// Number of the pair and of the operation.
    place: [usize; 2],
}

impl Pair {
    fn new(noise: &Noise, number: usize) -> Self {
        let mut draws = noise.draws(Purpose::Ordeal, 0, number & 0xffff, number >> 16);
        let beliefs = [(), ()].map(|()| belief(&mut draws));
        Self {
            draws,
            beliefs,
            tally: Tally::default(),
            place: [number, 0],
        }
    }

    fn live(mut self) -> Tally {
        for _ in 0..LIFE {
            self.place[1] += 1;
            let own = usize::from(self.draws.happens(0.5));
            self.act(own);
            self.tally.look(&self.beliefs[own].parts, self.place);
        }
        self.tally
    }

    fn act(&mut self, own: usize) {
        let dice = self.draws.uniform(0.0, 1.0);
        if dice < 0.7 {
            self.step(own);
        } else if dice < 0.85 {
            self.tell(own);
        } else {
            self.fix(own);
        }
        if self.draws.happens(0.1) {
            self.beliefs[own].make_dependent();
        }
    }

    fn step(&mut self, own: usize) {
        let (motion, dt_s) = (motion(&mut self.draws), decade(&mut self.draws, -2.0, 1.0));
        self.beliefs[own] = propagate(&self.beliefs[own], &motion, dt_s, Propagation::Honest);
        self.tally.steps += 1;
    }

    /// A sighting of the other one, which is told, and takes it as a peer does.
    fn tell(&mut self, own: usize) {
        let relative = pose(&mut self.draws, 10.0);
        let covariance = spread(&mut self.draws, [1.0, 1.0, 0.3]);
        let settings = Settings::default();
        let told = tell(&self.beliefs[own], &relative, &covariance, &settings);
        self.tally.conversions += 1;
        self.tally.look(&told.parts, self.place);
        let [independent, dependent] =
            [told.parts.independent, told.parts.dependent].map(|part| part.to_row_major());
        match Parts::from_row_major(independent, dependent) {
            Ok(parts) => self.hear(1 - own, GlobalPose { parts, ..told }),
            Err(_) => self.tally.refused += 1,
        }
    }

    /// Wherever it stands: no gate.
    fn hear(&mut self, own: usize, received: GlobalPose) {
        let settings = FusionSettings {
            gate: f64::INFINITY,
            damping: self.draws.uniform(0.05, 1.0),
            criterion: if self.draws.happens(0.5) {
                Criterion::Trace
            } else {
                Criterion::Determinant
            },
            ..FusionSettings::default()
        };
        self.beliefs[own] = fuse(&self.beliefs[own], &received, &settings).belief;
        self.tally.messages += 1;
        self.tally.look(&self.beliefs[own].parts, self.place);
    }

    fn fix(&mut self, own: usize) {
        let size = decade(&mut self.draws, -3.0, 2.0);
        let noise = plane(&mut self.draws, size);
        let Pose { x, y, .. } = self.beliefs[own].pose;
        let [a, b] = self.draws.normals();
        let position = [x + size * a, y + size * b];
        self.beliefs[own] = fix::update(&self.beliefs[own], position, &noise, f64::INFINITY).belief;
        self.tally.fixes += 1;
    }
}

pub(super) fn belief(draws: &mut Draws) -> Belief {
    let heading = decade(draws, -6.0, 1.0);
    let size = decade(draws, -3.0, 1.0);
    let part = |draws: &mut Draws| spread(draws, [size, size, heading]);
    Belief::gaussian(
        pose(draws, 10.0),
        Parts {
            independent: part(draws),
            dependent: part(draws),
        },
    )
}

pub(super) fn pose(draws: &mut Draws, size: f64) -> Pose {
    let [x, y] = [(), ()].map(|()| draws.uniform(-size, size));
    Pose::new(x, y, draws.uniform(-3.0, 3.0))
}

/// `10^low … 10^high`
pub(super) fn decade(draws: &mut Draws, low: f64, high: f64) -> f64 {
    libm::pow(10.0, draws.uniform(low, high))
}

/// `S S ᵀ` of a square of normal numbers with columns left out at random, so that every rank comes; rows of these sizes.
pub(super) fn spread(draws: &mut Draws, sizes: [f64; 3]) -> Covariance3 {
    let mut root = Matrix3::from_fn(|row, _| sizes[row] * draws.normal());
    for column in 0..3 {
        if draws.happens(0.3) {
            root.column_mut(column).fill(0.0);
        }
    }
    let product = root * root.transpose();
    Covariance3::new(0.5 * (product + product.transpose())).unwrap_or_default()
}

/// The same in the plane; one time in five it has one direction only.
pub(super) fn plane(draws: &mut Draws, size: f64) -> Covariance2 {
    let mut root = Matrix2::from_fn(|_, _| size * draws.normal());
    if draws.happens(0.2) {
        root.column_mut(1).fill(0.0);
    }
    let product = root * root.transpose();
    Covariance2::new(0.5 * (product + product.transpose())).unwrap_or_default()
}

/// A speed of up to 2 m/s in any direction, or none; its noise in all directions, in two or in none.
pub(super) fn motion(draws: &mut Draws) -> Motion {
    let size = decade(draws, -4.0, 0.0);
    let [vx, vy, omega] = [2.0, 1.0, 1.0].map(|it| draws.uniform(-it, it));
    if draws.happens(0.1) {
        return Motion::standstill([size * size, 0.0, size * size]);
    }
    if draws.happens(0.3) {
        return Motion::Holonomic {
            velocity: [vx, vy, omega],
            noise: spread(draws, [size, size, size]),
        };
    }
    let root = Matrix3x2::from_fn(|_, _| size * draws.normal());
    let noise = root.fixed_rows::<2>(0) * root.fixed_rows::<2>(0).transpose();
    Motion::Nonholonomic {
        velocity: [vx, omega],
        noise: Covariance2::new(0.5 * (noise + noise.transpose())).unwrap_or_default(),
    }
}

fn run(form: &Form) -> Tally {
    let noise = Noise::new(form.seed, 2);
    let pairs = form.operations.div_ceil(u64::from(LIFE));
    let pairs = usize::try_from(pairs).unwrap_or(usize::MAX);
    (0..pairs)
        .into_par_iter()
        .map(|number| Pair::new(&noise, number).live())
        .reduce(Tally::default, Tally::and)
}

/// Runs it and holds it to its bar.
#[must_use]
pub fn find(form: &Form) -> Finding {
    let tallies = [("two robots", run(form)), ("estimators", lives::run(form))];
    let mut table = Table::new([
        "of",
        "steps",
        "conversions",
        "messages",
        "fixes",
        "least eigenvalue / trace",
        "refused by a peer",
    ]);
    for (of, tally) in &tallies {
        table.row(row(of, tally));
    }
    Finding {
        title: "Everything that can happen, at random, headings known to 1e-6 … 10 rad".into(),
        text: table.text(),
        missed: tallies
            .iter()
            .flat_map(|(of, tally)| {
                missed(tally)
                    .into_iter()
                    .map(move |it| format!("{of}: {it}"))
            })
            .collect(),
    }
}

fn row(of: &str, tally: &Tally) -> [String; 7] {
    let counts =
        [tally.steps, tally.conversions, tally.messages, tally.fixes].map(|it| it.to_string());
    let [steps, conversions, messages, fixes] = counts;
    [
        of.into(),
        steps,
        conversions,
        messages,
        fixes,
        format!("{:.1e}", tally.least),
        tally.refused.to_string(),
    ]
}

fn missed(tally: &Tally) -> Vec<String> {
    let mut missed = Vec::new();
    if tally.least < BAR {
        missed.push(format!(
            "an eigenvalue is {:.2e} of its part's trace after operation {} of pair {}",
            tally.least, tally.place[1], tally.place[0]
        ));
    }
    if tally.refused > 0 {
        missed.push(format!("{} words refused by an honest peer", tally.refused));
    }
    missed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_eigenvalue_is_seen_beside_its_trace() {
        let negative = Parts {
            independent: Covariance3::ZERO,
            dependent: Covariance3::diagonal([3.0, 1.0, 0.0]).expect("positive"),
        };
        let mut tally = Tally::default();
        tally.look(&negative, [7, 8]);
        assert!(tally.least.abs() < 1e-16 && missed(&tally).is_empty());
        tally = tally.lesser(f64::NAN, [7, 8]);
        assert_eq!(tally.place, [7, 8]);
        tally.refused = 2;
        assert_eq!(missed(&tally).len(), 2);
    }

    #[test]
    fn every_estimator_publishes_a_covariance() {
        let form = Form {
            operations: 40_000,
            ..Form::short(1)
        };
        let tally = lives::run(&form);
        let Tally {
            steps,
            conversions,
            messages,
            fixes,
            ..
        } = tally;
        assert!(steps > 15_000 && conversions > 500 && messages > 2_000 && fixes > 5_000);
        assert_eq!(missed(&tally), Vec::<String>::new());
    }

    #[test]
    fn every_kind_of_operation_comes() {
        let form = Form {
            operations: 5000,
            ..Form::short(1)
        };
        let tally = run(&form);
        assert_eq!(tally.steps + tally.conversions + tally.fixes, 5000);
        assert!(tally.steps > 3000 && tally.conversions > 500 && tally.fixes > 500);
        assert_eq!(missed(&tally), Vec::<String>::new());
        assert_eq!(run(&form), tally);
    }
}
