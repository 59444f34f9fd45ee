//! Places that cannot be two things at once.

use std::path::Path;

use super::super::Config;
use super::super::finding::Finding;

/// Files with two writers, and a bus that is heard twice.
pub(super) fn refusals(config: &Config) -> impl Iterator<Item = Finding> {
    let files = &config.telemetry;
    let written = [
        ("telemetry.log_file", files.log_file.as_path()),
        ("telemetry.state_file", files.state_file.as_path()),
        ("telemetry.record", files.record.as_path()),
    ];
    (1..written.len())
        .filter_map(move |index| same_file(written, index))
        .chain(same_bus(config))
}

fn same_file(written: [(&str, &Path); 3], index: usize) -> Option<Finding> {
    let (key, path) = *written.get(index)?;
    let same = |(_, other): &&(&str, &Path)| !path.as_os_str().is_empty() && *other == path;
    let (other, _) = written.iter().take(index).find(same)?;
    let problem = format!(" = \"{}\": is the file of {other} too", path.display());
    Some(Finding::new(key, problem))
}

/// Every frame would count twice.
fn same_bus(config: &Config) -> Option<Finding> {
    let buses = &config.odometry.as_ref()?.buses;
    let twice = (1..buses.len()).find(|&index| buses[..index].contains(&buses[index]))?;
    let problem = format!(
        " = \"{}\": is listed twice; frames of one bus are heard once",
        buses.get(twice)?
    );
    Some(Finding::new(format!("odometry.buses.{twice}"), problem))
}
