//! How sensors and buses are doing.

/// How a sensor is doing.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Health {
    /// Nothing was ever received.
    #[default]
    NeverSeen = 0,
    /// News arrives in time and passes.
    Ok = 1,
    /// No news for longer than it may take.
    Stale = 2,
    /// News arrives and is wrong, or its source is broken.
    Faulty = 3,
    /// News arrives in time, and none of it passes.
    Refused = 4,
}

impl Health {
    /// The byte of a payload, decoded. A byte of no known meaning is [`Self::Faulty`]: nobody should trust it.
    #[must_use]
    pub const fn from_byte(byte: u8) -> Self {
        match byte {
            0 => Self::NeverSeen,
            1 => Self::Ok,
            2 => Self::Stale,
            4 => Self::Refused,
            _ => Self::Faulty,
        }
    }

    /// As it is printed.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::NeverSeen => "never_seen",
            Self::Ok => "ok",
            Self::Stale => "stale",
            Self::Faulty => "faulty",
            Self::Refused => "refused",
        }
    }
}

impl core::fmt::Display for Health {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.pad(self.name())
    }
}

/// How a CAN bus is doing, from good to bad.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum BusState {
    /// Open, without complaint.
    #[default]
    Active = 0,
    /// An error counter of the controller passed its warning level.
    Warning = 1,
    /// The controller is error-passive: it can listen but hardly be heard.
    Passive = 2,
    /// The controller has left the bus.
    Off = 3,
    /// The interface is down, gone, or could not be opened.
    Down = 4,
}

impl BusState {
    /// The byte of a payload, decoded. A byte of no known meaning is [`Self::Down`]: nobody should trust it.
    #[must_use]
    pub const fn from_byte(byte: u8) -> Self {
        match byte {
            0 => Self::Active,
            1 => Self::Warning,
            2 => Self::Passive,
            3 => Self::Off,
            _ => Self::Down,
        }
    }

    /// As it is printed.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Active => "active",
            Self::Warning => "warning",
            Self::Passive => "passive",
            Self::Off => "off",
            Self::Down => "down",
        }
    }
}

impl core::fmt::Display for BusState {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.pad(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::{BusState, Health};

    #[test]
    fn every_byte_has_a_meaning() {
        for health in [
            Health::NeverSeen,
            Health::Ok,
            Health::Stale,
            Health::Faulty,
            Health::Refused,
        ] {
            assert_eq!(Health::from_byte(health as u8), health);
        }
        assert_eq!(Health::from_byte(5), Health::Faulty);
        assert_eq!(Health::from_byte(255), Health::Faulty);
    }

    #[test]
    fn names_are_as_they_are_printed() {
        let health = [0, 1, 2, 3, 4].map(|byte| Health::from_byte(byte).to_string());
        assert_eq!(health, ["never_seen", "ok", "stale", "faulty", "refused"]);
        let buses = [0, 1, 2, 3, 4].map(|byte| BusState::from_byte(byte).to_string());
        assert_eq!(buses, ["active", "warning", "passive", "off", "down"]);
    }

    #[test]
    fn an_unknown_bus_state_is_the_worst() {
        for state in [
            BusState::Active,
            BusState::Warning,
            BusState::Passive,
            BusState::Off,
            BusState::Down,
        ] {
            assert_eq!(BusState::from_byte(state as u8), state);
        }
        assert_eq!(BusState::from_byte(200), BusState::Down);
    }
}
