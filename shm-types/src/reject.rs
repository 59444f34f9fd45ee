//! Why an input changed nothing.

/// The reason for which an input was turned away; indexes `rejected` of [`Status`](crate::Status).
///
/// The order is the order of the checks: of several reasons the first is the one that is counted. The numbers are part
/// of the payload's version: new ones are added at the end, with a new version.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, thiserror::Error)]
#[repr(u8)]
pub enum Reject {
    /// A number is NaN or infinite.
    #[error("a number in it is NaN or infinite")]
    NotFinite = 0,
    /// A covariance differs from its transpose.
    #[error("a covariance is not symmetric")]
    Asymmetric = 1,
    /// A covariance has a negative eigenvalue.
    #[error("a covariance has a negative eigenvalue")]
    NotPositiveSemidefinite = 2,
    /// The independent part exceeds the total: their difference has a negative eigenvalue.
    #[error("the independent covariance exceeds the total")]
    DependentNotPositiveSemidefinite = 3,
    /// The robot it names is not in the team, or is the receiver itself.
    #[error("it names a robot that is not another one of the team")]
    UnknownRobot = 4,
    /// Stamped later than now, beyond the tolerance.
    #[error("its stamp is in the future")]
    FromFuture = 5,
    /// Stamped before the history begins.
    #[error("its stamp is older than the history")]
    TooOld = 6,
    /// The receiver says that it has no usable fix.
    #[error("the receiver reports no usable fix")]
    BadQuality = 7,
    /// This message of this sender was here before, or is of an earlier start of the sender.
    #[error("it was received before")]
    Replayed = 8,
    /// The innovation is outside of the χ² gate.
    #[error("its innovation is outside of the gate")]
    Gated = 9,
    /// The history has no room for another entry.
    #[error("the history is full")]
    HistoryFull = 10,
}

impl Reject {
    /// How many there are.
    pub const COUNT: usize = 11;
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; Self::COUNT] = [
        Self::NotFinite,
        Self::Asymmetric,
        Self::NotPositiveSemidefinite,
        Self::DependentNotPositiveSemidefinite,
        Self::UnknownRobot,
        Self::FromFuture,
        Self::TooOld,
        Self::BadQuality,
        Self::Replayed,
        Self::Gated,
        Self::HistoryFull,
    ];

    /// As it is printed in tables and keyed in JSON.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::NotFinite => "not_finite",
            Self::Asymmetric => "asymmetric",
            Self::NotPositiveSemidefinite => "not_positive_semidefinite",
            Self::DependentNotPositiveSemidefinite => "dependent_not_positive_semidefinite",
            Self::UnknownRobot => "unknown_robot",
            Self::FromFuture => "from_future",
            Self::TooOld => "too_old",
            Self::BadQuality => "bad_quality",
            Self::Replayed => "replayed",
            Self::Gated => "gated",
            Self::HistoryFull => "history_full",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Reject;

    #[test]
    fn numbers_are_places_in_the_list() {
        for (place, reject) in Reject::ALL.into_iter().enumerate() {
            assert_eq!(reject as usize, place);
        }
    }
}
