//! The last belief on disk, so that a daemon that was killed can go on from it.
//!
//! Telemetry writes it a few times a second, into a new file that then takes the old one's name: whoever reads sees
//! the one or the other, never a half.

use std::fmt;
use std::io::Write;
use std::path::Path;

use coloc_estimator::{Belief, Covariance3, Pose};
use serde::{Deserialize, Serialize};

use crate::config::{Config, Motion};

/// A belief as it is written.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Saved {
    /// Whose.
    pub robot: u16,
    /// When, by `CLOCK_REALTIME`: the only clock that outlives a reboot \[ns\].
    pub realtime_ns: i64,
    /// `[x, y, φ]`
    pub pose: [f64; 3],
    /// P, row-major.
    pub total: [f64; 9],
    /// `P_i`, row-major.
    pub independent: [f64; 9],
}

/// Why a saved belief is not used. None of this is fatal: the robot starts from `[initial]`.
#[derive(Debug)]
pub enum Unusable {
    /// None was saved yet.
    Missing,
    /// It cannot be read.
    Unreadable(std::io::Error),
    /// Not what this program writes.
    Malformed(String),
    /// Of another robot.
    OtherRobot(u16),
    /// From the future, or too long ago \[s\].
    Age(f64),
}

impl fmt::Display for Unusable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Missing => f.write_str("none was saved yet"),
            Self::Unreadable(error) => write!(f, "it cannot be read: {error}"),
            Self::Malformed(problem) => write!(f, "it is not a saved belief: {problem}"),
            Self::OtherRobot(id) => write!(f, "it is robot {id}'s"),
            Self::Age(age_s) => write!(
                f,
                "it is {age_s:.1} s old, more than initial.resume_max_age_s or from the future"
            ),
        }
    }
}

impl Saved {
    /// What is to be written about `belief`.
    #[must_use]
    pub fn new(robot: u16, realtime_ns: i64, belief: &Belief) -> Self {
        let Pose { x, y, phi } = belief.pose;
        Self {
            robot,
            realtime_ns,
            pose: [x, y, phi],
            total: belief.total.to_row_major(),
            independent: belief.independent.to_row_major(),
        }
    }

    /// Replaces the file at `path`.
    ///
    /// # Errors
    /// What the file system says; the old file is then still whole.
    pub fn write(&self, path: &Path) -> std::io::Result<()> {
        let text = toml::to_string(self).map_err(std::io::Error::other)?;
        let new = path.with_extension("new");
        std::fs::File::create(&new)?.write_all(text.as_bytes())?;
        std::fs::rename(&new, path)
    }

    /// The belief to start with at `realtime_ns`: the saved one, grown by what an outage of that length would have
    /// added to it.
    ///
    /// # Errors
    /// Why there is none.
    pub fn resume(config: &Config, realtime_ns: i64) -> Result<(Belief, f64), Unusable> {
        let text =
            std::fs::read_to_string(config.state_file()).map_err(|error| match error.kind() {
                std::io::ErrorKind::NotFound => Unusable::Missing,
                _ => Unusable::Unreadable(error),
            })?;
        let saved: Self =
            toml::from_str(&text).map_err(|error| Unusable::Malformed(error.message().into()))?;
        if saved.robot != config.robot.id {
            return Err(Unusable::OtherRobot(saved.robot));
        }
        #[allow(clippy::cast_precision_loss)] // Exact for 104 days.
        let age_s = realtime_ns.saturating_sub(saved.realtime_ns) as f64 / 1e9;
        if !(0.0..=config.initial.resume_max_age_s).contains(&age_s) {
            return Err(Unusable::Age(age_s));
        }
        Ok((saved.inflated(&config.motion, age_s)?, age_s))
    }

    /// White velocity noise of variance q per period T, over a time t, moves a robot of unknown heading by q T t.
    fn inflated(&self, motion: &Motion, age_s: f64) -> Result<Belief, Unusable> {
        let [forward, sideways, turning] = motion.outage_variance;
        let across = forward.max(sideways);
        let growth =
            [across, across, turning].map(|variance| variance * motion.reference_period_s * age_s);
        let [x, y, phi] = self.pose;
        let pose = Pose::new(x, y, phi);
        if !pose.is_finite() {
            return Err(Unusable::Malformed("the pose is not finite".into()));
        }
        Ok(Belief {
            pose,
            total: grown(self.total, growth)?,
            independent: grown(self.independent, growth)?,
        })
    }
}

fn grown(mut rows: [f64; 9], growth: [f64; 3]) -> Result<Covariance3, Unusable> {
    for (variance, growth) in rows.iter_mut().step_by(4).zip(growth) {
        *variance += growth;
    }
    Covariance3::from_row_major(rows)
        .map_err(|problem| Unusable::Malformed(format!("a covariance is {problem:?}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: i64 = 1_000_000_000;

    fn config(directory: &Path) -> Config {
        let text = format!(
            "[robot]\nname = \"a\"\nid = 3\n[initial]\nresume = true\n[shm]\nroot = \"{}/shm\"\n",
            directory.display()
        );
        Config::parse(&text, Path::new("a.toml")).unwrap()
    }

    fn saved(robot: u16) -> Saved {
        let p = Covariance3::diagonal([0.01, 0.04, 0.0025]).unwrap();
        let belief = Belief {
            pose: Pose::new(1.0, -2.0, 3.0),
            total: p,
            independent: Covariance3::ZERO,
        };
        Saved::new(robot, 100 * SECOND, &belief)
    }

    #[test]
    fn what_was_saved_comes_back_grown_by_the_outage() {
        let directory = tempfile::tempdir().unwrap();
        let config = config(directory.path());
        saved(3).write(&config.state_file()).unwrap();
        let (belief, age_s) = Saved::resume(&config, 102 * SECOND).unwrap();
        assert_eq!(
            (belief.pose, age_s.to_bits()),
            (Pose::new(1.0, -2.0, 3.0), 2.0_f64.to_bits())
        );
        let [forward, ..] = config.motion.outage_variance;
        let expected = 0.01 + forward * 0.02 * 2.0;
        assert!((belief.total.to_row_major()[0] - expected).abs() < 1e-12);
        assert!((belief.independent.to_row_major()[0] - (expected - 0.01)).abs() < 1e-12);
    }

    #[test]
    fn what_cannot_be_trusted_is_not_used() {
        let directory = tempfile::tempdir().unwrap();
        let config = config(directory.path());
        assert!(matches!(Saved::resume(&config, 0), Err(Unusable::Missing)));
        saved(4).write(&config.state_file()).unwrap();
        assert!(matches!(
            Saved::resume(&config, 101 * SECOND),
            Err(Unusable::OtherRobot(4))
        ));
        saved(3).write(&config.state_file()).unwrap();
        assert!(matches!(
            Saved::resume(&config, 99 * SECOND),
            Err(Unusable::Age(_))
        ));
        assert!(matches!(
            Saved::resume(&config, 161 * SECOND),
            Err(Unusable::Age(_))
        ));
        let broken = Saved {
            total: [-1.0; 9],
            ..saved(3)
        };
        broken.write(&config.state_file()).unwrap();
        assert!(matches!(
            Saved::resume(&config, 101 * SECOND),
            Err(Unusable::Malformed(_))
        ));
        std::fs::write(config.state_file(), "half a fi").unwrap();
        assert!(matches!(
            Saved::resume(&config, 101 * SECOND),
            Err(Unusable::Malformed(_))
        ));
    }
}
