//! A gyro that speaks CAN: frames in, yaw rates out.

use crate::can::{Id, Kind, Received};
use crate::config_error::ConfigError;
use crate::signal::SignalDecoder;

use super::config::{BodySignal, OdometryConfig, TurnUnit};
use super::guard::Guard;
use super::plan;
use super::reject::FrameReject;

/// Makes yaw rates of one signal's frames. Nothing here allocates after `new`.
#[derive(Clone, Debug)]
pub struct GyroDecoder {
    place: (u8, Id),
    signal: SignalDecoder,
    guard: Guard,
    /// What one unit of the signal is \[rad/s\], and the most that is plausible.
    scale: f64,
    limit: f64,
    last_ns: Option<i64>,
}

/// What a gyro read.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct GyroReading {
    /// When, by the clock of the frames.
    pub stamp_ns: i64,
    /// Counter-clockwise \[rad/s\].
    pub rate_radps: f64,
}

impl GyroDecoder {
    /// Of `signal` on the buses of `config`, whose DBC file, messages and highest turn rate it shares.
    ///
    /// # Errors
    /// [`ConfigError`], with the message or signal and what there is instead; a setting is one of `[gyro]`.
    pub fn of(config: &OdometryConfig, signal: &BodySignal<TurnUnit>) -> Result<Self, ConfigError> {
        plan::gyro(config, signal)
    }

    pub(super) fn new(
        place: (u8, Id),
        signal: SignalDecoder,
        guard: Guard,
        (scale, limit): (f64, f64),
    ) -> Self {
        Self {
            place,
            signal,
            guard,
            scale,
            limit,
            last_ns: None,
        }
    }

    /// The identifier that is wanted from `bus`, if any is.
    #[must_use]
    pub fn wanted_id(&self, bus: u8) -> Option<Id> {
        let (own, id) = self.place;
        (own == bus).then_some(id)
    }

    /// What a frame says; `None` if it is of another message.
    ///
    /// # Errors
    /// Within: the frame does not count.
    pub fn push(&mut self, received: &Received) -> Option<Result<GyroReading, FrameReject>> {
        let (bus, id) = self.place;
        let carries = bus == received.bus && received.frame.id() == Some(id);
        carries.then(|| self.read(received))
    }

    fn read(&mut self, received: &Received) -> Result<GyroReading, FrameReject> {
        if received.frame.kind() == Kind::Remote {
            return Err(FrameReject::Remote);
        }
        let (data, stamp_ns) = (received.frame.data(), received.stamp_ns);
        if self.last_ns.is_some_and(|last_ns| stamp_ns < last_ns) {
            return Err(FrameReject::Backward);
        }
        let (_, id) = self.place;
        let passed = self.guard.check(id, data, stamp_ns)?;
        let physical = self.signal.physical(data).ok_or(FrameReject::Short)?;
        if !self.signal.allows(physical) {
            return Err(FrameReject::OutOfRange);
        }
        let rate_radps = physical * self.scale;
        // Not-a-number is in no range.
        if !(-self.limit..=self.limit).contains(&rate_radps) {
            return Err(FrameReject::Implausible);
        }
        self.guard.accept(passed);
        self.last_ns = Some(stamp_ns);
        Ok(GyroReading {
            stamp_ns,
            rate_radps,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::can::{BusSpec, Frame, StandardId};
    use crate::encoder::WheelFrames;

    const DBC: &str = "VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: Imu\n\nBO_ 513 Imu: 8 Imu\n \
                       SG_ YawRate : 0|16@1- (0.01,0) [-200|200] \"deg/s\" Vector__XXX\n";

    fn config(folder: &std::path::Path) -> OdometryConfig {
        let dbc = folder.join("imu.dbc");
        std::fs::write(&dbc, DBC).unwrap();
        let bus = BusSpec::Local {
            directory: "bus".into(),
        };
        OdometryConfig {
            dbc: Some(dbc),
            max_turn_rate_radps: 3.0,
            ..OdometryConfig::differential(bus, 0.3, 1e-4, 2.0)
        }
    }

    fn signal(unit: TurnUnit) -> BodySignal<TurnUnit> {
        BodySignal {
            bus: 0,
            message: "Imu".into(),
            signal: "YawRate".into(),
            unit,
            reversed: true,
        }
    }

    fn received(raw: i16, stamp_ns: i64) -> Received {
        let [low, high] = raw.to_le_bytes();
        let id = Id::Standard(StandardId::new(513).unwrap());
        Received {
            frame: Frame::data_frame(id, &[low, high, 0, 0, 0, 0, 0, 0]).unwrap(),
            stamp_ns,
            bus: 0,
        }
    }

    #[test]
    fn a_frame_is_a_yaw_rate_in_radians_that_turns_the_other_way() {
        let folder = tempfile::tempdir().unwrap();
        let mut gyro =
            GyroDecoder::of(&config(folder.path()), &signal(TurnUnit::DegreesPerSecond)).unwrap();
        let read = gyro.push(&received(1000, 5)).unwrap().unwrap();
        assert_eq!(read.stamp_ns, 5);
        assert!((read.rate_radps + 10.0_f64.to_radians()).abs() < 1e-12);
        let reject = |gyro: &mut GyroDecoder, raw, stamp| gyro.push(&received(raw, stamp)).unwrap();
        assert_eq!(reject(&mut gyro, 1000, 4), Err(FrameReject::Backward));
        assert_eq!(reject(&mut gyro, 32_000, 6), Err(FrameReject::OutOfRange));
        assert_eq!(reject(&mut gyro, 19_000, 6), Err(FrameReject::Implausible));
        let [other, _] = WheelFrames::new(1e-4).encode(0.0, 0.0);
        let other = Received {
            frame: other,
            stamp_ns: 7,
            bus: 0,
        };
        assert_eq!(gyro.push(&other), None);
    }

    #[test]
    fn a_unit_that_the_dbc_file_contradicts_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let refused = GyroDecoder::of(&config(folder.path()), &signal(TurnUnit::RadiansPerSecond));
        let text = refused.unwrap_err().to_string();
        assert!(text.contains("deg/s"), "{text}");
    }
}
