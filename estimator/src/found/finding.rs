//! What is known of whether the robot knows where it is.

use crate::kind::Kind;
use crate::list::FixedList;
use crate::output::Source;
use crate::stamp::Stamp;

/// Whether there is a belief, and what stands against it.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub enum FindingState {
    /// It is believed, and no majority is against it.
    #[default]
    Ok,
    /// There is no belief; the published pose is the best guess, its covariance holds every guess.
    Finding,
    /// As many are against it as for it; the covariance holds every possibility.
    Contradicted,
    /// As one of the two before, and nothing has come for ten seconds.
    Lost,
}

/// A source that stands against the belief.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Dissent {
    /// Who.
    pub source: Source,
    /// Since when.
    pub since: Stamp,
    /// d² of its last word.
    pub d2: f64,
    /// How far from the belief it has the robot \[m\]; NaN where it has no hypothesis.
    pub distance_m: f64,
}

/// Something that was decided.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Decision {
    /// The hypothesis of a source became the belief.
    Followed {
        /// Whose.
        source: Source,
        /// How far it was from the belief before \[m\]; NaN if there was none.
        distance_m: f64,
        /// So many sources agreed, and so many of those that stood by the belief did not; the wheels count as one.
        votes: [u8; 2],
    },
    /// The belief was dropped for what a source says: the robot stood, and its heading is open.
    Dropped {
        /// Whose word it was.
        source: Source,
        /// How far it was from the belief \[m\].
        distance_m: f64,
    },
    /// The heading is too uncertain for a fix to be fused: the belief is now the hypothesis of that source.
    Widened {
        /// Whose fix it was.
        source: Source,
    },
    /// The first fixes after a long gap are just outside of the gate and agree with one another: the belief is now the hypothesis of
    /// that source.
    SecondChance {
        /// Whose.
        source: Source,
    },
    /// A person set the pose: it is believed, and all that was held against the belief before is forgotten.
    Set {
        /// Who.
        source: Source,
        /// How far it was from the belief before \[m\]; NaN if there was none.
        distance_m: f64,
    },
    /// What a source says does not move as the wheels do; its hypothesis begins anew.
    Anew {
        /// Whose.
        source: Source,
    },
}

/// So many decisions one tick can tell.
pub(crate) const DECISIONS: usize = 32;

/// A decision, and the stamp of the word that it rests on.
pub type Decided = (Stamp, Decision);

/// What the last tick knows of it. All of it rests on what has left the history, so that it is a function of the set of inputs.
#[derive(Copy, Clone, Debug)]
pub struct Finding {
    /// Whether there is a belief, and what stands against it.
    pub state: FindingState,
    /// Since when it is so.
    pub since: Stamp,
    pub(crate) dissents: FixedList<Dissent, { super::SEATS }>,
    pub(crate) decisions: FixedList<Decided, DECISIONS>,
    /// Sources that found no seat, and decisions that did not fit in the list, since the start.
    pub unseated: u32,
}

impl Finding {
    /// Who stands against the belief.
    #[must_use]
    pub fn dissents(&self) -> &[Dissent] {
        self.dissents.as_slice()
    }

    /// What was decided in this tick, in the order of the stamps.
    #[must_use]
    pub fn decisions(&self) -> &[Decided] {
        self.decisions.as_slice()
    }

    pub(crate) fn decide(&mut self, stamp: Stamp, decision: Decision) {
        let fitted = self.decisions.push((stamp, decision));
        self.unseated = self.unseated.saturating_add(u32::from(!fitted));
    }
}

impl Default for Finding {
    /// Nobody stands against the belief.
    fn default() -> Self {
        Self::beginning(Stamp::default(), true)
    }
}

impl Finding {
    pub(super) fn beginning(stamp: Stamp, knows: bool) -> Self {
        let nobody = Source::new(Kind::Fix, 0);
        let dissent = Dissent {
            source: nobody,
            since: stamp,
            d2: 0.0,
            distance_m: 0.0,
        };
        let decision = Decision::Anew { source: nobody };
        Self {
            state: if knows {
                FindingState::Ok
            } else {
                FindingState::Finding
            },
            since: stamp,
            dissents: FixedList::new(dissent),
            decisions: FixedList::new((stamp, decision)),
            unseated: 0,
        }
    }
}

impl Decision {
    /// The source that it is about.
    #[must_use]
    pub fn source(&self) -> Source {
        match self {
            Self::Followed { source, .. }
            | Self::Dropped { source, .. }
            | Self::Widened { source }
            | Self::SecondChance { source }
            | Self::Set { source, .. }
            | Self::Anew { source } => *source,
        }
    }
}
