//! One number alone between two robots: a bearing, or a range.
//!
//! The observer is q, the robot seen r, the sensor at (m, μ) on the observer; `Δ = p_r − p_q`, `v = Δ − C(φ) m`. Along the line of
//! sight is `a = v̄/ρ̂`, across it `t = J a`. An error of v is `δΔ − M (√e J û (φ − φ̄) + w)`, `M = [[m₀, −m₁], [m₁, m₀]]`: of the
//! direction with all of its bend ([`crate::honest`]), where the sensor is not in the middle.
//!
//! ```text
//! range     ρ = |v| + n               E|v| = ρ̂ + τ²/2ρ̂      more of its variance: τ⁴/2ρ̂²
//! bearing   θ = az v − φ − μ + n      E az = az v̄ − κ/ρ̂²     more of its variance: 2 σ² τ²/ρ̂⁴
//! σ² = aᵀ Cov(Δ) a     τ² = tᵀ Cov(Δ) t     κ = aᵀ Cov(Δ) t
//! ```
//!
//! A bearing is taken as the angle that it is, not as the line in the common frame on which r must be: in the angle the heading
//! is linear however uncertain it is, in the line it is not (with σ of 0.3 rad its error is a third larger than the line has it).
//! The robots' errors may be the same: where a bound on a variance of Δ is needed, dependent parts count twice.

use super::columns::Columns;
use super::innovation::Innovation;
use super::place::SplitPosition;
use super::symmetric::Symmetric2;
use crate::angle::wrap;
use crate::belief::Belief;
use crate::honest::Circle;
use crate::pose::Pose;

/// Nearer than this nobody is \[m\].
const NEAREST_M: f64 = 1e-3;

/// The error of where they are to each other may be this part of the range: beyond it neither number is linear in it.
const WIDEST: f64 = 0.7;

/// One number, with its variances: `[white, slow]`, in its own unit squared.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Alone {
    /// Of a sensor mounted so on the body, counted from its own axis.
    Bearing {
        /// \[rad\]
        bearing_rad: f64,
        /// \[rad²\]
        variances: [f64; 2],
        /// m and μ.
        mount: Pose,
    },
    /// From the sensor to the robot seen.
    Range {
        /// \[m\]
        range_m: f64,
        /// \[m²\]
        variances: [f64; 2],
        /// m
        mount: Pose,
    },
}

/// What the number says, before one of the two learns of it: `difference = [H_q Z_q] (δx_q, w) + H_r δp_r + n`.
struct Relation {
    difference: f64,
    by_observer: [f64; 3],
    by_direction: [f64; 2],
    by_seen: [f64; 2],
    /// Variances of n, `[independent, dependent]`.
    noise: [f64; 2],
}

/// What the robot seen learns; `None` if the number says nothing that a Gaussian can learn.
#[must_use]
pub fn tell_alone(observer: &Belief, number: &Alone, seen: &Belief) -> Option<Innovation> {
    let relation = Relation::new(observer, number, &SplitPosition::of(seen))?;
    let (state, direction) = (
        [relation.by_observer, [0.0; 3]],
        [relation.by_direction, [0.0; 2]],
    );
    let own = Columns::new(observer, &state, &direction).seen();
    let independent = Symmetric2::seen(&state, &observer.parts.independent.symmetric());
    let [x, y] = relation.by_seen;
    let noise = [
        relation.noise[0] + independent.xx,
        relation.noise[1] + own.xx,
    ];
    Some(Innovation::of_number(
        relation.difference,
        [x, y, 0.0],
        [0.0; 2],
        noise,
    ))
}

/// What the observer learns, of the answer of the robot that it saw or of a landmark's; `None` as in [`tell_alone`].
#[must_use]
pub fn observed_alone(
    observer: &Belief,
    number: &Alone,
    answer: &SplitPosition,
) -> Option<Innovation> {
    let relation = Relation::new(observer, number, answer)?;
    let of = |part| Symmetric2::of(part).quadratic(relation.by_seen);
    let noise = [
        relation.noise[0] + of(&answer.independent),
        relation.noise[1] + of(&answer.dependent),
    ];
    Some(Innovation::of_number(
        relation.difference,
        relation.by_observer,
        relation.by_direction,
        noise,
    ))
}

/// Where the two are, as far as both are known.
struct Sight {
    circle: Circle,
    /// û
    forward: [f64; 2],
    /// Δ̄
    between: [f64; 2],
    /// `Cov(Δ)`, were both independent of each other.
    spread: Symmetric2,
    /// The most that it can be.
    widest: Symmetric2,
}

impl Sight {
    fn new(observer: &Belief, seen: &SplitPosition) -> Self {
        let (sin, cos) = libm::sincos(observer.pose.phi);
        let own = SplitPosition::of(observer);
        let sum = |a: &_, b: &_| Symmetric2::of(a) + Symmetric2::of(b);
        let independent = sum(&own.independent, &seen.independent);
        let dependent = sum(&own.dependent, &seen.dependent);
        Self {
            circle: Circle::of(observer.heading_variance(), 0.0),
            forward: [cos, sin],
            between: [
                seen.position[0] - own.position[0],
                seen.position[1] - own.position[1],
            ],
            spread: independent + dependent,
            widest: independent + dependent * 2.0,
        }
    }

    /// v̄; `None` where it says too little.
    fn line(&self, mount: &Pose) -> Option<Line> {
        let [x, y] = turned(self.forward, [mount.x, mount.y]);
        let mean = self.circle.mean;
        let line = [self.between[0] - mean * x, self.between[1] - mean * y];
        let range = libm::hypot(line[0], line[1]);
        let along = line.map(|it| it / range);
        let across = [-along[1], along[0]];
        let reach = WIDEST * range;
        let is_clear = |way| self.widest.quadratic(way) <= reach * reach;
        (range >= NEAREST_M && is_clear(along) && is_clear(across)).then_some(Line {
            range,
            along,
            across,
        })
    }

    /// How v moves in the direction of `way` with φ, and with w.
    fn by_mount(&self, way: [f64; 2], mount: &Pose) -> (f64, [f64; 2]) {
        let [cos, sin] = self.forward;
        let turning = turned([-sin, cos], [mount.x, mount.y]);
        let by_direction = [
            -dot(way, [mount.x, mount.y]),
            -dot(way, [-mount.y, mount.x]),
        ];
        (-self.circle.mean * dot(way, turning), by_direction)
    }
}

/// The line of sight: its length, and unit vectors.
struct Line {
    range: f64,
    along: [f64; 2],
    across: [f64; 2],
}

impl Relation {
    fn new(observer: &Belief, number: &Alone, seen: &SplitPosition) -> Option<Self> {
        let sight = Sight::new(observer, seen);
        match number {
            Alone::Bearing {
                bearing_rad,
                variances,
                mount,
            } => Self::of_bearing(observer, &sight, *bearing_rad, *variances, mount),
            Alone::Range {
                range_m,
                variances,
                mount,
            } => Self::of_range(&sight, *range_m, *variances, mount),
        }
    }

    fn of_bearing(
        observer: &Belief,
        sight: &Sight,
        bearing_rad: f64,
        [white, slow]: [f64; 2],
        mount: &Pose,
    ) -> Option<Self> {
        let Line {
            range,
            along,
            across,
        } = sight.line(mount)?;
        let square = range * range;
        let seen_at = libm::atan2(along[1], along[0]) - observer.pose.phi;
        let shift = sight.spread.bilinear(along, across) / square;
        let [wide, high] = [along, across].map(|it| sight.widest.quadratic(it) / square);
        let (by_heading, by_direction) = sight.by_mount(across, mount);
        let [x, y] = across.map(|it| it / range);
        Some(Self {
            difference: wrap(bearing_rad + mount.phi - seen_at + shift),
            by_observer: [-x, -y, by_heading / range - 1.0],
            by_direction: by_direction.map(|it| it / range),
            by_seen: [x, y],
            noise: [white, slow + 2.0 * wide * high],
        })
    }

    fn of_range(
        sight: &Sight,
        range_m: f64,
        [white, slow]: [f64; 2],
        mount: &Pose,
    ) -> Option<Self> {
        let Line {
            range,
            along,
            across,
        } = sight.line(mount)?;
        let (spread, widest) = (
            sight.spread.quadratic(across),
            sight.widest.quadratic(across),
        );
        let (by_heading, by_direction) = sight.by_mount(along, mount);
        Some(Self {
            difference: range_m - (range + 0.5 * spread / range),
            by_observer: [-along[0], -along[1], by_heading],
            by_direction,
            by_seen: along,
            noise: [white, slow + 0.5 * (widest / range) * (widest / range)],
        })
    }
}

/// `C v` of the heading that looks at `forward`.
fn turned([cos, sin]: [f64; 2], [x, y]: [f64; 2]) -> [f64; 2] {
    [cos * x - sin * y, sin * x + cos * y]
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::covariance::{Covariance2, Covariance3};
    use crate::honest::{Increments, advance};
    use crate::parts::Parts;
    use core::f64::consts::TAU;

    /// Random numbers of a test: the same on every machine.
    struct Chance(u64);

    impl Chance {
        /// Splitmix64, in (0, 1).
        fn uniform(&mut self) -> f64 {
            self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = self.0;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            #[allow(clippy::cast_precision_loss)] // 53 bits.
            let unit = ((z ^ (z >> 31)) >> 11) as f64;
            (unit + 0.5) / 9_007_199_254_740_992.0
        }

        fn normal(&mut self) -> f64 {
            let (a, b) = (self.uniform(), self.uniform());
            libm::sqrt(-2.0 * libm::log(a)) * libm::cos(TAU * b)
        }
    }

    /// A robot that knew itself to `sigma`, then drove `way`: its belief, and where it truly is.
    struct Driver {
        sigma: [f64; 3],
        way: [f64; 2],
    }

    impl Driver {
        fn belief(&self) -> Belief {
            let [x, y, phi] = self.sigma.map(|it| it * it);
            let start = Belief::gaussian(
                Pose::new(1.0, 2.0, 0.7),
                Parts::independent(Covariance3::diagonal([x, y, phi]).unwrap()),
            );
            let way = Increments {
                translation: self.way,
                ..Increments::default()
            };
            advance(&start, &way).belief
        }

        fn truth(&self, chance: &mut Chance) -> Pose {
            let phi = 0.7 + self.sigma[2] * chance.normal();
            let [x, y] = turned([libm::cos(phi), libm::sin(phi)], self.way);
            let (dx, dy) = (
                self.sigma[0] * chance.normal(),
                self.sigma[1] * chance.normal(),
            );
            Pose::new(1.0 + dx + x, 2.0 + dy + y, phi)
        }
    }

    const MOUNT: Pose = Pose {
        x: 0.3,
        y: -0.2,
        phi: 0.4,
    };
    const SEEN_SIGMA: [f64; 2] = [0.1, 0.2];

    fn seen() -> SplitPosition {
        let [x, y] = SEEN_SIGMA.map(|it| it * it);
        SplitPosition {
            position: [5.0, 6.0],
            independent: Covariance2::diagonal([x, y]).unwrap(),
            dependent: Covariance2::ZERO,
        }
    }

    /// ν over the deviation that it is said to have, its own bend and all noise counted once.
    fn normalised(observer: &Belief, innovation: &Innovation) -> f64 {
        let own = Columns::of(observer, innovation).seen();
        let independent = Symmetric2::seen(
            &innovation.by_state,
            &observer.parts.independent.symmetric(),
        );
        let noise = innovation.independent.matrix().m11 + innovation.dependent.matrix().m11;
        innovation.difference[0] / libm::sqrt(own.xx + independent.xx + noise)
    }

    /// Mean and mean square of the normalised ν of many worlds, and how many of them said something.
    fn moments(driver: &Driver, number: impl Fn([f64; 2], &mut Chance) -> Alone) -> [f64; 3] {
        let belief = driver.belief();
        let mut chance = Chance(7);
        let mut sums = [0.0; 3];
        for _ in 0..20_000 {
            let truth = driver.truth(&mut chance);
            let [x, y] = [0, 1].map(|i| seen().position[i] + SEEN_SIGMA[i] * chance.normal());
            let forward = [libm::cos(truth.phi), libm::sin(truth.phi)];
            let [mx, my] = turned(forward, [MOUNT.x, MOUNT.y]);
            let back = [forward[0], -forward[1]];
            let line = turned(back, [x - truth.x - mx, y - truth.y - my]);
            let number = number(line, &mut chance);
            if let Some(it) = observed_alone(&belief, &number, &seen()) {
                let nu = normalised(&belief, &it);
                sums = [sums[0] + nu, sums[1] + nu * nu, sums[2] + 1.0];
            }
        }
        [sums[0] / sums[2], sums[1] / sums[2], sums[2]]
    }

    fn bearing(line: [f64; 2], chance: &mut Chance) -> Alone {
        Alone::Bearing {
            bearing_rad: libm::atan2(line[1], line[0]) - MOUNT.phi + 0.02 * chance.normal(),
            variances: [0.02 * 0.02, 0.0],
            mount: MOUNT,
        }
    }

    fn range(line: [f64; 2], chance: &mut Chance) -> Alone {
        Alone::Range {
            range_m: libm::hypot(line[0], line[1]) + 0.1 * chance.normal(),
            variances: [0.1 * 0.1, 0.0],
            mount: MOUNT,
        }
    }

    /// Standard errors are 0.007 and 0.01. What is left beside them is of third order in the errors of where the two are, and of the
    /// bend's tails: a drive of 1.6 m with a heading known to 0.3 rad is the worst of these.
    #[test]
    fn what_one_number_says_is_as_far_off_as_it_is_said_to_be() {
        for (sigma, way, allowed) in [
            ([0.1, 0.1, 0.05], [0.0, 0.0], 0.03),
            ([0.3, 0.2, 0.2], [0.0, 0.0], 0.03),
            ([0.3, 0.2, 0.8], [0.0, 0.0], 0.06),
            ([0.1, 0.1, 0.3], [1.5, 0.5], 0.16),
            ([0.2, 0.1, 0.3], [-1.0, 1.0], 0.06),
        ] {
            let driver = Driver { sigma, way };
            for number in [
                bearing as fn([f64; 2], &mut Chance) -> Alone,
                range as fn([f64; 2], &mut Chance) -> Alone,
            ] {
                let [mean, square, count] = moments(&driver, number);
                assert!(count > 19_000.0, "{sigma:?} {way:?}: {count}");
                assert!(mean.abs() < 0.05, "{sigma:?} {way:?}: mean {mean}");
                let off = (square - 1.0).abs();
                assert!(off < allowed, "{sigma:?} {way:?}: mean square {square}");
            }
        }
    }

    #[test]
    fn of_who_is_nearer_than_it_is_known_nothing_is_said() {
        let belief = Driver {
            sigma: [6.0, 0.1, 0.1],
            way: [0.0; 2],
        }
        .belief();
        let (mut chance, line) = (Chance(1), [4.0, 0.5]);
        for number in [bearing(line, &mut chance), range(line, &mut chance)] {
            assert_eq!(observed_alone(&belief, &number, &seen()), None);
            assert_eq!(tell_alone(&belief, &number, &belief), None);
        }
    }
}
