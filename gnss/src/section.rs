//! `[gnss]` of `robot.toml`.

use std::path::PathBuf;

use coloc_daemon::config::Section;
use coloc_sensors::InputSpec;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

/// The receiver whose fixes `coloc-gnss` publishes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Gnss {
    /// Where its bytes come from: `serial:/dev/NAME?baud=9600`, `tcp:HOST:PORT`, `gpsd:HOST:2947`, `file:PATH` (plain or gzip;
    /// `?speed=full` as fast as it can be read) or `stdin`.
    #[schemars(
        example = &"serial:/dev/ttyACM0?baud=115200",
        length(min = 1, max = 1000)
    )]
    pub input: String,
    /// Its number, where the robot has several: `source` in the header of its messages.
    #[serde(default)]
    #[schemars(range(min = 0, max = 65535))]
    pub source: u16,
    /// Two letters, such as `GN`: of several talkers on one line only this one counts. Empty: all of them.
    #[serde(default)]
    #[schemars(length(max = 2))]
    pub talker: String,
    /// What a fix is stamped with.
    #[serde(default)]
    pub stamp: Stamp,
    /// So much earlier than its stamp says was a fix measured \[s\].
    #[serde(default)]
    #[schemars(range(min = 0, max = 10))]
    pub latency_s: f64,
    /// A fix whose time is further than that from the computer's clock is refused as `clock`, where it is stamped with its own \[s\].
    #[serde(default = "two")]
    #[schemars(range(min = 0.001, max = 3600))]
    pub clock_off_s: f64,
    /// A device or server that is silent for so long is opened again \[s\].
    #[serde(default = "ten")]
    #[schemars(range(min = 1, max = 3600))]
    pub silence_s: f64,
    /// Where the common frame is.
    #[serde(default)]
    pub datum: DatumSection,
    /// What a fix must have to be published.
    #[serde(default)]
    pub gate: Limits,
    /// What it must have until a minute was good: at the start, after a gap, after a jump.
    #[serde(default = "Limits::at_start", deserialize_with = "written_at_start")]
    pub start_gate: Limits,
    /// How far a fix may be from where the one before and its velocity lead.
    #[serde(default)]
    pub jump: Jump,
    /// The least error that a fix of quality 1 is believed to have, whatever the receiver says.
    #[serde(default = "Floor::autonomous")]
    pub autonomous: Floor,
    /// The same of quality 2, with differential corrections.
    #[serde(default = "Floor::differential")]
    pub differential: Floor,
    /// The same of quality 3, the precise service.
    #[serde(default = "Floor::precise")]
    pub precise: Floor,
    /// The same of quality 4, RTK with whole wavelengths.
    #[serde(default = "Floor::rtk_fixed")]
    pub rtk_fixed: Floor,
    /// The same of quality 5, RTK without.
    #[serde(default = "Floor::rtk_float")]
    pub rtk_float: Floor,
    /// Two antennas, or a compass that speaks NMEA.
    #[serde(default)]
    pub heading: HeadingSection,
    /// The course over ground, as a heading.
    #[serde(default)]
    pub course: CourseSection,
}

/// What a fix is stamped with.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Stamp {
    /// Its own time, in UTC: the computer's clock must be right, to the milliseconds that count for the robot.
    #[default]
    Fix,
    /// When the first byte of it came, by a clock that nobody sets; `latency_s` is then how long the receiver computes and sends.
    Arrival,
}

/// `[gnss.datum]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DatumSection {
    /// Of the origin, north of the equator. All robots of a team have the same. Without latitude and longitude it is the mean of the
    /// first good fixes, which is saved \[°\].
    #[schemars(range(min = -89.9, max = 89.9))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub latitude_deg: Option<f64>,
    /// Of the origin, east of Greenwich \[°\].
    #[schemars(range(min = -180, max = 180))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub longitude_deg: Option<f64>,
    /// Of the origin, above the ellipsoid \[m\].
    #[schemars(range(min = -1000, max = 10000))]
    pub height_m: f64,
    /// From east to the x axis of the common frame, to the left \[rad\].
    #[schemars(range(min = -7, max = 7))]
    pub turned_rad: f64,
    /// Of so many good fixes is the mean taken.
    #[schemars(range(min = 1, max = 100_000))]
    pub fixes: u32,
    /// Where the mean is saved, and read at the next start. Empty: `NAME.datum.toml` where the daemon saves its state.
    #[schemars(length(max = 1000))]
    pub file: PathBuf,
}

/// What a fix must have. What a receiver does not say is not asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Limits {
    /// So many satellites, or more.
    #[schemars(range(min = 0, max = 100))]
    pub satellites: u32,
    /// So small a horizontal dilution of precision, or smaller.
    #[schemars(range(min = 0.1, max = 100))]
    pub hdop: f64,
    /// So small a stated standard deviation, or smaller \[m\].
    #[schemars(range(min = 0.0001, max = 1000))]
    pub sigma_m: f64,
    /// The qualities that count, in the numbers of GGA: 1 autonomous, 2 differential, 3 precise, 4 RTK fixed, 5 RTK float.
    #[schemars(inner(range(min = 1, max = 5)))]
    pub qualities: Vec<u8>,
}

/// `[gnss.jump]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Jump {
    /// So fast is the robot at most, where the receiver says no velocity \[m/s\].
    #[schemars(range(min = 0.01, max = 1000))]
    pub most_speed_m_s: f64,
    /// So fast does its velocity change at most \[m/s²\].
    #[schemars(range(min = 0.01, max = 1000))]
    pub most_acceleration_m_s2: f64,
    /// Once all fixes agree for so long on another place than the one before, it is believed \[s\].
    #[schemars(range(min = 0, max = 3600))]
    pub believed_after_s: f64,
}

/// The least error that is believed.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Floor {
    /// Standard deviation in each coordinate of what is another error in every fix \[m\].
    #[schemars(range(min = 0.0001, max = 1000))]
    pub sigma_m: f64,
    /// Standard deviation of what the next fix has again. What a receiver states beyond both is added here \[m\].
    #[schemars(range(min = 0, max = 1000))]
    pub slow_sigma_m: f64,
    /// How long that lasts \[s\].
    #[schemars(range(min = 0.001, max = 86400))]
    pub slow_time_s: f64,
}

/// `[gnss.heading]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct HeadingSection {
    /// What HDT and RELPOSNED say.
    pub from: HeadingFrom,
    /// Standard deviation of what is another error in every word, at least \[rad\].
    #[schemars(range(min = 0.00001, max = 4))]
    pub sigma_rad: f64,
    /// Standard deviation of what the next word has again \[rad\].
    #[schemars(range(min = 0, max = 4))]
    pub slow_sigma_rad: f64,
    /// How long that lasts \[s\].
    #[schemars(range(min = 0.001, max = 86400))]
    pub slow_time_s: f64,
}

/// Where a heading comes from.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum HeadingFrom {
    /// Two antennas.
    #[default]
    Antennas,
    /// A compass or a gyroscope that finds north.
    Compass,
    /// It is not used.
    Nothing,
}

/// `[gnss.course]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CourseSection {
    /// Whether it is published. Fixes teach the heading of a robot that drives without it.
    pub publish: bool,
    /// Only while the receiver says that it moves at least so fast \[m/s\].
    #[schemars(range(min = 0.01, max = 1000))]
    pub least_speed_m_s: f64,
    /// Standard deviation of the velocity across: over the speed it is that of the course \[m/s\].
    #[schemars(range(min = 0.0001, max = 100))]
    pub sigma_m_s: f64,
    /// Standard deviation of what the next course has again \[rad\].
    #[schemars(range(min = 0, max = 4))]
    pub slow_sigma_rad: f64,
    /// How long that lasts \[s\].
    #[schemars(range(min = 0.001, max = 86400))]
    pub slow_time_s: f64,
}

fn two() -> f64 {
    2.0
}

fn ten() -> f64 {
    10.0
}

impl Default for DatumSection {
    fn default() -> Self {
        Self {
            latitude_deg: None,
            longitude_deg: None,
            height_m: 0.0,
            turned_rad: 0.0,
            fixes: 60,
            file: PathBuf::new(),
        }
    }
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            satellites: 5,
            hdop: 5.0,
            sigma_m: 15.0,
            qualities: vec![1, 2, 3, 4, 5],
        }
    }
}

impl Limits {
    fn at_start() -> Self {
        Self {
            satellites: 6,
            hdop: 2.5,
            sigma_m: 6.0,
            ..Self::default()
        }
    }
}

/// What is not written of `start_gate` is as by default there, not as in `gate`.
fn written_at_start<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Limits, D::Error> {
    #[derive(Deserialize)]
    struct Written {
        satellites: Option<u32>,
        hdop: Option<f64>,
        sigma_m: Option<f64>,
        qualities: Option<Vec<u8>>,
    }
    let (written, default) = (Written::deserialize(deserializer)?, Limits::at_start());
    Ok(Limits {
        satellites: written.satellites.unwrap_or(default.satellites),
        hdop: written.hdop.unwrap_or(default.hdop),
        sigma_m: written.sigma_m.unwrap_or(default.sigma_m),
        qualities: written.qualities.unwrap_or(default.qualities),
    })
}

impl Default for Jump {
    fn default() -> Self {
        Self {
            most_speed_m_s: 15.0,
            most_acceleration_m_s2: 4.0,
            believed_after_s: 10.0,
        }
    }
}

impl Floor {
    const fn new(sigma_m: f64, slow_sigma_m: f64, slow_time_s: f64) -> Self {
        Self {
            sigma_m,
            slow_sigma_m,
            slow_time_s,
        }
    }

    const fn autonomous() -> Self {
        Self::new(0.5, 3.0, 300.0)
    }

    const fn differential() -> Self {
        Self::new(0.3, 1.0, 120.0)
    }

    const fn precise() -> Self {
        Self::new(0.3, 1.0, 300.0)
    }

    const fn rtk_fixed() -> Self {
        Self::new(0.02, 0.01, 60.0)
    }

    const fn rtk_float() -> Self {
        Self::new(0.1, 0.4, 120.0)
    }
}

impl Default for HeadingSection {
    fn default() -> Self {
        Self {
            from: HeadingFrom::default(),
            sigma_rad: 0.01,
            slow_sigma_rad: 0.01,
            slow_time_s: 60.0,
        }
    }
}

impl Default for CourseSection {
    fn default() -> Self {
        Self {
            publish: false,
            least_speed_m_s: 1.0,
            sigma_m_s: 0.1,
            slow_sigma_rad: 0.03,
            slow_time_s: 2.0,
        }
    }
}

impl Gnss {
    /// Everything as it is by default.
    #[must_use]
    pub fn of(input: &str) -> Self {
        Self {
            input: input.into(),
            source: 0,
            talker: String::new(),
            stamp: Stamp::default(),
            latency_s: 0.0,
            clock_off_s: two(),
            silence_s: ten(),
            datum: DatumSection::default(),
            gate: Limits::default(),
            start_gate: Limits::at_start(),
            jump: Jump::default(),
            autonomous: Floor::autonomous(),
            differential: Floor::differential(),
            precise: Floor::precise(),
            rtk_fixed: Floor::rtk_fixed(),
            rtk_float: Floor::rtk_float(),
            heading: HeadingSection::default(),
            course: CourseSection::default(),
        }
    }

    /// Where bytes come from.
    ///
    /// # Errors
    /// What is wrong with it, in words; not of a section that was checked.
    pub fn spec(&self) -> Result<InputSpec, String> {
        self.input.parse()
    }

    /// The least error of a fix of this quality, where it counts at all.
    #[must_use]
    pub fn floor(&self, quality: u8) -> Option<Floor> {
        Some(match quality {
            1 => self.autonomous,
            2 => self.differential,
            3 => self.precise,
            4 => self.rtk_fixed,
            5 => self.rtk_float,
            _ => return None,
        })
    }

    /// The talker that counts alone.
    #[must_use]
    pub fn talker(&self) -> Option<[u8; 2]> {
        self.talker.as_bytes().try_into().ok()
    }
}

impl Section for Gnss {
    const NAME: &'static str = "gnss";

    fn refusals(&self) -> Vec<(String, String)> {
        let input =
            (self.spec().err()).map(|problem| ("input", format!(" = {:?}: {problem}", self.input)));
        let datum = &self.datum;
        let half = datum.latitude_deg.is_some() != datum.longitude_deg.is_some();
        let half = half.then(|| {
            (
                "datum",
                ": latitude_deg and longitude_deg are written both or not at all".into(),
            )
        });
        let one = self.talker.len() == 1 || !self.talker.is_ascii();
        let one = one.then(|| {
            (
                "talker",
                format!(" = {:?}: must be two letters, as \"GN\"", self.talker),
            )
        });
        let gates = [("gate", &self.gate), ("start_gate", &self.start_gate)];
        let empty = gates.map(|(name, limits)| {
            let never = limits.qualities.is_empty();
            never.then(|| (name, ".qualities = []: no fix would ever pass".into()))
        });
        let refused = [input, half, one].into_iter().chain(empty).flatten();
        refused
            .map(|(key, problem)| (key.into(), problem))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use coloc_daemon::config::Config;

    use super::*;

    fn parse(section: &str) -> Result<Gnss, String> {
        let text = format!("[robot]\nname = \"a\"\nid = 1\n[gnss]\ninput = \"stdin\"\n{section}");
        let parsed = Config::parse_with::<Gnss>(&text, Path::new("robot.toml"));
        parsed
            .map(|(_, gnss)| gnss)
            .map_err(|error| error.to_string())
    }

    #[test]
    fn what_is_not_written_is_as_by_default() {
        assert_eq!(parse(""), Ok(Gnss::of("stdin")));
        let gnss = parse("[gnss.start_gate]\nsatellites = 9\n[gnss.gate]\nhdop = 9.0\n").unwrap();
        let [start, normal] = [Limits::at_start(), Limits::default()];
        assert_eq!(
            gnss.start_gate,
            Limits {
                satellites: 9,
                ..start
            }
        );
        assert_eq!(
            gnss.gate,
            Limits {
                hdop: 9.0,
                ..normal
            }
        );
    }

    #[test]
    fn what_does_not_fit_together_is_refused() {
        for (section, said) in [
            (
                "talker = \"G\"\n",
                "robot.toml:6: gnss.talker = \"G\": must be two letters",
            ),
            (
                "[gnss.datum]\nlatitude_deg = 1.0\n",
                "robot.toml:6: gnss.datum: latitude_deg and longitude_deg",
            ),
            (
                "[gnss.start_gate]\nsatelites = 1\n",
                "robot.toml:7: [gnss.start_gate] has no satelites; did you mean satellites?",
            ),
        ] {
            let refusal = parse(section).unwrap_err();
            assert!(refusal.contains(said), "{refusal}");
        }
    }
}
