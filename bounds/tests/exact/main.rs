//! The rigorous value of a linear program against the exact one, in rational arithmetic: it is never below.

#![allow(clippy::unwrap_used)] // A test's panic is its verdict.

mod exact;
mod network;

use coloc_bounds::simplex::{NoVertex, Optimum};
use coloc_bounds::{Polytope, Projection, Simplex};
use exact::Exact;
use network::network;
use num_bigint::BigInt;
use num_rational::BigRational;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

#[derive(Default)]
struct Tally {
    programs: usize,
    value_below: usize,
    moved: usize,
    /// Of a safe value over the exact one, relative to 1 + |exact|.
    above: f64,
}

fn rational(value: f64) -> BigRational {
    BigRational::from_float(value).unwrap()
}

fn nearest(value: &BigRational) -> f64 {
    let scale = BigInt::from(10).pow(25);
    let scaled = (value * BigRational::from_integer(scale))
        .round()
        .to_integer();
    scaled.to_string().parse::<f64>().unwrap() / 1e25
}

impl Tally {
    fn check(
        &mut self,
        name: &str,
        simplex: &Simplex,
        optimum: Optimum,
        objective: &[(usize, f64)],
    ) {
        let mut exact = Exact::new(simplex.program(), objective, &simplex.working_rows());
        self.moved += exact.improve(name);
        let best = exact.value();
        assert!(
            rational(optimum.safe_upper) >= best,
            "{name}: {} is below the maximum {}",
            optimum.safe_upper,
            nearest(&best)
        );
        self.value_below += usize::from(rational(optimum.value) < best);
        let above = nearest(&(rational(optimum.safe_upper) - &best));
        let relative = above / (1.0 + nearest(&best).abs());
        self.above = self.above.max(relative);
        self.programs += 1;
    }
}

fn run(seeds: std::ops::Range<u64>) {
    let mut tally = Tally::default();
    for seed in seeds {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let polytope: Polytope = network(&mut random);
        let mut simplex = match Simplex::start(polytope.program(|_| true)) {
            Ok(simplex) => simplex,
            Err(NoVertex::Infeasible(conflict)) => {
                panic!("{seed}: the truth is excluded, {}", conflict.relaxation)
            }
            Err(NoVertex::Failed) => panic!("{seed}: failed"),
        };
        let last = polytope.robots() - 1;
        let angle = random.random_range(-3.0..3.0_f64);
        let objective = polytope.objective(Projection::Robot(last), [angle.cos(), angle.sin()]);
        let optimum = simplex.maximize(objective.terms().iter().copied()).unwrap();
        tally.check(
            &format!("network {seed}"),
            &simplex,
            optimum,
            objective.terms(),
        );
    }
    let Tally {
        programs,
        value_below,
        moved,
        above,
    } = tally;
    println!(
        "{programs} programs: safe_upper never below, at most {above:.1e} above; c z below in {value_below}, \
         vertex not exactly the best in {moved}"
    );
    assert!(
        above < 1e-7,
        "a bound that is so far off is of no use: {above:e}"
    );
}

#[test]
fn the_safe_value_is_never_below_the_maximum() {
    run(0..2_000);
}

#[test]
#[ignore = "ten thousand networks"]
fn the_safe_value_is_never_below_the_maximum_in_ten_thousand() {
    run(2_000..12_000);
}
