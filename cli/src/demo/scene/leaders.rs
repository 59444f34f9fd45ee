//! Two robots lead on one side of the floor, two children drive where leaders see them, and one where only those two do.

use coloc_daemon::config::Preset;
use coloc_sim::scenario::{Fixes, Sightings};
use coloc_sim::{Scenario, Synthetic, SyntheticConfig, Ways};

use super::meet::{Figure, oval};
use super::{Eyes, Scene};
use crate::args::DemoArgs;
use crate::demo::DemoError;
use crate::demo::lead::{Lead, SIGHTINGS_HZ};

const TOP_SPEED_MPS: f64 = 0.7;
const TOP_TURN_RADPS: f64 = 1.0;
const ARRIVED_M: f64 = 0.3;
/// Nobody sees farther.
const RANGE_M: f64 = 5.0;
/// Half the length and width of everybody's way.
const SIZE_M: [f64; 2] = [1.0, 0.8];

/// Where the middle of a robot's way is, where on it the robot begins, and which way round it drives.
const WAYS: [([f64; 2], f64, f64); 5] = [
    ([-5.8, 1.5], 0.1, 1.0),
    ([-5.8, -1.5], 0.6, -1.0),
    ([-2.2, 1.5], 0.3, -1.0),
    ([-2.2, -1.5], 0.9, 1.0),
    ([1.6, 0.0], 0.5, 1.0),
];

/// What robots see of one another, and what receivers say, where robots lead.
pub(super) fn sensors(lead: &Lead, range_m: f64) -> Scenario {
    let paper = Scenario::paper();
    Scenario {
        name: "leaders",
        sightings: Sightings {
            rate_hz: SIGHTINGS_HZ,
            range_m,
            ..paper.sightings
        },
        fixes: Fixes {
            robots: lead.leaders().collect(),
            ..paper.fixes
        },
        ..paper
    }
}

fn way((centre_m, start, round): ([f64; 2], f64, f64)) -> Vec<[f64; 2]> {
    let figure = Figure {
        shape: oval,
        size_m: SIZE_M,
        centre_m,
        turned_deg: 0.0,
        start,
        round,
    };
    figure.way(0.0)
}

/// A little longer than asked for: estimates are compared up to the last tick.
pub(super) fn scene(args: &DemoArgs) -> Result<Scene, DemoError> {
    let robots = args.robots.map_or(WAYS.len(), usize::from);
    let refuse = |reason: &str| DemoError::World(reason.into());
    if robots != WAYS.len() {
        return Err(refuse(
            "the scene of leaders has five robots: leave --robots out",
        ));
    }
    let lead = Lead::new(args, robots)?.ok_or(refuse("nobody leads"))?;
    // So bad that without help all would be metres off.
    let wheels = Preset::Paper;
    let ways = Ways {
        waypoints: WAYS.into_iter().map(way).collect(),
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
        description: format!("scene leaders, seed {}", args.seed),
        world: Box::new(Synthetic::along(&ways, &config)),
        parts: lead.parts(),
        sensors: sensors(&lead, RANGE_M),
        eyes: Eyes::Poses,
        wheels,
        lead: Some(lead),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn farthest_and_nearest(one: usize, other: usize) -> [f64; 2] {
        let [one, other] = [one, other].map(|it| way(WAYS[it]));
        let apart = |[ax, ay]: [f64; 2], [bx, by]: [f64; 2]| (ax - bx).hypot(ay - by);
        let all = one.iter().flat_map(|a| other.iter().map(|b| apart(*a, *b)));
        all.fold([0.0, f64::INFINITY], |[far, near], it| {
            [far.max(it), near.min(it)]
        })
    }

    #[test]
    fn leaders_never_see_the_last_child_and_see_the_others_sometimes_at_least() {
        for leader in [0, 1] {
            let [_, near] = farthest_and_nearest(leader, 4);
            assert!(near > RANGE_M, "{near} m");
            let [far, _] = farthest_and_nearest(leader, leader + 2);
            assert!(far < RANGE_M + 1.0, "{far} m");
        }
    }
}
