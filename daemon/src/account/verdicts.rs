//! The estimator's verdicts in the words of what is counted.

use coloc_estimator::assist::refusal::Refusal;
use coloc_estimator::{Kind, Verdict, rounds};
use coloc_shm_types::{Input, Reject};

use crate::health::Fact;

/// What input measurements of that kind are.
pub(super) fn input(kind: Kind) -> Input {
    match kind {
        Kind::Odometry => Input::Odometry,
        Kind::Sighting | Kind::Track => Input::RelativePose,
        Kind::Neighbour => Input::Neighbour,
        Kind::Fix => Input::Position,
        Kind::Pose => Input::Pose,
        Kind::Heading => Input::Heading,
        Kind::Gyro => Input::Gyro,
        Kind::Partial | Kind::Landmark => Input::Sighting,
        Kind::Seen | Kind::Ask => Input::Seen,
        Kind::Answer => Input::Answer,
        Kind::Assist => Input::Assist,
        Kind::Round => Input::Correction,
    }
}

/// What it says of the measurement's source.
pub(super) fn fact(verdict: Verdict) -> Fact {
    match verdict {
        Verdict::Accepted { d2 } => Fact::Passed {
            count: 1,
            d2: Some(d2),
        },
        Verdict::Heard => Fact::Passed { count: 1, d2: None },
        Verdict::Gated { d2 } => Fact::Refused { d2: Some(d2) },
        Verdict::Duplicate => Fact::Repeated,
        _ => Fact::Refused { d2: None },
    }
}

/// Why the estimator turned a measurement away; `None` if it did not.
pub(super) fn reason(verdict: Verdict) -> Option<Reject> {
    match verdict {
        Verdict::Accepted { .. } | Verdict::Heard => None,
        Verdict::Gated { .. } => Some(Reject::Gated),
        Verdict::TooOld => Some(Reject::TooOld),
        Verdict::FromFuture => Some(Reject::FromFuture),
        Verdict::Duplicate => Some(Reject::Replayed),
        Verdict::EmptyInterval => Some(Reject::EmptyInterval),
        Verdict::NoRoom => Some(Reject::HistoryFull),
        Verdict::NotFinite => Some(Reject::NotFinite),
        Verdict::NotMoving => Some(Reject::NotMoving),
        Verdict::NotAsked => Some(Reject::NotAsked),
        Verdict::NoNoise => Some(Reject::NoCovariance),
        Verdict::Refused(refusal) => Some(refused(refusal)),
        Verdict::NotFollowed(refusal) => Some(not_followed(refusal)),
    }
}

fn not_followed(refusal: rounds::Refusal) -> Reject {
    use rounds::Refusal as R;
    match refusal {
        R::TookNoPart => Reject::TookNoPart,
        R::NotABelief => Reject::NotPositiveSemidefinite,
        R::Factor | R::LessCertain | R::TooCertain => Reject::NoRound,
        R::TooFar => Reject::TooFar,
    }
}

fn refused(refusal: Refusal) -> Reject {
    match refusal {
        Refusal::NotALeader | Refusal::LeaderRelays | Refusal::NotAChild | Refusal::NotForRole => {
            Reject::NotForRole
        }
        Refusal::PathTooShort | Refusal::PathTooLong | Refusal::NotForMe | Refusal::NotOfSender => {
            Reject::BadPath
        }
        Refusal::UnknownRobot => Reject::UnknownRobot,
        Refusal::Looped => Reject::Looped,
        Refusal::NotFinal | Refusal::NotHandedOn => Reject::Unsupported,
        Refusal::WrongEvent => Reject::WrongEvent,
        Refusal::NotFinite => Reject::NotFinite,
    }
}
