//! Neither part ever loses its sign, and no peer refuses what it is told: random steps, sightings, fixes and messages, at
//! headings known to 1e-6 rad and to 10, singular covariances included. Nothing is clipped on the way.
//!
//! `COLOC_STEPS` says how many; 10⁷ take a minute in a release build.

use coloc_estimator::convert::tell;
use coloc_estimator::honest::advance;
use coloc_estimator::settings::FusionSettings;
use coloc_estimator::{
    Belief, Covariance2, Covariance3, GlobalPose, Increments, Motion, Parts, Pose, Propagation,
    Settings, fix, fuse, propagate, to_global,
};
use nalgebra::{Matrix3, Vector3};

const STEPS: u64 = 200_000;
const STEPS_OF_A_LIFE: u64 = 40;

/// Steele, Lea and Flood's `SplitMix64`.
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        #[allow(clippy::cast_precision_loss)] // 53 bits.
        let unit = (self.bits() >> 11) as f64 / (1_u64 << 53) as f64;
        low + (high - low) * unit
    }

    fn signed(&mut self) -> f64 {
        self.between(-1.0, 1.0)
    }

    /// Between powers of ten.
    fn power(&mut self, low: f64, high: f64) -> f64 {
        10.0_f64.powf(self.between(low, high))
    }

    fn one_in(&mut self, count: u64) -> bool {
        self.bits().is_multiple_of(count)
    }

    /// `F Fᵀ` of any rank, with these σ.
    fn covariance(&mut self, sigma: [f64; 3]) -> Covariance3 {
        let columns = self.bits() % 5; // Full rank in two of five.
        let sigma = Vector3::from(sigma);
        let column = |random: &mut Self| {
            let c = Vector3::from_fn(|_, _| random.signed()).component_mul(&sigma);
            c * c.transpose()
        };
        let sum = (0..columns).fold(Matrix3::zeros(), |sum, _| sum + column(self));
        Covariance3::new(sum).unwrap()
    }

    fn noise(&mut self) -> Covariance3 {
        let [along, aside, turning] = [self.power(-4.0, 0.0), 0.0, self.power(-4.0, 0.0)];
        match self.bits() % 4 {
            0 => Covariance3::ZERO,
            1 => self.covariance([along, 0.1 * along, turning]),
            _ => Covariance3::diagonal([along, aside, turning].map(|it| it * it)).unwrap(),
        }
    }

    fn motion(&mut self) -> Motion {
        let [v, aside, omega] = [3.0 * self.signed(), self.signed(), 3.0 * self.signed()];
        if self.one_in(3) {
            let noise = self.noise();
            return Motion::Holonomic {
                velocity: [v, aside, omega],
                noise,
            };
        }
        let [along, turning] = [self.power(-4.0, 0.0), self.power(-4.0, 0.0)];
        Motion::Nonholonomic {
            velocity: [v, omega],
            noise: Covariance2::diagonal([along * along, turning * turning]).unwrap(),
        }
    }

    fn pose(&mut self, range: f64) -> Pose {
        let (x, y) = (range * self.signed(), range * self.signed());
        Pose::new(x, y, 3.0 * self.signed())
    }

    fn belief(&mut self) -> Belief {
        let (position, heading) = (self.power(-4.0, 2.0), self.power(-6.0, 1.0));
        let sigma = [position, position, heading];
        let parts = Parts {
            independent: self.covariance(sigma),
            dependent: self.covariance(sigma),
        };
        Belief::gaussian(self.pose(10.0), parts)
    }

    fn message(&mut self, near: &Pose) -> GlobalPose {
        let (position, heading) = (self.power(-2.0, 2.0), self.power(-3.0, 0.5));
        let sigma = [position, position, heading];
        let apart = self.pose(position);
        GlobalPose {
            pose: Pose::new(
                near.x + apart.x,
                near.y + apart.y,
                near.phi + heading * self.signed(),
            ),
            parts: Parts {
                independent: self.covariance(sigma),
                dependent: self.covariance(sigma),
            },
        }
    }
}

/// The least eigenvalue in units of the trace.
fn least(part: &Covariance3) -> f64 {
    let matrix = part.matrix();
    let trace = matrix.trace();
    let least = matrix.symmetric_eigenvalues().min();
    if least >= 0.0 {
        0.0
    } else {
        least / trace.abs()
    }
}

/// What has been seen.
#[derive(Debug, Default)]
struct Account {
    worst: f64,
    refused: u64,
    unreadable: u64,
    steps: u64,
    sightings: u64,
    fixes: u64,
    messages: u64,
}

impl Account {
    /// Whoever reads it from a disk asks what [`Belief::new`] asks.
    fn save(&mut self, belief: &Belief) {
        let Belief { pose, parts, bend } = *belief;
        self.unreadable += u64::from(Belief::new(pose, parts, bend).is_err());
    }

    fn judge(&mut self, parts: &Parts, what: &str) {
        let found = least(&parts.independent).min(least(&parts.dependent));
        assert!(
            found >= -1e-14,
            "{what}: {found:e} of {parts:?} after {self:?}"
        );
        self.worst = self.worst.min(found);
    }

    fn tell(&mut self, belief: &Belief, random: &mut Random) {
        let noise = [random.power(-3.0, 0.0), random.power(-3.0, -1.0)].map(|it| it * it);
        let noise = Covariance3::diagonal([noise[0], noise[0], noise[1]]).unwrap();
        let relative = random.pose(20.0);
        let by_letter = to_global(belief, &relative, &noise, Propagation::Honest);
        let told = tell(belief, &relative, &noise, &Settings::default());
        for parts in [by_letter.parts, told.parts] {
            self.judge(&parts, "a sighting");
            let [independent, dependent] =
                [parts.independent, parts.dependent].map(|part| part.to_row_major());
            let heard = Parts::from_row_major(independent, dependent);
            self.refused += u64::from(heard.is_err());
        }
        self.sightings += 1;
    }

    /// One thing that happens to a belief.
    fn happens(&mut self, belief: &mut Belief, random: &mut Random) {
        match random.bits() % 32 {
            0..=1 => {
                let variance = random.power(-3.0, 2.0).powi(2);
                let noise = Covariance2::diagonal([variance, variance]).unwrap();
                let near = [
                    belief.pose.x + random.signed(),
                    belief.pose.y + random.signed(),
                ];
                *belief = fix::update(belief, near, &noise, f64::INFINITY).belief;
                self.fixes += 1;
                self.judge(&belief.parts, "a fix");
            }
            2..=3 => {
                let settings = FusionSettings {
                    damping: random.between(0.05, 1.0),
                    gate: f64::INFINITY,
                    ..FusionSettings::default()
                };
                let message = random.message(&belief.pose);
                *belief = fuse(belief, &message, &settings).belief;
                self.messages += 1;
                self.judge(&belief.parts, "a message");
                belief.make_dependent();
            }
            4..=5 => self.tell(belief, random),
            6 => belief.make_dependent(),
            7 => {
                let [x, y] = [5.0 * random.signed(), 5.0 * random.signed()];
                let increments = Increments {
                    translation: [x, y],
                    turn: 3.0 * random.signed(),
                    noise: random.noise(),
                };
                *belief = advance(belief, &increments).belief;
                self.steps += 1;
                self.judge(&belief.parts, "a displacement");
            }
            _ => {
                let dt_s = random.power(-3.0, 0.0);
                *belief = propagate(belief, &random.motion(), dt_s, Propagation::Honest);
                self.steps += 1;
                self.judge(&belief.parts, "a motion");
            }
        }
    }
}

#[test]
fn neither_part_loses_its_sign_whatever_happens() {
    let asked = std::env::var("COLOC_STEPS").map(|count| count.parse().unwrap());
    let (mut random, mut account) = (Random(12), Account::default());
    for _ in 0..asked.unwrap_or(STEPS) / STEPS_OF_A_LIFE {
        let mut belief = random.belief();
        for _ in 0..STEPS_OF_A_LIFE {
            account.happens(&mut belief, &mut random);
            account.save(&belief);
        }
    }
    eprintln!("{account:?}");
    assert_eq!(account.refused, 0, "a peer would refuse what it is told");
    assert_eq!(
        account.unreadable, 0,
        "what is saved would not be read again"
    );
    assert!(account.steps > 100_000 && account.fixes > 10_000 && account.messages > 10_000);
}
