//! Places that cannot be two things at once.

use std::path::{Component, Path, PathBuf};

use coloc_drivers::can::BusSpec;

use super::super::Config;
use super::super::finding::Finding;

/// Files with two writers or that are read as well, and a bus that is heard twice; `own` is the configuration's file.
pub(super) fn refusals(config: &Config, own: &Path) -> impl Iterator<Item = Finding> {
    let files = &config.telemetry;
    let written = [
        ("telemetry.log_file", plain(&files.log_file)),
        ("telemetry.state_file", plain(&files.state_file)),
        ("telemetry.record", plain(&files.record)),
    ];
    let written = written.map(|(key, path)| (key, path.filter(|path| path.file_name().is_some())));
    let read = read(config, own);
    let private = private(config);
    (0..written.len())
        .filter_map(move |index| {
            let (key, path) = written.get(index)?;
            let path = path.as_ref()?;
            let before = written.iter().take(index);
            let other = before.filter_map(|(key, path)| Some((*key, path.as_ref()?)));
            let read = read.iter().map(|(name, path)| (*name, path));
            let same = other.chain(read).find(|(_, other)| *other == path);
            let problem = match (same, private.iter().find(|(_, it)| path.starts_with(it))) {
                (Some((other, _)), _) => format!("is the file of {other} too"),
                (None, Some((what, _))) => {
                    format!(
                        "lies in {what}, where no file may be but coloc's own: put it elsewhere"
                    )
                }
                (None, None) => return None,
            };
            let problem = format!(" = \"{}\": {problem}", path.display());
            Some(Finding::new(*key, problem))
        })
        .chain(same_bus(config))
}

/// Absolute, without `.` and `..`; none where nothing is set. Nothing is opened, and no link followed.
fn plain(path: &Path) -> Option<PathBuf> {
    if path.as_os_str().is_empty() {
        return None;
    }
    let mut plain = PathBuf::new();
    for part in std::path::absolute(path).ok()?.components() {
        match part {
            Component::ParentDir => drop(plain.pop()),
            part => plain.push(part),
        }
    }
    Some(plain)
}

/// What is read at start.
fn read(config: &Config, own: &Path) -> Vec<(&'static str, PathBuf)> {
    let odometry = config.odometry.as_ref();
    let dbc = odometry.and_then(|odometry| odometry.dbc.as_deref());
    let logs = odometry.iter().flat_map(|odometry| &odometry.buses);
    let logs = logs.filter_map(|bus| match bus {
        BusSpec::Candump { path, .. } => Some(("odometry.buses", path.as_path())),
        BusSpec::SocketCan { .. } | BusSpec::Local { .. } => None,
    });
    let files = std::iter::once(("this configuration", own))
        .chain(dbc.map(|dbc| ("odometry.dbc", dbc)))
        .chain(logs);
    files
        .filter_map(|(name, path)| Some((name, plain(path)?)))
        .collect()
}

/// Directories that coloc has for itself.
fn private(config: &Config) -> Vec<(&'static str, PathBuf)> {
    let root = config.shm_root().ok().and_then(|root| plain(&root.path));
    let buses = config.odometry.iter().flat_map(|odometry| &odometry.buses);
    let buses = buses.filter_map(|bus| match bus {
        BusSpec::Local { directory } => Some(("the local bus", plain(directory)?)),
        BusSpec::SocketCan { .. } | BusSpec::Candump { .. } => None,
    });
    root.map(|root| ("the shared-memory root", root))
        .into_iter()
        .chain(buses)
        .collect()
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
