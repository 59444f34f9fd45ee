//! The kinds of input that a daemon takes in.

/// What can change a belief, or judges it; indexes `health`, `accepted` and `rejected` of the payloads.
///
/// The numbers are part of the payloads' version; a new one takes the first that is spare.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum Input {
    /// Wheel encoders, over CAN or a driver.
    Odometry = 0,
    /// Sightings of other robots.
    RelativePose = 1,
    /// Satellite fixes.
    Position = 2,
    /// What neighbours say.
    Neighbour = 3,
    /// Poses that a person or a map says.
    Pose = 4,
    /// Headings: a compass, two antennas, the course over ground.
    Heading = 5,
    /// Yaw rates of a gyro.
    Gyro = 6,
    /// Sightings of other robots, or of landmarks, that say a part only.
    Sighting = 7,
    /// Where other robots have seen this one in part.
    Seen = 8,
    /// Where robots believed to be that this one has seen in part.
    Answer = 9,
    /// Where leaders have this robot.
    Assist = 10,
    /// What became of what this robot handed on of leaders' words.
    AssistAck = 11,
    /// What the team's rounds do to the belief.
    Correction = 12,
    /// What other robots have seen of children, for a leader.
    Readings = 13,
    /// Where this robot must be, as `coloc-bounds` has it: it changes no belief.
    Integrity = 14,
}

impl Input {
    /// How many there are.
    pub const COUNT: usize = 15;
    /// So many have a place in the payloads; those without a name are spare.
    pub const PLACES: usize = 16;
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; Self::COUNT] = [
        Self::Odometry,
        Self::RelativePose,
        Self::Position,
        Self::Neighbour,
        Self::Pose,
        Self::Heading,
        Self::Gyro,
        Self::Sighting,
        Self::Seen,
        Self::Answer,
        Self::Assist,
        Self::AssistAck,
        Self::Correction,
        Self::Readings,
        Self::Integrity,
    ];

    /// As it is printed.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Odometry => "odometry",
            Self::RelativePose => "relative_pose",
            Self::Position => "position",
            Self::Neighbour => "neighbour",
            Self::Pose => "pose",
            Self::Heading => "heading",
            Self::Gyro => "gyro",
            Self::Sighting => "sighting",
            Self::Seen => "seen",
            Self::Answer => "answer",
            Self::Assist => "assist",
            Self::AssistAck => "assist_ack",
            Self::Correction => "correction",
            Self::Readings => "readings",
            Self::Integrity => "integrity",
        }
    }
}

impl core::fmt::Display for Input {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.pad(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::Input;

    /// Logs, status and recordings say them: whoever looks for one finds it.
    #[test]
    fn names_are_as_they_are_printed() {
        let names = Input::ALL.map(|input| input.to_string());
        assert_eq!(
            names,
            [
                "odometry",
                "relative_pose",
                "position",
                "neighbour",
                "pose",
                "heading",
                "gyro",
                "sighting",
                "seen",
                "answer",
                "assist",
                "assist_ack",
                "correction",
                "readings",
                "integrity"
            ]
        );
    }

    #[test]
    fn numbers_are_places_in_the_list() {
        for (place, input) in Input::ALL.into_iter().enumerate() {
            assert_eq!(input as usize, place);
        }
    }
}
