//! Which bus: the string that names one in a configuration.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// A bus, by kind and place.
///
/// | string | bus |
/// | --- | --- |
/// | `socketcan:can0` | the kernel's CAN interface of that name |
/// | `candump:run.log`, `candump:run.log.gz?interface=can0` | a recorded log, played in real time, whole or one interface of it |
/// | `local:/run/user/1000/can0` | a directory of sockets: a bus between processes of one machine that needs no CAN in the kernel |
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum BusSpec {
    /// A CAN interface of the kernel.
    SocketCan {
        /// Its name, at most 15 bytes.
        interface: String,
    },
    /// A log in the format of `candump -L`, plain or gzip.
    Candump {
        /// The file.
        path: PathBuf,
        /// Only the frames of this interface.
        interface: Option<String>,
    },
    /// A directory of Unix datagram sockets.
    Local {
        /// The directory.
        directory: PathBuf,
    },
}

/// Why a string names no bus.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BusSpecError {
    /// No known kind before the colon.
    #[error(
        "'{0}' is no bus: write socketcan:INTERFACE, candump:FILE[?interface=NAME] or local:DIRECTORY"
    )]
    Kind(String),
    /// Nothing after the colon.
    #[error("'{0}' names a kind of bus but not which one")]
    Empty(String),
    /// The kernel knows no such interface names.
    #[error("'{0}' can't be a network interface: 1 to 15 bytes without '/' and spaces")]
    Interface(String),
    /// Something other than `?interface=`.
    #[error("'{0}' is no option of a candump log: the only one is ?interface=NAME")]
    Option(String),
}

/// `IFNAMSIZ` without the closing zero.
const LONGEST_INTERFACE_NAME: usize = libc::IFNAMSIZ - 1;

impl FromStr for BusSpec {
    type Err = BusSpecError;

    fn from_str(spec: &str) -> Result<Self, Self::Err> {
        let (kind, place) = spec
            .split_once(':')
            .ok_or_else(|| BusSpecError::Kind(spec.to_owned()))?;
        if place.is_empty() {
            return Err(BusSpecError::Empty(spec.to_owned()));
        }
        match kind {
            "socketcan" => Ok(Self::SocketCan {
                interface: interface(place)?,
            }),
            "candump" => candump(place),
            "local" => Ok(Self::Local {
                directory: place.into(),
            }),
            _ => Err(BusSpecError::Kind(spec.to_owned())),
        }
    }
}

fn interface(name: &str) -> Result<String, BusSpecError> {
    let legal = |byte: u8| byte.is_ascii_graphic() && byte != b'/';
    if name.is_empty() || name.len() > LONGEST_INTERFACE_NAME || !name.bytes().all(legal) {
        return Err(BusSpecError::Interface(name.to_owned()));
    }
    Ok(name.to_owned())
}

fn candump(place: &str) -> Result<BusSpec, BusSpecError> {
    let Some((path, option)) = place.split_once('?') else {
        return Ok(BusSpec::Candump {
            path: place.into(),
            interface: None,
        });
    };
    let name = option
        .strip_prefix("interface=")
        .ok_or_else(|| BusSpecError::Option(option.to_owned()))?;
    Ok(BusSpec::Candump {
        path: path.into(),
        interface: Some(interface(name)?),
    })
}

impl fmt::Display for BusSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let path = Path::display;
        match self {
            Self::SocketCan { interface } => write!(f, "socketcan:{interface}"),
            Self::Candump {
                path: file,
                interface: None,
            } => write!(f, "candump:{}", path(file)),
            Self::Candump {
                path: file,
                interface: Some(name),
            } => {
                write!(f, "candump:{}?interface={name}", path(file))
            }
            Self::Local { directory } => write!(f, "local:{}", path(directory)),
        }
    }
}

impl TryFrom<String> for BusSpec {
    type Error = BusSpecError;

    fn try_from(spec: String) -> Result<Self, Self::Error> {
        spec.parse()
    }
}

impl From<BusSpec> for String {
    fn from(spec: BusSpec) -> Self {
        spec.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_spec_is_written_as_it_was_read() {
        for spec in [
            "socketcan:can0",
            "candump:/a/b.log.gz",
            "candump:b.log?interface=vcan1",
            "local:/tmp/bus",
        ] {
            assert_eq!(spec.parse::<BusSpec>().unwrap().to_string(), spec);
        }
    }

    #[test]
    fn what_names_no_bus_is_refused_with_the_reason() {
        let refusal = |spec: &str| spec.parse::<BusSpec>().unwrap_err();
        assert_eq!(refusal("can0"), BusSpecError::Kind("can0".into()));
        assert_eq!(refusal("usb:can0"), BusSpecError::Kind("usb:can0".into()));
        assert_eq!(refusal("local:"), BusSpecError::Empty("local:".into()));
        assert_eq!(
            refusal("socketcan:a/b"),
            BusSpecError::Interface("a/b".into())
        );
        assert_eq!(
            refusal("socketcan:sixteen-bytes-xx"),
            BusSpecError::Interface("sixteen-bytes-xx".into())
        );
        assert_eq!(
            refusal("candump:x?speed=2"),
            BusSpecError::Option("speed=2".into())
        );
    }
}
