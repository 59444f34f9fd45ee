//! The clocks that stamps are of, and which start of a computer they belong to.
use std::sync::OnceLock;

use crate::Reject;

/// The clock of a stamp, as the byte `clock` of a [`Header`](crate::Header) says it.
///
/// A driver on the robot's own computer does best with [`Self::Boottime`]: it is never set, so nobody has to guess on
/// which side of a step a stamp was made.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Clock {
    /// `CLOCK_BOOTTIME`: nanoseconds since the computer started, its sleep included. It never steps; two computers, or two
    /// starts of one, have nothing in common.
    #[default]
    Boottime = 0,
    /// `CLOCK_REALTIME`: nanoseconds since 1970-01-01 00:00 UTC, as the computer knows it. NTP or a person may set it.
    Realtime = 1,
    /// `CLOCK_TAI`: as [`Self::Realtime`], but without leap seconds.
    Tai = 2,
}

impl Clock {
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; 3] = [Self::Boottime, Self::Realtime, Self::Tai];

    /// The byte of a header, decoded.
    ///
    /// # Errors
    /// [`Reject::UnknownClock`] if the byte has no meaning: nobody can know when that was.
    pub const fn from_byte(byte: u8) -> Result<Self, Reject> {
        match byte {
            0 => Ok(Self::Boottime),
            1 => Ok(Self::Realtime),
            2 => Ok(Self::Tai),
            _ => Err(Reject::UnknownClock),
        }
    }

    /// As it is printed.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Boottime => "boottime",
            Self::Realtime => "realtime",
            Self::Tai => "tai",
        }
    }
}

impl core::fmt::Display for Clock {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.pad(self.name())
    }
}

/// One moment by several clocks (ns); `None` by a clock that stamps cannot be compared with.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Present {
    /// By `CLOCK_BOOTTIME`.
    pub boottime_ns: Option<i64>,
    /// By `CLOCK_REALTIME`.
    pub realtime_ns: Option<i64>,
    /// By `CLOCK_TAI`.
    pub tai_ns: Option<i64>,
}

impl Present {
    /// Known by one clock alone.
    #[must_use]
    pub const fn only(clock: Clock, now_ns: i64) -> Self {
        let unknown = Self {
            boottime_ns: None,
            realtime_ns: None,
            tai_ns: None,
        };
        let now = Some(now_ns);
        match clock {
            Clock::Boottime => Self {
                boottime_ns: now,
                ..unknown
            },
            Clock::Realtime => Self {
                realtime_ns: now,
                ..unknown
            },
            Clock::Tai => Self {
                tai_ns: now,
                ..unknown
            },
        }
    }

    /// By `clock` (ns).
    #[must_use]
    pub const fn of(&self, clock: Clock) -> Option<i64> {
        match clock {
            Clock::Boottime => self.boottime_ns,
            Clock::Realtime => self.realtime_ns,
            Clock::Tai => self.tai_ns,
        }
    }
}

/// Which start of which computer this is, for `boot` of a [`Header`](crate::Header): the first eight bytes of the UUID in
/// `/proc/sys/kernel/random/boot_id`. 0 where the kernel does not say.
#[must_use]
pub fn boot() -> u64 {
    static BOOT: OnceLock<u64> = OnceLock::new();
    *BOOT.get_or_init(|| {
        let uuid = std::fs::read_to_string("/proc/sys/kernel/random/boot_id");
        let boot = uuid.ok().and_then(|uuid| first_eight_bytes(&uuid));
        boot.unwrap_or(0)
    })
}

fn first_eight_bytes(uuid: &str) -> Option<u64> {
    let digits: String = uuid
        .chars()
        .filter(char::is_ascii_hexdigit)
        .take(16)
        .collect();
    let whole = digits.len() == 16;
    whole.then(|| u64::from_str_radix(&digits, 16).ok())?
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_is_a_clock_or_refused() {
        for byte in 0..=u8::MAX {
            match Clock::from_byte(byte) {
                Ok(clock) => assert_eq!(clock as u8, byte),
                Err(reason) => assert!(byte > 2 && reason == Reject::UnknownClock),
            }
        }
    }

    #[test]
    fn who_knows_one_clock_knows_no_other() {
        for known in Clock::ALL {
            let present = Present::only(known, 7);
            for clock in Clock::ALL {
                assert_eq!(present.of(clock), (clock == known).then_some(7));
            }
        }
    }

    #[test]
    fn a_boot_is_the_first_half_of_its_uuid() {
        let uuid = "0123abcd-ef45-4678-9abc-def012345678\n";
        assert_eq!(first_eight_bytes(uuid), Some(0x0123_abcd_ef45_4678));
        assert_eq!(first_eight_bytes("0123"), None);
        assert_ne!(boot(), 0);
        assert_eq!(boot(), boot());
    }
}
