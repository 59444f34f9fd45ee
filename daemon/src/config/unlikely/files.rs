//! Places that are not there. Nothing is opened or made.

use std::path::Path;

use coloc_drivers::can::BusSpec;

use super::super::Config;
use super::super::finding::Finding;

pub(super) fn findings(config: &Config) -> Vec<Finding> {
    let files = &config.telemetry;
    let written = [
        ("telemetry.log_file", files.log_file.as_path()),
        ("telemetry.state_file", files.state_file.as_path()),
        ("telemetry.record", files.record.as_path()),
    ];
    let unwritable = written
        .into_iter()
        .filter(|(_, path)| !path.as_os_str().is_empty())
        .filter_map(|(key, path)| homeless(key, path).or_else(|| directory(key, path)));
    unwritable.chain(logs(config)).collect()
}

fn directory(key: &str, path: &Path) -> Option<Finding> {
    let problem = format!(
        " = \"{}\": that is a directory: name a file in it",
        path.display()
    );
    path.is_dir().then(|| Finding::new(key, problem))
}

fn homeless(key: &str, path: &Path) -> Option<Finding> {
    let directory = path.parent()?;
    let problem = format!(
        " = \"{}\": there is no directory {}: the file cannot be written until it is made",
        path.display(),
        directory.display()
    );
    (!directory.is_dir()).then(|| Finding::new(key, problem))
}

/// Recorded logs that cannot be played.
fn logs(config: &Config) -> impl Iterator<Item = Finding> {
    let buses = config.odometry.iter().flat_map(|it| it.buses.iter());
    buses.enumerate().filter_map(|(index, bus)| match bus {
        BusSpec::Candump { path, .. } if !path.exists() => {
            let problem = format!(" = \"{bus}\": there is no such file");
            Some(Finding::new(format!("odometry.buses.{index}"), problem))
        }
        _ => None,
    })
}
