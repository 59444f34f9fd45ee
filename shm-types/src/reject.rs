//! Why an input changed nothing.

/// The list: [`Reject`], how each reads, and what it is called.
macro_rules! reasons {
    ($($(#[$text:meta])* $reason:ident = $number:literal, $name:literal, $sentence:literal;)*) => {
        /// The reason for which an input was turned away; indexes `rejected` of [`Status`](crate::Status).
        ///
        /// Up to `HistoryFull` the order is the order of the checks: of several reasons the first is the one that is counted. The
        /// numbers are part of the payload's version; a new reason takes the first that is spare.
        #[derive(Copy, Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, thiserror::Error)]
        #[repr(u8)]
        pub enum Reject {
            $($(#[$text])* #[error($sentence)] $reason = $number,)*
        }

        impl Reject {
            /// All of them, in the order of their numbers.
            pub const ALL: &[Self] = &[$(Self::$reason,)*];

            /// As it is printed in tables and keyed in JSON.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$reason => $name,)* }
            }
        }
    };
}

reasons! {
    /// A number is NaN or infinite.
    NotFinite = 0, "not_finite", "a number in it is NaN, infinite or too large: a place or speed beyond 1e12, a variance beyond 1e60";
    /// A covariance differs from its transpose.
    Asymmetric = 1, "asymmetric", "a covariance is not symmetric";
    /// A covariance has a negative eigenvalue, or a standard deviation is negative.
    NotPositiveSemidefinite = 2, "not_positive_semidefinite",
        "a covariance has a negative eigenvalue, or a standard deviation is negative";
    /// The dependent part of a covariance has a negative eigenvalue.
    DependentNotPositiveSemidefinite = 3, "dependent_not_positive_semidefinite",
        "the dependent part of its covariance has a negative eigenvalue";
    /// A variance is zero, which many programs send where they do not know it.
    NoCovariance = 4, "no_covariance", "a variance in it is zero: nothing is known so well, so it says nothing";
    /// It asks for something that this version of coloc does not do.
    Unsupported = 5, "unsupported", "it uses a field that this version of coloc does not support yet";
    /// The robot it names is not in the team, or is the receiver itself.
    UnknownRobot = 6, "unknown_robot", "it names a robot that is not another one of the team";
    /// The number of its clock has no meaning.
    UnknownClock = 7, "unknown_clock", "it does not say of which clock its stamp is";
    /// Its stamp cannot be compared with the receiver's clocks.
    ForeignClock = 8, "foreign_clock", "its stamp is of a clock that this robot cannot compare with its own";
    /// It stands for an interval that does not end after it begins.
    EmptyInterval = 9, "empty_interval", "its interval does not end after it begins";
    /// Stamped later than now, beyond the tolerance.
    FromFuture = 10, "from_future", "its stamp is in the future";
    /// Stamped before the history begins.
    TooOld = 11, "too_old", "its stamp is older than the history";
    /// The receiver says that it has no usable fix.
    BadQuality = 12, "bad_quality", "the receiver reports no usable fix";
    /// More sources speak on the channel than there is room for.
    TooManySources = 13, "too_many_sources", "more sources speak on its channel than there is room for";
    /// This message of this sender was here before.
    Replayed = 14, "replayed", "it was received before";
    /// The innovation is outside of the χ² gate.
    Gated = 15, "gated", "its innovation is outside of the gate";
    /// The history has no room for another entry.
    HistoryFull = 16, "history_full", "the history is full";
    /// Faster than the robot can be.
    Implausible = 17, "implausible", "it says that the robot is faster than [odometry] allows";
    /// Older than one of its sender that has been used.
    OutOfOrder = 18, "out_of_order", "its sender has said something newer before, which its way is in";
    /// The configuration lacks what it takes to understand it.
    NotConfigured = 19, "not_configured",
        "[odometry.base] does not say what it takes to understand it: track_m for wheels, metres_per_count for counts";
    /// A course over ground while the robot does not move, or may move sideways.
    NotMoving = 20, "not_moving",
        "it is a course over ground, and the wheels do not say that the robot moves as fast as heading.least_speed_m_s";
    /// A landmark that the configuration does not list.
    UnknownLandmark = 21, "unknown_landmark", "it names a landmark that the configuration does not list";
    /// A range that is zero or less.
    NoRange = 22, "no_range", "its range is not more than zero";
    /// An answer to nothing that is in the history.
    NotAsked = 23, "not_asked", "it answers a sighting that is not in the history";
    /// Who says it, or of whom it is, has another part in the team.
    NotForRole = 24, "not_for_role", "by [assist] it cannot come from there: from a robot that does not lead, or from a child to a leader";
    /// Its stamp does not fit its event.
    WrongEvent = 25, "wrong_event", "its stamp is not of the event that it names; is assist.period_s the same on all robots?";
    /// A robot is twice in its path.
    Looped = 26, "looped", "a robot is twice in its path";
    /// Its path is none from its leader through its sender to this robot.
    BadPath = 27, "bad_path", "its path does not go from a leader through its sender to this robot, or is too long";
    /// A round in which the robot took no part, or not as it now is.
    TookNoPart = 28, "took_no_part", "the robot took no part in that round, or something has replaced its belief since";
    /// No round can have made that covariance of what was shared.
    NoRound = 29, "no_round", "no round can have made its covariance of the one that was shared";
    /// The pose moves farther than what was learned allows.
    TooFar = 30, "too_far", "its pose is farther from the one that was shared than what was learned allows";
}

impl Reject {
    /// So many have a place in [`Status`](crate::Status); those without a name are spare.
    pub const PLACES: usize = 32;
}

#[cfg(test)]
mod tests {
    use super::Reject;

    #[test]
    fn numbers_are_places_in_the_list_and_some_are_spare() {
        for (place, reject) in Reject::ALL.iter().enumerate() {
            assert_eq!(*reject as usize, place);
        }
        assert!(Reject::ALL.len() < Reject::PLACES);
    }
}
