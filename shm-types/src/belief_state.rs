//! How a belief is doing.

/// Whether a robot knows where it is.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum BeliefState {
    /// It does not know yet, or not well enough.
    #[default]
    Finding = 0,
    /// It knows, within the covariance that it states.
    Ok = 1,
    /// What it measures contradicts what it believes.
    Contradicted = 2,
    /// It has lost itself: the pose is not to be used.
    Lost = 3,
}

impl BeliefState {
    /// The byte of a payload, decoded. A byte of no known meaning is [`Self::Lost`]: nobody should drive on it.
    #[must_use]
    pub const fn from_byte(byte: u8) -> Self {
        match byte {
            0 => Self::Finding,
            1 => Self::Ok,
            2 => Self::Contradicted,
            _ => Self::Lost,
        }
    }

    /// As it is printed.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Finding => "finding",
            Self::Ok => "ok",
            Self::Contradicted => "contradicted",
            Self::Lost => "lost",
        }
    }
}

impl core::fmt::Display for BeliefState {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.pad(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::BeliefState;

    #[test]
    fn a_byte_of_no_meaning_is_nothing_to_drive_on() {
        for byte in 0..=u8::MAX {
            let state = BeliefState::from_byte(byte);
            assert!(state as u8 == byte || (byte > 3 && state == BeliefState::Lost));
        }
    }
}
