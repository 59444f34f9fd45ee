//! From what a person wrote to what the decoder runs: every name looked up, every number checked.

use crate::can::Id;
use crate::database::{Database, DbcMessage};
use crate::signal::SignalDecoder;

use super::channel::{Channel, Measure};
use super::config::{
    BodyConfig, BodySignal, ConfigError, MessageConfig, OdometryConfig, Quantity, SpeedUnit,
    TurnUnit, WheelConfig, WheelsConfig,
};
use super::counter::{Counter, Counts};
use super::decoder::Message;
use super::description::{self, Description};
use super::guard::Guard;
use super::kinematics::Kinematics;
use super::unit::{Meaning, Unit};

/// Everything that a decoder needs.
#[derive(Debug)]
pub(super) struct Plan {
    pub(super) messages: Vec<Message>,
    pub(super) channels: Vec<Channel>,
    pub(super) kinematics: Kinematics,
    pub(super) description: Description,
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
        description: planner.description,
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
    taken: Vec<Taken>,
    description: Description,
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
            taken: Vec::new(),
            description: Description::default(),
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
        let scale = scale_of(setting, wheel)?;
        let source = Source {
            setting,
            bus: wheel.bus,
            message: &wheel.message,
            signal: &wheel.signal,
        };
        let found = self.find(&source)?;
        agree(&source, "quantity", &found.unit, wheel.quantity)?;
        let measure = match wheel.quantity {
            Quantity::CumulativeTicks => self.counter(setting, wheel, &found.decoder, scale)?,
            _ if wheel.modulus.is_some() => {
                let problem = "is for cumulative_ticks only";
                return Err(ConfigError::setting(format!("{setting}.modulus"), problem));
            }
            _ => Measure::Rate {
                scale,
                limit: self.config.max_speed_mps,
            },
        };
        self.add(&source, &found, measure, wheel.quantity.word())
    }

    fn counter(
        &mut self,
        setting: &str,
        wheel: &WheelConfig,
        signal: &SignalDecoder,
        scale: f64,
    ) -> Result<Measure, ConfigError> {
        let limit = self.config.max_speed_mps;
        let counts = counts(setting, wheel, signal)?;
        let metres_per_count = scale * signal.factor();
        let fastest_mps = Counter::fastest_mps(counts, metres_per_count);
        if limit >= fastest_mps {
            let problem = format!(
                "is {limit}; {setting} has {} counts of {} m, too few to tell forwards from backwards between frames \
                 20 ms apart and up to 50 ms late: give less than {fastest_mps:.4}",
                counts.number(),
                metres_per_count.abs()
            );
            return Err(ConfigError::setting("max_speed_mps", problem));
        }
        Ok(Measure::Counter(Counter::new(
            counts,
            metres_per_count,
            limit,
        )))
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

    fn rate<U: Default + Meaning>(
        &mut self,
        setting: &str,
        signal: &BodySignal<U>,
        scale: f64,
        limit: f64,
    ) -> Result<(), ConfigError> {
        let source = Source {
            setting,
            bus: signal.bus,
            message: &signal.message,
            signal: &signal.signal,
        };
        let found = self.find(&source)?;
        agree(&source, "unit", &found.unit, signal.unit)?;
        let scale = if signal.reversed { -scale } else { scale };
        self.add(
            &source,
            &found,
            Measure::Rate { scale, limit },
            signal.unit.word(),
        )
    }

    fn find(&self, source: &Source) -> Result<Found, ConfigError> {
        let buses = self.config.buses.len();
        if usize::from(source.bus) >= buses {
            let problem = format!(
                "there is no bus {}; 'buses' has {buses}, counted from 0",
                source.bus
            );
            return Err(ConfigError::setting(
                format!("{}.bus", source.setting),
                problem,
            ));
        }
        let message = self.database.message(source.message)?;
        Ok(Found {
            id: message.id()?,
            decoder: self.database.signal(message, source.signal)?,
            unit: message.signal(source.signal)?.unit.clone(),
        })
    }

    fn add(
        &mut self,
        source: &Source,
        found: &Found,
        measure: Measure,
        meaning: &str,
    ) -> Result<(), ConfigError> {
        self.take_bits(source, found)?;
        self.describe(source, found, &measure, meaning)?;
        let guard = self.guard(source, found)?;
        let (bus, id, channel) = (source.bus, found.id, self.channels.len());
        self.channels.push(Channel::new(found.decoder, measure));
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

    /// Two things that are the same bits are a mistake.
    fn take_bits(&mut self, source: &Source, found: &Found) -> Result<(), ConfigError> {
        let place = (source.bus, found.id);
        let same = |taken: &&Taken| taken.place == place && taken.decoder.overlaps(&found.decoder);
        if let Some(taken) = self.taken.iter().find(same) {
            let problem = format!(
                "signal {} of message {} is made of the same bits as that of {}",
                source.signal, source.message, taken.setting
            );
            return Err(ConfigError::setting(source.setting, problem));
        }
        self.taken.push(Taken {
            setting: source.setting.to_owned(),
            place,
            decoder: found.decoder,
        });
        Ok(())
    }

    fn describe(
        &mut self,
        source: &Source,
        found: &Found,
        measure: &Measure,
        meaning: &str,
    ) -> Result<(), ConfigError> {
        let signal = self
            .database
            .message(source.message)?
            .signal(source.signal)?;
        let place = (source.message, found.id, source.bus);
        let line = description::line(source.setting, place, signal, &found.decoder, meaning);
        self.description.signals.push(line);
        if is_placeholder(found.id) {
            self.description.warn(format!(
                "message {}: its identifier ends in FE, in J1939 the address of nobody; frames are taken whose identifier is \
                 equal in every bit: put the sender's address in its place",
                source.message
            ));
        }
        if let (Measure::Rate { scale, limit }, Some(range)) = (measure, found.decoder.range()) {
            self.warn_of_range(source.setting, range.map(|end| end * scale), *limit);
        }
        Ok(())
    }

    /// A range that leaves out what the robot can do makes odometry stop just then.
    fn warn_of_range(&mut self, setting: &str, [a, b]: [f64; 2], limit: f64) {
        let (lowest, highest) = (a.min(b), a.max(b));
        if lowest >= 0.0 || highest <= 0.0 {
            self.description.warn(format!(
                "{setting}: its range in the DBC file leaves one direction out ({lowest:.3} to {highest:.3} m/s or rad/s): \
                 no odometry while the robot moves that way"
            ));
        }
        if highest.max(-lowest) < limit {
            self.description.warn(format!(
                "{setting}: its range in the DBC file ends at {:.3}, below the limit of {limit}",
                highest.max(-lowest)
            ));
        }
    }

    fn guard(&mut self, source: &Source, found: &Found) -> Result<Guard, ConfigError> {
        let message = self.database.message(source.message)?;
        let Some(proof) = self
            .proofs
            .iter()
            .find(|proof| proof.message == message.name())
        else {
            return Ok(Guard::new(None, None));
        };
        let signal = |name: &Option<String>| {
            name.as_ref()
                .map(|name| self.database.signal(message, name))
                .transpose()
        };
        let (alive, checksum) = (signal(&proof.alive)?, signal(&proof.checksum)?);
        if let Some(alive) = &alive {
            check_alive(message, alive, found)?;
        }
        let byte = checksum
            .map(|checksum| byte_of(message, &checksum))
            .transpose()?;
        let size = alive.map_or(0, |alive| alive.size());
        if size > USUAL_ALIVE_BITS {
            self.description.warn(format!(
                "alive of message {}: has {size} bits; counters of frames usually have 2 to 8: is it one?",
                source.message
            ));
        }
        Ok(Guard::new(alive, byte))
    }
}

/// J1939 has the sender's address in the last byte, and many DBC files what stands for none.
fn is_placeholder(id: Id) -> bool {
    matches!(id, Id::Extended(id) if id.as_raw() & 0xFF == 0xFE)
}

/// A setting and the signal that it names.
struct Source<'a> {
    setting: &'a str,
    bus: u8,
    message: &'a str,
    signal: &'a str,
}

/// What the DBC file says of that signal.
struct Found {
    id: Id,
    decoder: SignalDecoder,
    unit: String,
}

/// Bits that have a meaning already.
struct Taken {
    setting: String,
    place: (u8, Id),
    decoder: SignalDecoder,
}

/// More is possible and unlikely.
const USUAL_ALIVE_BITS: u32 = 8;

/// More is something else.
const MOST_ALIVE_BITS: u32 = 32;

fn check_alive(
    message: &DbcMessage,
    alive: &SignalDecoder,
    found: &Found,
) -> Result<(), ConfigError> {
    let problem = if !alive.is_integer() || alive.size() > MOST_ALIVE_BITS {
        "must be an integer of at most 32 bits that counts the frames"
    } else if alive.overlaps(&found.decoder) {
        "is made of the same bits as the signal that it shall guard"
    } else {
        return Ok(());
    };
    Err(ConfigError::setting(
        format!("alive of message {}", message.name()),
        problem,
    ))
}

/// The DBC file must not contradict what the signal is taken for.
fn agree(source: &Source, key: &str, unit: &str, meaning: impl Meaning) -> Result<(), ConfigError> {
    if Unit::of(unit).is_none_or(|unit| meaning.allows(unit)) {
        return Ok(());
    }
    let problem = format!(
        "is {}, but the DBC file gives signal {} of message {} the unit '{unit}': one of the two is wrong",
        meaning.word(),
        source.signal,
        source.message
    );
    Err(ConfigError::setting(
        format!("{}.{key}", source.setting),
        problem,
    ))
}

/// Which counts a counter has. The DBC file's range alone is no proof of where it wraps.
fn counts(
    setting: &str,
    wheel: &WheelConfig,
    signal: &SignalDecoder,
) -> Result<Counts, ConfigError> {
    if !signal.is_integer() {
        return Err(ConfigError::setting(
            setting,
            "cumulative ticks must be an integer signal, this one is a float",
        ));
    }
    let all = Counts {
        bits: signal.size(),
        signed: signal.is_signed(),
        modulus: None,
        range: None,
    };
    if let Some(modulus) = wheel.modulus {
        return with_modulus(setting, all, modulus);
    }
    let Some((lowest, highest)) = signal.raw_range() else {
        return Ok(all);
    };
    let number = u64::try_from(highest - lowest + 1).unwrap_or(u64::MAX);
    let missing = (1_i128 << all.bits) - i128::from(number);
    if missing > FEW_CODES || number < ENOUGH_COUNTS {
        if is_rounding(missing, all.bits) {
            return Ok(all);
        }
        let problem = format!(
            "give how many different counts the {} bits of signal {} have: {number} if they wrap after {highest}, as its \
             range in the DBC file may mean, {} if they use every bit",
            all.bits,
            wheel.signal,
            1_i128 << all.bits
        );
        return Err(ConfigError::setting(format!("{setting}.modulus"), problem));
    }
    Ok(Counts {
        modulus: Some(number),
        range: Some((lowest, highest)),
        ..all
    })
}

/// A range that leaves out so few counts leaves out codes, such as "not available": whether the counter wraps before or
/// behind them is a count or two a turn ...
const FEW_CODES: i128 = 2;

/// ... of so many, less than any wheel slips.
const ENOUGH_COUNTS: u64 = 20_000;

/// Whether a range was written with six digits, as in `[0|4.29496E+009]`.
fn is_rounding(missing: i128, bits: u32) -> bool {
    missing > 0 && missing.saturating_mul(200_000) <= 1_i128 << bits
}

fn with_modulus(setting: &str, all: Counts, modulus: u64) -> Result<Counts, ConfigError> {
    let most = 1_i128 << all.bits;
    if !(2..=most).contains(&i128::from(modulus)) {
        let problem = format!(
            "is {modulus}; the signal's {} bits have 2 to {most} counts",
            all.bits
        );
        return Err(ConfigError::setting(format!("{setting}.modulus"), problem));
    }
    if i128::from(modulus) == most {
        return Ok(all);
    }
    Ok(Counts {
        modulus: Some(modulus),
        range: (!all.signed).then_some((0, i128::from(modulus) - 1)),
        ..all
    })
}

fn byte_of(message: &DbcMessage, checksum: &SignalDecoder) -> Result<usize, ConfigError> {
    let problem = "must be 8 bits that fill one byte";
    checksum.whole_byte().ok_or_else(|| {
        ConfigError::setting(format!("checksum of message {}", message.name()), problem)
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
