//! What an epoch costs. Nothing is asserted of time: `cargo test --release -p coloc-bounds --test cost -- --ignored --nocapture`

#![allow(clippy::unwrap_used)] // A test's panic is its verdict.

#[path = "support/network.rs"]
mod network;

use std::time::Instant;

use coloc_bounds::team::{Pair, Supports};
use coloc_bounds::{AngleInterval, Arena, Source, Team};
use network::{Sort, network};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const DIRECTIONS: usize = 16;

/// Everybody within half a metre of the truth, seen from the origin.
fn team(truth: &[[f64; 2]], pairs: impl IntoIterator<Item = (usize, usize)>) -> Team {
    let around = |at: [f64; 2]| {
        let mut region = Supports::disc(DIRECTIONS, 0.5);
        region.add_motion(&still(at), AngleInterval::new(0.0, 0.0));
        region
    };
    let mut team = Team::new(truth.len(), DIRECTIONS);
    team.regions = truth.iter().map(|&at| around(at)).collect();
    let pairs = pairs.into_iter().map(|(i, j)| {
        let mut region = team.regions[i].clone();
        region.subtract(&team.regions[j]);
        Pair { i, j, region }
    });
    team.pairs = pairs.collect();
    team
}

fn still(at: [f64; 2]) -> coloc_bounds::team::Motion {
    coloc_bounds::team::Motion {
        velocity: at,
        velocity_half: [0.0; 2],
        rate: 0.0,
        rate_half: 0.0,
        seconds: 1.0,
    }
}

/// Milliseconds of an epoch, the least of some: what else the machine does is in the others.
fn epoch_ms(robots: usize, pairs: &[(usize, usize)]) -> f64 {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let network = network(&mut random, robots, Sort::Fixed);
    let mut team = team(&network.truth, pairs.iter().copied());
    let arena = Arena {
        centre: [0.0; 2],
        half: 1e4,
    };
    let moved = vec![Supports::disc(DIRECTIONS, 0.1); robots];
    let mut least = f64::INFINITY;
    for _ in 0..10 {
        let start = Instant::now();
        team.predict(&moved);
        let mut polytope = team.polytope(arena, 1e-9).unwrap();
        for (index, measurement) in network.measurements.iter().enumerate() {
            polytope
                .add(measurement, Source::Measurement(index))
                .unwrap();
        }
        team.keep(&mut polytope.region().unwrap());
        least = least.min(start.elapsed().as_secs_f64() * 1e3);
    }
    least
}

#[test]
#[ignore = "it only measures"]
fn cost_of_an_epoch() {
    for robots in [2, 3, 5, 8, 10, 16] {
        let all = (0..robots).flat_map(|i| (i + 1..robots).map(move |j| (i, j)));
        let all: Vec<_> = all.collect();
        let own: Vec<_> = (1..robots).map(|j| (0, j)).collect();
        if robots <= 10 {
            println!(
                "{robots} robots, all pairs: {:.2} ms",
                epoch_ms(robots, &all)
            );
        }
        println!(
            "{robots} robots, own pairs: {:.2} ms",
            epoch_ms(robots, &own)
        );
    }
}
