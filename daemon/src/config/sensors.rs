//! The sections of `robot.toml` that say where a sensor sits and how it errs; written as those in [`super::sections`].

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[[position.receiver]]`: a receiver that is not as `[position]` says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Receiver {
    /// Which one: `source` in the header of its messages.
    pub source: u16,
    /// In place of `position.lever_m` \[m\].
    #[serde(default)]
    #[schemars(inner(range(min = -1000, max = 1000)))]
    pub lever_m: [f64; 2],
    /// In place of `position.slow_sigma_m` \[m\].
    #[serde(default)]
    #[schemars(range(min = 0, max = 1e3))]
    pub slow_sigma_m: f64,
    /// In place of `position.slow_time_s` \[s\].
    #[serde(default = "a_minute")]
    #[schemars(range(max = 86400), extend("exclusiveMinimum" = 0))]
    pub slow_time_s: f64,
    /// In place of `position.delay_s` \[s\].
    #[serde(default)]
    #[schemars(range(min = -10, max = 10))]
    pub delay_s: f64,
}

/// `[relative_pose]`
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RelativePose {
    /// Where the laser or camera sits in the robot's body frame: forward, left, and how far it is turned to the left. What it sees is
    /// seen from there; zero where its driver has turned that into the body frame already \[m, m, rad\].
    #[schemars(inner(range(min = -1000, max = 1000)))]
    pub mount: [f64; 3],
    /// Sensors that sit somewhere else, an entry each.
    #[schemars(example = [Sensor::example()])]
    pub sensor: Vec<Sensor>,
}

/// `[[relative_pose.sensor]]`: a laser or camera that does not sit where `[relative_pose]` says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sensor {
    /// Which one: `source` in the header of its messages.
    pub source: u16,
    /// In place of `relative_pose.mount` \[m, m, rad\].
    #[schemars(inner(range(min = -1000, max = 1000)))]
    pub mount: [f64; 3],
}

/// `[sighting]`
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Sighting {
    /// Whether the robot takes part: hears its own sensors on the channel `sighting`, and other robots on `seen` and `answer`. Let all
    /// robots of a team take part that have such a sensor or are seen by one.
    pub heard: bool,
    /// Whether sightings of other robots come by way of `coloc-track`, which has to run: the pose of a track in the place of a sighting
    /// where its heading is known well, once a second at most, and all others as they are. Landmarks are heard as ever.
    pub through_track: bool,
    /// Where the sensor sits in the robot's body frame: forward, left, and how far it is turned to the left; used where a message says
    /// zero \[m, m, rad\].
    #[schemars(inner(range(min = -1000, max = 1000)))]
    pub mount: [f64; 3],
    /// Sensors that sit somewhere else, an entry each.
    #[schemars(example = [Eye::example()])]
    pub sensor: Vec<Eye>,
}

/// `[[sighting.sensor]]`: a sensor that does not sit where `[sighting]` says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Eye {
    /// Which one: `source` in the header of its messages.
    pub source: u16,
    /// In place of `sighting.mount` \[m, m, rad\].
    #[schemars(inner(range(min = -1000, max = 1000)))]
    pub mount: [f64; 3],
}

/// `[[landmark]]`: a place that is known, and what a sensor calls it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Landmark {
    /// Its number: `observed` in a sighting of a landmark.
    pub number: u16,
    /// Where it is in the frame that all robots share \[m, m\].
    #[schemars(inner(range(min = -1e9, max = 1e9)))]
    pub position: [f64; 2],
    /// Standard deviation of that in each coordinate: an error that never changes \[m\].
    #[schemars(range(max = 1e6), extend("exclusiveMinimum" = 0))]
    pub sigma_m: f64,
}

/// `[heading]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Heading {
    /// Added to what a compass or two antennas say: how they are turned on the robot, and the declination where they stand, so that
    /// what comes out is where the robot looks in the common frame. Not added to a course over ground \[rad\].
    #[schemars(range(min = -7, max = 7))]
    pub offset_rad: f64,
    /// Standard deviation of the slow error, where a message does not say its own: iron and currents near a compass. 0: none
    /// \[rad\].
    #[schemars(range(min = 0, max = 4))]
    pub slow_sigma_rad: f64,
    /// How long it lasts, where a message does not say its own \[s\].
    #[schemars(range(max = 86400), extend("exclusiveMinimum" = 0))]
    pub slow_time_s: f64,
    /// A course over ground counts only while the wheels say that its antenna moves at least so fast, and that the robot does not
    /// move sideways; driven backwards it is turned by half a turn \[m/s\].
    #[schemars(range(max = 1000), extend("exclusiveMinimum" = 0))]
    pub least_speed_m_s: f64,
    /// Where the antenna of a course over ground is in the body frame, forward and left: it swings out in a turn \[m, m\].
    #[schemars(inner(range(min = -1000, max = 1000)))]
    pub lever_m: [f64; 2],
    /// Sensors that are not so, an entry each.
    #[schemars(example = [Compass::example()])]
    pub sensor: Vec<Compass>,
}

/// `[[heading.sensor]]`: a sensor of the heading that is not as `[heading]` says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Compass {
    /// Which one: `source` in the header of its messages.
    pub source: u16,
    /// In place of `heading.offset_rad` \[rad\].
    #[serde(default)]
    #[schemars(range(min = -7, max = 7))]
    pub offset_rad: f64,
    /// In place of `heading.slow_sigma_rad` \[rad\].
    #[serde(default)]
    #[schemars(range(min = 0, max = 4))]
    pub slow_sigma_rad: f64,
    /// In place of `heading.slow_time_s` \[s\].
    #[serde(default = "a_minute")]
    #[schemars(range(max = 86400), extend("exclusiveMinimum" = 0))]
    pub slow_time_s: f64,
    /// In place of `heading.lever_m` \[m, m\].
    #[serde(default)]
    #[schemars(inner(range(min = -1000, max = 1000)))]
    pub lever_m: [f64; 2],
}

fn a_minute() -> f64 {
    60.0
}

/// A compass in a robot is seldom better than 3°, and its error lasts for as long as the robot stays near what makes it.
impl Default for Heading {
    fn default() -> Self {
        Self {
            offset_rad: 0.0,
            slow_sigma_rad: 0.05,
            slow_time_s: a_minute(),
            least_speed_m_s: 0.5,
            lever_m: [0.0; 2],
            sensor: Vec::new(),
        }
    }
}

impl Receiver {
    pub(super) fn example() -> impl Serialize {
        serde_json::json!({ "source": 1, "lever_m": [0.3, 0.0], "slow_sigma_m": 1.0, "slow_time_s": 60.0, "delay_s": 0.1 })
    }
}

impl Sensor {
    fn example() -> impl Serialize {
        serde_json::json!({ "source": 1, "mount": [-0.2, 0.0, 1.5] })
    }
}

impl Eye {
    fn example() -> impl Serialize {
        serde_json::json!({ "source": 1, "mount": [-0.2, 0.0, 1.5] })
    }
}

impl Landmark {
    pub(super) fn example() -> impl Serialize {
        serde_json::json!({ "number": 6, "position": [1.5, -2.0], "sigma_m": 0.01 })
    }
}

impl Compass {
    fn example() -> impl Serialize {
        serde_json::json!({
            "source": 1, "offset_rad": 1.5, "slow_sigma_rad": 0.0, "slow_time_s": 60.0, "lever_m": [0.0, 0.0]
        })
    }
}
