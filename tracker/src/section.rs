//! `[track]` of `robot.toml`.

use coloc_daemon::config::Section;
use coloc_estimator::Span;
use coloc_track::Config;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Where the neighbours are, as `coloc-track` has it. Where the sensors sit that see them is `mount` in `[sighting]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Track {
    /// So far are tracks behind the present: what comes later than that is not used. It takes what a camera needs for an image, and what the
    /// others' messages need to come \[s\].
    #[schemars(range(min = 0, max = 2))]
    pub delay_s: f64,
    /// So often each track is published, and the others are told how this robot moves \[s\].
    #[schemars(range(min = 0.01, max = 1))]
    pub period_s: f64,
    /// So many sightings make a track believed.
    #[schemars(range(min = 1, max = 1000))]
    pub confirm_hits: u32,
    /// A track that is not seen for so long is coasted: its `status` says so \[s\].
    #[schemars(range(min = 0.01, max = 60))]
    pub coast_s: f64,
    /// A track that is not seen for so long is given up \[s\].
    #[schemars(range(min = 0.01, max = 600))]
    pub delete_s: f64,
    /// A track less certain than this is given up: the largest standard deviation in any direction \[m\].
    #[schemars(range(min = 0.01, max = 1000))]
    pub most_sigma_m: f64,
}

impl Default for Track {
    fn default() -> Self {
        let known = Config::default();
        Self {
            delay_s: 0.15,
            period_s: 0.05,
            confirm_hits: known.confirm_hits,
            coast_s: known.coast.as_seconds(),
            delete_s: known.delete.as_seconds(),
            most_sigma_m: known.max_sigma_m,
        }
    }
}

impl Track {
    /// As the tracks' manager takes it.
    #[must_use]
    pub fn config(&self) -> Config {
        Config {
            confirm_hits: self.confirm_hits,
            coast: Span::from_seconds(self.coast_s),
            delete: Span::from_seconds(self.delete_s),
            max_sigma_m: self.most_sigma_m,
            ..Config::default()
        }
    }
}

impl Section for Track {
    const NAME: &'static str = "track";

    fn refusals(&self) -> Vec<(String, String)> {
        let is_never = self.delete_s < self.coast_s;
        let never = is_never.then(|| {
            let problem = format!(
                " = {}: is shorter than track.coast_s = {}",
                self.delete_s, self.coast_s
            );
            ("delete_s".to_owned(), problem)
        });
        never.into_iter().collect()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn parse(section: &str) -> Result<Track, String> {
        let text = format!("[robot]\nname = \"a\"\nid = 1\n[track]\n{section}");
        let parsed =
            coloc_daemon::config::Config::parse_with::<Track>(&text, Path::new("robot.toml"));
        parsed
            .map(|(_, track)| track)
            .map_err(|error| error.to_string())
    }

    #[test]
    fn an_empty_section_is_enough() {
        let track = parse("").unwrap();
        assert_eq!(track, Track::default());
        assert_eq!(track.config(), Config::default());
    }

    #[test]
    fn what_does_not_fit_together_is_refused() {
        let refusal = parse("coast_s = 2.0\ndelete_s = 1.0\n").unwrap_err();
        assert!(refusal.contains("shorter than track.coast_s"), "{refusal}");
        for line in ["delay_s = 3.0", "most_sigma_m = 1e-300", "delete_s = inf"] {
            assert!(parse(line).is_err(), "{line}");
        }
    }
}
