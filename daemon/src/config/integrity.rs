//! What `colocd` does with the word of `coloc-bounds`.

use schemars::JsonSchema;
use serde::de::Deserializer;
use serde::{Deserialize, Serialize};

/// With the word that an estimate cannot be right.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Action {
    /// `coloc-bounds` says it on `integrity` and in its log; `colocd` does not hear it.
    #[default]
    Report,
    /// `colocd` hears it too: it stands in every estimate as `opinion`, its health is that of the input `integrity`, and a change is
    /// said in the log. A belief is never changed by it.
    Health,
}

/// What `colocd` reads of `[integrity]`; `coloc-bounds` checks the section.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Integrity {
    /// Whether it is there.
    pub is_there: bool,
    /// What is done with its word.
    pub action: Action,
}

impl<'de> Deserialize<'de> for Integrity {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        struct Known {
            #[serde(default)]
            action: Action,
        }
        let Known { action } = Known::deserialize(deserializer)?;
        Ok(Self {
            is_there: true,
            action,
        })
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::Config;
    use super::*;

    fn parse(section: &str) -> Result<Integrity, String> {
        let text = format!("[robot]\nname = \"a\"\nid = 1\n{section}");
        let parsed = Config::parse(&text, Path::new("robot.toml"));
        parsed
            .map(|it| it.integrity)
            .map_err(|error| error.to_string())
    }

    #[test]
    fn its_word_is_heard_only_where_that_is_asked_for() {
        assert_eq!(parse("").unwrap(), Integrity::default());
        let heard = parse("[integrity]\naction = \"health\"\nalarm_slots = 3\n").unwrap();
        assert_eq!(heard.action, Action::Health);
        for silent in ["[integrity]\n", "[integrity]\naction = \"report\"\n"] {
            let parsed = parse(silent).unwrap();
            assert!(parsed.is_there && parsed.action == Action::Report);
        }
        let wrong = parse("[integrity]\naction = \"drive\"\n").unwrap_err();
        assert!(
            wrong.contains("report") && wrong.contains("health"),
            "{wrong}"
        );
    }
}
