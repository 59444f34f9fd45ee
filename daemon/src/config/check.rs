//! What is allowed beyond a value by itself: the values against one another, and what only a program can look up.

mod files;
mod history;
mod noise;
mod odometry;
mod team;

use super::finding::Finding;
use super::{Config, Scheduler, WaitMode};

/// Everything that is not allowed.
pub(super) fn check(config: &Config) -> Vec<Finding> {
    let one = [
        root(config),
        prefix(config),
        odometry::refusal(config),
        history::refusal(config),
        polling(config),
    ];
    team::refusals(config)
        .chain(one.into_iter().flatten())
        .chain(noise::refusals(config))
        .chain(files::refusals(config))
        .collect()
}

fn root(config: &Config) -> Option<Finding> {
    let root = &config.shm.root;
    let problem = format!(
        " = \"{}\": must be an absolute path, as \"/run/coloc\" is",
        root.display()
    );
    let is_default = root.as_os_str().is_empty();
    (!is_default && !root.is_absolute()).then(|| Finding::new("shm.root", problem))
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
