//! Where this robot and the others are believed to be when a scan is made.

use coloc_daemon::config::Config;
use coloc_scan::Prior;
use coloc_scan::beams::ScannerMotion;
use coloc_scan::finder::OwnHeading;
use coloc_sensors::Moment;
use coloc_shm_types::{BeliefState, Estimate, Header};

use crate::past::Past;

/// An estimate is of use for so long \[s\].
const OF_USE_S: f64 = 1.0;

/// A moment by `CLOCK_BOOTTIME` of this computer, if a stamp can be read so \[ns\].
#[must_use]
pub fn boottime(header: &Header, own_boot: u64, now: Moment) -> Option<i64> {
    now.boottime_of(header, own_boot)
}

/// What a robot said of itself.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct Belief {
    pub(crate) at_ns: i64,
    pub(crate) pose: [f64; 3],
    /// In its body frame.
    pub(crate) velocity: [f64; 3],
    pub(crate) covariance: [[f64; 3]; 3],
}

/// Another robot.
#[derive(Clone, Debug)]
struct Other {
    robot: u16,
    look: usize,
    past: Past,
}

/// What all robots have said of themselves.
#[derive(Clone, Debug)]
pub struct Beliefs {
    own_boot: u64,
    mount: [f64; 3],
    change_m_s: f64,
    own: Past,
    others: Vec<Other>,
    priors: Vec<Prior>,
}

/// Where a scanner sits, by `[relative_pose]`.
#[must_use]
pub fn mount(config: &Config, source: u16) -> [f64; 3] {
    let section = &config.relative_pose;
    let own = section.sensor.iter().find(|it| it.source == source);
    own.map_or(section.mount, |it| it.mount)
}

impl Beliefs {
    /// Of a robot whose scanner sits at `mount`, and of these others with their looks.
    #[must_use]
    pub fn new(own_boot: u64, mount: [f64; 3], change_m_s: f64, others: &[(u16, usize)]) -> Self {
        let other = |(robot, look): &(u16, usize)| Other {
            robot: *robot,
            look: *look,
            past: Past::default(),
        };
        Self {
            own_boot,
            mount,
            change_m_s,
            own: Past::default(),
            others: others.iter().map(other).collect(),
            priors: Vec::with_capacity(others.len()),
        }
    }

    /// Where the scanner sits on this robot.
    #[must_use]
    pub fn mount(&self) -> [f64; 3] {
        self.mount
    }

    /// What this robot believes of itself.
    pub fn hear_own(&mut self, estimate: &Estimate, now: Moment) {
        let belief = self.read(estimate, now);
        self.own.hear(belief);
    }

    /// What another one believes of itself.
    pub fn hear(&mut self, robot: u16, estimate: &Estimate, now: Moment) {
        let belief = self.read(estimate, now);
        if let Some(other) = self.others.iter_mut().find(|it| it.robot == robot) {
            other.past.hear(belief);
        }
    }

    /// None of who has not found itself.
    fn read(&self, estimate: &Estimate, now: Moment) -> Option<Belief> {
        let total = estimate.total();
        let numbers = estimate.pose.iter().chain(&estimate.velocity).chain(&total);
        let is_usable = numbers.copied().all(f64::is_finite) && estimate.state() == BeliefState::Ok;
        let at_ns = boottime(&estimate.header, self.own_boot, now).filter(|_| is_usable)?;
        Some(Belief {
            at_ns,
            pose: estimate.pose,
            velocity: estimate.velocity,
            covariance: [0, 1, 2].map(|row| [0, 1, 2].map(|column| total[3 * row + column])),
        })
    }

    /// How the scanner moves at `at_ns`, if this robot knows where it is.
    #[must_use]
    pub fn motion(&self, at_ns: i64) -> Option<ScannerMotion> {
        let [vx, vy, turn] = at(&self.own, at_ns)?.velocity;
        let [x, y, turned] = self.mount;
        let (sin, cos) = turned.sin_cos();
        let (vx, vy) = (vx - turn * y, vy + turn * x);
        Some(ScannerMotion {
            velocity_m_s: [cos * vx + sin * vy, cos * vy - sin * vx],
            turn_rad_s: turn,
        })
    }

    /// How uncertain the own heading is: an error that all priors share. What the own position has in common with it moves the point about
    /// which everything swings.
    #[must_use]
    pub fn own_heading(&self, at_ns: i64) -> OwnHeading {
        let Some(own) = at(&self.own, at_ns) else {
            return OwnHeading::default();
        };
        let variance = own.covariance[2][2];
        if variance <= 0.0 {
            return OwnHeading::default();
        }
        let [gx, gy] = [0, 1].map(|it| own.covariance[it][2] / variance);
        let (own_sin, own_cos) = own.pose[2].sin_cos();
        // Seen from the own body, then from the scanner.
        let [x, y] = [
            -own_cos * gy + own_sin * gx - self.mount[0],
            own_sin * gy + own_cos * gx - self.mount[1],
        ];
        let (sin, cos) = self.mount[2].sin_cos();
        OwnHeading {
            variance,
            about_m: [cos * x + sin * y, cos * y - sin * x],
        }
    }

    /// Where the others are believed to be at `at_ns`, seen from the scanner.
    pub fn priors(&mut self, at_ns: i64) -> &[Prior] {
        self.priors.clear();
        let Some(own) = at(&self.own, at_ns) else {
            return &self.priors;
        };
        for other in &self.others {
            let Some(said) = other.past.nearest(at_ns) else {
                continue;
            };
            let Some(belief) = said.until(at_ns) else {
                continue;
            };
            let age_s = seconds(at_ns - said.at_ns).abs();
            let grown = self.change_m_s * age_s;
            let (pose, covariance) = relative(&own, &belief, grown * grown, self.mount);
            self.priors.push(Prior {
                robot: other.robot,
                look: other.look,
                pose,
                covariance,
            });
        }
        &self.priors
    }
}

/// What a robot believes of itself at `at_ns`, if it has said enough about then.
fn at(past: &Past, at_ns: i64) -> Option<Belief> {
    past.nearest(at_ns)?.until(at_ns)
}

#[allow(clippy::cast_precision_loss)] // To a microsecond it is exact for centuries.
fn seconds(ns: i64) -> f64 {
    ns as f64 * 1e-9
}

impl Belief {
    /// Carried on to `at_ns`, if that is not too far away.
    fn until(self, at_ns: i64) -> Option<Self> {
        let later_s = seconds(at_ns.checked_sub(self.at_ns)?);
        if later_s.abs() > OF_USE_S {
            return None;
        }
        let [x, y, heading] = self.pose;
        let [vx, vy, turn] = self.velocity;
        let (sin, cos) = (heading + 0.5 * turn * later_s).sin_cos();
        let pose = [
            x + (cos * vx - sin * vy) * later_s,
            y + (sin * vx + cos * vy) * later_s,
            heading + turn * later_s,
        ];
        Some(Self {
            at_ns,
            pose,
            ..self
        })
    }
}

type Matrix = [[f64; 3]; 3];

/// The pose of `other` seen from a scanner at `mount` of `own`, and its covariance, larger by `grown` in each direction.
fn relative(own: &Belief, other: &Belief, grown: f64, mount: [f64; 3]) -> ([f64; 3], Matrix) {
    let turned = own.pose[2] + mount[2];
    let (sin, cos) = turned.sin_cos();
    let (own_sin, own_cos) = own.pose[2].sin_cos();
    // From the own origin to the scanner, in the common frame.
    let arm = [
        own_cos * mount[0] - own_sin * mount[1],
        own_sin * mount[0] + own_cos * mount[1],
    ];
    let away = [other.pose[0] - own.pose[0], other.pose[1] - own.pose[1]];
    let [dx, dy] = [away[0] - arm[0], away[1] - arm[1]];
    let pose = [
        cos * dx + sin * dy,
        cos * dy - sin * dx,
        other.pose[2] - turned,
    ];
    // By the other's x, y and heading; by the own ones, which also swing the scanner.
    let of_other = [[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]];
    let swing = [away[1], -away[0]];
    let of_own = [
        [-cos, -sin, cos * swing[0] + sin * swing[1]],
        [sin, -cos, cos * swing[1] - sin * swing[0]],
        [0.0, 0.0, -1.0],
    ];
    let mut covariance = sum(
        &spread(&of_other, &other.covariance),
        &spread(&of_own, &own.covariance),
    );
    covariance[0][0] += grown;
    covariance[1][1] += grown;
    (pose, covariance)
}

/// J P Jᵀ.
fn spread(slope: &Matrix, covariance: &Matrix) -> Matrix {
    let mut spread = [[0.0; 3]; 3];
    for (row, from) in spread.iter_mut().zip(slope) {
        for (entry, to) in row.iter_mut().zip(slope) {
            for (a, line) in from.iter().zip(covariance) {
                *entry += a * (line[0] * to[0] + line[1] * to[1] + line[2] * to[2]);
            }
        }
    }
    spread
}

fn sum(a: &Matrix, b: &Matrix) -> Matrix {
    [0, 1, 2].map(|row| [0, 1, 2].map(|column| a[row][column] + b[row][column]))
}

#[cfg(test)]
mod tests {
    use coloc_shm_types::Clock;

    use super::*;

    const SECOND: i64 = 1_000_000_000;

    fn estimate(pose: [f64; 3], velocity: [f64; 3], stamp_ns: i64) -> Estimate {
        Estimate {
            header: Header {
                stamp_ns,
                boot: 7,
                ..Header::default()
            },
            pose,
            velocity,
            independent: [0.09, 0.0, 0.0, 0.0, 0.09, 0.0, 0.0, 0.0, 0.03],
            state: BeliefState::Ok as u8,
            ..Estimate::default()
        }
    }

    fn beliefs(mount: [f64; 3]) -> Beliefs {
        Beliefs::new(7, mount, 1.0, &[(2, 0), (3, 1)])
    }

    #[test]
    fn others_are_seen_from_the_scanner_at_the_time_of_the_scan() {
        let mut beliefs = beliefs([0.5, 0.0, std::f64::consts::PI]);
        let now = Moment::default();
        beliefs.hear_own(
            &estimate([1.0, 1.0, std::f64::consts::FRAC_PI_2], [0.0; 3], SECOND),
            now,
        );
        beliefs.hear(3, &estimate([1.0, 3.0, 0.0], [1.0, 0.0, 0.0], SECOND), now);
        let [prior] = beliefs.priors(SECOND + SECOND / 2) else {
            panic!("one of them has spoken");
        };
        // Two metres ahead and half a metre to the right, seen from half a metre ahead by who looks back.
        let expected = [-1.5, 0.5, -1.5 * std::f64::consts::PI];
        let off = [0, 1, 2].map(|it| (prior.pose[it] - expected[it]).abs());
        assert!(off.iter().all(|it| *it < 1e-12), "{prior:?}");
        assert_eq!((prior.robot, prior.look), (3, 1));
        // The own heading moves it across, by its distance from the own origin.
        assert!((prior.covariance[1][1] - (0.18 + 0.25 + 4.0 * 0.03)).abs() < 1e-12);
        assert!((prior.covariance[2][2] - 0.06).abs() < 1e-12);
        assert!(beliefs.priors(3 * SECOND).is_empty());
    }

    #[test]
    fn a_scan_that_comes_late_meets_what_was_believed_at_its_time() {
        let mut beliefs = beliefs([0.0; 3]);
        let now = Moment::default();
        for tenth in 0..10 {
            let stamp_ns = tenth * SECOND / 10;
            #[allow(clippy::cast_precision_loss)] // At most ten.
            let x = tenth as f64;
            beliefs.hear_own(&estimate([x, 0.0, 0.0], [0.0; 3], stamp_ns), now);
            beliefs.hear(2, &estimate([2.0 * x, 0.0, 0.0], [0.0; 3], stamp_ns), now);
        }
        let [prior] = beliefs.priors(3 * SECOND / 10) else {
            panic!("one of them has spoken");
        };
        assert!((prior.pose[0] - 3.0).abs() < 1e-12, "{prior:?}");
        assert!((prior.covariance[0][0] - 0.18).abs() < 1e-12, "{prior:?}");
    }

    #[test]
    fn slopes_are_those_of_finite_differences() {
        let belief = |pose| Belief {
            at_ns: 0,
            pose,
            velocity: [0.0; 3],
            covariance: [[0.0; 3]; 3],
        };
        let mount = [0.3, -0.2, 0.7];
        let (own, other) = ([1.0, -2.0, 0.6], [3.0, 1.0, -2.0]);
        let pose = |own, other| relative(&belief(own), &belief(other), 0.0, mount).0;
        for axis in 0..3 {
            for (moves_own, step) in [(true, 1e-6), (false, 1e-6)] {
                let mut unit = belief(own);
                unit.covariance[axis][axis] = 1.0;
                let mut fixed = belief(other);
                let (mut moved_own, mut moved_other) = (own, other);
                if moves_own {
                    moved_own[axis] += step;
                } else {
                    unit.covariance = [[0.0; 3]; 3];
                    fixed.covariance[axis][axis] = 1.0;
                    moved_other[axis] += step;
                }
                let (at, covariance) = relative(&unit, &fixed, 0.0, mount);
                let moved = pose(moved_own, moved_other);
                for place in 0..3 {
                    let slope = (moved[place] - at[place]) / step;
                    assert!(
                        (covariance[place][place] - slope * slope).abs() < 1e-4,
                        "{axis} {place}"
                    );
                }
            }
        }
    }

    #[test]
    fn everything_swings_about_a_point_with_the_own_heading() {
        let mut beliefs = beliefs([0.3, -0.2, 0.7]);
        let now = Moment::default();
        // An error of the heading alone, and what the position has in common with it.
        let by = [0.4, -0.1, 1.0];
        let mut own = estimate([1.0, -2.0, 0.6], [0.0; 3], 0);
        for (place, entry) in own.independent.iter_mut().enumerate() {
            *entry = 0.03 * by[place / 3] * by[place % 3];
        }
        let mut other = estimate([3.0, 1.0, -2.0], [0.0; 3], 0);
        other.independent = [0.0; 9];
        beliefs.hear_own(&own, now);
        beliefs.hear(2, &other, now);
        let OwnHeading { variance, about_m } = beliefs.own_heading(0);
        let [prior] = beliefs.priors(0) else {
            panic!("one of them has spoken");
        };
        let [x, y, _] = prior.pose;
        let slope = [about_m[1] - y, x - about_m[0], 1.0];
        for row in 0..3 {
            for column in 0..3 {
                let expected = variance * slope[row] * slope[column];
                let off = prior.covariance[row][column] - expected;
                assert!(off.abs() < 1e-12, "{prior:?}");
            }
        }
        beliefs.hear_own(&Estimate::default(), now);
        assert_eq!(beliefs.own_heading(0), OwnHeading::default());
    }

    #[test]
    fn the_scanner_swings_as_the_robot_turns() {
        let mut beliefs = beliefs([0.5, 0.0, std::f64::consts::FRAC_PI_2]);
        assert_eq!(beliefs.motion(0), None);
        beliefs.hear_own(&estimate([0.0; 3], [1.0, 0.0, 2.0], 0), Moment::default());
        let motion = beliefs.motion(0).unwrap();
        // Forward is to its right, and the swing to the left is forward.
        assert!(
            (motion.velocity_m_s[0] - 1.0).abs() < 1e-12
                && (motion.velocity_m_s[1] + 1.0).abs() < 1e-12
        );
        beliefs.hear_own(&Estimate::default(), Moment::default());
        assert_eq!(beliefs.motion(0), None);
    }

    #[test]
    fn stamps_are_read_by_the_clock_that_they_are_of() {
        let now = Moment {
            boottime_ns: 100,
            realtime_ns: 1000,
        };
        let header = |clock: Clock, boot, stamp_ns| Header {
            stamp_ns,
            boot,
            clock: clock as u8,
            ..Header::default()
        };
        assert_eq!(boottime(&header(Clock::Boottime, 7, 90), 7, now), Some(90));
        assert_eq!(boottime(&header(Clock::Boottime, 8, 90), 7, now), None);
        assert_eq!(boottime(&header(Clock::Realtime, 8, 990), 7, now), Some(90));
        assert_eq!(
            boottime(&header(Clock::Realtime, 8, i64::MIN), 7, now),
            None
        );
        assert_eq!(boottime(&header(Clock::Tai, 7, 90), 7, now), None);
    }
}
