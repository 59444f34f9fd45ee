//! The newest roster that a robot has seen, and what becomes of others that it is offered.
use super::{Roster, RosterError};
use crate::keys::PublicKey;

/// The newest roster, with its text to hand on.
#[derive(Clone, Debug)]
pub struct Book {
    team: PublicKey,
    text: String,
    roster: Roster,
}

/// What became of a roster that was offered.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Offer {
    /// It is in force from now on.
    Newer,
    /// It is the one in force.
    Same,
    /// It is older, and refused: who offers it wants the newer one.
    Old,
    /// It has the same version and says something else: two people have changed the team at once. Refused.
    Another,
}

impl Book {
    /// Opens it with the roster in `text`, which `team` must have signed.
    ///
    /// # Errors
    /// Why it is none.
    pub fn open(text: String, team: PublicKey) -> Result<Self, RosterError> {
        let roster = Roster::verify(&text, &team)?;
        Ok(Self { team, text, roster })
    }

    /// Takes a roster if it is newer.
    ///
    /// # Errors
    /// Why it is none of this team.
    pub fn offer(&mut self, text: &str) -> Result<Offer, RosterError> {
        if text == self.text {
            return Ok(Offer::Same);
        }
        let offered = Roster::verify(text, &self.team)?;
        if offered.version < self.roster.version {
            return Ok(Offer::Old);
        }
        if offered.version == self.roster.version {
            return Ok(Offer::Another);
        }
        self.roster = offered;
        text.clone_into(&mut self.text);
        Ok(Offer::Newer)
    }

    /// The roster in force.
    #[must_use]
    pub const fn roster(&self) -> &Roster {
        &self.roster
    }

    /// Its text, to hand on.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The team's key.
    #[must_use]
    pub const fn team(&self) -> &PublicKey {
        &self.team
    }
}
