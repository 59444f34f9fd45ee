//! The newest roster: who is let in by it, where newer ones come from, and what one that is in force changes.
use std::sync::{Arc, PoisonError, RwLock};

use coloc_shm_types::private::OwnFile;

use super::office::{Office, now};
use crate::engine::Closing;
use crate::keys::PublicKey;
use crate::roster::{Moment, Offer, Roster};
use crate::tls::Members;

/// Who is let in: the members of the newest roster, but for the robot itself.
#[derive(Debug)]
pub struct Team {
    roster: RwLock<Arc<Roster>>,
    own: u16,
}

impl Team {
    pub(super) fn of(roster: Arc<Roster>, own: u16) -> Self {
        Self {
            roster: RwLock::new(roster),
            own,
        }
    }

    pub(super) fn newest(&self) -> Arc<Roster> {
        let roster = self.roster.read().unwrap_or_else(PoisonError::into_inner);
        Arc::clone(&roster)
    }

    fn set(&self, newer: Arc<Roster>) {
        *self.roster.write().unwrap_or_else(PoisonError::into_inner) = newer;
    }
}

impl Members for Team {
    fn admits(&self, key: &PublicKey) -> bool {
        let roster = self.newest();
        let owner = roster.owner(key).filter(|owner| owner.id != self.own);
        owner.is_some_and(|owner| {
            roster
                .standing(owner.id, Moment::of_ns(now().wall_ns))
                .is_ok()
        })
    }
}

impl Office {
    /// Takes a roster that somebody offers; whether it is in force now.
    pub(super) fn offer(&mut self, text: &str, by: &str) -> bool {
        match self.book.offer(text) {
            Ok(Offer::Newer) => {
                self.remember();
                self.apply();
                let version = self.book.roster().version;
                self.teller
                    .remark(format!("roster {version} is in force, from {by}"));
                true
            }
            Ok(Offer::Another) => {
                self.teller.remark(format!(
                    "{by} has another roster with the version of this one: sign a newer one"
                ));
                false
            }
            Ok(Offer::Same | Offer::Old) => false,
            Err(error) => {
                self.teller.remark(format!("{by}: {error}"));
                false
            }
        }
    }

    /// Writes the roster down, so that the next start begins with it.
    fn remember(&mut self) {
        self.fleet_text = self.book.text().into();
        let text = self.fleet_text.clone();
        let written = OwnFile::named(&self.fleet).and_then(|file| file.replace(text.as_bytes()));
        if let Err(error) = written {
            self.teller
                .remark(format!("the roster cannot be written: {error}"));
        }
    }

    /// The roster decides, also over connections that are up.
    fn apply(&mut self) {
        let roster = Arc::new(self.book.roster().clone());
        self.team.set(Arc::clone(&roster));
        self.rules.datum = roster.datum_fingerprint();
        self.rules.periods = roster.periods_fingerprint();
        self.admission.set_rules(self.rules.clone());
        self.admission.forget_strangers(&roster);
        self.found.tidy(&roster);
        self.dismiss();
        let gone = |id: &u16| roster.member(*id).is_none();
        self.mouths.retain(|(speaker, _), _| !gone(speaker));
    }

    /// Ends connections of those who are no members any more.
    pub(super) fn dismiss(&mut self) {
        let team = Arc::clone(&self.team);
        let teller = &mut self.teller;
        self.members.retain(|_, member| {
            let stays = team.admits(member.line.key());
            if !stays {
                let lines = member.spare.iter().chain([&member.line]);
                lines.for_each(|line| line.close(Closing::Revoked));
                teller.remark(format!("{} is no member any more", member.name));
            }
            stays
        });
    }

    /// A file that somebody has exchanged is a roster that is offered.
    pub(super) fn look_at_the_file(&mut self) {
        let read = std::fs::read_to_string(&self.fleet);
        let Ok(text) = read else { return };
        if text != self.fleet_text && text.len() <= Roster::LONGEST {
            self.fleet_text.clone_from(&text);
            if self.offer(&text, "the file") {
                self.hand_on_the_roster();
            }
        }
    }
}
