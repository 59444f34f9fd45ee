//! A roster as text: the signature in the first line, TOML behind it.
use std::collections::BTreeSet;

use ed25519_dalek::{Signature, Signer};

use super::{FORMAT, Roster};
use crate::keys::{Identity, PublicKey, hex, unhex};
use crate::kinds::Kind;
use crate::wire;

/// What is signed begins with this, so that nothing else that the key might sign is a roster.
const CONTEXT: &[u8] = b"coloc roster\n";

/// Why a text is no roster of this team.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RosterError {
    /// It does not begin with a signature.
    #[error("the roster does not begin with a line `signature = \"...\"`")]
    NotSigned,
    /// Somebody else signed it, or it was changed since.
    #[error(
        "the roster is not signed by the team's key {team}, or was changed since: sign it anew with `coloc-link fleet`"
    )]
    BadSignature {
        /// The key that it was held against.
        team: String,
    },
    /// It cannot be read.
    #[error("the roster cannot be read: {0}")]
    Unreadable(String),
    /// It contradicts itself.
    #[error("the roster contradicts itself: {0}")]
    Contradiction(String),
    /// It is written in a newer way.
    #[error("the roster is of format {0}, and this program reads {FORMAT}: update it")]
    Format(u32),
    /// It is too large to be handed on.
    #[error("the roster is longer than {} bytes", Roster::LONGEST)]
    TooLong,
}

impl Roster {
    /// The longest text of a roster: it is handed on in one message (bytes).
    pub const LONGEST: usize = wire::LARGEST - wire::Envelope::AROUND;

    /// Reads a roster that the key `team` has signed. Nothing of the text is looked at before the signature is.
    ///
    /// # Errors
    /// Why it is none.
    pub fn verify(text: &str, team: &PublicKey) -> Result<Self, RosterError> {
        if text.len() > Self::LONGEST {
            return Err(RosterError::TooLong);
        }
        let (first, signed) = text.split_once('\n').ok_or(RosterError::NotSigned)?;
        let signature = first
            .trim_end()
            .strip_prefix("signature = \"")
            .and_then(|rest| unhex(rest.strip_suffix('"')?))
            .ok_or(RosterError::NotSigned)?;
        let key = team.verifier();
        let good = key.is_some_and(|key| {
            key.verify_strict(&message(signed), &Signature::from_bytes(&signature))
                .is_ok()
        });
        if !good {
            let team = team.to_string();
            return Err(RosterError::BadSignature { team });
        }
        Self::parse(signed, team)
    }

    fn parse(signed: &str, team: &PublicKey) -> Result<Self, RosterError> {
        let unreadable = |error: toml::de::Error| RosterError::Unreadable(error.to_string());
        let format: Format = toml::from_str(signed).map_err(unreadable)?;
        if format.format != FORMAT {
            return Err(RosterError::Format(format.format));
        }
        let roster: Self = toml::from_str(signed).map_err(unreadable)?;
        if roster.team != *team {
            return Err(contradiction("it is of another team than its signature"));
        }
        roster.check()?;
        Ok(roster)
    }

    /// That no two members share a name, a number or a key, and so on.
    ///
    /// # Errors
    /// [`RosterError::Contradiction`].
    pub fn check(&self) -> Result<(), RosterError> {
        let mut names = BTreeSet::new();
        let mut numbers = BTreeSet::new();
        let mut keys = BTreeSet::new();
        for member in &self.member {
            let name = &member.name;
            if !names.insert(name) || !numbers.insert(member.id) {
                return Err(contradiction(&format!(
                    "two members are {name} or have the number {}",
                    member.id
                )));
            }
            if member.id == wire::EVERYBODY {
                return Err(contradiction(&format!(
                    "{name} has the number {}, which means everybody",
                    member.id
                )));
            }
            if !member
                .keys()
                .all(|key| *key != self.team && keys.insert(*key))
            {
                return Err(contradiction(&format!(
                    "somebody else has a key of {name} too"
                )));
            }
            let says = member.says.iter().flatten();
            if let Some(unknown) = says.clone().find(|says| !is_a_channel(says)) {
                return Err(contradiction(&format!(
                    "{name} says {unknown:?}, and there is no such channel for a network"
                )));
            }
        }
        if let Some(leader) = self.leaders.iter().find(|it| self.named(it).is_none()) {
            return Err(contradiction(&format!("{leader} leads and is no member")));
        }
        if self
            .periods
            .values()
            .any(|period| !period.is_finite() || *period <= 0.0)
        {
            return Err(contradiction("a period is not above zero"));
        }
        Ok(())
    }

    /// Its text, signed by the team's key.
    ///
    /// # Errors
    /// If it contradicts itself, is too long, or of another team.
    pub fn sign(&self, team: &Identity) -> Result<String, RosterError> {
        if team.public() != self.team {
            return Err(contradiction("the key is of another team"));
        }
        self.check()?;
        let body =
            toml::to_string(self).map_err(|error| RosterError::Unreadable(error.to_string()))?;
        let signature = team.signing().sign(&message(&body));
        let text = format!("signature = \"{}\"\n{body}", hex(&signature.to_bytes()));
        if text.len() > Self::LONGEST {
            return Err(RosterError::TooLong);
        }
        Ok(text)
    }
}

#[derive(serde::Deserialize)]
struct Format {
    format: u32,
}

fn message(signed: &str) -> Vec<u8> {
    [CONTEXT, signed.as_bytes()].concat()
}

/// A name that a later version knows is no contradiction here: what this one does not know nobody can say to it. Drivers' are.
fn is_a_channel(name: &str) -> bool {
    Kind::of_name(name).is_none_or(|kind| !kind.is_a_drivers())
}

fn contradiction(what: &str) -> RosterError {
    RosterError::Contradiction(what.into())
}
