//! Where each sensor sits and how it errs: what the configuration says, and the messages do not.

use coloc_estimator::{HeadingOf, Pose, Sighting, SlowError, Span};
use coloc_shm_types::{self as shm, Heading, Position};

use crate::config::{self, Compass, Config, Receiver};

/// All of them.
#[derive(Clone, Debug)]
pub struct Sensors {
    position: config::Position,
    relative_pose: config::RelativePose,
    heading: config::Heading,
    sighting: config::Sighting,
    gyro_scale: f64,
}

impl Sensors {
    /// Those of a configuration.
    #[must_use]
    pub fn of(config: &Config) -> Self {
        Self {
            position: config.position.clone(),
            relative_pose: config.relative_pose.clone(),
            heading: config.heading.clone(),
            sighting: config.sighting.clone(),
            gyro_scale: config.gyro.scale,
        }
    }

    /// What was seen from the sensor, seen from the body: `mount ⊕ z`.
    #[must_use]
    pub fn of_body(&self, seen: &Sighting) -> Sighting {
        let [x, y, phi] = self.mount_of_relative(seen.origin.source);
        if x == 0.0 && y == 0.0 && phi == 0.0 {
            return *seen;
        }
        let ((sin, cos), z) = (phi.sin_cos(), &seen.relative);
        Sighting {
            relative: Pose::new(
                x + cos * z.x - sin * z.y,
                y + sin * z.x + cos * z.y,
                phi + z.phi,
            ),
            covariance: seen.covariance.turned(phi),
            ..*seen
        }
    }

    /// Where a sensor of relative poses is \[m, m, rad\].
    #[must_use]
    pub fn mount_of_relative(&self, source: u16) -> [f64; 3] {
        let mut entries = self.relative_pose.sensor.iter();
        let own = entries.find(|it| it.source == source);
        own.map_or(self.relative_pose.mount, |it| it.mount)
    }

    /// Where the sensor of a sighting that says a part is: the message's own word, if it has one.
    pub(super) fn mount_of(&self, message: &shm::Sighting) -> Pose {
        let mut entries = self.sighting.sensor.iter();
        let own = entries.find(|it| it.source == message.header.source);
        let [x, y, phi] = if message.mount.iter().all(|it| *it == 0.0) {
            own.map_or(self.sighting.mount, |it| it.mount)
        } else {
            message.mount
        };
        Pose::new(x, y, phi)
    }

    /// Where the antenna of a fix is \[m\]: the message's own word, if it has one.
    #[must_use]
    pub fn lever_of(&self, message: &Position) -> [f64; 2] {
        let [forward, left] = message.lever_m;
        if forward != 0.0 || left != 0.0 {
            return message.lever_m;
        }
        let own = self.receiver(message.header.source);
        own.map_or(self.position.lever_m, |it| it.lever_m)
    }

    /// How late the stamp of a fix is.
    #[must_use]
    pub fn delay_of(&self, message: &Position) -> Span {
        let own = self.receiver(message.header.source);
        Span::from_seconds(own.map_or(self.position.delay_s, |it| it.delay_s))
    }

    /// How fast the robot turns, beside the bias, where a gyro reads that \[rad/s\].
    pub(super) fn turning(&self, read_radps: f64) -> f64 {
        self.gyro_scale * read_radps
    }

    /// The slow error of a fix: likewise, σ and time each by itself.
    #[must_use]
    pub fn slow_of_fix(&self, message: &Position) -> SlowError {
        let all = (self.position.slow_sigma_m, self.position.slow_time_s);
        let own = self.receiver(message.header.source);
        let usual = own.map_or(all, |it| (it.slow_sigma_m, it.slow_time_s));
        slow((message.slow_sigma_m, message.slow_time_s), usual)
    }

    /// The slow error of a heading: likewise.
    pub(super) fn slow_of_heading(&self, message: &Heading) -> SlowError {
        let all = (self.heading.slow_sigma_rad, self.heading.slow_time_s);
        let own = self.compass(message.header.source);
        let usual = own.map_or(all, |it| (it.slow_sigma_rad, it.slow_time_s));
        slow((message.slow_sigma_rad, message.slow_time_s), usual)
    }

    /// A heading in the common frame \[rad\], and what it is the heading of.
    #[must_use]
    pub fn looking(&self, message: &Heading) -> (f64, HeadingOf) {
        let own = self.compass(message.header.source);
        if message.what == Heading::COURSE {
            let course = HeadingOf::Course {
                least_m_s: self.heading.least_speed_m_s,
                lever: own.map_or(self.heading.lever_m, |it| it.lever_m),
            };
            return (message.heading, course);
        }
        let offset = own.map_or(self.heading.offset_rad, |it| it.offset_rad);
        (message.heading + offset, HeadingOf::Body)
    }

    fn receiver(&self, source: u16) -> Option<&Receiver> {
        let mut entries = self.position.receiver.iter();
        entries.find(|it| it.source == source)
    }

    fn compass(&self, source: u16) -> Option<&Compass> {
        let mut entries = self.heading.sensor.iter();
        entries.find(|it| it.source == source)
    }
}

/// σ and time of what the message says; of what it does not say, the usual.
fn slow((sigma, time_s): (f64, f64), usual: (f64, f64)) -> SlowError {
    let or = |said: f64, usual: f64| if said > 0.0 { said } else { usual };
    let sigma = or(sigma, usual.0);
    SlowError {
        variance: sigma * sigma,
        memory: Span::from_seconds(or(time_s, usual.1)),
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;
    use std::path::Path;

    use coloc_estimator::{Covariance3, Origin, RobotId, Stamp};
    use coloc_shm_types::Header;

    use super::*;

    fn sensors(lines: &str) -> Sensors {
        let text = format!("[robot]\nname = \"a\"\nid = 1\n{lines}");
        Sensors::of(&Config::parse(&text, Path::new("a.toml")).unwrap())
    }

    fn sighting(source: u16) -> Sighting {
        Sighting {
            stamp: Stamp::default(),
            origin: Origin {
                source,
                ..Origin::counted(0)
            },
            observed: RobotId(2),
            relative: Pose::new(2.0, 1.0, 3.0),
            covariance: Covariance3::diagonal([0.04, 0.01, 0.02]).unwrap(),
        }
    }

    fn header(source: u16) -> Header {
        Header {
            source,
            ..Header::default()
        }
    }

    #[test]
    fn a_laser_that_looks_to_the_left_sees_what_is_to_the_left() {
        let sensors = sensors(&format!(
            "[relative_pose]\nmount = [0.5, 0.1, {FRAC_PI_2}]\n\
             [[relative_pose.sensor]]\nsource = 3\nmount = [0.0, 0.0, 0.0]\n"
        ));
        let seen = sensors.of_body(&sighting(0));
        let Pose { x, y, phi } = seen.relative;
        assert!((x - -0.5).abs() < 1e-15 && (y - 2.1).abs() < 1e-15);
        assert!((phi - (3.0 + FRAC_PI_2 - std::f64::consts::TAU)).abs() < 1e-15);
        let [xx, yy, pp] = seen.covariance.variances();
        assert!((xx - 0.01).abs() < 1e-15 && (yy - 0.04).abs() < 1e-15);
        assert!((pp - 0.02).abs() < 1e-15);
        assert_eq!(sensors.of_body(&sighting(3)), sighting(3), "bit for bit");
    }

    #[test]
    fn a_messages_own_word_comes_before_the_receivers_and_that_before_all_receivers() {
        let sensors = sensors(
            "[position]\nlever_m = [1.0, 2.0]\nslow_sigma_m = 2.0\nslow_time_s = 100.0\n\
             [[position.receiver]]\nsource = 3\nlever_m = [3.0, 4.0]\n",
        );
        let of = |source: u16, lever_m: [f64; 2], slow: [f64; 2]| {
            let [slow_sigma_m, slow_time_s] = slow;
            let message = Position {
                header: header(source),
                lever_m,
                slow_sigma_m,
                slow_time_s,
                ..Position::default()
            };
            let SlowError { variance, memory } = sensors.slow_of_fix(&message);
            let [forward, left] = sensors.lever_of(&message);
            [forward, left, variance, memory.as_seconds()].map(|it| format!("{it:.0}"))
        };
        assert_eq!(of(0, [0.0; 2], [0.0; 2]), ["1", "2", "4", "100"]);
        assert_eq!(of(0, [0.0, 5.0], [3.0, 0.0]), ["0", "5", "9", "100"]);
        assert_eq!(of(0, [0.0; 2], [0.0, 7.0]), ["1", "2", "4", "7"]);
        assert_eq!(of(3, [0.0; 2], [0.0; 2]), ["3", "4", "0", "60"]);
    }

    #[test]
    fn a_fix_is_older_than_its_stamp_and_a_gyro_reads_too_little() {
        let sensors = sensors(
            "[position]\ndelay_s = 0.25\n[[position.receiver]]\nsource = 3\ndelay_s = -0.5\n\
             [gyro]\nscale = 1.25\n",
        );
        let delay_ms = |source| {
            let message = Position {
                header: header(source),
                ..Position::default()
            };
            sensors.delay_of(&message).as_nanos() / 1_000_000
        };
        assert_eq!([0, 3].map(delay_ms), [250, -500]);
        assert!((sensors.turning(0.5) - 0.625).abs() < 1e-15);
    }

    #[test]
    fn the_offset_turns_a_compass_and_no_course() {
        let sensors = sensors("[heading]\noffset_rad = 0.5\nleast_speed_m_s = 0.25\n");
        let looking = |what: u8| {
            sensors.looking(&Heading {
                header: header(0),
                what,
                heading: 1.0,
                ..Heading::default()
            })
        };
        assert_eq!(looking(Heading::COMPASS), (1.5, HeadingOf::Body));
        assert_eq!(looking(Heading::ANTENNAS), (1.5, HeadingOf::Body));
        let course = HeadingOf::Course {
            least_m_s: 0.25,
            lever: [0.0; 2],
        };
        assert_eq!(looking(Heading::COURSE), (1.0, course));
    }
}
