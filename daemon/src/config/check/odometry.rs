//! The wheels, on buses or of a base.

use coloc_drivers::encoder::{BaseDecoder, ConfigError, OdometryDecoder};

use super::super::Config;
use super::super::finding::Finding;

/// Whether the signals are in the DBC file and make sense together is the decoder's to say.
pub(super) fn refusal(config: &Config) -> Option<Finding> {
    let odometry = config.odometry.as_ref()?;
    let on_can = odometry
        .is_on_can()
        .then(|| OdometryDecoder::new(odometry).err());
    let base = odometry
        .base
        .is_some()
        .then(|| BaseDecoder::new(odometry).err());
    let error = on_can.flatten().or(base.flatten())?;
    let word = match &error {
        ConfigError::Setting { setting, problem } => {
            return Some(Finding::new(
                format!("odometry.{setting}"),
                format!(": {problem}"),
            ));
        }
        ConfigError::UnknownSignal { signal, .. } | ConfigError::Signal { signal, .. } => signal,
        ConfigError::UnknownMessage { message, .. } | ConfigError::Identifier { message, .. } => {
            message
        }
        ConfigError::ReadDbc { .. }
        | ConfigError::ParseDbc { .. }
        | ConfigError::Ambiguous { .. } => {
            return Some(Finding::new("odometry.dbc", format!(": {error}")));
        }
    };
    Some(Finding {
        word: Some(word.clone()),
        ..Finding::new("odometry", format!(": {error}"))
    })
}
