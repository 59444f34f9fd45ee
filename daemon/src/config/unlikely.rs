//! What is allowed and unlikely: a slip of the pen, a wrong unit, a setting that undoes another.
//!
//! A robot runs with it; `colocd check` and the log say it.

mod assist;
mod buses;
mod files;
mod fusion;
mod health;
mod motion;
mod robot;
mod times;
mod wheels;

use super::Config;
use super::finding::Finding;

/// Everything that was hardly meant.
pub(super) fn unlikely(config: &Config) -> Vec<Finding> {
    [
        robot::findings(config),
        wheels::findings(config),
        motion::findings(config),
        fusion::findings(config),
        health::findings(config),
        times::findings(config),
        files::findings(config),
        buses::findings(config),
        assist::findings(config),
    ]
    .concat()
}

/// `[a, b, c]`, as one writes it.
fn list(values: &[f64]) -> String {
    let values: Vec<_> = values.iter().map(ToString::to_string).collect();
    format!("[{}]", values.join(", "))
}
