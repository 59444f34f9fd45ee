//! What holds of any partial sightings, of robots at random.

use coloc_estimator::partial::{
    Alone, BodySighting, PositionSettings, ReadingNoise, SplitPosition, fuse, observed,
    observed_alone, tell, tell_alone, told,
};
use coloc_estimator::{
    Belief, Covariance2, Covariance3, Motion, Parts, Pose, Propagation, fix, propagate,
};

/// Random numbers of a test: the same on every machine.
struct Chance(u64);

impl Chance {
    /// Splitmix64, in [0, 1).
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        #[allow(clippy::cast_precision_loss)] // 53 bits.
        let unit = ((z ^ (z >> 31)) >> 11) as f64;
        unit / 9_007_199_254_740_992.0
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Over powers of ten.
    fn magnitude(&mut self, low: f64, high: f64) -> f64 {
        self.between(low.ln(), high.ln()).exp()
    }

    fn start(&mut self) -> Belief {
        let variances = [0; 3].map(|_| self.magnitude(1e-8, 4.0));
        let covariance = Covariance3::diagonal(variances).unwrap();
        let parts = if self.unit() < 0.5 {
            Parts::independent(covariance)
        } else {
            Parts::dependent(covariance)
        };
        let pose = [5.0, 5.0, 3.1].map(|reach| self.between(-reach, reach));
        Belief::gaussian(Pose::new(pose[0], pose[1], pose[2]), parts)
    }

    fn motion(&mut self) -> Motion {
        Motion::Nonholonomic {
            velocity: [self.between(-0.5, 1.0), self.between(-1.0, 1.0)],
            noise: Covariance2::diagonal([0; 2].map(|_| self.magnitude(1e-9, 0.1))).unwrap(),
        }
    }

    fn noise(&mut self) -> ReadingNoise {
        let is_slow = self.unit() < 0.7;
        ReadingNoise {
            white: [0; 2].map(|_| self.magnitude(1e-8, 0.1)),
            slow: [0; 2].map(|_| {
                if is_slow {
                    self.magnitude(1e-4, 0.1)
                } else {
                    0.0
                }
            }),
        }
    }

    fn mount(&mut self) -> Pose {
        Pose::new(
            self.between(-0.3, 0.3),
            self.between(-0.3, 0.3),
            self.between(-3.0, 3.0),
        )
    }
}

fn is_whole(name: &str, belief: &Belief) {
    let Belief { pose, parts, bend } = *belief;
    for part in [&parts.independent, &parts.dependent] {
        let least = part.matrix().symmetric_eigenvalues().min();
        let trace: f64 = belief.total().variances().iter().sum();
        assert!(least >= -1e-14 * trace, "{name}: {least:e} of {trace:e}");
    }
    assert!(
        Belief::new(pose, parts, bend).is_ok(),
        "{name}: its bend is more than it holds"
    );
}

fn is_whole_position(name: &str, said: &SplitPosition) {
    for part in [&said.independent, &said.dependent] {
        assert!(Covariance2::new(part.matrix()).is_ok(), "{name}: {part:?}");
    }
}

/// One exchange of two robots in whatever way; `None` where a number says nothing.
fn exchange(chance: &mut Chance, [one, other]: [&Belief; 2]) -> Option<[Belief; 2]> {
    let (dx, dy) = (other.pose.x - one.pose.x, other.pose.y - one.pose.y);
    let range = dx.hypot(dy).max(0.01) * chance.between(0.9, 1.1);
    let bearing = dy.atan2(dx) - one.pose.phi + chance.between(-0.2, 0.2);
    let (noise, mount) = (chance.noise(), chance.mount());
    let settings = PositionSettings {
        damping: chance.between(0.05, 1.0),
        gate: f64::INFINITY,
        gate_alone: f64::INFINITY,
        ..PositionSettings::default()
    };
    let answer = SplitPosition::of(other);
    let [w, s] = [noise.white, noise.slow.map(|it| it * it)];
    let (forward, backward) = match chance.unit() {
        way if way < 0.5 => {
            let sighting = BodySighting::of(range, bearing - mount.phi, &mount, &noise);
            let said = tell(one, &sighting);
            is_whole_position("told", &said);
            (told(other, &said), observed(one, &sighting, &answer))
        }
        way => {
            let number = if way < 0.75 {
                Alone::Bearing {
                    bearing_rad: bearing - mount.phi,
                    variances: [w[1], s[1]],
                    mount,
                }
            } else {
                Alone::Range {
                    range_m: range,
                    variances: [w[0], s[0]],
                    mount,
                }
            };
            (
                tell_alone(one, &number, other)?,
                observed_alone(one, &number, &answer)?,
            )
        }
    };
    Some([
        fuse(one, &backward, &settings).belief,
        fuse(other, &forward, &settings).belief,
    ])
}

/// As a fleet lives: whatever happens in whatever order, no part loses its sign, and no bend is more than its part holds.
#[test]
fn no_part_loses_its_sign() {
    let mut chance = Chance(11);
    let mut exchanges = 0;
    for life in 0..200 {
        let mut robots = [chance.start(), chance.start()];
        for step in 0..200 {
            let name = format!("life {life}, step {step}");
            for robot in &mut robots {
                let motion = chance.motion();
                *robot = propagate(robot, &motion, 0.1, Propagation::Honest);
            }
            if chance.unit() < 0.3
                && let Some(after) = exchange(&mut chance, [&robots[0], &robots[1]])
            {
                robots = after;
                exchanges += 1;
                for robot in &mut robots {
                    is_whole(&name, robot);
                    robot.make_dependent();
                }
            }
            if chance.unit() < 0.02 {
                let Pose { x, y, .. } = robots[0].pose;
                let noise = Covariance2::diagonal([0.01, 0.02]).unwrap();
                robots[0] = fix::update(&robots[0], [x, y], &noise, f64::INFINITY).belief;
            }
            for robot in &robots {
                is_whole(&name, robot);
            }
        }
    }
    assert!(exchanges > 5000, "{exchanges}");
}

/// A position fix by other means.
#[test]
fn a_landmark_where_the_robot_stands_is_a_fix() {
    let covariance = Covariance3::diagonal([0.04, 0.09, 0.01]).unwrap();
    let own = Belief::independent(Pose::new(1.0, 2.0, 0.3), covariance);
    let noise = Covariance2::diagonal([0.01, 0.02]).unwrap();
    let said = SplitPosition {
        position: [1.1, 1.9],
        independent: noise,
        dependent: Covariance2::ZERO,
    };
    let settings = PositionSettings::default();
    let fused = fuse(&own, &told(&own, &said), &settings);
    let fixed = fix::update(&own, said.position, &noise, settings.gate);
    assert!((fused.d2 - fixed.d2).abs() < 1e-12 && fused.alpha == 0.0);
    let difference = fused.belief.total().matrix() - fixed.belief.total().matrix();
    assert!(difference.abs().max() < 1e-15);
}

/// What is the same for all that one camera sees is never taken for news.
#[test]
fn no_slow_error_is_independent() {
    let covariance = Covariance3::diagonal([0.01, 0.01, 0.001]).unwrap();
    let observer = Belief::gaussian(Pose::default(), Parts::dependent(covariance));
    let slow = ReadingNoise {
        white: [1e-12, 1e-12],
        slow: [0.05, 0.01],
    };
    let sighting = BodySighting::of(3.0, 0.2, &Pose::default(), &slow);
    let said = tell(&observer, &sighting);
    assert!(said.independent.variances().into_iter().sum::<f64>() < 1e-10);
    assert!(said.dependent.variances().into_iter().sum::<f64>() > 0.05 * 0.05 * 9.0);
}
