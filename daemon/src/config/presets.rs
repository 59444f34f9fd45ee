//! `[motion]` of the robots that people own, and how what is written overrides it.

use coloc_estimator::{OdometryNoise, OdometrySettings, noise};
use serde::{Deserialize, Deserializer};

use super::{Motion, Preset, StandsBy, Variance};

/// What every second, metre and radian add to a variance.
fn added([per_s, per_m, per_rad]: [f64; 3]) -> Variance {
    Variance {
        per_s,
        per_m,
        per_rad,
        ..Variance::default()
    }
}

/// (2 mm)² a second: what a robot still rolls when its wheels have stopped.
const FLOOR: f64 = 4e-6;

impl Preset {
    /// Forward, sideways, turning.
    fn noise(self) -> [Variance; 3] {
        match self {
            Self::Differential => {
                let turning = [4.6e-5, 0.0, 4e-4];
                [[FLOOR, 4e-4, 1e-4], [FLOOR, 1e-4, 1e-4], turning].map(added)
            }
            Self::SkidSteer => {
                let turning = [1.8e-4, 0.0, 1e-2];
                [[FLOOR, 4.9e-3, 2.5e-3], [FLOOR, 2.5e-3, 2.5e-3], turning].map(added)
            }
            Self::Car => {
                let turning = [5.1e-6, 3e-6, 4e-4];
                [[FLOOR, 1e-4, 0.0], [FLOOR, 1e-4, 2.5e-3], turning].map(added)
            }
            Self::Mrclam => {
                let [paper, _, turning] = Self::Paper.noise();
                let floor = |a| Variance {
                    a,
                    ..Variance::default()
                };
                let forward = Variance { a: 0.005, ..paper };
                [forward, floor(0.001), turning]
            }
            Self::Paper => {
                let paper = OdometryNoise::paper();
                [paper.forward, paper.sideways, paper.turning].map(of_a_sample)
            }
        }
    }

    fn stands_by(self) -> StandsBy {
        match self {
            Self::Mrclam | Self::Paper => StandsBy::Nothing,
            _ => StandsBy::Counts,
        }
    }

    /// The whole section.
    #[must_use]
    pub fn motion(self) -> Motion {
        let [forward, sideways, turning] = self.noise();
        let between = OdometrySettings::default();
        Motion {
            preset: self,
            forward,
            sideways,
            turning,
            stands_by: self.stands_by(),
            creep_per_hour: [0.1, 0.1, 0.05],
            reference_period_s: between.reference_period.as_seconds(),
            hold_s: between.hold.as_seconds(),
            hold_growth: between.hold_growth,
            outage_variance: between.outage_variance,
        }
    }
}

fn of_a_sample(noise::Variance { a, b, c, .. }: noise::Variance) -> Variance {
    Variance {
        a,
        b,
        c,
        ..Variance::default()
    }
}

impl Variance {
    /// In a sample of `period_s`, for the estimator.
    pub(crate) fn in_a_sample_of(self, period_s: f64) -> noise::Variance {
        noise::Variance {
            a: self.a + self.per_s / period_s,
            b: self.b,
            c: self.c,
            per_speed: self.per_m / period_s,
            per_turn_rate: self.per_rad / period_s,
        }
    }
}

impl Motion {
    /// Noise of a velocity, per reference period.
    #[must_use]
    pub fn noise(&self) -> OdometryNoise {
        let variance = |variance: Variance| variance.in_a_sample_of(self.reference_period_s);
        OdometryNoise {
            forward: variance(self.forward),
            sideways: variance(self.sideways),
            turning: variance(self.turning),
        }
    }

    /// Variances of the velocity of a robot that stands, per reference period: in an hour they add up to a third of its creep.
    #[must_use]
    pub fn creep_variance(&self) -> [f64; 3] {
        self.creep_per_hour.map(|creep| {
            let sigma = creep / 3.0;
            sigma * sigma / (3600.0 * self.reference_period_s)
        })
    }
}

impl Default for Motion {
    fn default() -> Self {
        Preset::default().motion()
    }
}

/// The section as a person wrote it.
#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Written {
    preset: Preset,
    forward: Option<Variance>,
    sideways: Option<Variance>,
    turning: Option<Variance>,
    stands_by: Option<StandsBy>,
    creep_per_hour: Option<[f64; 3]>,
    reference_period_s: Option<f64>,
    hold_s: Option<f64>,
    hold_growth: Option<f64>,
    outage_variance: Option<[f64; 3]>,
}

impl<'de> Deserialize<'de> for Motion {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let written = Written::deserialize(from)?;
        let preset = written.preset.motion();
        Ok(Self {
            preset: written.preset,
            forward: written.forward.unwrap_or(preset.forward),
            sideways: written.sideways.unwrap_or(preset.sideways),
            turning: written.turning.unwrap_or(preset.turning),
            stands_by: written.stands_by.unwrap_or(preset.stands_by),
            creep_per_hour: written.creep_per_hour.unwrap_or(preset.creep_per_hour),
            reference_period_s: written
                .reference_period_s
                .unwrap_or(preset.reference_period_s),
            hold_s: written.hold_s.unwrap_or(preset.hold_s),
            hold_growth: written.hold_growth.unwrap_or(preset.hold_growth),
            outage_variance: written.outage_variance.unwrap_or(preset.outage_variance),
        })
    }
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "these results are exact")]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::config::Config;

    fn motion(lines: &str) -> Motion {
        let text = format!("[robot]\nname = \"a\"\nid = 1\n[motion]\n{lines}");
        Config::parse(&text, Path::new("a.toml")).unwrap().motion
    }

    const PRESETS: [(&str, Preset); 5] = [
        ("differential", Preset::Differential),
        ("skid-steer", Preset::SkidSteer),
        ("car", Preset::Car),
        ("mrclam", Preset::Mrclam),
        ("paper", Preset::Paper),
    ];

    #[test]
    fn a_preset_is_all_that_must_be_written_and_differential_not_even_that() {
        for (word, preset) in PRESETS {
            assert_eq!(motion(&format!("preset = \"{word}\"")), preset.motion());
        }
        assert_eq!(motion(""), Preset::Differential.motion());
    }

    #[test]
    fn what_is_written_overrides_the_preset_and_nothing_else_does() {
        let written = motion(
            "preset = \"paper\"\nsideways = { per_m = 0.5 }\nstands_by = \"speeds\"\nhold_s = 0.5",
        );
        let expected = Motion {
            sideways: Variance {
                per_m: 0.5,
                ..Variance::default()
            },
            stands_by: StandsBy::Speeds,
            hold_s: 0.5,
            ..Preset::Paper.motion()
        };
        assert_eq!(written, expected);
    }

    #[test]
    fn a_section_written_out_is_read_as_it_was() {
        for (_, preset) in PRESETS {
            let config = Config {
                motion: preset.motion(),
                ..Config::parse("[robot]\nname = \"a\"\nid = 1\n", Path::new("a.toml")).unwrap()
            };
            let text = toml::to_string(&config).unwrap();
            assert_eq!(Config::parse(&text, Path::new("a.toml")), Ok(config));
        }
    }

    #[test]
    fn the_paper_is_table_2_and_mrclam_what_was_found_honest() {
        assert_eq!(Preset::Paper.motion().noise(), OdometryNoise::paper());
        let found = Preset::Mrclam.motion().noise();
        let at = |variance: noise::Variance, v: f64| variance.at(v, v, 0.3);
        assert_eq!(at(found.forward, 2.0), 0.005 + 5.075 * 4.0);
        assert_eq!(at(found.sideways, 2.0), 0.001);
        assert_eq!(found.turning, OdometryNoise::paper().turning);
    }

    /// A robot's noise after a second, a metre or a radian is its own, whatever the samples.
    #[test]
    fn a_robots_noise_does_not_depend_on_the_period_it_is_stated_for() {
        let grown = |lines: &str| {
            let motion = motion(lines);
            let period_s = motion.reference_period_s;
            let noise = motion.noise();
            let all = [noise.forward, noise.sideways, noise.turning];
            all.map(|variance| variance.at(0.5, 0.5, 0.2) * period_s)
        };
        for (word, _) in PRESETS.iter().take(3) {
            let [short, long] = ["0.01", "0.5"].map(|period| {
                grown(&format!(
                    "preset = \"{word}\"\nreference_period_s = {period}"
                ))
            });
            for (short, long) in short.into_iter().zip(long) {
                assert!((short - long).abs() < 1e-12 * long, "{short} {long}");
            }
        }
    }

    #[test]
    fn no_direction_is_without_noise_at_rest_but_the_papers() {
        for (word, preset) in &PRESETS[..4] {
            let noise = preset.motion().noise();
            let at_rest = [noise.forward, noise.sideways, noise.turning];
            assert!(
                at_rest.iter().all(|it| it.at(0.0, 0.0, 0.0) > 0.0),
                "{word}: {noise:?}"
            );
        }
    }
}
