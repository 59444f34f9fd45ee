//! What the rounds of the team do to this robot ([`crate::rounds`]). That a correction is believed is decided once, when it comes.

use super::{Key, Kind, Measured, Origin, check_numbers, check_variances};
use crate::belief::Belief;
use crate::covariance::Covariance3;
use crate::filter::Filter;
use crate::found::Gauge;
use crate::outbox::Outbox;
use crate::output::{Source, Verdict};
use crate::parts::Parts;
use crate::pose::Pose;
use crate::rounds::{Correction, Of};
use crate::settings::Floors;
use crate::stamp::Stamp;
use crate::terms::Terms;

/// A word of the robot's own process that makes rounds.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct RoundWord {
    /// From when on it holds. Of a correction the history's word, its slot or, after that has left the history, the tick; whatever stands here.
    pub stamp: Stamp,
    /// Which word it is.
    pub origin: Origin,
    /// What is to be done.
    pub deed: Deed,
    /// What a correction is of; the history's word, whatever stands here. `None`: it acts on nothing, or not any more.
    pub of: Option<Of>,
}

/// What is to be done.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Deed {
    /// The belief at a slot is replaced: a [`Correction`].
    Correct {
        /// The slot.
        slot: u64,
        /// `x̂⁺`
        pose: Pose,
        /// `P⁺`
        covariance: Covariance3,
        /// Of the block bound.
        factor: f64,
    },
    /// Corrections of later slots than this are forgotten, all of them if there is none: the team went on without them.
    Undo(Option<u64>),
    /// A slot begins, at the stamp: the tick says what is shared then.
    Share(u64),
    /// The robot takes part from now on, and shares nothing that is known.
    Join,
    /// It takes no part any more: split covariance intersection.
    Leave,
}

impl Deed {
    /// The correction, if it is one.
    #[must_use]
    pub fn correction(&self) -> Option<Correction> {
        match self {
            Self::Correct {
                slot,
                pose,
                covariance,
                factor,
            } => Some(Correction {
                slot: *slot,
                pose: *pose,
                covariance: covariance.matrix(),
                factor: *factor,
            }),
            Self::Undo(_) | Self::Share(_) | Self::Join | Self::Leave => None,
        }
    }
}

impl RoundWord {
    /// Of which slot it corrects the belief.
    pub(crate) fn corrects(&self) -> Option<u64> {
        match self.deed {
            Deed::Correct { slot, .. } => Some(slot),
            Deed::Undo(_) | Deed::Share(_) | Deed::Join | Deed::Leave => None,
        }
    }
}

impl Measured for RoundWord {
    fn key(&self) -> Key {
        Key::new(self.stamp, Kind::Round, self.origin)
    }

    fn source(&self) -> Source {
        Source::new(Kind::Round, self.origin.source)
    }

    fn check(&self) -> Result<(), Verdict> {
        let Deed::Correct {
            pose, covariance, ..
        } = &self.deed
        else {
            return Ok(());
        };
        check_numbers(pose.to_vector().as_slice())?;
        check_variances(&covariance.variances())
    }

    /// A round made it of what is no more certain than the floors.
    fn with_floor(&self, _: &Floors) -> Self {
        *self
    }

    fn apply(&self, filter: &mut Filter, terms: &Terms<'_>, _: Option<&mut Outbox>) -> Gauge {
        match &self.deed {
            Deed::Correct {
                slot,
                pose,
                covariance,
                ..
            } => {
                let belief = Belief::gaussian(*pose, Parts::dependent(*covariance));
                if let Some(of) = &self.of {
                    filter.follow(*slot, &belief, of, terms.lates);
                }
            }
            Deed::Join => filter.join(),
            Deed::Leave => filter.leave(),
            Deed::Undo(_) | Deed::Share(_) => {}
        }
        Gauge::default()
    }
}
