//! The gyro: where it is heard, and whether the history holds its samples.

use coloc_drivers::encoder::{ConfigError, GyroDecoder};
use coloc_estimator::GYRO_SAMPLES;

use super::super::finding::Finding;
use super::super::{Config, GyroSource};

pub(super) fn refusal(config: &Config) -> Option<Finding> {
    match config.gyro.source {
        GyroSource::None => None,
        GyroSource::Channel => room(config),
        GyroSource::Can => signal(config).or_else(|| room(config)),
    }
}

fn signal(config: &Config) -> Option<Finding> {
    let buses = config.odometry.as_ref().filter(|it| it.is_on_can());
    let Some((odometry, signal)) = buses.zip(config.gyro.signal.as_ref()) else {
        let problem = " = \"can\": needs gyro.signal, and a bus in odometry.buses";
        return Some(Finding::new("gyro.source", problem));
    };
    let error = GyroDecoder::of(odometry, signal).err()?;
    Some(match &error {
        ConfigError::Setting { setting, problem } => {
            Finding::new(format!("gyro.{setting}"), format!(": {problem}"))
        }
        _ => Finding::new("gyro.signal", format!(": {error}")),
    })
}

/// A sample that finds no room drives nothing.
fn room(config: &Config) -> Option<Finding> {
    let (gyro, history) = (&config.gyro, &config.history);
    let longest_s = history.length_s + history.future_tolerance_s;
    #[allow(clippy::cast_precision_loss)] // A thousand.
    let most_hz = GYRO_SAMPLES as f64 / longest_s;
    let problem = format!(
        " = {}: must be {most_hz:.0} Hz or less, for the history to hold {GYRO_SAMPLES} samples",
        gyro.rate_hz
    );
    (gyro.rate_hz > most_hz).then(|| Finding {
        or: &["history.length_s"],
        ..Finding::new("gyro.rate_hz", problem)
    })
}
