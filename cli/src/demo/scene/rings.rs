//! Ways around one another that never meet: who looks like a body must not drive through another.

use coloc_daemon::config::Preset;
use coloc_sim::scenario::{Fixes, Sightings};
use coloc_sim::{Scenario, Synthetic, SyntheticConfig, Ways};

use super::meet::{Figure, oval};
use super::{Eyes, Help, Part, Scene};
use crate::args::DemoArgs;
use crate::demo::DemoError;
use crate::demo::bars::Expectation;

const TOP_SPEED_MPS: f64 = 0.7;
const TOP_TURN_RADPS: f64 = 1.0;
const ARRIVED_M: f64 = 0.3;
/// So many of the first robots have receivers.
const RECEIVERS: usize = 2;
/// Of the time in which robots are told something. Three to five robots were told something in all of it by scans, and in 65 to 100 % by cameras.
const TOLD: f64 = 0.5;
const FIX_SIGMA_M: f64 = 0.1;

/// Half the length and width of a robot's way, where its middle is, where on it the robot begins, and which way round it drives.
type Ring = ([f64; 2], [f64; 2], f64, f64);

/// The two small ones lie beside each other in the third.
const RINGS: [Ring; 5] = [
    ([6.7, 4.7], [0.0, 0.0], 0.1, 1.0),
    ([5.3, 3.5], [0.0, 0.0], 0.6, -1.0),
    ([0.9, 0.6], [-1.8, 0.0], 0.3, 1.0),
    ([4.0, 2.3], [0.0, 0.0], 0.9, 1.0),
    ([0.9, 0.6], [1.8, 0.0], 0.8, -1.0),
];

/// As many robots as there are rings.
pub(super) const MOST: usize = RINGS.len();

fn way((size_m, centre_m, start, round): Ring) -> Vec<[f64; 2]> {
    let figure = Figure {
        shape: oval,
        size_m,
        centre_m,
        turned_deg: 0.0,
        start,
        round,
    };
    figure.way(0.0)
}

fn part(robot: usize, whose: &'static str) -> Part {
    Part {
        help: if robot < RECEIVERS {
            Help::Receiver
        } else {
            Help::Told
        },
        expected: Some(Expectation {
            whose,
            error: None,
            inside: 0.99,
            told: TOLD,
        }),
        tale: None,
    }
}

/// Nobody is given a pose; receivers are as the paper has them.
fn sensors() -> Scenario {
    let paper = Scenario::paper();
    Scenario {
        name: "rings",
        sightings: Sightings {
            range_m: 0.0,
            ..paper.sightings
        },
        fixes: Fixes {
            robots: (0..RECEIVERS).collect(),
            sigma_m: FIX_SIGMA_M,
            ..paper.fixes
        },
        ..paper
    }
}

/// A little longer than asked for: estimates are compared up to the last tick.
pub(super) fn scene(
    args: &DemoArgs,
    name: &'static str,
    whose: &'static str,
    eyes: Eyes,
) -> Result<Scene, DemoError> {
    let robots = args.robots.map_or(MOST, usize::from);
    if robots > MOST {
        let reason = format!("the scene {name} has {MOST} robots: use --robots 1 to {MOST}");
        return Err(DemoError::World(reason));
    }
    let wheels = Preset::Differential;
    let ways = Ways {
        waypoints: RINGS[..robots].iter().copied().map(way).collect(),
        arrived_m: ARRIVED_M,
    };
    let config = SyntheticConfig {
        robots,
        seconds: args.length_s() + 1.0,
        seed: args.seed,
        top_speed_mps: TOP_SPEED_MPS,
        top_turn_radps: TOP_TURN_RADPS,
        noise: wheels.motion().noise(),
        ..SyntheticConfig::default()
    };
    Ok(Scene {
        description: format!("scene {name}, seed {}", args.seed),
        world: Box::new(Synthetic::along(&ways, &config)),
        parts: (0..robots).map(|robot| part(robot, whose)).collect(),
        sensors: sensors(),
        eyes,
        wheels,
        lead: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ways_never_come_close() {
        let ways: Vec<_> = RINGS.into_iter().map(way).collect();
        for (place, one) in ways.iter().enumerate() {
            for other in &ways[..place] {
                let apart = |a: &[f64; 2]| {
                    let far = other.iter().map(|b| (a[0] - b[0]).hypot(a[1] - b[1]));
                    far.fold(f64::INFINITY, f64::min)
                };
                let nearest = one.iter().map(apart).fold(f64::INFINITY, f64::min);
                // Half a metre of each robot, and the corners that it cuts.
                assert!(nearest > 0.99, "{nearest} m");
            }
        }
    }
}
