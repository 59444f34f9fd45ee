//! `[gyro]`: the yaw rate, and how good it is.

use coloc_drivers::encoder::{BodySignal, TurnUnit};
use coloc_estimator::{GyroSettings, Span};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::nanos;

/// `[gyro]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Gyro {
    /// Where the yaw rate is heard.
    pub source: GyroSource,
    /// Its signal, for `source = "can"`: on a bus of `[odometry]`, of the DBC file there, and no faster than `max_turn_rate_radps`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = example())]
    pub signal: Option<BodySignal<TurnUnit>>,
    /// Samples in a second. Where they come one and a half times as rarely, one was lost, and the wheels alone tell of the time \[Hz\].
    #[schemars(range(min = 1, max = 1000))]
    pub rate_hz: f64,
    /// Radians for a radian that it reads, as `coloc calibrate` finds it.
    #[schemars(range(min = 0.5, max = 2))]
    pub scale: f64,
    /// What it reads when nothing turns, as far as that is known before the start \[rad/s\].
    #[schemars(range(min = -10, max = 10))]
    pub bias_radps: f64,
    /// White noise, as data sheets have it ("rate noise density"); where a message does not say its own \[rad/s/√Hz\].
    #[schemars(range(max = 1), extend("exclusiveMinimum" = 0))]
    pub noise_density: f64,
    /// Standard deviation after a radian turned: of its scale, and of how it is mounted. It grows with the root of the angle \[rad\].
    #[schemars(range(min = 0, max = 1))]
    pub noise_per_turn: f64,
    /// Standard deviation of the bias at the start \[rad/s\].
    #[schemars(range(max = 10), extend("exclusiveMinimum" = 0))]
    pub bias_sigma: f64,
    /// How fast the bias walks: its standard deviation after a second. It grows with the root of the time \[rad/s\].
    #[schemars(range(min = 0, max = 1))]
    pub bias_walk: f64,
}

/// Where a gyro is heard.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum GyroSource {
    /// Nowhere: there is none, and what the channel says is not used.
    #[default]
    None,
    /// On the channel `gyro`.
    Channel,
    /// On a CAN bus, as `signal` says.
    Can,
}

fn example() -> BodySignal<TurnUnit> {
    BodySignal {
        bus: 0,
        message: "Imu".to_owned(),
        signal: "YawRate".to_owned(),
        unit: TurnUnit::default(),
        reversed: false,
    }
}

impl Default for Gyro {
    fn default() -> Self {
        Self {
            source: GyroSource::None,
            signal: None,
            rate_hz: 200.0,
            scale: 1.0,
            bias_radps: 0.0,
            noise_density: 1.7e-4,
            noise_per_turn: 1.7e-3,
            bias_sigma: 0.05,
            bias_walk: 2.2e-5,
        }
    }
}

impl Gyro {
    /// In the estimator's words, if there is one.
    #[must_use]
    pub fn settings(&self) -> Option<GyroSettings> {
        let square = |sigma: f64| sigma * sigma;
        (self.source != GyroSource::None).then(|| GyroSettings {
            noise: square(self.noise_density),
            noise_per_turn: square(self.noise_per_turn),
            bias: self.scale * self.bias_radps,
            bias_variance: square(self.bias_sigma),
            bias_walk: square(self.bias_walk),
            period: Span::from_nanos(nanos(1.0 / self.rate_hz)),
        })
    }

    /// The signal that is read off a bus.
    #[must_use]
    pub fn on_can(&self) -> Option<&BodySignal<TurnUnit>> {
        let is_on_can = self.source == GyroSource::Can;
        self.signal.as_ref().filter(|_| is_on_can)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_the_estimators_ordinary_gyro() {
        let gyro = Gyro {
            source: GyroSource::Channel,
            ..Gyro::default()
        };
        let (own, ordinary) = (gyro.settings().unwrap(), GyroSettings::ORDINARY);
        let numbers =
            |it: &GyroSettings| [it.noise, it.noise_per_turn, it.bias_variance, it.bias_walk];
        for (a, b) in numbers(&own).into_iter().zip(numbers(&ordinary)) {
            assert!((a - b).abs() < 1e-12 * b, "{a} is not {b}");
        }
        assert_eq!((own.period, own.bias.to_bits()), (ordinary.period, 0));
        assert_eq!(Gyro::default().settings(), None);
    }
}
