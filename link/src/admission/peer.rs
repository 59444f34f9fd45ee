//! What is remembered of a peer.
use std::collections::BTreeMap;

use ed25519_dalek::VerifyingKey;

use super::window::Window;
use super::{Counts, Now, Refusal, Rules, Word};
use crate::clock_offset::{ClockOffset, Correction, Offset};
use crate::keys::PublicKey;
use crate::roster::{Moment, Roster};
use crate::wire::{ClockWord, Envelope, Hello, Parsed, word};

/// What is remembered of a peer.
#[derive(Debug, Default)]
pub struct Peer {
    /// What of its messages was refused.
    pub counts: Counts,
    session: Option<u64>,
    windows: BTreeMap<u32, Window>,
    hello: Option<Hello>,
    roster: u32,
    verifier: Option<(PublicKey, VerifyingKey)>,
    clock: ClockOffset,
    offset: Option<Offset>,
    correction: Option<Correction>,
    /// The stamp of its last word on clocks, and when that came by the own clock.
    echo: Option<(i64, i64)>,
}

impl Peer {
    /// What it said of itself last.
    #[must_use]
    pub const fn hello(&self) -> Option<&Hello> {
        self.hello.as_ref()
    }

    /// The version of the roster that it goes by; 0 if nothing was heard of it.
    #[must_use]
    pub const fn roster(&self) -> u32 {
        self.roster
    }

    /// What is known of its clock.
    #[must_use]
    pub const fn offset(&self) -> Option<Offset> {
        self.offset
    }

    /// How often its clock was found to have been set.
    #[must_use]
    pub const fn clock_steps(&self) -> u32 {
        self.clock.steps()
    }

    /// What is done to its stamps.
    #[must_use]
    pub fn correction(&self) -> Correction {
        self.correction.unwrap_or_default()
    }

    pub(super) fn clock_word(&self) -> ClockWord {
        let (echo_ns, heard_ns) = self.echo.unwrap_or_default();
        ClockWord { echo_ns, heard_ns }
    }

    /// That it is of this session, was not here before, and that `proven` signed it.
    pub(super) fn check_signed(
        &mut self,
        parsed: &Parsed<'_>,
        proven: &PublicKey,
    ) -> Result<(), Refusal> {
        let envelope = &parsed.envelope;
        let same_session = self.session == Some(envelope.session);
        if !same_session && envelope.kind != word::HELLO {
            return Err(Refusal::OldSession);
        }
        let window = self.windows.get(&envelope.kind).filter(|_| same_session);
        if !window.is_none_or(|window| window.is_new(envelope.sequence)) {
            return Err(Refusal::Replayed);
        }
        let verifier = self.verifier(proven).ok_or(Refusal::BadSignature)?;
        if !parsed.is_signed_by(&verifier) {
            return Err(Refusal::BadSignature);
        }
        Ok(())
    }

    /// Decompressing a key takes a tenth of a verification: it is done once.
    fn verifier(&mut self, proven: &PublicKey) -> Option<VerifyingKey> {
        if let Some((key, verifier)) = self.verifier
            && key == *proven
        {
            return Some(verifier);
        }
        let verifier = proven.verifier()?;
        self.verifier = Some((*proven, verifier));
        Some(verifier)
    }

    /// Notes a message whose signature is good.
    pub(super) fn hear(&mut self, envelope: &Envelope, now: Now) {
        if self.session != Some(envelope.session) {
            self.session = Some(envelope.session);
            self.windows.clear();
            self.hello = None;
            self.echo = None;
        }
        let window = self.windows.entry(envelope.kind).or_default();
        window.note(envelope.sequence);
        self.roster = self.roster.max(envelope.roster);
        let theta_ns = envelope.stamp_ns.saturating_sub(now.wall_ns);
        self.clock.at_least(now.boot_ns, theta_ns);
    }

    pub(super) fn hear_word<'a>(
        &mut self,
        parsed: &Parsed<'a>,
        now: Now,
    ) -> Result<Word<'a>, Refusal> {
        match parsed.envelope.kind {
            word::HELLO => {
                let hello = Hello::of(parsed.body).ok_or(Refusal::BadWord)?;
                self.roster = parsed.envelope.roster;
                self.hello = Some(hello.clone());
                Ok(Word::Hello(hello))
            }
            word::CLOCK => {
                let heard = ClockWord::of(parsed.body).ok_or(Refusal::BadWord)?;
                self.hear_clock(&heard, parsed.envelope.stamp_ns, now);
                let is_first = heard.echo_ns == 0;
                Ok(Word::Clock { is_first })
            }
            _ => {
                let text = str::from_utf8(parsed.body).map_err(|_| Refusal::BadWord)?;
                Ok(Word::Roster(text))
            }
        }
    }

    fn hear_clock(&mut self, heard: &ClockWord, stamp_ns: i64, now: Now) {
        self.echo = Some((stamp_ns, now.wall_ns));
        if heard.echo_ns != 0 {
            self.clock.round(
                now.boot_ns,
                heard.echo_ns,
                heard.heard_ns,
                stamp_ns,
                now.wall_ns,
            );
        }
        self.offset = self.clock.at(now.boot_ns);
        self.correction = self.offset.map(|offset| match &self.correction {
            Some(correction) => correction.after(&offset),
            None => Correction::of(&offset),
        });
    }

    /// That it goes by the same frame and periods.
    pub(super) fn check_rules(&self, rules: &Rules) -> Result<(), Refusal> {
        let hello = self.hello.as_ref().ok_or(Refusal::OldSession)?;
        if hello.datum != rules.datum {
            return Err(Refusal::WrongDatum);
        }
        // One frame may have a point of the earth for one robot, which has a receiver, and none for another.
        if hello.origin != 0 && rules.origin != 0 && hello.origin != rules.origin {
            return Err(Refusal::WrongDatum);
        }
        if hello.periods != rules.periods {
            return Err(Refusal::WrongPeriod);
        }
        Ok(())
    }

    /// What is to be done to its stamps.
    pub(super) fn check_clock(
        &self,
        rules: &Rules,
        roster: &Roster,
        now: Now,
    ) -> Result<Correction, Refusal> {
        let offset = self.offset.ok_or(Refusal::ClockUnknown)?;
        if rules.correct_offset {
            return Ok(self.correction());
        }
        if roster.clock_is_wrong(Moment::of_ns(now.wall_ns)) {
            return Err(Refusal::OwnClock);
        }
        if offset.exceeds(rules.max_offset_s) {
            return Err(Refusal::ClockOffset);
        }
        Ok(Correction::default())
    }
}
