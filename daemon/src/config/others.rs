//! Sections of `robot.toml` that other programs read: `colocd` passes over them, and helps those programs to read theirs.

use std::path::Path;

use schemars::JsonSchema;
use serde::de::{DeserializeOwned, Deserializer, IgnoredAny};
use serde::{Deserialize, Serialize};
use toml::de::DeTable;

use super::error::Fault;
use super::finding::Finding;
use super::shape::Shape;
use super::{Config, ConfigError, none_of, read, review};

/// What another program has in the file.
pub(super) struct Other {
    pub(super) name: &'static str,
    /// Who checks it.
    pub(super) program: &'static str,
    pub(super) is_in: fn(&Config) -> bool,
}

/// All of them.
pub(super) const OTHERS: [Other; 6] = [
    Other {
        name: "gnss",
        program: "coloc-gnss check",
        is_in: |config| config.gnss.is_there,
    },
    Other {
        name: "laser",
        program: "coloc-laser check",
        is_in: |config| config.laser.is_there,
    },
    Other {
        name: "track",
        program: "coloc-track check",
        is_in: |config| config.track.is_there,
    },
    Other {
        name: "bounds",
        program: "coloc-bounds check",
        is_in: |config| config.bounds.is_there,
    },
    Other {
        name: "integrity",
        program: "coloc-bounds check",
        is_in: |config| config.integrity.is_there,
    },
    Other {
        name: "link",
        program: "coloc-link check",
        is_in: |config| config.link.is_there,
    },
];

/// Such a section, of which nothing is kept but whether it is there.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct SomebodyElses {
    /// Whether it is.
    pub is_there: bool,
}

impl<'de> Deserialize<'de> for SomebodyElses {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        IgnoredAny::deserialize(deserializer).map(|_| Self { is_there: true })
    }
}

/// A section of another program: what can be written and is allowed stands in its type, as in that of `colocd`'s own.
pub trait Section: JsonSchema + DeserializeOwned {
    /// As it stands in brackets.
    const NAME: &'static str;

    /// What is not allowed beyond a value by itself: the dotted key below the section, and what is to be said of it.
    fn refusals(&self) -> Vec<(String, String)>;
}

impl Config {
    /// Reads and checks the file at `path`, the section of another program with it.
    ///
    /// # Errors
    /// As [`Config::load`]; and if the section is not there, or wrong.
    pub fn load_with<S: Section>(path: &Path) -> Result<(Self, S), ConfigError> {
        Self::parse_with(&read(path)?, path)
    }

    /// The same of `text`; `path` is for the errors, and where relative paths begin.
    ///
    /// # Errors
    /// As [`Config::load_with`].
    pub fn parse_with<S: Section>(text: &str, path: &Path) -> Result<(Self, S), ConfigError> {
        let config = Self::parse(text, path)?;
        match parse_section(text) {
            Ok(section) => Ok((config, section)),
            Err(faults) => Err(ConfigError::new(path, text, faults)),
        }
    }
}

/// `text` was found to be TOML before.
fn parse_section<S: Section>(text: &str) -> Result<S, Vec<Fault>> {
    let document = DeTable::parse(text).map_err(|error| vec![Fault::no_toml(&error, text)])?;
    let document = document.get_ref();
    none_of(review::review_section(
        text,
        document,
        S::NAME,
        Shape::of::<S>(),
    ))?;
    let no_value = |error| vec![Fault::no_value(&error, document)];
    let mut table: toml::Table = toml::from_str(text).map_err(no_value)?;
    let section = table.remove(S::NAME).unwrap_or(toml::Table::new().into());
    let section: S = section.try_into().map_err(|error: toml::de::Error| {
        let problem = format!(": {}", error.message());
        vec![Fault::found(&Finding::new(S::NAME, problem), document)]
    })?;
    let refused = section.refusals().into_iter();
    let refused = refused.map(|(key, problem)| Finding::new(format!("{}.{key}", S::NAME), problem));
    none_of(refused.map(|finding| Fault::found(&finding, document)))?;
    Ok(section)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A scale.
    #[derive(Debug, PartialEq, Deserialize, JsonSchema)]
    #[serde(deny_unknown_fields)]
    struct Scale {
        /// Where it is.
        #[schemars(example = &"here")]
        place: String,
        /// How much it may say \[kg\].
        #[serde(default)]
        #[schemars(range(min = 0, max = 5))]
        most: f64,
    }

    impl Section for Scale {
        const NAME: &'static str = "gnss";

        fn refusals(&self) -> Vec<(String, String)> {
            let bad = self.place == "nowhere";
            bad.then(|| ("place".into(), " = \"nowhere\": is no place".into()))
                .into_iter()
                .collect()
        }
    }

    fn parse(section: &str) -> Result<Scale, String> {
        let text = format!("[robot]\nname = \"a\"\nid = 1\n{section}");
        let parsed = Config::parse_with(&text, Path::new("robot.toml"));
        parsed
            .map(|(_, scale)| scale)
            .map_err(|error| error.to_string())
    }

    #[test]
    fn another_programs_section_is_read_by_it_alone() {
        let text = "[robot]\nname = \"a\"\nid = 1\n[gnss]\nwhat = { ever = 1 }\n";
        let mut config = Config::parse(text, Path::new("robot.toml")).unwrap();
        assert!(config.gnss.is_there);
        config.gnss = SomebodyElses::default();
        let without = Config::parse("[robot]\nname = \"a\"\nid = 1\n", Path::new("robot.toml"));
        assert_eq!(config, without.unwrap());
        let scale = parse("[gnss]\nplace = \"a\"\nmost = 2\n").unwrap();
        assert_eq!((scale.place.as_str(), scale.most), ("a", 2.0));
    }

    #[test]
    fn what_is_wrong_in_it_is_said_with_its_line() {
        for (section, said) in [
            (
                "[gnss]\nplace = \"a\"\nmost = 7\n",
                "robot.toml:6: gnss.most = 7: must be a number, 0 to 5 kg",
            ),
            (
                "[gnss]\nplace = \"nowhere\"\n",
                "robot.toml:5: gnss.place = \"nowhere\": is no place",
            ),
            (
                "[gnss]\nplaces = \"a\"\n",
                "robot.toml:5: [gnss] has no places; did you mean place?",
            ),
            (
                "[gnss]\n",
                "robot.toml:4: [gnss] lacks place; write, for example:",
            ),
            ("", "robot.toml: the file lacks [gnss]"),
        ] {
            let refusal = parse(section).unwrap_err();
            assert!(refusal.contains(said), "{refusal}");
        }
    }
}
