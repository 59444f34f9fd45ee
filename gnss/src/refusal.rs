//! Why a fix or a heading is not published.

/// The reasons; their numbers are places in `refused` of the driver's status.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Refusal {
    /// The receiver has no fix.
    NoFix = 0,
    /// Its quality is none that counts.
    Quality = 1,
    /// Too few satellites.
    Satellites = 2,
    /// They stand too close together.
    Hdop = 3,
    /// The receiver itself says that it is too bad.
    Accuracy = 4,
    /// It is not where the fix before and its velocity lead.
    Jump = 5,
    /// No date is known yet, so its time is not either.
    NoDate = 6,
    /// Its time and the computer's are too far apart.
    Clock = 7,
    /// The datum is being measured.
    NoDatum = 8,
    /// It is more than 50 km from the datum.
    Far = 9,
    /// A fix of this time, or a later one, was here before.
    Repeated = 10,
    /// A heading without a fix that is good enough.
    Heading = 11,
    /// The channel did not take it.
    Channel = 12,
}

impl Refusal {
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; 13] = [
        Self::NoFix,
        Self::Quality,
        Self::Satellites,
        Self::Hdop,
        Self::Accuracy,
        Self::Jump,
        Self::NoDate,
        Self::Clock,
        Self::NoDatum,
        Self::Far,
        Self::Repeated,
        Self::Heading,
        Self::Channel,
    ];

    /// As it is printed.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::NoFix => "no_fix",
            Self::Quality => "quality",
            Self::Satellites => "satellites",
            Self::Hdop => "hdop",
            Self::Accuracy => "accuracy",
            Self::Jump => "jump",
            Self::NoDate => "no_date",
            Self::Clock => "clock",
            Self::NoDatum => "no_datum",
            Self::Far => "far",
            Self::Repeated => "repeated",
            Self::Heading => "heading",
            Self::Channel => "channel",
        }
    }

    /// As it stands in the log.
    #[must_use]
    pub fn said(self) -> String {
        format!("refused as {}: {}", self.name(), self.advice())
    }

    /// What a person can do about it.
    #[must_use]
    pub const fn advice(self) -> &'static str {
        match self {
            Self::NoFix => "the receiver has no fix: does its antenna see the sky?",
            Self::Quality => {
                "the quality of the fixes is none of [gnss.gate] qualities, or until a minute was good of [gnss.start_gate]"
            }
            Self::Satellites => {
                "the fixes have too few satellites for [gnss.gate], or until a minute was good for [gnss.start_gate]"
            }
            Self::Hdop => {
                "the satellites stand too close together for [gnss.gate], or until a minute was good for [gnss.start_gate]"
            }
            Self::Accuracy => {
                "the receiver states a larger error than [gnss.gate] allows, or until a minute was good [gnss.start_gate]"
            }
            Self::Jump => "a fix jumped",
            Self::NoDate => {
                "no sentence says the date: have the receiver send RMC or ZDA, or set stamp = \"arrival\""
            }
            Self::Clock => {
                "the fixes' time and the computer's clock are too far apart: have the clock set by NTP or the receiver, or set \
                 stamp = \"arrival\""
            }
            Self::NoDatum => "the datum is being measured",
            Self::Far => "the fixes are more than 50 km from the datum: is it that of this place?",
            Self::Repeated => "a time came twice or backwards",
            Self::Heading => "a heading is not valid",
            Self::Channel => "the channel did not take a message",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_places() {
        for (place, refusal) in Refusal::ALL.into_iter().enumerate() {
            assert_eq!(refusal as usize, place);
            let same = Refusal::ALL.iter().filter(|it| it.name() == refusal.name());
            assert_eq!(same.count(), 1);
        }
    }
}
