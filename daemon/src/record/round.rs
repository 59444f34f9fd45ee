//! What the team's rounds do to the robot, as it is recorded.

use coloc_estimator::{
    Covariance3, Deed, Measurement, NotACovariance, Origin, Pose, RoundWord, Stamp,
};
use serde::{Deserialize, Serialize};

use super::Record;

/// What is to be done.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RecordedDeed {
    /// The belief at the slot is replaced.
    Correct,
    /// What rounds of later slots did is taken back.
    Undo,
    /// What all rounds did is taken back.
    UndoAll,
    /// The slot begins.
    Share,
    /// The robot takes part.
    Join,
    /// It does not any more.
    Leave,
}

impl From<&RoundWord> for Record {
    fn from(word: &RoundWord) -> Self {
        let (deed, slot) = match word.deed {
            Deed::Correct { slot, .. } => (RecordedDeed::Correct, slot),
            Deed::Undo(Some(slot)) => (RecordedDeed::Undo, slot),
            Deed::Undo(None) => (RecordedDeed::UndoAll, 0),
            Deed::Share(slot) => (RecordedDeed::Share, slot),
            Deed::Join => (RecordedDeed::Join, 0),
            Deed::Leave => (RecordedDeed::Leave, 0),
        };
        let (pose, covariance, factor) = match &word.deed {
            Deed::Correct {
                pose,
                covariance,
                factor,
                ..
            } => (pose.to_vector().into(), covariance.to_row_major(), *factor),
            _ => ([0.0; 3], [0.0; 9], 0.0),
        };
        Self::Round {
            stamp_ns: word.stamp.as_nanos(),
            source: word.origin.source,
            session: word.origin.session,
            sequence: word.origin.sequence,
            deed,
            slot,
            pose,
            covariance,
            factor,
        }
    }
}

/// As it was; `None` if it is of something else.
pub(super) fn taken(record: &Record) -> Option<Result<Measurement, NotACovariance>> {
    let Record::Round {
        stamp_ns,
        source,
        session,
        sequence,
        deed,
        slot,
        pose: [x, y, phi],
        covariance,
        factor,
    } = *record
    else {
        return None;
    };
    let deed = match deed {
        RecordedDeed::Correct => match Covariance3::from_row_major(covariance) {
            Ok(covariance) => Deed::Correct {
                slot,
                pose: Pose { x, y, phi },
                covariance,
                factor,
            },
            Err(problem) => return Some(Err(problem)),
        },
        RecordedDeed::Undo => Deed::Undo(Some(slot)),
        RecordedDeed::UndoAll => Deed::Undo(None),
        RecordedDeed::Share => Deed::Share(slot),
        RecordedDeed::Join => Deed::Join,
        RecordedDeed::Leave => Deed::Leave,
    };
    let word = RoundWord {
        stamp: Stamp::from_nanos(stamp_ns),
        origin: Origin {
            source,
            session,
            sequence,
        },
        deed,
        of: None,
    };
    Some(Ok(Measurement::Round(word)))
}
