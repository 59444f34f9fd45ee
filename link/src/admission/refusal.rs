//! Why something from the network is not admitted.
use std::fmt;

macro_rules! refusals {
    ($($(#[doc = $doc:literal])+ $name:ident = $text:literal,)*) => {
        /// Why something from the network is not admitted.
        #[derive(Copy, Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Refusal {
            $($(#[doc = $doc])+ $name,)*
        }

        impl Refusal {
            /// All of them.
            pub const ALL: &[Self] = &[$(Self::$name,)*];

            /// As it is counted and printed.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$name => $text,)*
                }
            }
        }
    };
}

refusals! {
    /// It is no message.
    Unreadable = "unreadable",
    /// It is of a version of the format that is not understood.
    UnknownVersion = "unknown_version",
    /// It is of another team.
    OtherTeam = "other_team",
    /// Its speaker, or who calls, is not in the roster: never was, or was revoked.
    NotInRoster = "not_in_roster",
    /// Its speaker's time in the roster is over.
    Expired = "expired",
    /// The connection is another robot's, or the payload says that it is.
    NotSpeaker = "not_speaker",
    /// It is for somebody else.
    NotForMe = "not_for_me",
    /// It is of a kind that is not known here.
    UnknownKind = "unknown_kind",
    /// Its speaker may not say that.
    NotForRole = "not_for_role",
    /// Its speaker goes by a roster that is older than the last but one.
    OldRoster = "old_roster",
    /// Its session is not the one that its speaker is in, or that one has not begun.
    OldSession = "old_session",
    /// It was here before.
    Replayed = "replayed",
    /// Its speaker did not sign it, or it was changed since.
    BadSignature = "bad_signature",
    /// A word of the link says too little.
    BadWord = "bad_word",
    /// It is not as long as its kind.
    WrongSize = "wrong_size",
    /// Its speaker's poses are in another frame.
    WrongDatum = "wrong_datum",
    /// Its speaker goes by other periods.
    WrongPeriod = "wrong_period",
    /// Its stamp is not of the shared clock.
    ForeignClock = "foreign_clock",
    /// The own clock is wrong.
    OwnClock = "own_clock",
    /// Nothing is known of its speaker's clock yet.
    ClockUnknown = "clock_unknown",
    /// Its speaker's clock is off by more than is allowed.
    ClockOffset = "clock_offset",
    /// It is older than its kind may get.
    TooOld = "too_old",
    /// It is of a moment that has not been.
    FromFuture = "from_future",
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// How often each was the reason.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Counts([u64; Refusal::ALL.len()]);

impl Counts {
    /// Counts one.
    pub const fn count(&mut self, refusal: Refusal) {
        let count = &mut self.0[refusal as usize];
        *count = count.saturating_add(1);
    }

    /// How often it was the reason.
    #[must_use]
    pub const fn of(&self, refusal: Refusal) -> u64 {
        self.0[refusal as usize]
    }

    /// Those that were.
    pub fn some(&self) -> impl Iterator<Item = (Refusal, u64)> {
        let all = Refusal::ALL.iter().map(|it| (*it, self.of(*it)));
        all.filter(|(_, count)| *count > 0)
    }

    /// All together.
    #[must_use]
    pub fn sum(&self) -> u64 {
        self.0
            .iter()
            .fold(0, |sum, count| sum.saturating_add(*count))
    }
}
