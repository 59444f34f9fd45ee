//! Alive counter and checksum of a message: what shows that its frames are new and whole.

use crate::config_error::ConfigError;
use crate::database::{Database, DbcMessage};
use crate::signal::SignalDecoder;

use super::super::config::MessageConfig;
use super::super::guard::Guard;

/// What is checked of every frame of a message.
pub(super) struct Proof {
    pub(super) guard: Guard,
    /// In words.
    pub(super) description: String,
    pub(super) warning: Option<String>,
}

/// More is possible and unlikely.
const USUAL_ALIVE_BITS: std::ops::RangeInclusive<u32> = 2..=8;

/// More is something else.
const MOST_ALIVE_BITS: u32 = 32;

/// What `proofs` say of `message`, one of whose signals is `guarded`.
pub(super) fn of(
    database: &Database,
    proofs: &[MessageConfig],
    message: &DbcMessage,
    guarded: &SignalDecoder,
) -> Result<Proof, ConfigError> {
    let none = MessageConfig {
        message: message.name().to_owned(),
        alive: None,
        checksum: None,
    };
    let mut named = proofs
        .iter()
        .filter(|proof| proof.message == message.name());
    let proof = named.next().unwrap_or(&none);
    if named.next().is_some() {
        let problem = format!(
            "message {} is there twice: write both into one",
            message.name()
        );
        return Err(ConfigError::setting("messages", problem));
    }
    let signal = |name: &Option<String>| {
        let decoder = name.as_ref().map(|name| database.signal(message, name));
        decoder.transpose()
    };
    let (alive, checksum) = (signal(&proof.alive)?, signal(&proof.checksum)?);
    let alive = alive.map(|alive| check_alive(message, alive, guarded));
    let alive = alive.transpose()?;
    let byte = checksum.map(|checksum| byte_of(message, &checksum, guarded, alive.as_ref()));
    let byte = byte.transpose()?;
    Ok(Proof {
        guard: Guard::new(alive, byte),
        description: describe(proof, alive.as_ref(), byte),
        warning: alive.and_then(|alive| unlikely(message, &alive)),
    })
}

fn check_alive(
    message: &DbcMessage,
    alive: SignalDecoder,
    guarded: &SignalDecoder,
) -> Result<SignalDecoder, ConfigError> {
    let problem = if !alive.is_integer() || alive.size() > MOST_ALIVE_BITS {
        "must be an integer of at most 32 bits that counts the frames"
    } else if alive.overlaps(guarded) {
        "is made of the same bits as the signal that it shall guard"
    } else {
        return Ok(alive);
    };
    let setting = format!("alive of message {}", message.name());
    Err(ConfigError::setting(setting, problem))
}

fn byte_of(
    message: &DbcMessage,
    checksum: &SignalDecoder,
    guarded: &SignalDecoder,
    alive: Option<&SignalDecoder>,
) -> Result<usize, ConfigError> {
    let refused = |problem: &str| {
        let setting = format!("checksum of message {}", message.name());
        ConfigError::setting(setting, problem)
    };
    let byte = checksum.whole_byte();
    let byte = byte.ok_or_else(|| refused("must be 8 bits that fill one byte"))?;
    if checksum.overlaps(guarded) || alive.is_some_and(|alive| checksum.overlaps(alive)) {
        return Err(refused("is made of bits that it shall guard"));
    }
    if byte <= guarded.last_byte() {
        return Err(refused(
            "covers the bytes before it, and the signal that it shall guard is not among them",
        ));
    }
    Ok(byte)
}

fn unlikely(message: &DbcMessage, alive: &SignalDecoder) -> Option<String> {
    let (name, size) = (message.name(), alive.size());
    (!USUAL_ALIVE_BITS.contains(&size)).then(|| {
        format!(
            "alive of message {name}: has {size} bits; counters of frames usually have 2 to 8: is it one?"
        )
    })
}

fn describe(proof: &MessageConfig, alive: Option<&SignalDecoder>, byte: Option<usize>) -> String {
    let name = |name: &Option<String>| name.clone().unwrap_or_default();
    let alive = alive.map_or(
        "no alive counter: a repeated frame counts as a new one".into(),
        |alive| {
            format!(
                "alive counter {}, {} bits",
                name(&proof.alive),
                alive.size()
            )
        },
    );
    let checksum = byte.map_or("no checksum: a garbled frame counts".into(), |byte| {
        format!(
            "checksum {} in byte {byte}, CRC-8 SAE J1850 over identifier and bytes before it",
            name(&proof.checksum)
        )
    });
    format!("{alive}; {checksum}")
}
