//! A car whose front wheels are steered.

use super::kinematics::{NO_SPREAD, Twist, add_outer};

/// The bicycle model: the front wheels as one in the middle, the body's origin in the middle of the rear axle.
///
/// With the angle δ of that wheel, counter-clockwise, and the wheel base L it turns at `ω = v tan δ / L` (Rajamani, Vehicle
/// Dynamics and Control, 2nd ed., 2.2, for a rear axle that is not steered). What is measured h left of the origin goes at
/// `v_e = v − ω h`, so `v = v_e / (1 − tan δ h / L)`, forwards and backwards.
///
/// Between two frames the angle is taken to run straight from one value to the other, and v to stay the same. The mean of tan δ is
/// that of its beginning, middle and end by Simpson's rule. Where the angle changes hardly faster or slower than in the interval
/// before, it runs along a parabola: with b rad/s² its mean is `b dt²/12` less. More than [`GENTLE`] is a jerk between two frames, of
/// which the frames before say nothing. Where the turning rate changes by Δω within dt, the way is no arc: its
/// end lies `v Δω dt² / 12` to the right of the arc's, which the mean velocity to the left says.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct Bicycle {
    wheel_base_m: f64,
    lateral_m: f64,
    /// Variance of the angle in a frame \[rad²\].
    variance: f64,
}

/// As fast the rate of the angle changes while somebody steers gently \[rad/s²\].
const GENTLE: f64 = 0.2;

/// The largest part of the speed that may be lost or won by measuring beside the middle.
const LARGEST_PART: f64 = 0.95;

impl Bicycle {
    /// `None` where a robot that is steered as far as `max_rad` would turn about a point so near to where its speed is measured
    /// that this says nothing.
    pub(super) fn new(
        wheel_base_m: f64,
        lateral_m: f64,
        max_rad: f64,
        sigma_rad: f64,
    ) -> Option<Self> {
        let part = lateral_m.abs() * max_rad.tan() / wheel_base_m;
        (part <= LARGEST_PART).then_some(Self {
            wheel_base_m,
            lateral_m,
            variance: sigma_rad * sigma_rad,
        })
    }

    /// With the mean speed of the wheel over `dt_s`, the angle at the beginning and the end, and how much faster it changes than before
    /// \[m/s, rad, rad, rad/s²\].
    pub(super) fn twist(
        &self,
        speed_mps: f64,
        [begin, end]: [f64; 2],
        bend: f64,
        dt_s: f64,
    ) -> Twist {
        let straight = f64::midpoint(begin, end);
        let bend = if bend.abs() <= GENTLE { bend } else { 0.0 };
        let middle = straight - bend * dt_s * dt_s / 8.0;
        let [first, second, third] = [begin, middle, end].map(f64::tan);
        let tan = (first + 4.0 * second + third) / 6.0;
        let forward = speed_mps / (1.0 - tan * self.lateral_m / self.wheel_base_m);
        let change = forward * (third - first) / self.wheel_base_m;
        let mut spread = NO_SPREAD;
        if self.variance > 0.0 {
            // Half of each angle's error is in this sample, and half in the next: in all of them together, the whole.
            let [forward, turning] = self.per_angle(middle).map(|it| it * speed_mps);
            add_outer(&mut spread, [forward, 0.0, turning], self.variance);
        }
        Twist {
            velocity: [
                forward,
                -forward * change * dt_s / 12.0,
                forward * tan / self.wheel_base_m,
            ],
            spread,
        }
    }

    /// How `[v, ω]` changes with the angle, for a wheel that goes at 1 m/s.
    fn per_angle(&self, angle_rad: f64) -> [f64; 2] {
        let tan = angle_rad.tan();
        let share = 1.0 - tan * self.lateral_m / self.wheel_base_m;
        let slope = (1.0 + tan * tan) / (self.wheel_base_m * share * share);
        [self.lateral_m * slope, slope]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wheel_beside_the_middle_says_the_same_as_the_middle_forwards_and_backwards() {
        let (angle, base) = (0.4_f64, 2.5);
        let middle = Bicycle::new(base, 0.0, 0.8, 0.0).unwrap();
        for v in [3.0, -3.0] {
            let expected = [v, 0.0, v * angle.tan() / base];
            for lateral_m in [-0.8, 0.0, 0.8] {
                let beside = Bicycle {
                    lateral_m,
                    ..middle
                };
                let said = v - expected[2] * lateral_m;
                let made = beside.twist(said, [angle; 2], 0.0, 0.02).velocity;
                let near = |(a, b): (f64, f64)| (a - b).abs() < 1e-12;
                assert!(
                    made.into_iter().zip(expected).all(near),
                    "{made:?} {expected:?}"
                );
            }
        }
    }

    /// Against the integral in ten thousand steps.
    #[test]
    fn while_it_is_steered_the_way_is_no_arc_and_still_said() {
        let bicycle = Bicycle::new(1.2, 0.0, 0.8, 0.0).unwrap();
        let (v, dt_s, begin, end) = (1.5, 0.1, 0.1, 0.2);
        let (steps, [mut x, mut y, mut phi]) = (10_000, [0.0_f64; 3]);
        for step in 0..steps {
            let part = (f64::from(step) + 0.5) / f64::from(steps);
            let turn = v * f64::tan(begin + part * (end - begin)) / 1.2 * dt_s / f64::from(steps);
            let way = v * dt_s / f64::from(steps);
            (x, y) = (
                x + way * (phi + turn / 2.0).cos(),
                y + way * (phi + turn / 2.0).sin(),
            );
            phi += turn;
        }
        let [vx, vy, omega] = bicycle.twist(v, [begin, end], 0.0, dt_s).velocity;
        let half = omega * dt_s / 2.0;
        let chord = dt_s * half.sin() / half;
        let found = [
            chord * (vx * half.cos() - vy * half.sin()),
            chord * (vx * half.sin() + vy * half.cos()),
            omega * dt_s,
        ];
        for (found, expected) in found.into_iter().zip([x, y, phi]) {
            // Of second order in the change of the angle: a tenth of what is promised of the way.
            assert!(
                (found - expected).abs() < 1e-5 * v * dt_s,
                "{found} {expected}"
            );
        }
    }

    /// The mean of an angle that runs along a parabola; of a jerk, as if there were none.
    #[test]
    fn an_angle_that_is_turned_gently_runs_along_a_parabola() {
        let bicycle = Bicycle::new(1.2, 0.0, 0.8, 0.0).unwrap();
        let (dt_s, bend, steps) = (0.1, 0.15, 10_000);
        let angle = |t: f64| 0.1 + 0.2 * t + 0.5 * bend * t * t;
        let turned: f64 = (0..steps)
            .map(|step| angle((f64::from(step) + 0.5) / f64::from(steps) * dt_s).tan())
            .sum::<f64>()
            / f64::from(steps)
            / 1.2;
        let ends = [angle(0.0), angle(dt_s)];
        let [.., omega] = bicycle.twist(1.0, ends, bend, dt_s).velocity;
        assert!((omega - turned).abs() < 1e-8, "{omega} {turned}");
        let straight = bicycle.twist(1.0, ends, 0.0, dt_s);
        assert!((straight.velocity[2] - turned).abs() > 1e-5);
        assert_eq!(bicycle.twist(1.0, ends, 2.0 * GENTLE, dt_s), straight);
    }

    /// By differences.
    #[test]
    fn noise_of_the_angle_is_noise_of_the_turning_rate_and_beside_the_middle_of_the_way() {
        let (sigma, angle, v) = (1e-6, 0.3, -2.0);
        let bicycle = Bicycle::new(1.2, 0.4, 0.8, sigma).unwrap();
        let at = |angle| bicycle.twist(v, [angle; 2], 0.0, 0.02).velocity;
        let (less, more) = (at(angle - sigma), at(angle + sigma));
        let spread = bicycle.twist(v, [angle; 2], 0.0, 0.02).spread;
        for (row, column) in [(0, 0), (0, 2), (2, 2)] {
            let step = |of: usize| (more[of] - less[of]) / 2.0;
            let expected = step(row) * step(column);
            let error = (spread[row][column] - expected).abs();
            assert!(error < 1e-6 * expected.abs(), "{row} {column}");
        }
    }

    #[test]
    fn a_circle_about_the_wheel_itself_is_refused() {
        assert!(Bicycle::new(1.0, 0.9, 0.8, 0.0).is_some());
        assert_eq!(Bicycle::new(1.0, -1.0, 0.8, 0.0), None);
    }
}
