//! A member of the team.
use coloc_shm_types::RobotName;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

use super::Moment;
use crate::keys::PublicKey;
use crate::kinds::Kind;

/// `[[member]]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Member {
    /// Its name, as in its own `[robot]`.
    #[serde(serialize_with = "write_name", deserialize_with = "read_name")]
    pub name: RobotName,
    /// Its number, as in its own `[robot]`.
    pub id: u16,
    /// What it is.
    pub role: Role,
    /// Its public key.
    pub key: PublicKey,
    /// The key that it will have; both are believed until the roster drops the first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next_key: Option<PublicKey>,
    /// Until when it is a member.
    pub expires: Moment,
    /// Where it is called, `host:port`; none if it only calls.
    #[serde(default)]
    pub addresses: Vec<String>,
    /// Names of the channels that it may say something on; without this, what its role may.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub says: Option<Vec<String>>,
}

/// What a member is.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// It speaks for itself.
    Robot,
    /// It listens.
    Station,
}

impl Member {
    /// Whether the key is its own, or will be.
    #[must_use]
    pub fn has(&self, key: &PublicKey) -> bool {
        self.keys().any(|own| own == key)
    }

    /// Its keys.
    pub fn keys(&self) -> impl Iterator<Item = &PublicKey> {
        [&self.key].into_iter().chain(&self.next_key)
    }

    /// Whether it may say that. Drivers' words never cross a network, whoever says them.
    #[must_use]
    pub fn may_say(&self, kind: &Kind) -> bool {
        if kind.is_a_drivers() {
            return false;
        }
        match &self.says {
            Some(names) => names.iter().any(|name| name == kind.told.name),
            None => self.role == Role::Robot,
        }
    }
}

fn write_name<S: Serializer>(name: &RobotName, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_str(name.as_str())
}

fn read_name<'de, D: Deserializer<'de>>(from: D) -> Result<RobotName, D::Error> {
    RobotName::new(&String::deserialize(from)?).map_err(de::Error::custom)
}
