//! `[bounds]` and `[integrity]` of `robot.toml`.

use coloc_bounds::Arena;
use coloc_bounds::evidence::Wheels;
use coloc_bounds::mean::Promise;
use coloc_bounds::monitor::Settings;
use coloc_daemon::config::{Action, Section};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What `coloc-bounds` may rely on. These bounds are hard: outside of them its word is worth nothing. The whole team must have the same slots,
/// and the same largest speeds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Bounds {
    /// Length of a slot: all robots of a team cut the common clock alike \[s\].
    #[schemars(range(min = 0.1, max = 10))]
    pub slot_s: f64,
    /// So long after its end a slot is closed. Half of it is for the robot's own sensors, half for the others' evidence \[s\].
    #[schemars(range(min = 0.02, max = 5))]
    pub grace_s: f64,
    /// Sightings and fixes are off by no more than so many of their stated standard deviations, unless it is given below.
    #[schemars(range(min = 0.1, max = 100))]
    pub sigmas: f64,
    /// A sighting is off by no more along each axis; 0: from `sigmas` \[m\].
    #[schemars(range(min = 0, max = 1000))]
    pub sighting_m: f64,
    /// A sighted robot's heading is off by no more; 0: from `sigmas` \[rad\].
    #[schemars(range(min = 0, max = 3.15))]
    pub sighting_rad: f64,
    /// A fix is off by no more along each axis; 0: from `sigmas`, its slow error included \[m\].
    #[schemars(range(min = 0, max = 1000))]
    pub fix_m: f64,
    /// The wheels' speed is off by no more, forward, in the mean from any measurement to the end of its slot \[m/s\].
    #[schemars(range(min = 0.0001, max = 100))]
    pub speed_mps: f64,
    /// The same to the side. Wheels slip: never 0 \[m/s\].
    #[schemars(range(min = 0.0001, max = 100))]
    pub sideways_mps: f64,
    /// The same of the rate of turning \[rad/s\].
    #[schemars(range(min = 0.0001, max = 100))]
    pub turn_radps: f64,
    /// The compass is off by no more; 0: there is none that can be relied on \[rad\].
    #[schemars(range(min = 0, max = 1.5))]
    pub compass_rad: f64,
    /// No robot of the team is ever faster, in any direction \[m/s\].
    #[schemars(range(min = 0.01, max = 100))]
    pub max_speed_mps: f64,
    /// No robot of the team ever turns faster \[rad/s\].
    #[schemars(range(min = 0.01, max = 100))]
    pub max_turn_radps: f64,
    /// Where one robot can be, seen from another, is kept for so long after one has seen the other \[s\].
    #[schemars(range(min = 0, max = 3600))]
    pub pair_s: f64,
    /// Over so many slots the errors of each sensor have a mean that is bounded by `mean_share`.
    #[schemars(range(min = 2, max = 100))]
    pub mean_slots: usize,
    /// In the mean of `mean_slots` slots each sensor is off by no more than this share of its bound: errors change sign. 1: nothing is
    /// promised, and a fix that goes away slowly is found late.
    #[schemars(range(max = 1), extend("exclusiveMinimum" = 0))]
    pub mean_share: f64,
    /// The same of sightings, if it is another one; 0: `mean_share`. Honest robots that see one another break it first.
    #[schemars(range(min = 0, max = 1))]
    pub mean_share_sightings: f64,
    /// While it begins, or begins anew after something did not fit, a fix is taken to be off by so much at least \[m\].
    #[schemars(range(min = 0, max = 1000))]
    pub initial_m: f64,
    /// The same of a compass, if there is one that can be relied on \[rad\].
    #[schemars(range(min = 0, max = 1.5))]
    pub initial_rad: f64,
    /// All robots are within so far of the origin, along each axis \[m\].
    #[schemars(range(min = 1, max = 10000))]
    pub arena_m: f64,
}

impl Default for Bounds {
    fn default() -> Self {
        Self {
            slot_s: 0.5,
            grace_s: 0.1,
            sigmas: 5.0,
            sighting_m: 0.0,
            sighting_rad: 0.0,
            fix_m: 0.0,
            speed_mps: 0.07,
            sideways_mps: 0.03,
            turn_radps: 0.7,
            compass_rad: 0.0,
            max_speed_mps: 2.0,
            max_turn_radps: 3.0,
            pair_s: 5.0,
            mean_slots: 8,
            mean_share: 1.0,
            mean_share_sightings: 0.0,
            initial_m: 0.5,
            initial_rad: 0.2,
            arena_m: 1e4,
        }
    }
}

/// When `coloc-bounds` says that an estimate cannot be right.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Integrity {
    /// What `colocd` does with its word: `report`, nothing; `health`, it says it on, in every estimate and in its log. A belief is never
    /// changed by it.
    pub action: Action,
    /// So many slots outside in a row are an alarm.
    #[schemars(range(min = 1, max = 1000))]
    pub alarm_slots: u32,
    /// And so many inside in a row end it.
    #[schemars(range(min = 1, max = 1000))]
    pub clear_slots: u32,
}

impl Default for Integrity {
    fn default() -> Self {
        Self {
            action: Action::Report,
            alarm_slots: 2,
            clear_slots: 5,
        }
    }
}

impl Bounds {
    /// Of the wheels.
    #[must_use]
    pub fn wheels(&self) -> Wheels {
        Wheels {
            speed_mps: self.speed_mps,
            sideways_mps: self.sideways_mps,
            turn_radps: self.turn_radps,
            max_speed_mps: self.max_speed_mps,
            max_turn_radps: self.max_turn_radps,
        }
    }

    /// Of the monitor of the robot with the index `own` in its team.
    #[must_use]
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // An hour over a tenth of a second at most.
    pub fn settings(&self, own: usize) -> Settings {
        Settings {
            own,
            slot_s: self.slot_s,
            wheels: self.wheels(),
            pair_slots: (self.pair_s / self.slot_s).ceil() as u64,
            arena: Arena {
                centre: [0.0; 2],
                half: self.arena_m,
            },
            means: Promise {
                slots: self.mean_slots,
                fixes: self.mean_share,
                sightings: self.means_of_sightings(),
            },
            initial: [self.initial_m, self.initial_rad],
        }
    }

    /// Of the bounds of a single slot.
    #[must_use]
    pub fn means_of_sightings(&self) -> f64 {
        if self.mean_share_sightings > 0.0 {
            self.mean_share_sightings
        } else {
            self.mean_share
        }
    }

    /// How far off a measurement of that deviation can be.
    #[must_use]
    pub fn half(&self, given: f64, sigma: f64) -> f64 {
        if given > 0.0 {
            given
        } else {
            self.sigmas * sigma
        }
    }
}

impl Section for Bounds {
    const NAME: &'static str = "bounds";

    fn refusals(&self) -> Vec<(String, String)> {
        let is_long = self.grace_s >= self.slot_s;
        let long = is_long.then(|| {
            let Self {
                grace_s, slot_s, ..
            } = self;
            let problem = format!(" = {grace_s}: is not shorter than bounds.slot_s = {slot_s}");
            ("grace_s".to_owned(), problem)
        });
        long.into_iter().collect()
    }
}

impl Section for Integrity {
    const NAME: &'static str = "integrity";

    fn refusals(&self) -> Vec<(String, String)> {
        Vec::new()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn parse(section: &str) -> Result<Bounds, String> {
        let text = format!("[robot]\nname = \"a\"\nid = 1\n[bounds]\n{section}");
        let parsed =
            coloc_daemon::config::Config::parse_with::<Bounds>(&text, Path::new("robot.toml"));
        parsed
            .map(|(_, bounds)| bounds)
            .map_err(|error| error.to_string())
    }

    #[test]
    fn an_empty_section_is_enough() {
        assert_eq!(parse("").unwrap(), Bounds::default());
        assert_eq!(Bounds::default().settings(0).pair_slots, 10);
        let means = parse("mean_share = 0.2").unwrap().settings(0).means;
        assert!((means.sightings - 0.2).abs() < 1e-12);
        let means = parse("mean_share = 0.2\nmean_share_sightings = 0.4");
        let means = means.unwrap().settings(0).means;
        assert!((means.fixes - 0.2).abs() < 1e-12 && (means.sightings - 0.4).abs() < 1e-12);
    }

    #[test]
    fn bounds_that_are_none_are_refused() {
        for line in [
            "sideways_mps = 0.0",
            "max_speed_mps = 1e-300",
            "arena_m = 1e-300",
            "speed_mps = -1.0",
            "sigmas = 0.0",
            "arena_m = 1e9",
            "turn_radps = nan",
            "mean_share = 0.0",
            "mean_share = 1.1",
            "mean_share_sightings = 1.1",
            "mean_slots = 1",
            "initial_m = -0.1",
            "slot_s = 0.1\ngrace_s = 0.1",
        ] {
            assert!(parse(line).is_err(), "{line}");
        }
    }
}
