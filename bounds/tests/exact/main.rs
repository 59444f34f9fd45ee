//! The rigorous value of a linear program against the exact one, in rational arithmetic: it is never below.

#![allow(clippy::unwrap_used)] // A test's panic is its verdict.

mod exact;
#[path = "../support/network.rs"]
mod network;

use coloc_bounds::simplex::{NoVertex, Optimum};
use coloc_bounds::{Polytope, Program, Projection, Simplex};
use exact::Exact;
use network::{any_sort, network, spoilt, with};
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

/// Two to eight robots.
fn any_network(random: &mut ChaCha8Rng) -> network::Network {
    let (robots, sort) = (random.random_range(2..=8), any_sort(random));
    network(random, robots, sort)
}

fn run(seeds: std::ops::Range<u64>) {
    let mut tally = Tally::default();
    for seed in seeds {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let polytope = any_network(&mut random).polytope;
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

/// The program that finds by how much all rows have to be relaxed.
fn relaxed(polytope: &Polytope) -> (Program, usize) {
    let mut program = polytope.unknowns();
    let relaxation = program.column(0.0, 1e6);
    for row in polytope.rows() {
        let terms = row.terms().iter().copied();
        program.row(terms.chain([(relaxation, -1.0)]), row.rhs);
    }
    (program, relaxation)
}

/// How much is needed, exactly.
fn exact_relaxation(name: &str, polytope: &Polytope) -> BigRational {
    let (program, relaxation) = relaxed(polytope);
    let mut simplex = Simplex::start(program).unwrap();
    let objective = [(relaxation, -1.0)];
    simplex.maximize(objective).unwrap();
    let mut exact = Exact::new(simplex.program(), &objective, &simplex.working_rows());
    exact.improve(name);
    -exact.value()
}

/// One measurement is off by 0.5 to 10 times its bound: sometimes that shows, sometimes not.
#[test]
fn what_is_called_infeasible_is() {
    let (mut infeasible, mut feasible) = (0, 0);
    for seed in 0..600_u64 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let network = any_network(&mut random);
        let mut measurements = network.measurements.clone();
        let one = random.random_range(0..measurements.len());
        let bounds = 0.5 * random.random_range(0.0..3.0_f64).exp();
        measurements[one] = spoilt(&measurements[one], bounds);
        let robots = network.truth.len();
        let gauge = network::gauge(network.sort, &network.truth);
        let empty = Polytope::new(robots, &gauge, network.polytope.arena(), 0.0).unwrap();
        let polytope = with(&empty, &measurements);
        let exact = exact_relaxation(&format!("network {seed}"), &polytope);
        match polytope.region() {
            Ok(_) => {
                assert!(exact <= rational(1.01e-7), "{seed}: {}", nearest(&exact));
                feasible += 1;
            }
            Err(NoVertex::Infeasible(conflict)) => {
                assert!(exact > rational(0.0), "{seed}: it is feasible");
                let off = (conflict.relaxation - nearest(&exact)).abs();
                assert!(off < 1e-9, "{seed}: relaxation off by {off:e}");
                infeasible += 1;
            }
            Err(NoVertex::Failed) => panic!("{seed}: failed"),
        }
    }
    println!("{infeasible} infeasible, {feasible} feasible, all of them exactly so");
    assert!(infeasible > 100 && feasible > 100);
}
