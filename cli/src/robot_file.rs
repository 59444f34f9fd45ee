//! The `robot.toml` of a robot that a command runs.

use std::collections::BTreeMap;
use std::path::Path;

use coloc_daemon::config::{Config, Member, Robot, Section};
use coloc_shm_types::RobotName;
use serde::Serialize;

use crate::result_file::WriteError;

/// The robot with this number in its team, `robot1` and so on; everything else as it is by default.
pub(crate) fn robot(id: u16) -> Result<Config, String> {
    let Member { name, id } = member(id)?;
    Ok(Config::of(Robot { name, id }))
}

/// The same, as others know it.
pub(crate) fn member(id: u16) -> Result<Member, String> {
    let name = RobotName::new(&format!("robot{id}")).map_err(|error| error.to_string())?;
    Ok(Member { name, id })
}

/// Everybody up to this number.
pub(crate) fn team(last: u16) -> Result<Vec<Member>, String> {
    (1..=last).map(member).collect()
}

/// Writes what `config` says, or why it does not.
pub(crate) fn write(path: &Path, config: Result<Config, String>) -> Result<(), WriteError> {
    write_text(path, config.and_then(|config| text_of(&config)))
}

/// The same, and below it the section of another program.
pub(crate) fn write_with<S: Section + Serialize>(
    path: &Path,
    config: Result<Config, String>,
    section: &S,
) -> Result<(), WriteError> {
    write_below(path, config, S::NAME, section)
}

/// The same, of a section whose type is not known here.
pub(crate) fn write_below(
    path: &Path,
    config: Result<Config, String>,
    name: &str,
    section: &impl Serialize,
) -> Result<(), WriteError> {
    let below = BTreeMap::from([(name, section)]);
    let text = config.and_then(|config| Ok(text_of(&config)? + "\n" + &text_of(&below)?));
    write_text(path, text)
}

fn text_of(table: &impl Serialize) -> Result<String, String> {
    toml::to_string(table).map_err(|error| error.to_string())
}

fn write_text(path: &Path, text: Result<String, String>) -> Result<(), WriteError> {
    let text = text.map_err(|reason| WriteError::new(path, &reason))?;
    std::fs::write(path, text).map_err(|error| WriteError::new(path, &error))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_what_the_daemon_reads() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("robot2.toml");
        let config = Config {
            team: team(3).unwrap(),
            ..robot(2).unwrap()
        };
        write(&path, Ok(config.clone())).unwrap();
        assert_eq!(Config::load(&path).unwrap(), config);
        assert_eq!(config.peers().count(), 2);
    }
}
