//! The roster: who the team is. One file, `fleet.toml`, signed by the team's key, which the links hand on to one another.
//!
//! * The newest roster decides, at once: who is not in it is nobody, also on a connection that is up.
//! * It says of each member its key, its role, what it may say and until when. A member's new key stands beside its old one until the
//!   robot has it: so nothing is ever without a key that others know.
//! * Its first line is the signature of all bytes behind that line. What is verified is what is read.

mod book;
mod member;
mod moment;
mod signed;

use std::collections::BTreeMap;

use coloc_shm_types::RobotName;
use serde::{Deserialize, Serialize};

use crate::keys::PublicKey;

pub use book::{Book, Offer};
pub use member::{Member, Role};
pub use moment::Moment;
pub use signed::RosterError;

/// The file of the roster in a robot's directory.
pub const FLEET: &str = "fleet.toml";

/// Version of the way in which rosters are written: what reads an older one reads no newer one.
pub const FORMAT: u32 = 1;

/// Who the team is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Roster {
    /// [`FORMAT`].
    pub format: u32,
    /// Counts from 1; a newer roster has a higher one.
    pub version: u32,
    /// What the team is called.
    pub name: String,
    /// The key that signs its rosters.
    pub team: PublicKey,
    /// When this version was signed. A robot whose clock says less has a wrong clock.
    pub issued: Moment,
    /// The frame that all poses are in, as a word or as the datum of the receivers; those of another frame are refused.
    pub datum: String,
    /// Periods that all have to share, by name \[s\].
    #[serde(default)]
    pub periods: BTreeMap<String, f64>,
    /// Robots that lead.
    #[serde(default)]
    pub leaders: Vec<String>,
    /// Everybody.
    #[serde(default)]
    pub member: Vec<Member>,
}

/// What is wrong with a member at this moment.
#[derive(Copy, Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Standing {
    /// It is not in the roster: it never was, or it was revoked.
    #[error("it is not in the roster")]
    Unknown,
    /// Its time is over.
    #[error("its time in the roster is over")]
    Expired,
}

/// By how much the operator's clock may be ahead of a robot's before that one's is called wrong (s).
const AHEAD_S: i64 = 600;

impl Roster {
    /// One of nobody yet.
    #[must_use]
    pub fn begin(team: PublicKey, now: Moment) -> Self {
        Self {
            format: FORMAT,
            version: 1,
            name: String::new(),
            team,
            issued: now,
            datum: String::new(),
            periods: BTreeMap::new(),
            leaders: Vec::new(),
            member: Vec::new(),
        }
    }

    /// The member with that number.
    #[must_use]
    pub fn member(&self, id: u16) -> Option<&Member> {
        self.member.iter().find(|member| member.id == id)
    }

    /// The member with that name.
    #[must_use]
    pub fn named(&self, name: &str) -> Option<&Member> {
        self.member
            .iter()
            .find(|member| member.name.as_str() == name)
    }

    /// The member whose key it is, or will be.
    #[must_use]
    pub fn owner(&self, key: &PublicKey) -> Option<&Member> {
        self.member.iter().find(|member| member.has(key))
    }

    /// The member with that number, if its time is not over at `now`.
    ///
    /// Where the own clock is known to be wrong ([`Self::clock_is_wrong`]) no time is over: that is the clock's fault, and nobody's
    /// else.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn standing(&self, id: u16, now: Moment) -> Result<&Member, Standing> {
        let member = self.member(id).ok_or(Standing::Unknown)?;
        if now > member.expires {
            return Err(Standing::Expired);
        }
        Ok(member)
    }

    /// Whether a clock that says `now` must be wrong: the roster was signed later than that. So is that of a computer without a
    /// real-time clock until it has heard of the time.
    #[must_use]
    pub fn clock_is_wrong(&self, now: Moment) -> bool {
        now.seconds().saturating_add(AHEAD_S) < self.issued.seconds()
    }

    /// Whether the robot of that name leads.
    #[must_use]
    pub fn leads(&self, name: &RobotName) -> bool {
        self.leaders.iter().any(|leader| leader == name.as_str())
    }

    /// [`fingerprint`] of the frame.
    #[must_use]
    pub fn datum_fingerprint(&self) -> u64 {
        fingerprint(&self.datum)
    }

    /// [`fingerprint`] of the periods.
    #[must_use]
    pub fn periods_fingerprint(&self) -> u64 {
        let mut text = String::new();
        for (name, period) in &self.periods {
            text.extend([name, "=", &period.to_string(), ";"]);
        }
        fingerprint(&text)
    }
}

/// 64 bits that two texts hardly share by accident (FNV-1a): for telling that two robots were configured differently, not for
/// security.
#[must_use]
pub fn fingerprint(text: &str) -> u64 {
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

#[cfg(test)]
pub(crate) mod tests;
