//! The gyro, if there is one.

use coloc_drivers::encoder::Rounded;

use super::super::{Config, GyroSource};
use super::page::Page;

pub(super) fn write(config: &Config, page: &mut Page) {
    let gyro = &config.gyro;
    let heard = match (gyro.source, &gyro.signal) {
        (GyroSource::None, _) | (GyroSource::Can, None) => return,
        (GyroSource::Channel, _) => "on the channel gyro".to_owned(),
        (GyroSource::Can, Some(it)) => format!("in signal {} of message {}", it.signal, it.message),
    };
    page.line("gyro", format!("{heard}, {} Hz", gyro.rate_hz));
    let degrees = |rad: f64| Rounded(rad.to_degrees());
    page.line(
        "",
        format!(
            "its bias is at the start {} ± {}°/s (σ), and known to ± {}°/s after ten seconds of standing",
            degrees(gyro.bias_radps),
            degrees(gyro.bias_sigma),
            degrees(gyro.noise_density / 10.0_f64.sqrt()),
        ),
    );
    page.line(
        "",
        format!(
            "a bias that was known walks by ± {}°/s in ten minutes",
            degrees(gyro.bias_walk * 600.0_f64.sqrt())
        ),
    );
}
