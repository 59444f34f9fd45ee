//! `[laser]` of `robot.toml`.

use coloc_daemon::config::Section;
use coloc_scan::finder::Noise;
use coloc_scan::shape::Pattern;
use coloc_scan::{Look, Settings};
use coloc_sensors::InputSpec;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The laser scanner in whose scans `coloc-laser` finds other robots. Where it sits is `mount` in `[relative_pose]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Laser {
    /// `scan`: the channel of that name. Or where CARMEN text comes from: `file:PATH` (plain or gzip; `?speed=full` as fast as it can be
    /// read), `stdin`, `tcp:HOST:PORT` or `serial:/dev/NAME?baud=115200`.
    #[serde(default = "the_channel")]
    #[schemars(length(min = 1, max = 1000))]
    pub input: String,
    /// Its number, where the robot has several: `source` in the header of scans and sightings.
    #[serde(default)]
    #[schemars(range(min = 0, max = 65535))]
    pub source: u16,
    /// What other robots look like at the height of the scanner, an entry each.
    #[schemars(example = [LookSection::example()])]
    pub look: Vec<LookSection>,
    /// Standard deviation of a range \[m\].
    #[serde(default = "range_sigma")]
    #[schemars(range(min = 0.0001, max = 1))]
    pub range_sigma_m: f64,
    /// Standard deviation of a beam's angle \[rad\].
    #[serde(default = "angle_sigma")]
    #[schemars(range(min = 0.00001, max = 0.1))]
    pub angle_sigma_rad: f64,
    /// By so much does a robot differ from what is written of it \[m\].
    #[serde(default = "shape_sigma")]
    #[schemars(range(min = 0.0001, max = 0.5))]
    pub shape_sigma_m: f64,
    /// Beyond that no robot is looked for \[m\].
    #[serde(default = "farthest")]
    #[schemars(range(min = 0.5, max = 100))]
    pub farthest_m: f64,
    /// So many beams at least must meet a robot.
    #[serde(default = "least_beams")]
    #[schemars(range(min = 4, max = 1000))]
    pub least_beams: u16,
    /// A beam at least so bright has met a reflective mark, in the scanner's own measure.
    #[serde(default = "bright")]
    #[schemars(range(min = 0))]
    pub bright: f32,
    /// How often something that is none of the team looks like one: people, furniture, other robots \[1/m²\].
    #[serde(default = "clutter")]
    #[schemars(range(min = 0.00001, max = 10))]
    pub clutter_per_m2: f64,
    /// So fast may another robot have changed its way since it last said where it is \[m/s\].
    #[serde(default = "one")]
    #[schemars(range(min = 0, max = 100))]
    pub change_m_s: f64,
    /// The slow errors of what is published without a heading.
    #[serde(default)]
    pub slow: Slow,
}

/// `laser.slow`: errors that the next scan has again. What is published without a heading carries them; the white ones are found with each
/// robot.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Slow {
    /// Standard deviation of a range's scale: the scanner's own, and a radius that is written a little wrong.
    #[schemars(range(min = 0, max = 1))]
    pub scale_sigma: f64,
    /// How long that lasts \[s\].
    #[schemars(range(min = 0.001, max = 86400))]
    pub scale_time_s: f64,
    /// Standard deviation of how the scanner is turned on the robot, beyond `mount` \[rad\].
    #[schemars(range(min = 0, max = 1))]
    pub bearing_sigma_rad: f64,
    /// How long that lasts \[s\].
    #[schemars(range(min = 0.001, max = 86400))]
    pub bearing_time_s: f64,
}

impl Default for Slow {
    /// 5 mm at 2 m, and a third of a degree.
    fn default() -> Self {
        Self {
            scale_sigma: 0.0025,
            scale_time_s: 60.0,
            bearing_sigma_rad: 0.005,
            bearing_time_s: 60.0,
        }
    }
}

/// `[[laser.look]]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LookSection {
    /// Team numbers of the robots that look so. Empty: all that have no entry of their own.
    #[serde(default)]
    pub robots: Vec<u16>,
    /// What they look like.
    pub shape: Shape,
    /// Of a cylinder around the robot's origin \[m\].
    #[serde(default)]
    #[schemars(range(min = 0, max = 5))]
    pub radius_m: f64,
    /// Of a rectangle, from its rear to its front \[m\].
    #[serde(default)]
    #[schemars(range(min = 0, max = 10))]
    pub length_m: f64,
    /// Of a rectangle, from its left to its right \[m\].
    #[serde(default)]
    #[schemars(range(min = 0, max = 10))]
    pub width_m: f64,
    /// Of a rectangle: where its middle is in the robot's body frame, forward and left \[m\].
    #[serde(default)]
    #[schemars(inner(range(min = -5, max = 5)))]
    pub centre_m: [f64; 2],
    /// Of reflective marks: where each is in the robot's body frame, forward and left \[m\].
    #[serde(default)]
    pub marks: Vec<[f64; 2]>,
    /// Radius of the poles that carry the marks; 0 for flat ones \[m\].
    #[serde(default)]
    #[schemars(range(min = 0, max = 1))]
    pub mark_radius_m: f64,
}

/// What a robot looks like.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Shape {
    /// It has no heading.
    Cylinder,
    /// Its faces say its heading.
    Rectangle,
    /// Three to eight of them, no two pairs as far apart.
    Marks,
}

fn the_channel() -> String {
    CHANNEL.into()
}

fn range_sigma() -> f64 {
    Noise::default().range_sigma_m
}

fn angle_sigma() -> f64 {
    Noise::default().angle_sigma_rad
}

fn shape_sigma() -> f64 {
    Noise::default().shape_sigma_m
}

fn farthest() -> f64 {
    Settings::of(Vec::new()).farthest_m
}

fn least_beams() -> u16 {
    5
}

fn bright() -> f32 {
    1e6
}

fn clutter() -> f64 {
    Settings::of(Vec::new()).clutter_per_m2
}

fn one() -> f64 {
    1.0
}

/// Nothing smaller is told from noise \[m\].
const LEAST_M: f64 = 0.02;

/// The input that is a channel.
pub const CHANNEL: &str = "scan";

impl Default for LookSection {
    /// A cylinder without a size, which is refused: a beginning.
    fn default() -> Self {
        Self {
            robots: Vec::new(),
            shape: Shape::Cylinder,
            radius_m: 0.0,
            length_m: 0.0,
            width_m: 0.0,
            centre_m: [0.0; 2],
            marks: Vec::new(),
            mark_radius_m: 0.0,
        }
    }
}

impl LookSection {
    fn example() -> impl Serialize {
        serde_json::json!({ "shape": "rectangle", "length_m": 0.7, "width_m": 0.5 })
    }

    /// As it is looked for.
    ///
    /// # Errors
    /// What is wrong with it, in words.
    pub fn look(&self) -> Result<Look, String> {
        match self.shape {
            Shape::Cylinder if self.radius_m >= LEAST_M => Ok(Look::Cylinder {
                radius_m: self.radius_m,
            }),
            Shape::Cylinder => Err(format!("a cylinder needs radius_m, {LEAST_M} m or more")),
            Shape::Rectangle if self.length_m.min(self.width_m) >= LEAST_M => Ok(Look::Rectangle {
                length_m: self.length_m,
                width_m: self.width_m,
                centre_m: self.centre_m,
            }),
            Shape::Rectangle => Err(format!(
                "a rectangle needs length_m and width_m, {LEAST_M} m or more each"
            )),
            Shape::Marks => Pattern::new(&self.marks, self.mark_radius_m)
                .map(Look::Marks)
                .map_err(Into::into),
        }
    }
}

impl Laser {
    /// Everything as it is by default.
    #[must_use]
    pub fn of(look: Vec<LookSection>) -> Self {
        Self {
            input: the_channel(),
            source: 0,
            look,
            range_sigma_m: range_sigma(),
            angle_sigma_rad: angle_sigma(),
            shape_sigma_m: shape_sigma(),
            farthest_m: farthest(),
            least_beams: least_beams(),
            bright: bright(),
            clutter_per_m2: clutter(),
            change_m_s: one(),
            slow: Slow::default(),
        }
    }

    /// Where CARMEN text comes from; none where scans come from the channel.
    ///
    /// # Errors
    /// What is wrong with it, in words; not of a section that was checked.
    pub fn spec(&self) -> Result<Option<InputSpec>, String> {
        if self.input == CHANNEL {
            return Ok(None);
        }
        match self.input.parse() {
            Ok(InputSpec::Gpsd { .. }) => {
                Err("gpsd has no scans; write scan, file:PATH or tcp:HOST:PORT".into())
            }
            Ok(spec) => Ok(Some(spec)),
            Err(problem) => Err(format!("{problem}, or scan for the channel")),
        }
    }

    /// What is asked of a sighting.
    #[must_use]
    pub fn settings(&self) -> Settings {
        let looks = self.look.iter().filter_map(|it| it.look().ok());
        Settings {
            noise: Noise {
                range_sigma_m: self.range_sigma_m,
                angle_sigma_rad: self.angle_sigma_rad,
                shape_sigma_m: self.shape_sigma_m,
            },
            farthest_m: self.farthest_m,
            least_beams: self.least_beams.into(),
            bright: self.bright,
            clutter_per_m2: self.clutter_per_m2,
            ..Settings::of(looks.collect())
        }
    }

    /// Of two entries for the same robots the second would count for nothing.
    fn looks_that_nobody_has(&self) -> Vec<String> {
        let for_all = self.look.iter().filter(|it| it.robots.is_empty());
        let mut named: Vec<u16> = self.look.iter().flat_map(|it| it.robots.clone()).collect();
        named.sort_unstable();
        let twice = named.windows(2).find(|pair| pair[0] == pair[1]);
        let twice = twice.map(|pair| format!("robot {} is named in two entries", pair[0]));
        let all = (for_all.count() > 1)
            .then(|| "two entries name no robots: only one can be of all others".to_owned());
        twice.into_iter().chain(all).collect()
    }

    /// Place of the look of a robot, if it has one.
    #[must_use]
    pub fn look_of(&self, robot: u16) -> Option<usize> {
        let own = self.look.iter().position(|it| it.robots.contains(&robot));
        own.or_else(|| self.look.iter().position(|it| it.robots.is_empty()))
    }
}

impl Section for Laser {
    const NAME: &'static str = "laser";

    fn refusals(&self) -> Vec<(String, String)> {
        let input = self.spec().err();
        let input = input.map(|problem| {
            (
                "input".to_owned(),
                format!(" = {:?}: {problem}", self.input),
            )
        });
        let none = self.look.is_empty();
        let none = none.then(|| {
            (
                "look".to_owned(),
                ": say what other robots look like".to_owned(),
            )
        });
        let looks = self.look.iter().filter_map(|it| it.look().err());
        let looks = looks.chain(self.looks_that_nobody_has());
        let looks = looks.map(|problem| ("look".to_owned(), format!(": {problem}")));
        input.into_iter().chain(none).chain(looks).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use coloc_daemon::config::Config;

    use super::*;

    fn parse(section: &str) -> Result<Laser, String> {
        let text = format!("[robot]\nname = \"a\"\nid = 1\n[laser]\n{section}");
        let parsed = Config::parse_with::<Laser>(&text, Path::new("robot.toml"));
        parsed
            .map(|(_, laser)| laser)
            .map_err(|error| error.to_string())
    }

    #[test]
    fn looks_are_of_who_is_named_and_else_of_all() {
        let laser = parse(
            "[[laser.look]]\nshape = \"cylinder\"\nradius_m = 0.2\n[[laser.look]]\nrobots = [3]\nshape = \"rectangle\"\nlength_m = 0.7\n\
             width_m = 0.5\n",
        )
        .unwrap();
        assert_eq!([2, 3].map(|robot| laser.look_of(robot)), [Some(0), Some(1)]);
        assert_eq!(laser.settings().looks.len(), 2);
        assert_eq!(laser.spec(), Ok(None));
    }

    #[test]
    fn what_does_not_fit_together_is_refused() {
        for (section, said) in [
            ("look = []\n", "laser.look: say what other robots look like"),
            (
                "[[laser.look]]\nshape = \"cylinder\"\n",
                "a cylinder needs radius_m",
            ),
            (
                "[[laser.look]]\nshape = \"cylinder\"\nradius_m = 1e-300\n",
                "a cylinder needs radius_m, 0.02 m or more",
            ),
            (
                "[[laser.look]]\nshape = \"cylinder\"\nradius_m = 1e300\n",
                "radius_m",
            ),
            (
                "[[laser.look]]\nshape = \"marks\"\nmarks = [[0.1, 0.0], [0.1, 0.0], [0.1, 0.0]]\n",
                "seen as one",
            ),
            (
                "[[laser.look]]\nrobots = [2, 3]\nshape = \"cylinder\"\nradius_m = 0.2\n[[laser.look]]\nrobots = [3]\n\
                 shape = \"cylinder\"\nradius_m = 0.3\n",
                "robot 3 is named in two entries",
            ),
            (
                "[[laser.look]]\nshape = \"cylinder\"\nradius_m = 0.2\n[[laser.look]]\nshape = \"cylinder\"\nradius_m = 0.3\n",
                "two entries name no robots",
            ),
            (
                "farthest_m = 1e-300\n[[laser.look]]\nshape = \"cylinder\"\nradius_m = 0.2\n",
                "farthest_m",
            ),
            (
                "bright = nan\n[[laser.look]]\nshape = \"cylinder\"\nradius_m = 0.2\n",
                "bright",
            ),
            (
                "[[laser.look]]\nshape = \"rectangle\"\nlength_m = 1\n",
                "a rectangle needs length_m and width_m",
            ),
            (
                "[[laser.look]]\nshape = \"marks\"\nmarks = [[0.0, 0.1]]\n",
                "a pattern has 3 to 8 marks",
            ),
            (
                "input = \"gpsd\"\n[[laser.look]]\nshape = \"cylinder\"\nradius_m = 0.2\n",
                "gpsd has no scans",
            ),
            (
                "input = \"usb\"\n[[laser.look]]\nshape = \"cylinder\"\nradius_m = 0.2\n",
                "or scan for the channel",
            ),
        ] {
            let refusal = parse(section).unwrap_err();
            assert!(refusal.contains(said), "{refusal}");
        }
    }
}
