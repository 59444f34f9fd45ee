//! `[rounds]`: when the team makes rounds; written as the sections in [`super::sections`].

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Config, Mode, nanos};

/// `[rounds]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Rounds {
    /// Slots a second of the common clock; the same on every robot \[Hz\].
    #[schemars(range(min = 0.2, max = 10))]
    pub rate_hz: f64,
    /// A sighting is of use at a slot from which it is no farther. It is moved there by the robot's own wheels \[s\].
    #[schemars(range(min = 0, max = 1))]
    pub skew_s: f64,
    /// So long after a slot the leader makes the round, with the robots that are there \[s\].
    #[schemars(range(min = 0.02, max = 5))]
    pub deadline_s: f64,
    /// After so long without a round health says that there is none \[s\].
    #[schemars(range(min = 0.1, max = 3600))]
    pub timeout_s: f64,
}

impl Default for Rounds {
    fn default() -> Self {
        Self {
            rate_hz: 2.0,
            skew_s: 0.05,
            deadline_s: 0.1,
            timeout_s: 3.0,
        }
    }
}

impl Rounds {
    /// Length of a slot \[ns\].
    #[must_use]
    pub fn period_ns(&self) -> i64 {
        nanos(1.0 / self.rate_hz)
    }
}

impl Config {
    /// Whether this robot may take part in its team's rounds.
    #[must_use]
    pub fn makes_rounds(&self) -> bool {
        self.fusion.mode == Mode::Rounds
    }
}
