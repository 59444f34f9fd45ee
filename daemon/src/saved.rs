//! The last belief on disk, so that a daemon that was killed, or a computer that lost its power, can go on from it.
//!
//! Each time the file is written anew, brought to the disk, and given its name: whoever reads sees the old one or the
//! new one, never a half, also after a power cut. That is done on a thread of its own, `telemetry.state_hz` times a
//! second at most, and less often where the disk is slower.
//!
//! # Going on
//!
//! The robot moved on while nobody looked. A belief of age t is carried on as the estimator does when odometry stops
//! ([`coloc_estimator::OdometrySettings`], with T = `motion.reference_period_s`):
//!
//! * for h = min(t, `motion.hold_s`) by the last velocity, with noise Q · T/h · (1 + `hold_growth` · h/2T),
//! * for the rest r = t − h with velocity zero and noise `outage_variance` · T/r.
//!
//! The velocity counts as measured when the belief was saved. Where there was none, h = 0.
//!
//! The bias of a gyro is saved too, but not what its error has in common with the heading's. So it is taken up with twice its standard
//! deviation, and walks on as configured; where it is known no better than the configuration says, it is not used.

mod clocks;
mod saver;

use std::fmt;
use std::io::ErrorKind;
use std::path::PathBuf;

use coloc_estimator::{Belief, Bend, Covariance3, Motion, Parts, Pose, propagate};
use coloc_shm_types::{OpenError, all_finite, check_split};
use serde::{Deserialize, Serialize};

use crate::collect::wheels::ToMotion;
use crate::config::{self, Config};
use crate::estimate;

pub use clocks::When;
pub use saver::Saver;

/// A belief as it is written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Saved {
    /// Whose.
    pub robot: u16,
    /// When.
    pub when: When,
    /// `[x, y, φ]`
    pub pose: [f64; 3],
    /// `[v_x, v_y, ω]`, if there was odometry.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub velocity: Option<[f64; 3]>,
    /// Bias of the gyro and its standard deviation, if there is one \[rad/s\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gyro: Option<[f64; 2]>,
    /// `P_i`, row-major.
    pub independent: [f64; 9],
    /// `P_d`, row-major.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dependent: Option<[f64; 9]>,
    /// `k_a` and `k_b` of the distribution's bend.
    #[serde(default)]
    pub bend: [f64; 6],
    /// P, row-major: what older versions wrote in place of `P_d`; they knew no bend.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub total: Option<[f64; 9]>,
}

/// What a saved belief says of now.
#[derive(Clone, Debug, PartialEq)]
pub struct Resumed {
    /// The belief to start with.
    pub belief: Belief,
    /// How old the saved one is \[s\].
    pub age_s: f64,
    /// Bias of the gyro and its variance \[rad/s, rad²/s²\]; `None`: as configured.
    pub gyro: Option<[f64; 2]>,
}

/// Why a saved belief is not used. None of this is fatal: the robot starts from `[initial]`.
#[derive(Debug)]
pub enum Unusable {
    /// None was saved yet.
    Missing,
    /// It cannot be read, or others could have written it.
    Unreadable(OpenError),
    /// Not what this program writes.
    Malformed {
        /// Where it is.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
    /// Of another robot.
    OtherRobot(u16),
    /// From the future, or too long ago \[s\].
    Age(f64),
}

impl fmt::Display for Unusable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Missing => f.write_str("none was saved yet"),
            Self::Unreadable(problem) => problem.fmt(f),
            Self::Malformed { path, problem } => {
                write!(f, "{} is not a saved belief: {problem}", path.display())
            }
            Self::OtherRobot(id) => write!(f, "it is robot {id}'s"),
            Self::Age(age_s) if *age_s < 0.0 => write!(
                f,
                "it was saved {:.1} s in the future: this computer's clock was set back, or is not set yet",
                -age_s
            ),
            Self::Age(age_s) => write!(
                f,
                "it is {age_s:.1} s old, more than initial.resume_max_age_s"
            ),
        }
    }
}

impl Saved {
    /// What is to be written about `belief`.
    #[must_use]
    pub fn new(robot: u16, when: When, belief: &Belief, velocity: Option<[f64; 3]>) -> Self {
        let Pose { x, y, phi } = belief.pose;
        Self {
            robot,
            when,
            pose: [x, y, phi],
            velocity,
            gyro: None,
            independent: belief.parts.independent.to_row_major(),
            dependent: Some(belief.parts.dependent.to_row_major()),
            bend: belief.bend.to_array(),
            total: None,
        }
    }

    /// What to start with at `now`.
    ///
    /// # Errors
    /// Why there is none.
    pub fn resume(config: &Config, now: &When) -> Result<Resumed, Unusable> {
        let (path, text) = read(config)?;
        let saved: Self = toml::from_str(&text).map_err(|error| Unusable::Malformed {
            path: path.clone(),
            problem: error.message().into(),
        })?;
        if saved.robot != config.robot.id {
            return Err(Unusable::OtherRobot(saved.robot));
        }
        let belief = saved
            .belief()
            .map_err(|problem| Unusable::Malformed { path, problem })?;
        let age_s = now.since(&saved.when);
        if !(0.0..=config.initial.resume_max_age_s).contains(&age_s) {
            return Err(Unusable::Age(age_s));
        }
        Ok(Resumed {
            belief: carried_on(config, &belief, saved.velocity, age_s),
            age_s,
            gyro: saved.gyro.and_then(|it| known(config, it, age_s)),
        })
    }

    fn belief(&self) -> Result<Belief, String> {
        let [x, y, phi] = self.pose;
        let velocity = self.velocity.unwrap_or_default();
        if !all_finite(&self.pose) || !all_finite(&velocity) {
            return Err("the pose or the velocity is not finite".into());
        }
        if velocity.iter().any(|number| number.abs() > FASTEST) {
            return Err("no robot is as fast as its velocity".into());
        }
        let [bias, sigma] = self.gyro.unwrap_or_default();
        if !all_finite(&[bias, sigma]) {
            return Err("the gyro's bias is not finite".into());
        }
        if bias.abs() > LARGEST_BIAS {
            return Err("no gyro has as large a bias".into());
        }
        if sigma < 0.0 {
            return Err("the standard deviation of the gyro's bias is negative".into());
        }
        let bend = Bend::from_array(self.bend);
        Belief::new(Pose::new(x, y, phi), self.parts()?, bend)
            .map_err(|problem| problem.to_string())
    }

    fn parts(&self) -> Result<Parts, String> {
        let impossible = |reason: &dyn fmt::Display| format!("its covariances cannot be: {reason}");
        match (self.dependent, self.total) {
            (Some(dependent), None) => {
                Parts::from_row_major(self.independent, dependent).map_err(|it| impossible(&it))
            }
            (None, Some(total)) => {
                check_split(&total, &self.independent).map_err(|it| impossible(&it))?;
                let [total, independent] =
                    [total, self.independent].map(Covariance3::from_row_major);
                let total = total.map_err(|it| impossible(&it))?;
                let independent = independent.map_err(|it| impossible(&it))?;
                Ok(Parts::of(&total, &independent))
            }
            _ => Err("one of dependent and total has to be there".into()),
        }
    }
}

/// As fast as `odometry.max_speed_mps` and `odometry.max_turn_rate_radps` may be \[m/s, rad/s\].
const FASTEST: f64 = 1000.0;

/// Ten times what the worst of gyros reads when it stands \[rad/s\].
const LARGEST_BIAS: f64 = 5.0;

/// Far more than a belief takes (bytes).
const LIMIT: u64 = 64 << 10;

fn read(config: &Config) -> Result<(PathBuf, String), Unusable> {
    let read = || -> Result<_, OpenError> {
        let file = config.state()?;
        Ok((file.path().to_owned(), file.read(LIMIT)?))
    };
    match read() {
        Ok((path, text)) => Ok((path, text.ok_or(Unusable::Missing)?)),
        Err(OpenError::NotPrivate(problem)) if problem.kind() == ErrorKind::NotFound => {
            Err(Unusable::Missing)
        }
        Err(problem) => Err(Unusable::Unreadable(problem)),
    }
}

/// A bias that was saved, and its variance now.
fn known(config: &Config, [bias, sigma]: [f64; 2], age_s: f64) -> Option<[f64; 2]> {
    let gyro = config.gyro.settings()?;
    let variance = 4.0 * sigma * sigma + gyro.bias_walk * age_s;
    (variance > 0.0 && variance < gyro.bias_variance).then_some([bias, variance])
}

/// The equation above.
fn carried_on(config: &Config, belief: &Belief, velocity: Option<[f64; 3]>, age_s: f64) -> Belief {
    let config::Motion {
        reference_period_s,
        hold_s,
        hold_growth,
        outage_variance,
        ..
    } = config.motion;
    let held_s = velocity.map_or(0.0, |_| age_s.min(hold_s));
    let propagation = estimate::propagation(&config.fusion);
    let moved = |belief: &Belief, motion: &Motion, for_s: f64, growth: f64| {
        let white = reference_period_s / for_s;
        if for_s > 0.0 {
            let noisy = motion.with_noise_scaled(white * growth);
            propagate(belief, &noisy, for_s, propagation)
        } else {
            *belief
        }
    };
    let motion = ToMotion::new(config).motion(velocity.unwrap_or_default());
    let growth = 1.0 + hold_growth * held_s / (2.0 * reference_period_s);
    let held = moved(belief, &motion, held_s, growth);
    moved(
        &held,
        &Motion::standstill(outage_variance),
        age_s - held_s,
        1.0,
    )
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use coloc_estimator::{
        Estimator, Measurement, OdometrySample, Slot, Span, Stamp, TickInputs, step,
    };

    use super::*;
    use crate::estimate::settings;

    fn config(directory: &Path) -> Config {
        let text = format!(
            "[robot]\nname = \"a\"\nid = 3\n[initial]\nresume = true\n[telemetry]\nstate_file = \"{}/belief\"\n",
            directory.display()
        );
        Config::parse(&text, Path::new("a.toml")).unwrap()
    }

    fn at(seconds: f64) -> When {
        When {
            boot_id: "this".into(),
            boottime_ns: Span::from_nanos(config::nanos(seconds)).as_nanos(),
            realtime_ns: 0,
        }
    }

    fn believed() -> Belief {
        let p = Covariance3::diagonal([0.01, 0.04, 0.0025]).unwrap();
        let bend = Bend {
            along: [1e-5, -2e-5, 1e-6],
            across: [-2e-6, 3e-6, 1e-7],
        };
        Belief::new(Pose::new(1.0, -2.0, 3.0), Parts::dependent(p), bend).unwrap()
    }

    fn saved(velocity: Option<[f64; 3]>) -> Saved {
        Saved::new(3, at(100.0), &believed(), velocity)
    }

    /// What a daemon that was not killed would believe `age_s` after its last sample of odometry.
    fn without_a_gap(config: &Config, velocity: Option<[f64; 3]>, age_s: f64) -> Belief {
        let instant = Span::from_nanos(1);
        let (begin, last) = (Stamp::default(), Stamp::default() + instant);
        let samples = velocity.map(|velocity| {
            Measurement::Odometry(OdometrySample {
                source: 0,
                start: begin,
                stamp: last,
                motion: ToMotion::new(config).motion(velocity),
            })
        });
        let mut estimator = Estimator::new(
            settings(config),
            begin,
            believed(),
            vec![Slot::default(); 4],
        );
        let inputs = TickInputs {
            stamp: last,
            measurements: samples.as_slice(),
        };
        step(&mut estimator, &inputs);
        let age = Span::from_nanos(config::nanos(age_s));
        estimator.extrapolated(last + age).belief
    }

    #[test]
    fn a_gap_is_an_outage_of_that_length() {
        let directory = tempfile::tempdir().unwrap();
        let config = config(directory.path());
        for velocity in [None, Some([0.0; 3]), Some([0.8, 0.0, -0.3])] {
            for age_s in [0.0, 0.05, 0.2, 0.7, 30.0] {
                saved(velocity).write(&config).unwrap();
                let resumed = Saved::resume(&config, &at(100.0 + age_s)).unwrap();
                let (resumed, age) = (resumed.belief, resumed.age_s);
                let expected = without_a_gap(&config, velocity, age_s);
                let numbers = |belief: &Belief| {
                    let pose: [f64; 3] = belief.pose.to_vector().into();
                    let covariances = [belief.parts.dependent, belief.parts.independent]
                        .map(|it| it.to_row_major());
                    let bend = belief.bend.to_array();
                    [pose.as_slice(), covariances.as_flattened(), &bend].concat()
                };
                let same = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-6 * b.abs() + 1e-7;
                let (resumed, expected) = (numbers(&resumed), numbers(&expected));
                assert!(
                    (age - age_s).abs() < 1e-9 && resumed.iter().zip(&expected).all(same),
                    "{velocity:?} {age_s} s: {resumed:?} instead of {expected:?}"
                );
            }
        }
    }

    #[test]
    fn a_moving_robot_is_found_further_on() {
        let directory = tempfile::tempdir().unwrap();
        let config = config(directory.path());
        saved(Some([1.0, 0.0, 0.0])).write(&config).unwrap();
        let belief = Saved::resume(&config, &at(100.1)).unwrap().belief;
        let way_m = (belief.pose.x - 1.0).hypot(belief.pose.y + 2.0);
        assert!((way_m - 0.1).abs() < 1e-3, "{way_m} m in 0.1 s at 1 m/s");
    }

    /// Saved 100 s ago, of a robot with a gyro whose bias is known to 0.05 rad/s and walks by 1e-3 rad/s in a second.
    fn resumed_bias(gyro: Option<[f64; 2]>, section: &str) -> Option<[f64; 2]> {
        let directory = tempfile::tempdir().unwrap();
        let config = Config::parse(
            &format!(
                "[robot]\nname = \"a\"\nid = 3\n[initial]\nresume = true\nresume_max_age_s = 1000.0\n{section}\n\
                 [telemetry]\nstate_file = \"{}/belief\"\n",
                directory.path().display()
            ),
            Path::new("a.toml"),
        )
        .unwrap();
        let saved = Saved {
            gyro,
            ..saved(None)
        };
        saved.write(&config).unwrap();
        Saved::resume(&config, &at(200.0)).unwrap().gyro
    }

    #[test]
    fn the_bias_of_the_gyro_is_found_again_and_has_walked() {
        let section = "[gyro]\nsource = \"channel\"\nbias_sigma = 0.05\nbias_walk = 1e-3";
        let [bias, variance] = resumed_bias(Some([0.02, 1e-3]), section).unwrap();
        assert_eq!(bias.to_bits(), 0.02_f64.to_bits());
        assert!(
            (variance - (4e-6 + 100.0 * 1e-6)).abs() < 1e-12,
            "{variance}"
        );
        assert_eq!(resumed_bias(None, section), None, "none was saved");
        assert_eq!(
            resumed_bias(Some([0.02, 0.03]), section),
            None,
            "no better than configured"
        );
        assert_eq!(resumed_bias(Some([0.02, 1e-3]), ""), None, "no gyro");
    }

    fn refusal(change: impl FnOnce(&mut Saved), now_s: f64) -> String {
        let directory = tempfile::tempdir().unwrap();
        let config = config(directory.path());
        let mut saved = saved(None);
        change(&mut saved);
        saved.write(&config).unwrap();
        Saved::resume(&config, &at(now_s)).unwrap_err().to_string()
    }

    #[test]
    fn what_cannot_be_trusted_is_not_used() {
        let refused = |change: fn(&mut Saved), reason: &str| {
            let said = refusal(change, 101.0);
            assert!(said.contains(reason), "{said} instead of {reason}");
        };
        refused(|saved| saved.robot = 4, "robot 4's");
        refused(|saved| saved.pose[0] = f64::NAN, "not finite");
        refused(
            |saved| saved.velocity = Some([1.0, 0.0, 1001.0]),
            "no robot is as fast",
        );
        refused(
            |saved| saved.velocity = Some([f64::INFINITY; 3]),
            "not finite",
        );
        refused(|saved| saved.gyro = Some([f64::NAN, 1.0]), "not finite");
        refused(
            |saved| saved.gyro = Some([0.02, f64::INFINITY]),
            "not finite",
        );
        refused(
            |saved| saved.gyro = Some([1e6, 1e-3]),
            "no gyro has as large",
        );
        refused(
            |saved| saved.gyro = Some([-5.1, 1e-3]),
            "no gyro has as large",
        );
        refused(|saved| saved.gyro = Some([0.02, -1e-3]), "bias is negative");
        refused(|saved| saved.dependent = Some([-1.0; 9]), "covariances");
        refused(|saved| saved.independent[1] = 0.5, "covariances");
        refused(|saved| saved.dependent = None, "dependent and total");
        refused(|saved| saved.bend[0] = f64::NAN, "not a finite number");
        refused(|saved| saved.bend[0] = 0.1, "bend is more than");
        assert!(refusal(|_| (), 99.0).contains("1.0 s in the future"));
        assert!(refusal(|_| (), 161.0).contains("61.0 s old"));
    }

    /// It wrote the whole in place of the dependent part, and nothing of a bend.
    #[test]
    fn what_a_version_before_wrote_is_read_too() {
        let with = |total: [f64; 9]| Saved {
            dependent: None,
            bend: [0.0; 6],
            total: Some(total),
            independent: Covariance3::diagonal([0.005, 0.01, 0.001])
                .unwrap()
                .to_row_major(),
            ..saved(None)
        };
        let total = believed().total();
        let belief = with(total.to_row_major()).belief().unwrap();
        assert_eq!((belief.bend, belief.pose), (Bend::ZERO, believed().pose));
        let rest = Covariance3::diagonal([0.005, 0.03, 0.0015]).unwrap();
        let error = (belief.parts.dependent.matrix() - rest.matrix()).abs();
        assert!(error.max() < 1e-17, "{belief:?}");
        let less = Covariance3::diagonal([0.004, 0.04, 0.0025]).unwrap();
        let refused = with(less.to_row_major()).belief().unwrap_err();
        assert!(refused.contains("covariances"), "{refused}");
    }

    #[test]
    fn what_is_no_belief_says_so() {
        let directory = tempfile::tempdir().unwrap();
        let config = config(directory.path());
        let resume = || Saved::resume(&config, &at(101.0));
        assert!(matches!(resume(), Err(Unusable::Missing)));
        std::fs::write(directory.path().join("belief"), "half a fi").unwrap();
        assert!(matches!(resume(), Err(Unusable::Malformed { .. })));
    }

    #[test]
    fn what_others_could_have_put_there_is_not_used() {
        use std::os::unix::fs::PermissionsExt;
        let directory = tempfile::tempdir().unwrap();
        let config = config(directory.path());
        let resume = || Saved::resume(&config, &at(101.0));
        let elsewhere = directory.path().join("elsewhere");
        saved(None).write(&config).unwrap();
        std::fs::hard_link(directory.path().join("belief"), &elsewhere).unwrap();
        assert!(matches!(resume(), Err(Unusable::Unreadable(_))));
        std::fs::remove_file(&elsewhere).unwrap();
        assert!(resume().is_ok());
        let open = std::fs::Permissions::from_mode(0o666);
        std::fs::set_permissions(directory.path().join("belief"), open).unwrap();
        assert!(matches!(resume(), Err(Unusable::Unreadable(_))));
    }
}
