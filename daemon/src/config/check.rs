//! What is allowed beyond a value by itself: the values against one another, and what only a program can look up.

mod assist;
mod canopen;
mod files;
mod gyro;
mod history;
mod landmarks;
mod noise;
mod odometry;
mod rounds;
mod team;
mod through_track;

use std::path::Path;

use coloc_shm_types::{OpenError, Space, places};

use super::finding::Finding;
use super::{Config, Scheduler, WaitMode};

/// Everything that is not allowed; `own` is the file that it was read from.
pub(super) fn check(config: &Config, own: &Path) -> Vec<Finding> {
    let one = [
        root(config),
        prefix(config),
        odometry::refusal(config),
        canopen::refusal(config),
        gyro::refusal(config),
        assist::refusal(config),
        rounds::refusal(config),
        through_track::refusal(config),
        history::refusal(config),
        polling(config),
    ];
    team::refusals(config)
        .chain(one.into_iter().flatten())
        .chain(landmarks::refusals(config))
        .chain(noise::refusals(config))
        .chain(files::refusals(config, own))
        .collect()
}

fn root(config: &Config) -> Option<Finding> {
    let root = &config.shm.root;
    if root.as_os_str().is_empty() {
        return None;
    }
    let must = if root.is_absolute() {
        match Space::check_place(root, places::DEFAULT_PREFIX) {
            Err(OpenError::BadRoot { limit, .. }) => {
                format!("must be at most {limit} bytes long, of ASCII characters alone")
            }
            _ => return None,
        }
    } else {
        "must be an absolute path, as \"/run/coloc\" is".into()
    };
    // With its line breaks and zeros in words.
    let root = root.to_string_lossy();
    Some(Finding::new("shm.root", format!(" = {root:?}: {must}")))
}

fn prefix(config: &Config) -> Option<Finding> {
    let prefix = &config.shm.prefix;
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let problem = format!(" = {prefix:?}: must have letters, digits and `_` only");
    (!prefix.chars().all(plain)).then(|| Finding::new("shm.prefix", problem))
}

/// The kernel takes a real-time thread that never sleeps off its processor for 50 ms of every second.
fn polling(config: &Config) -> Option<Finding> {
    let refused =
        config.tick.wait == WaitMode::Poll && config.realtime.scheduler != Scheduler::Other;
    let problem = " = \"poll\": needs realtime.scheduler = \"other\": the kernel stops a real-time thread that never \
                   sleeps for 50 ms of every second";
    refused.then(|| Finding::new("tick.wait", problem))
}
