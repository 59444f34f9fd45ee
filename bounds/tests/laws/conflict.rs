//! A measurement that lies is among those that alone explain the conflict.

use coloc_bounds::diagnosis::{elastic, membership, removable};
use coloc_bounds::simplex::NoVertex;
use coloc_bounds::{Polytope, Projection, Sandwich, Source, Tolerance};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::network::{Network, Sort, gauge, network, spoilt, with};

fn with_a_liar(network: &Network, liar: usize, bounds: f64) -> Polytope {
    let mut measurements = network.measurements.clone();
    measurements[liar] = spoilt(&measurements[liar], bounds);
    let frame = gauge(network.sort, &network.truth);
    let arena = network.polytope.arena();
    let empty = Polytope::new(network.truth.len(), &frame, arena, 1e-9).unwrap();
    with(&empty, &measurements)
}

#[test]
fn a_liar_is_among_those_who_alone_explain_it() {
    let (mut conflicts, mut alone, mut suspected) = (0, 0, 0);
    for seed in 0..150 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let network = network(&mut random, 6, Sort::Relative);
        let liar = random.random_range(0..network.measurements.len());
        let bounds = random.random_range(1.0..10.0);
        let polytope = with_a_liar(&network, liar, bounds);
        let Err(NoVertex::Infeasible(conflict)) = polytope.region() else {
            continue;
        };
        conflicts += 1;
        let source = Source::Measurement(liar);
        assert!(polytope.sources(&conflict).contains(&source), "{seed}");
        let found = removable(&polytope, &conflict).unwrap();
        assert!(found.contains(&source), "{seed}: {found:?} without {liar}");
        alone += usize::from(found.len() == 1);
        suspected += usize::from(elastic(&polytope).unwrap().suspect() == Some(source));
    }
    println!(
        "{conflicts} conflicts, the liar is named alone in {alone}, relaxed most in {suspected}"
    );
    assert!(conflicts > 50 && alone > conflicts / 2);
}

#[test]
fn an_estimate_is_outside_where_the_polygon_ends() {
    for seed in 0..50 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let network = network(&mut random, 4, Sort::Fixed);
        let mut region = network.polytope.region().unwrap();
        let tolerance = Tolerance::of_programs(&network.polytope.arena());
        let mut search = |direction| region.support(Projection::Robot(3), direction);
        let found = Sandwich::start(&mut search, [1.0, 0.0], tolerance).unwrap();
        for vertex in found.inner() {
            let distance = membership(&network.polytope, 3, vertex).unwrap();
            assert!(distance.metres < 1e-9 && distance.at_least <= 0.0, "{seed}");
        }
        let east = found
            .sides()
            .iter()
            .find(|it| it.direction[0] > 0.999)
            .unwrap();
        let beyond = [east.found.point[0] + 0.5, east.found.point[1]];
        let distance = membership(&network.polytope, 3, beyond).unwrap();
        // The nearest point in the larger of x and y is no farther than the vertex itself, and no nearer than half of it by the same side.
        assert!(
            distance.metres <= 0.5 + 1e-9 && distance.at_least > 0.49,
            "{seed}: {distance:?}"
        );
    }
}
