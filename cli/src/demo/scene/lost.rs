//! Robots that do not know where they are, or are told wrong things of it: one starts from nowhere, one is carried away, one has two
//! receivers of which one jumps, and one has a single receiver that jumps. They do not see one another.

use coloc_daemon::config::Preset;
use coloc_estimator::Pose;
use coloc_sim::scenario::{Fixes, Sightings};
use coloc_sim::sensors::relative;
use coloc_sim::{Scenario, Synthetic, SyntheticConfig, Ways, World};

use super::meet::{Figure, oval};
use super::{Eyes, Help, Part, Scene};
use crate::args::DemoArgs;
use crate::demo::DemoError;
use crate::demo::tale::{EVENT_S, SHIFT_M, Tale};
use crate::demo::wheels::moved;

const TALES: [Tale; 4] = [Tale::Nowhere, Tale::Carried, Tale::Liar, Tale::Doubted];
const CENTRES_M: [[f64; 2]; 4] = [[-12.0, 5.0], [-12.0, -5.0], [12.0, 5.0], [12.0, -5.0]];
const TOP_SPEED_MPS: f64 = 1.0;
const TOP_TURN_RADPS: f64 = 1.5;
const ARRIVED_M: f64 = 0.3;
const FIX_SIGMA_M: f64 = 0.3;
const FIX_RATE_HZ: f64 = 5.0;
/// By so much the robot that is carried is turned \[rad\].
const TURNED_RAD: f64 = 2.0;

/// A world in which one robot is taken up at a step and put down elsewhere: its wheels do not feel it.
struct Carried {
    world: Synthetic,
    robot: usize,
    step: usize,
    from: Pose,
    to: Pose,
}

impl Carried {
    fn new(world: Synthetic, robot: usize, step: usize) -> Self {
        let from = world.truth(step, robot).unwrap_or_default();
        Self {
            to: Pose::new(from.x + SHIFT_M, from.y, from.phi + TURNED_RAD),
            world,
            robot,
            step,
            from,
        }
    }
}

impl World for Carried {
    fn dt_s(&self) -> f64 {
        self.world.dt_s()
    }

    fn steps(&self) -> usize {
        self.world.steps()
    }

    fn robots(&self) -> usize {
        self.world.robots()
    }

    fn truth(&self, step: usize, robot: usize) -> Option<Pose> {
        let pose = self.world.truth(step, robot)?;
        let is_carried = robot == self.robot && step >= self.step;
        Some(if is_carried {
            moved(&self.to, &relative(&self.from, &pose))
        } else {
            pose
        })
    }

    fn odometry(&self, step: usize, robot: usize) -> [f64; 2] {
        self.world.odometry(step, robot)
    }
}

fn way(centre_m: [f64; 2]) -> Vec<[f64; 2]> {
    let figure = Figure {
        shape: oval,
        size_m: [3.5, 2.2],
        centre_m,
        turned_deg: 0.0,
        start: 0.6,
        round: 1.0,
    };
    figure.way(0.0)
}

fn part(tale: Tale) -> Part {
    Part {
        help: Help::Receiver,
        expected: None,
        tale: Some(tale),
    }
}

/// Receivers as they are sold, and nobody sees anybody.
fn sensors(robots: usize) -> Scenario {
    let paper = Scenario::paper();
    Scenario {
        name: "lost",
        sightings: Sightings {
            range_m: 0.0,
            ..paper.sightings
        },
        fixes: Fixes {
            rate_hz: FIX_RATE_HZ,
            robots: (0..robots).collect(),
            sigma_m: FIX_SIGMA_M,
            ..paper.fixes
        },
        ..paper
    }
}

/// A little longer than asked for: estimates are compared up to the last tick.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // A few hundred.
pub(super) fn scene(args: &DemoArgs) -> Result<Scene, DemoError> {
    let robots = args.robots.map_or(TALES.len(), usize::from);
    if robots > TALES.len() {
        let most = TALES.len();
        let reason = format!("the scene lost has {most} robots: use --robots 1 to {most}");
        return Err(DemoError::World(reason));
    }
    let wheels = Preset::Differential;
    let ways = Ways {
        waypoints: CENTRES_M[..robots].iter().copied().map(way).collect(),
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
    let world = Synthetic::along(&ways, &config);
    let step = (EVENT_S / world.dt_s()).round() as usize;
    let carried = TALES.iter().position(|&it| it == Tale::Carried);
    Ok(Scene {
        description: format!("scene lost, seed {}", args.seed),
        world: Box::new(Carried::new(world, carried.unwrap_or(robots), step)),
        parts: TALES[..robots].iter().copied().map(part).collect(),
        sensors: sensors(robots),
        eyes: Eyes::Poses,
        wheels,
        lead: None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_is_carried_goes_on_as_its_wheels_say_from_another_place() {
        let config = SyntheticConfig {
            robots: 2,
            seconds: 4.0,
            top_speed_mps: 1.0,
            ..SyntheticConfig::default()
        };
        let plain = Synthetic::new(&config);
        let world = Carried::new(plain.clone(), 1, 100);
        let truth = |step, robot| world.truth(step, robot).unwrap();
        assert_eq!(truth(150, 0), plain.truth(150, 0).unwrap());
        assert_eq!(truth(99, 1), plain.truth(99, 1).unwrap());
        let [before, after] = [99, 100].map(|step| truth(step, 1));
        assert!((after.x - before.x - SHIFT_M).abs() < 0.1);
        let steps = [150, 151].map(|step| (truth(step, 1), plain.truth(step, 1).unwrap()));
        let [own, of_plain] = [
            relative(&steps[0].0, &steps[1].0),
            relative(&steps[0].1, &steps[1].1),
        ];
        assert!((own.x - of_plain.x).abs() < 1e-9 && (own.y - of_plain.y).abs() < 1e-9);
    }
}
