//! `coloc-link check`: what of a robot's link is as it has to be, in words, before it runs and while it does.

mod calls;
mod papers;
mod peers;

use std::path::Path;

use coloc_daemon::config::Config;
use coloc_sensors::{EndError, Moment as Present, page};

use crate::roster::Moment;
use crate::section::Link;

/// What was found.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Findings {
    /// A line for each thing that is as it should be, or a fact.
    pub text: String,
    /// What is not.
    pub warnings: Vec<String>,
}

impl Findings {
    fn tell(&mut self, what: &str, text: &str) {
        self.text.extend([&format!("{what:12} "), text, "\n"]);
    }

    fn warn(&mut self, warning: String) {
        self.warnings.push(warning);
    }
}

/// Prints what is found of the link of a robot, and with `strict` fails if something is not as it should be.
///
/// # Errors
/// If its configuration is wrong, its keys or roster are not as they have to be, or something else and `strict`.
pub fn run(path: &Path, strict: bool) -> Result<(), EndError> {
    let (config, section) = Config::load_with::<Link>(path)?;
    let mut findings = Findings::default();
    let now = Moment::of_ns(Present::now().realtime_ns);
    let roster = papers::look(&config, &section, now, &mut findings)?;
    if let Some(roster) = roster {
        calls::try_all(&roster, config.robot.id, &mut findings)?;
        peers::look(&section.own_directory(&config)?, &mut findings);
    }
    page::check(findings.text, &findings.warnings, strict)
}

#[cfg(test)]
mod tests;
