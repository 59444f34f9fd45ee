//! What a driver's program prints when it is asked: what a configuration means, and how the one that runs is doing.

use std::io::{self, Write};
use std::time::{Duration, Instant};

use coloc_shm_types::{DriverStatus, RobotName, Space};
use serde_json::{Map, Value, json};

use crate::EndError;

/// So many statuses, one a second, are waited for.
const PATIENCE: Duration = Duration::from_secs(3);

/// A driver as its status names it.
#[derive(Copy, Clone, Debug)]
pub struct Names<'a> {
    /// Of the program, for people.
    pub program: &'a str,
    /// In its status.
    pub driver: &'a str,
    /// Its number.
    pub source: u16,
    /// Of its reasons to refuse, in their order.
    pub refusals: &'a [&'a str],
    /// Of its figures, likewise.
    pub figures: &'a [&'a str],
}

/// Prints what a configuration means and what is unlikely about it.
///
/// # Errors
/// If it is to be strict, and something is unlikely; or of standard output.
pub fn check(mut understood: String, warnings: &[String], strict: bool) -> Result<(), EndError> {
    for warning in warnings {
        understood.extend(["warning      ", warning, "\n"]);
    }
    print(&understood)?;
    if strict && !warnings.is_empty() {
        return Err(EndError::Unlikely(warnings.len()));
    }
    Ok(())
}

/// Prints the status of the driver that runs for `robot`, once.
///
/// # Errors
/// If none speaks, or of shared memory or standard output.
pub fn status(space: &Space, robot: &RobotName, names: &Names<'_>) -> Result<(), EndError> {
    let statuses = space.subscriber::<DriverStatus>(robot)?;
    let until = Instant::now() + PATIENCE;
    while let Some(left) = until.checked_duration_since(Instant::now()) {
        let waited = statuses.wait(left);
        let heard = waited.map_err(|problem| EndError::Input(problem.to_string()))?;
        let own = |it: &DriverStatus| it.header.source == names.source && it.name() == names.driver;
        if let Some(status) = heard.filter(own) {
            return print(&format!("{}\n", described(&status, names)));
        }
    }
    Err(EndError::Input(format!(
        "no {} of {robot} speaks: does it run?",
        names.program
    )))
}

fn described(status: &DriverStatus, names: &Names<'_>) -> Value {
    let refused: Map<_, _> = names
        .refusals
        .iter()
        .zip(status.refused)
        .filter(|(_, count)| *count > 0)
        .map(|(name, count)| ((*name).to_owned(), count.into()))
        .collect();
    let figures: Map<_, _> = names
        .figures
        .iter()
        .zip(status.figures)
        .filter(|(_, figure)| figure.is_finite())
        .map(|(name, figure)| ((*name).to_owned(), figure.into()))
        .collect();
    json!({
        "health": status.health().name(), "open": status.open == 1, "opened": status.opened, "bytes": status.bytes,
        "whole": status.whole, "broken": status.broken, "said": status.said, "refused": refused, "figures": figures,
    })
}

fn print(text: &str) -> Result<(), EndError> {
    let mut out = io::stdout();
    let printed = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    printed.map_err(EndError::of("standard output cannot be written"))
}
