//! What `colocd` was told of its belief by a second opinion.

use crate::Integrity;

/// The word of `coloc-bounds` as it stands in an estimate. It never changes a belief.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Opinion {
    /// Nobody is asked, or nobody has said anything yet.
    #[default]
    None = 0,
    /// All fits.
    Possible = 1,
    /// The estimate is where the robot cannot be.
    EstimateOutside = 2,
    /// What was measured cannot all be within its bounds.
    BoundsViolated = 3,
    /// Nothing bounds where the robot is.
    NotObservable = 4,
    /// Nothing was said for long, or slots were not closed in time.
    Stale = 5,
    /// It begins, or begins anew.
    Starting = 6,
}

impl Opinion {
    /// The byte of a payload, decoded. A byte of no known meaning is [`Self::Stale`]: it says nothing.
    #[must_use]
    pub const fn from_byte(byte: u8) -> Self {
        match byte {
            0 => Self::None,
            1 => Self::Possible,
            2 => Self::EstimateOutside,
            3 => Self::BoundsViolated,
            4 => Self::NotObservable,
            6 => Self::Starting,
            _ => Self::Stale,
        }
    }

    /// Of a word's `state`.
    #[must_use]
    pub const fn of_state(state: u8) -> Self {
        match state {
            Integrity::OK => Self::Possible,
            Integrity::ESTIMATE_OUTSIDE => Self::EstimateOutside,
            Integrity::BOUNDS_VIOLATED => Self::BoundsViolated,
            Integrity::NOT_OBSERVABLE => Self::NotObservable,
            Integrity::STARTING => Self::Starting,
            _ => Self::Stale,
        }
    }

    /// As it is printed.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Possible => "possible",
            Self::EstimateOutside => "estimate_outside",
            Self::BoundsViolated => "bounds_violated",
            Self::NotObservable => "not_observable",
            Self::Stale => "stale",
            Self::Starting => "starting",
        }
    }

    /// What it means, for people; follows "it" or a robot's name.
    #[must_use]
    pub const fn meaning(self) -> &'static str {
        match self {
            Self::None => "has no second opinion",
            Self::Possible => "can be where it believes to be, by coloc-bounds",
            Self::EstimateOutside => {
                "cannot be where it believes to be: coloc-bounds finds its estimate outside of all places that its sensors allow"
            }
            Self::BoundsViolated => {
                "has sensors that cannot all be right: coloc-bounds finds a bound broken, and its log says whose"
            }
            Self::NotObservable => {
                "is not bounded by anything that coloc-bounds hears: no second opinion"
            }
            Self::Stale => "does not hear coloc-bounds in time: no second opinion",
            Self::Starting => "is not known to coloc-bounds yet: no second opinion",
        }
    }
}

impl core::fmt::Display for Opinion {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.pad(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_and_states_are_what_they_say() {
        for byte in 0..=6 {
            assert_eq!(Opinion::from_byte(byte) as u8, byte);
        }
        for byte in [7, 255] {
            assert_eq!(Opinion::from_byte(byte), Opinion::Stale);
        }
        let of_states = [0, 1, 2, 3, 4, 5].map(|it| Opinion::of_state(it).name());
        assert_eq!(
            of_states,
            [
                "possible",
                "estimate_outside",
                "bounds_violated",
                "not_observable",
                "stale",
                "starting"
            ]
        );
    }
}
