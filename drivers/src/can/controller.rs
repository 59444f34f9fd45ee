//! How the kernel runs an interface's controller: what `ip -details link show` would say of it.

use std::fmt;

use socketcan::nl::{CanCtrlMode, InterfaceDetails};
use socketcan::{CanInterface, IoError};

use super::spec::BusSpec;

/// A controller as it is set. A virtual interface has neither a bit rate nor a restart.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Controller {
    /// Whether the interface is up.
    pub is_up: bool,
    /// On the wire \[bit/s\].
    pub bit_rate: Option<u32>,
    /// So long after it took itself off the bus it comes back \[ms\]; 0 is never.
    pub restart_ms: Option<u32>,
    /// Whether it sends nothing, not even that it has heard.
    pub only_listens: bool,
}

impl Controller {
    /// That of a bus that is an interface of this machine. A bus that is not here is no fault: it is read about elsewhere.
    #[must_use]
    pub fn of_bus(spec: &BusSpec) -> Option<(&str, Self)> {
        let BusSpec::SocketCan { interface } = spec else {
            return None;
        };
        let here = Self::of(interface).ok().flatten()?;
        Some((interface, here))
    }

    /// That of an interface on this machine; none if there is no such interface.
    ///
    /// # Errors
    /// What the kernel says if it does not answer.
    pub fn of(interface: &str) -> Result<Option<Self>, IoError> {
        // As the kernel names what is not there.
        let Ok(interface) = CanInterface::open(interface) else {
            return Ok(None);
        };
        match interface.details() {
            Ok(details) => Ok(Some(Self::from(&details))),
            Err(error) => Err(IoError::other(error.to_string())),
        }
    }

    /// What will go wrong with it on `interface`, and what to do.
    #[must_use]
    pub fn warnings(&self, interface: &str) -> Vec<String> {
        let set = |what: &str| {
            format!("ip link set {interface} down; ip link set {interface} up type can {what}")
        };
        let mut warnings = Vec::new();
        if self.bit_rate.is_some() && self.restart_ms.unwrap_or(0) == 0 {
            warnings.push(format!(
                "{interface} never comes back by itself once it has taken itself off the bus (restart-ms is 0): {}",
                set("restart-ms 100")
            ));
        }
        if self.only_listens {
            warnings.push(format!(
                "{interface} only listens: where nobody else acknowledges, the wheels repeat one frame for ever: {}",
                set("listen-only off")
            ));
        }
        warnings
    }
}

impl From<&InterfaceDetails> for Controller {
    fn from(details: &InterfaceDetails) -> Self {
        let can = &details.can;
        Self {
            is_up: details.is_up,
            bit_rate: can.bit_timing.map(|it| it.bitrate),
            restart_ms: can.restart_ms,
            only_listens: can
                .ctrl_mode
                .is_some_and(|it| it.has_mode(CanCtrlMode::ListenOnly)),
        }
    }
}

/// As on the line of a bus: `up, 500 kbit/s, back 100 ms after it left the bus`.
impl fmt::Display for Controller {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.is_up { "up" } else { "down" })?;
        if let Some(rate) = self.bit_rate {
            write!(f, ", {} kbit/s", f64::from(rate) / 1000.0)?;
        }
        match self.restart_ms {
            Some(0) => f.write_str(", never back by itself after it left the bus"),
            Some(ms) => write!(f, ", back {ms} ms after it left the bus"),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: Controller = Controller {
        is_up: true,
        bit_rate: Some(500_000),
        restart_ms: Some(100),
        only_listens: false,
    };

    #[test]
    fn a_good_one_is_told_and_not_warned_of() {
        assert_eq!(
            GOOD.to_string(),
            "up, 500 kbit/s, back 100 ms after it left the bus"
        );
        assert_eq!(GOOD.warnings("can0"), [] as [&str; 0]);
    }

    #[test]
    fn who_never_comes_back_is_warned_of_with_the_command() {
        for restart_ms in [Some(0), None] {
            let never = Controller { restart_ms, ..GOOD };
            let warnings = never.warnings("can1");
            assert_eq!(warnings.len(), 1);
            assert!(
                warnings[0].ends_with(
                    "ip link set can1 down; ip link set can1 up type can restart-ms 100"
                )
            );
        }
    }

    #[test]
    fn who_only_listens_is_warned_of() {
        let deaf = Controller {
            only_listens: true,
            ..GOOD
        };
        assert!(deaf.warnings("can0")[0].starts_with("can0 only listens"));
    }

    #[test]
    fn a_virtual_one_has_no_restart_to_set() {
        let details = InterfaceDetails {
            is_up: true,
            ..InterfaceDetails::new(7)
        };
        let controller = Controller::from(&details);
        assert_eq!(controller.to_string(), "up");
        assert!(controller.warnings("vcan0").is_empty());
    }

    #[test]
    fn what_is_not_there_is_none_and_what_is_no_can_has_no_rate() {
        assert_eq!(Controller::of("can-nowhere").unwrap(), None);
        let loopback = Controller::of("lo").unwrap().unwrap();
        assert_eq!((loopback.bit_rate, loopback.restart_ms), (None, None));
    }
}
