//! What becomes of bytes from the network: a message, or a reason why not.
//!
//! [`Admission::admit`] has no clock and no socket: bytes, the key that the connection has proved, the roster and the present go in.
//! What is cheap is checked first, and nothing is noted of a message before its signature was found good, so that nobody but a robot
//! itself can use up its numbers. Every refusal is counted, in all and for the peer that the connection belongs to.
//!
//! A session is that of the newest hello, which counts only on a connection on which its robot has proved its key: so what is played
//! again of an earlier session is of no session, without anybody having to remember those.

mod peer;
mod refusal;
mod window;

use std::collections::BTreeMap;

use coloc_shm_types::{Age, Clock};

use crate::clock_offset::{Correction, Offset};
use crate::keys::PublicKey;
use crate::kinds::Kind;
use crate::roster::{Moment, Roster, Standing};
use crate::wire::{ClockWord, EVERYBODY, Envelope, Hello, Parsed, Unreadable, Versions, word};

pub use peer::Peer;
pub use refusal::{Counts, Refusal};

/// The present by two clocks (ns).
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Now {
    /// `CLOCK_REALTIME`.
    pub wall_ns: i64,
    /// `CLOCK_BOOTTIME`.
    pub boot_ns: i64,
}

/// By which rules messages are admitted.
#[derive(Clone, Debug, PartialEq)]
pub struct Rules {
    /// The own number in the team.
    pub own: u16,
    /// [`fingerprint`](crate::roster::fingerprint) of the own frame.
    pub datum: u64,
    /// The same of the own periods.
    pub periods: u64,
    /// The same of the point of the earth that the own frame begins at; 0: none is configured.
    pub origin: u64,
    /// Which versions of the format are understood.
    pub versions: Versions,
    /// How far back the history of the own estimator reaches (ns).
    pub history_ns: i64,
    /// By how much a stamp may be ahead, beside what is not known of its clock (ns).
    pub future_ns: i64,
    /// Beyond this a peer's clock is refused (s).
    pub max_offset_s: f64,
    /// Whether its stamps are corrected instead.
    pub correct_offset: bool,
}

/// A message that was admitted.
#[derive(Clone, Debug)]
pub enum Word<'a> {
    /// What the peer is and understands.
    Hello(Hello),
    /// It was about clocks, and is noted.
    Clock {
        /// The peer has heard nothing of the own clock yet.
        is_first: bool,
    },
    /// A roster, for [`Book::offer`](crate::roster::Book::offer).
    Roster(&'a str),
    /// Something for shared memory.
    Payload(Payload<'a>),
}

/// Something for shared memory.
#[derive(Copy, Clone, Debug)]
pub struct Payload<'a> {
    /// What it is.
    pub kind: Kind,
    /// What the envelope says.
    pub envelope: Envelope,
    /// The payload, as many bytes as the kind has, its stamp still the peer's.
    pub bytes: &'a [u8],
    /// Its stamp, still the peer's (ns).
    pub stamp_ns: i64,
    /// What is to be done to its stamps.
    pub correction: Correction,
}

/// Admits messages of the whole team.
#[derive(Debug)]
pub struct Admission {
    rules: Rules,
    peers: BTreeMap<u16, Peer>,
    counts: Counts,
}

impl Admission {
    /// By these rules; nobody is known yet.
    #[must_use]
    pub fn new(rules: Rules) -> Self {
        Self {
            rules,
            peers: BTreeMap::new(),
            counts: Counts::default(),
        }
    }

    /// Admits a message that came at `now` over a connection on which `proven` was proved, or says why not.
    ///
    /// # Errors
    /// The first reason; it is counted.
    pub fn admit<'a>(
        &mut self,
        bytes: &'a [u8],
        proven: &PublicKey,
        roster: &Roster,
        now: Now,
    ) -> Result<Word<'a>, Refusal> {
        let admitted = self.judge(bytes, proven, roster, now);
        if let Err(refusal) = &admitted {
            self.count(*refusal, proven, roster);
        }
        admitted
    }

    /// Counts something that was refused elsewhere: a handshake, a roster.
    pub fn count(&mut self, refusal: Refusal, proven: &PublicKey, roster: &Roster) {
        self.counts.count(refusal);
        if let Some(owner) = roster.owner(proven) {
            let peer = self.peers.entry(owner.id).or_default();
            peer.counts.count(refusal);
        }
    }

    fn judge<'a>(
        &mut self,
        bytes: &'a [u8],
        proven: &PublicKey,
        roster: &Roster,
        now: Now,
    ) -> Result<Word<'a>, Refusal> {
        let parsed = Parsed::among(bytes, self.rules.versions)?;
        let kind = self.check_envelope(&parsed.envelope, proven, roster, now)?;
        let peer = self.peers.entry(parsed.envelope.speaker).or_default();
        peer.check_signed(&parsed, proven)?;
        peer.hear(&parsed.envelope, now);
        match kind {
            Some(kind) => self
                .judge_payload(kind, &parsed, roster, now)
                .map(Word::Payload),
            None => peer.hear_word(&parsed, now),
        }
    }

    /// All that can be told without the signature; `None` for a word of the link.
    fn check_envelope(
        &self,
        envelope: &Envelope,
        proven: &PublicKey,
        roster: &Roster,
        now: Now,
    ) -> Result<Option<Kind>, Refusal> {
        if envelope.team != roster.team.team() {
            return Err(Refusal::OtherTeam);
        }
        let member = roster.standing(envelope.speaker, Moment::of_ns(now.wall_ns))?;
        if !member.has(proven) || envelope.speaker == self.rules.own {
            return Err(Refusal::NotSpeaker);
        }
        if ![self.rules.own, EVERYBODY].contains(&envelope.receiver) {
            return Err(Refusal::NotForMe);
        }
        if [word::HELLO, word::CLOCK, word::ROSTER].contains(&envelope.kind) {
            return Ok(None);
        }
        let kind = Kind::of_code(envelope.kind).ok_or(Refusal::UnknownKind)?;
        if !member.may_say(&kind) {
            return Err(Refusal::NotForRole);
        }
        if envelope.roster.saturating_add(1) < roster.version {
            return Err(Refusal::OldRoster);
        }
        Ok(Some(kind))
    }

    fn judge_payload<'a>(
        &mut self,
        kind: Kind,
        parsed: &Parsed<'a>,
        roster: &Roster,
        now: Now,
    ) -> Result<Payload<'a>, Refusal> {
        let envelope = parsed.envelope;
        let header = kind.header(parsed.body).ok_or(Refusal::WrongSize)?;
        let peer = self.peers.entry(envelope.speaker).or_default();
        peer.check_rules(&self.rules)?;
        let mut correction = peer.check_clock(&self.rules, roster, now)?;
        if kind.echoes {
            // Its speaker has it by the own clock again, and has said what it doubts of that.
            correction = Correction::default();
        }
        if header.source != envelope.speaker {
            return Err(Refusal::NotSpeaker);
        }
        if header.clock() != Ok(Clock::Realtime) {
            return Err(Refusal::ForeignClock);
        }
        let stamp_ns = header.stamp_ns.saturating_add(correction.by_ns);
        self.check_age(kind, stamp_ns, peer_doubt_ns(&correction), now)?;
        Ok(Payload {
            kind,
            envelope,
            bytes: parsed.body,
            stamp_ns: header.stamp_ns,
            correction,
        })
    }

    fn check_age(&self, kind: Kind, stamp_ns: i64, doubt_ns: i64, now: Now) -> Result<(), Refusal> {
        let age_ns = now.wall_ns.saturating_sub(stamp_ns);
        let largest_ns = match kind.told.age {
            Age::History => self.rules.history_ns,
            Age::Millis(millis) => i64::from(millis) * 1_000_000,
        };
        match age_ns {
            age_ns if age_ns > largest_ns.saturating_add(doubt_ns) => Err(Refusal::TooOld),
            age_ns if -age_ns > self.rules.future_ns.saturating_add(doubt_ns) => {
                Err(Refusal::FromFuture)
            }
            _ => Ok(()),
        }
    }

    /// What to tell a peer about clocks, at `now`.
    #[must_use]
    pub fn clock_word(&self, peer: u16) -> ClockWord {
        self.peers
            .get(&peer)
            .map_or_else(ClockWord::default, Peer::clock_word)
    }

    /// How a peer is doing, if anything came of it.
    #[must_use]
    pub fn peer(&self, id: u16) -> Option<&Peer> {
        self.peers.get(&id)
    }

    /// All of which anything came.
    pub fn peers(&self) -> impl Iterator<Item = (u16, &Peer)> {
        self.peers.iter().map(|(id, peer)| (*id, peer))
    }

    /// What is known of every peer's clock.
    #[must_use]
    pub fn offsets(&self) -> Vec<(u16, Offset)> {
        self.peers()
            .filter_map(|(id, peer)| Some((id, peer.offset()?)))
            .collect()
    }

    /// Forgets whom the roster does not know any more.
    pub fn forget_strangers(&mut self, roster: &Roster) {
        self.peers.retain(|id, _| roster.member(*id).is_some());
    }

    /// What was refused, in all.
    #[must_use]
    pub const fn counts(&self) -> &Counts {
        &self.counts
    }

    /// Goes by other rules from now on, as after a newer roster.
    pub fn set_rules(&mut self, rules: Rules) {
        self.rules = rules;
    }
}

/// Three deviations of what a correction has wrong (ns).
fn peer_doubt_ns(correction: &Correction) -> i64 {
    #[expect(clippy::cast_possible_truncation, reason = "to whole nanoseconds")]
    let doubt_ns = (3e9 * correction.variance_s2.sqrt()) as i64;
    doubt_ns
}

impl From<Unreadable> for Refusal {
    fn from(unreadable: Unreadable) -> Self {
        match unreadable {
            Unreadable::Version(_) => Self::UnknownVersion,
            Unreadable::Length | Unreadable::Magic => Self::Unreadable,
        }
    }
}

impl From<Standing> for Refusal {
    fn from(standing: Standing) -> Self {
        match standing {
            Standing::Unknown => Self::NotInRoster,
            Standing::Expired => Self::Expired,
        }
    }
}

/// The hello of a link that speaks this version, understands all kinds and goes by `rules`.
#[must_use]
pub fn own_hello(rules: &Rules, roster: &Roster, now: Now) -> Hello {
    let wrong = roster.clock_is_wrong(Moment::of_ns(now.wall_ns));
    Hello {
        oldest: rules.versions.oldest,
        newest: rules.versions.newest,
        flags: if wrong { Hello::CLOCK_UNSET } else { 0 },
        datum: rules.datum,
        periods: rules.periods,
        kinds: Kind::all().iter().map(|kind| kind.code).collect(),
        origin: rules.origin,
        program: Hello::program_of(env!("CARGO_PKG_VERSION")),
    }
}

#[cfg(test)]
mod tests;
