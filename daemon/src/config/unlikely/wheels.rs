//! What the decoder finds unlikely about the wheels.

use coloc_drivers::encoder::{OdometryConfig, warnings};

use super::super::finding::Finding;
use super::super::{Config, Trigger};

pub(super) fn findings(config: &Config) -> Vec<Finding> {
    let odometry = config.odometry.as_ref();
    let on_can = odometry.is_some_and(OdometryConfig::is_on_can);
    let timer = (!on_can).then(|| timer_alone(config));
    let warnings = odometry
        .and_then(|it| warnings(it).ok())
        .unwrap_or_default();
    let wheels = warnings.iter().map(|warning| finding(warning));
    wheels.chain(timer.flatten()).collect()
}

/// A base's message ends no wait.
fn timer_alone(config: &Config) -> Option<Finding> {
    let problem = " = \"encoder\": no frame can start a tick where no bus is heard; the timer will";
    (config.tick.trigger == Trigger::Encoder).then(|| Finding::new("tick.trigger", problem))
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
