//! What is planned, signal by signal.

use crate::can::Id;
use crate::config_error::ConfigError;
use crate::database::Database;
use crate::signal::SignalDecoder;

use super::super::channel::{Channel, Measure};
use super::super::config::{MessageConfig, OdometryConfig};
use super::super::description::{Description, Expected, SignalDescription};
use super::super::message::Message;
use super::super::said::Carried;
use super::period::Period;
use super::reach::{self, Reach};
use super::source::{Found, Source};
use super::{proof, unlikely};

/// What has been planned so far.
pub(super) struct Planner<'a> {
    pub(super) config: &'a OdometryConfig,
    database: &'a Database,
    proofs: Vec<MessageConfig>,
    messages: Vec<Message>,
    channels: Vec<Channel>,
    pub(super) counters: Vec<Reach>,
    taken: Vec<Taken>,
    pub(super) description: Description,
}

/// Bits that have a meaning already.
struct Taken {
    setting: String,
    place: (u8, Id),
    decoder: SignalDecoder,
}

/// What a signal is, for the decoder and in words.
pub(super) struct Role {
    pub(super) measure: Measure,
    pub(super) meaning: String,
    pub(super) period: Period,
}

impl<'a> Planner<'a> {
    pub(super) fn new(
        config: &'a OdometryConfig,
        database: &'a Database,
    ) -> Result<Self, ConfigError> {
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
            counters: Vec::new(),
            taken: Vec::new(),
            description: Description::default(),
        })
    }

    /// A velocity, one unit of which is worth `scale`; its meaning is left open.
    pub(super) fn rate(
        &mut self,
        source: &Source,
        found: &Found,
        scale: f64,
        limit: f64,
        period_s: Option<f64>,
    ) -> Result<Role, ConfigError> {
        let period = Period::of(period_s, found.message);
        let longest_s = self.config.tolerance.longest_rate_s;
        reach::check_rate(source.setting, period, longest_s)?;
        self.description.warn(unlikely::of_rate(
            source.setting,
            &found.decoder,
            scale,
            limit,
        ));
        Ok(Role {
            measure: Measure::Rate {
                scale,
                limit,
                longest_s,
            },
            meaning: String::new(),
            period,
        })
    }

    /// What the DBC file says of a signal.
    pub(super) fn find(&self, source: &Source) -> Result<Found<'a>, ConfigError> {
        Found::look_up(source, self.database, self.config.buses.len())
    }

    /// Has the decoder read a signal.
    pub(super) fn add(
        &mut self,
        source: &Source,
        found: &Found,
        role: Role,
    ) -> Result<(), ConfigError> {
        self.take_bits(source, found)?;
        let proof = proof::of(self.database, &self.proofs, found.message, &found.decoder)?;
        self.description.warn(proof.warning);
        self.description.signals.push(SignalDescription {
            setting: source.setting.to_owned(),
            place: found.place.clone(),
            meaning: role.meaning,
            rhythm: role.period.describe(),
            proof: proof.description,
        });
        let carried = Carried {
            channel: self.channels.len(),
            signal: found.decoder,
            counts: matches!(role.measure, Measure::Counter(_)),
        };
        self.channels.push(Channel::new(role.measure));
        let (bus, id) = (source.bus, found.id);
        let known = |known: &&mut Message| known.bus == bus && known.id == id;
        if let Some(known) = self.messages.iter_mut().find(known) {
            known.signals.push(carried);
            return Ok(());
        }
        self.description.expected.push(Expected {
            bus,
            id,
            message: source.message.to_owned(),
            period_us: role.period.us(),
        });
        self.messages.push(Message {
            bus,
            id,
            guard: proof.guard,
            period_us: role.period.us(),
            signals: vec![carried],
            last_ns: None,
            heard: 0,
        });
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

    /// What the decoder needs, and what there is to say about it.
    pub(super) fn finish(mut self) -> (Vec<Message>, Vec<Channel>, Description) {
        let (config, expected) = (self.config, &self.description.expected);
        let unlikely = [
            unlikely::of_robot(config),
            unlikely::of_identifiers(expected, config.buses.len()),
        ];
        self.description.warn(unlikely.concat());
        (self.messages, self.channels, self.description)
    }
}
