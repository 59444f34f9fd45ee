//! What the decoder finds unlikely about the wheels.

use coloc_drivers::encoder::describe;

use super::super::Config;
use super::super::finding::Finding;

pub(super) fn findings(config: &Config) -> Vec<Finding> {
    let Some(Ok(description)) = config.odometry.as_ref().map(describe) else {
        return Vec::new();
    };
    let finding = |warning: &String| finding(warning);
    description.warnings.iter().map(finding).collect()
}

/// A warning begins with its setting, or with the message that it is about.
fn finding(warning: &str) -> Finding {
    let (setting, problem) = warning.split_once(": ").unwrap_or(("", warning));
    let about = setting.split_once("message ");
    match about {
        Some((_, message)) => Finding {
            word: Some(message.into()),
            ..Finding::new("odometry", format!(": {warning}"))
        },
        None => Finding::new(format!("odometry.{setting}"), format!(": {problem}")),
    }
}
