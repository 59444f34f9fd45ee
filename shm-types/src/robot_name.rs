//! The name of a robot, as it stands in service names.

/// Longest name of a robot (bytes).
const LONGEST: usize = 32;

/// A robot's name: 1 to 32 letters, digits, `-` or `_`, so that it fits into service and file names as it is.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct RobotName(String);

/// Not a name for a robot.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` cannot name a robot: use 1 to {LONGEST} of the characters a-z, A-Z, 0-9, `-` and `_`"
)]
pub struct NotARobotName(String);

impl RobotName {
    /// Checks `name`.
    ///
    /// # Errors
    /// If it is empty, too long, or has any other character.
    pub fn new(name: &str) -> Result<Self, NotARobotName> {
        let fits = (1..=LONGEST).contains(&name.len());
        let plain = name
            .bytes()
            .all(|byte| byte.is_ascii_alphanumeric() || b"-_".contains(&byte));
        if fits && plain {
            Ok(Self(name.into()))
        } else {
            Err(NotARobotName(name.into()))
        }
    }

    /// As it was given.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl core::fmt::Display for RobotName {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.pad(&self.0)
    }
}

impl core::str::FromStr for RobotName {
    type Err = NotARobotName;

    fn from_str(name: &str) -> Result<Self, NotARobotName> {
        Self::new(name)
    }
}

#[cfg(test)]
mod tests {
    use super::RobotName;

    #[test]
    fn plain_names_pass() {
        for name in ["r1", "Robot_5", "a", "left-front", &"x".repeat(32)] {
            assert_eq!(RobotName::new(name).unwrap().as_str(), name);
        }
    }

    #[test]
    fn what_would_change_a_path_is_refused() {
        for name in ["", "a/b", "..", "a b", "é", "a\0", &"x".repeat(33)] {
            assert!(RobotName::new(name).is_err(), "{name:?}");
        }
    }
}
