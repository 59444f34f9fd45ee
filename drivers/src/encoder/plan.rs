//! From what a person wrote to what the decoder runs: every name looked up, every number checked.

use can_dbc::Message as DbcMessage;

use crate::database::{Database, id_of};
use crate::signal::SignalDecoder;

use super::channel::{Channel, Measure};
use super::config::{
    BodyConfig, BodySignal, ConfigError, MessageConfig, OdometryConfig, Quantity, SpeedUnit,
    TurnUnit, WheelConfig, WheelsConfig,
};
use super::counter::Counter;
use super::decoder::Message;
use super::guard::Guard;
use super::kinematics::Kinematics;

/// Everything that a decoder needs.
#[derive(Debug)]
pub(super) struct Plan {
    pub(super) messages: Vec<Message>,
    pub(super) channels: Vec<Channel>,
    pub(super) kinematics: Kinematics,
}

/// Compiles the configuration.
pub(super) fn plan(config: &OdometryConfig) -> Result<Plan, ConfigError> {
    check_buses(config)?;
    positive("max_speed_mps", config.max_speed_mps)?;
    positive("max_turn_rate_radps", config.max_turn_rate_radps)?;
    let mut planner = Planner::new(config)?;
    let kinematics = match (&config.wheels, &config.body) {
        (Some(wheels), None) => planner.wheels(wheels)?,
        (None, Some(body)) => planner.body(body)?,
        _ => {
            return Err(ConfigError::setting(
                "wheels",
                "give either [wheels] or [body], one of the two",
            ));
        }
    };
    Ok(Plan {
        messages: planner.messages,
        channels: planner.channels,
        kinematics,
    })
}

fn check_buses(config: &OdometryConfig) -> Result<(), ConfigError> {
    if (1..=256).contains(&config.buses.len()) {
        return Ok(());
    }
    Err(ConfigError::setting(
        "buses",
        "give at least one bus, for example [\"socketcan:can0\"]",
    ))
}

struct Planner<'a> {
    config: &'a OdometryConfig,
    database: Database,
    proofs: Vec<MessageConfig>,
    messages: Vec<Message>,
    channels: Vec<Channel>,
}

impl<'a> Planner<'a> {
    fn new(config: &'a OdometryConfig) -> Result<Self, ConfigError> {
        let database = Database::load(config.dbc.as_deref())?;
        let mut proofs = config.messages.clone();
        if config.dbc.is_none() {
            proofs.extend(MessageConfig::coloc());
        }
        for proof in &proofs {
            database.message(&proof.message)?;
        }
        Ok(Self {
            config,
            database,
            proofs,
            messages: Vec::new(),
            channels: Vec::new(),
        })
    }

    fn wheels(&mut self, wheels: &WheelsConfig) -> Result<Kinematics, ConfigError> {
        positive("wheels.track_m", wheels.track_m)?;
        self.wheel("wheels.left", &wheels.left)?;
        self.wheel("wheels.right", &wheels.right)?;
        Ok(Kinematics::Axle {
            track_m: wheels.track_m,
        })
    }

    fn wheel(&mut self, setting: &str, wheel: &WheelConfig) -> Result<(), ConfigError> {
        let limit = self.config.max_speed_mps;
        let scale = scale_of(setting, wheel)?;
        self.channel(
            setting,
            wheel.bus,
            &wheel.message,
            &wheel.signal,
            |signal| match wheel.quantity {
                Quantity::CumulativeTicks if !signal.is_integer() => Err(ConfigError::setting(
                    setting,
                    "cumulative ticks must be an integer signal, this one is a float",
                )),
                Quantity::CumulativeTicks => Ok(Measure::Counter(Counter::new(
                    signal.size(),
                    scale * signal.factor(),
                    limit,
                ))),
                _ => Ok(Measure::Rate { scale, limit }),
            },
        )
    }

    fn body(&mut self, body: &BodyConfig) -> Result<Kinematics, ConfigError> {
        let speed = |signal: &BodySignal<SpeedUnit>| match signal.unit {
            SpeedUnit::MetresPerSecond => 1.0,
            SpeedUnit::KilometresPerHour => MPS_PER_KMH,
        };
        let turn = match body.turn.unit {
            TurnUnit::RadiansPerSecond => 1.0,
            TurnUnit::DegreesPerSecond => 1.0_f64.to_radians(),
        };
        let (max_speed, max_turn) = (self.config.max_speed_mps, self.config.max_turn_rate_radps);
        self.rate(
            "body.forward",
            &body.forward,
            speed(&body.forward),
            max_speed,
        )?;
        self.rate("body.turn", &body.turn, turn, max_turn)?;
        if let Some(sideways) = &body.sideways {
            self.rate("body.sideways", sideways, speed(sideways), max_speed)?;
        }
        Ok(Kinematics::Body)
    }

    fn rate<U: Default>(
        &mut self,
        setting: &str,
        signal: &BodySignal<U>,
        scale: f64,
        limit: f64,
    ) -> Result<(), ConfigError> {
        let scale = if signal.reversed { -scale } else { scale };
        self.channel(setting, signal.bus, &signal.message, &signal.signal, |_| {
            Ok(Measure::Rate { scale, limit })
        })
    }

    fn channel(
        &mut self,
        setting: &str,
        bus: u8,
        message: &str,
        signal: &str,
        measure: impl FnOnce(&SignalDecoder) -> Result<Measure, ConfigError>,
    ) -> Result<(), ConfigError> {
        if usize::from(bus) >= self.config.buses.len() {
            let problem = format!(
                "there is no bus {bus}; 'buses' has {}, counted from 0",
                self.config.buses.len()
            );
            return Err(ConfigError::setting(format!("{setting}.bus"), problem));
        }
        let described = self.database.message(message)?;
        let decoder = self.database.signal(described, signal)?;
        let (id, guard) = (id_of(described)?, self.guard(described)?);
        let channel = self.channels.len();
        self.channels
            .push(Channel::new(decoder, measure(&decoder)?));
        match self
            .messages
            .iter_mut()
            .find(|known| known.bus == bus && known.id == id)
        {
            Some(known) => known.channels.push(channel),
            None => self.messages.push(Message {
                bus,
                id,
                guard,
                channels: vec![channel],
                last_ns: None,
            }),
        }
        Ok(())
    }

    fn guard(&self, message: &DbcMessage) -> Result<Guard, ConfigError> {
        let Some(proof) = self
            .proofs
            .iter()
            .find(|proof| proof.message == message.name)
        else {
            return Ok(Guard::new(None, None));
        };
        let signal = |name: &Option<String>| {
            name.as_ref()
                .map(|name| self.database.signal(message, name))
                .transpose()
        };
        let alive = signal(&proof.alive)?;
        let checksum = signal(&proof.checksum)?
            .map(|checksum| byte_of(message, &checksum))
            .transpose()?;
        Ok(Guard::new(alive, checksum))
    }
}

fn byte_of(message: &DbcMessage, checksum: &SignalDecoder) -> Result<usize, ConfigError> {
    let problem = "must be 8 bits that fill one byte";
    checksum.whole_byte().ok_or_else(|| {
        ConfigError::setting(format!("checksum of message {}", message.name), problem)
    })
}

const MPS_PER_KMH: f64 = 1.0 / 3.6;
const RADPS_PER_RPM: f64 = std::f64::consts::TAU / 60.0;

/// From the signal's unit to metres, or metres per second.
fn scale_of(setting: &str, wheel: &WheelConfig) -> Result<f64, ConfigError> {
    let radius_m = || required(setting, "wheel_radius_m", wheel.wheel_radius_m);
    let scale = match wheel.quantity {
        Quantity::CumulativeTicks => metres_per_tick(setting, wheel)?,
        Quantity::TicksPerPeriod => {
            metres_per_tick(setting, wheel)? / required(setting, "period_s", wheel.period_s)?
        }
        Quantity::MetresPerSecond => 1.0,
        Quantity::KilometresPerHour => MPS_PER_KMH,
        Quantity::RadiansPerSecond => radius_m()?,
        Quantity::RevolutionsPerMinute => radius_m()? * RADPS_PER_RPM,
    };
    Ok(if wheel.reversed { -scale } else { scale })
}

fn metres_per_tick(setting: &str, wheel: &WheelConfig) -> Result<f64, ConfigError> {
    match (
        wheel.metres_per_tick,
        wheel.wheel_radius_m,
        wheel.ticks_per_revolution,
    ) {
        (Some(metres), None, None) => positive(&format!("{setting}.metres_per_tick"), metres),
        (None, Some(radius_m), Some(ticks)) => {
            let radius_m = positive(&format!("{setting}.wheel_radius_m"), radius_m)?;
            Ok(std::f64::consts::TAU * radius_m
                / positive(&format!("{setting}.ticks_per_revolution"), ticks)?)
        }
        _ => Err(ConfigError::setting(
            setting,
            "give metres_per_tick, or wheel_radius_m and ticks_per_revolution",
        )),
    }
}

fn required(setting: &str, name: &str, value: Option<f64>) -> Result<f64, ConfigError> {
    let setting = format!("{setting}.{name}");
    value.map_or_else(
        || {
            Err(ConfigError::setting(
                setting.clone(),
                "is needed for this quantity",
            ))
        },
        |value| positive(&setting, value),
    )
}

fn positive(setting: &str, value: f64) -> Result<f64, ConfigError> {
    if value.is_finite() && value > 0.0 {
        return Ok(value);
    }
    Err(ConfigError::setting(
        setting,
        format!("is {value}; it must be a positive number"),
    ))
}
