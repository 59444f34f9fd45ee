//! How a person says where bytes come from: `serial:/dev/ttyUSB0?baud=115200`.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Where bytes come from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum InputSpec {
    /// A serial device.
    Serial {
        /// The device.
        path: PathBuf,
        /// Bits a second.
        baud: u32,
    },
    /// A server that sends what its sensor says.
    Tcp {
        /// Name or number, and port.
        address: String,
    },
    /// gpsd, which is asked for what its receiver says.
    Gpsd {
        /// Name or number, and port.
        address: String,
        /// The receiver, if gpsd has several.
        device: Option<String>,
        /// gpsd's translation to NMEA, for receivers with another language.
        as_nmea: bool,
    },
    /// A recording, plain or gzip.
    File {
        /// The file.
        path: PathBuf,
        /// At the speed at which it was recorded, else as fast as it can be read.
        paced: bool,
    },
    /// Standard input, plain or gzip.
    Stdin {
        /// As that of a file.
        paced: bool,
    },
}

/// What every refusal ends with.
const FORMS: &str =
    "write serial:/dev/NAME?baud=9600, tcp:HOST:PORT, gpsd:HOST:2947, file:PATH or stdin";
const GPSD_PORT: &str = "2947";
/// What a receiver has that nobody has set.
const BAUD: u32 = 9600;

impl FromStr for InputSpec {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (rest, options) = text.split_once('?').unwrap_or((text, ""));
        let mut options = Options::new(options)?;
        let (scheme, place) = rest.split_once(':').unwrap_or((rest, ""));
        let spec = match (scheme, place) {
            ("serial", "") => Err("it lacks the device: serial:/dev/NAME?baud=9600".to_owned()),
            ("serial", path) => options.baud().map(|baud| Self::Serial {
                path: path.into(),
                baud,
            }),
            ("tcp", address) => has_port(address).map(|address| Self::Tcp { address }),
            ("gpsd", address) => Ok(Self::Gpsd {
                address: with_port(address),
                device: options.take("device").map(ToOwned::to_owned),
                as_nmea: options.choice("watch", ["raw", "nmea"])? == 1,
            }),
            ("file", "") => Err("it lacks the path: file:PATH".into()),
            ("file", path) => options.is_paced("recorded").map(|paced| Self::File {
                path: path.into(),
                paced,
            }),
            ("stdin", "") => options.is_paced("full").map(|paced| Self::Stdin { paced }),
            _ => Err(FORMS.into()),
        }?;
        options.end()?;
        Ok(spec)
    }
}

fn has_port(address: &str) -> Result<String, String> {
    let has = address.rsplit_once(':').is_some_and(|(host, port)| {
        !host.is_empty() && port.parse::<u16>().is_ok_and(|port| port > 0)
    });
    has.then(|| address.to_owned())
        .ok_or_else(|| "it lacks host or port: tcp:HOST:PORT".into())
}

/// `localhost`, `host`, `host:port`, `[::1]` or `[::1]:port`.
fn with_port(address: &str) -> String {
    match address {
        "" => format!("localhost:{GPSD_PORT}"),
        _ if has_port(address).is_ok() && !address.ends_with(']') => address.to_owned(),
        _ => format!("{address}:{GPSD_PORT}"),
    }
}

/// What stands behind the question mark.
struct Options<'t>(Vec<(&'t str, &'t str)>);

impl<'t> Options<'t> {
    fn new(text: &'t str) -> Result<Self, String> {
        let options = text.split('&').filter(|option| !option.is_empty());
        let pair = |option: &'t str| {
            option
                .split_once('=')
                .ok_or_else(|| format!("`{option}` is no option; one is written NAME=VALUE"))
        };
        options.map(pair).collect::<Result<_, _>>().map(Self)
    }

    fn take(&mut self, name: &str) -> Option<&'t str> {
        let place = self.0.iter().position(|(known, _)| *known == name)?;
        Some(self.0.remove(place).1)
    }

    /// Which of two words was chosen; the first if none was.
    fn choice(&mut self, name: &str, words: [&str; 2]) -> Result<usize, String> {
        let Some(value) = self.take(name) else {
            return Ok(0);
        };
        let place = words.iter().position(|word| *word == value);
        place.ok_or_else(|| format!("{name}={value}: it may be {} or {}", words[0], words[1]))
    }

    fn baud(&mut self) -> Result<u32, String> {
        let Some(value) = self.take("baud") else {
            return Ok(BAUD);
        };
        let baud = value
            .parse()
            .ok()
            .filter(|baud| (50..=4_000_000).contains(baud));
        baud.ok_or_else(|| format!("baud={value}: it may be 50 to 4000000"))
    }

    fn is_paced(&mut self, default: &str) -> Result<bool, String> {
        match self.take("speed").unwrap_or(default) {
            "recorded" => Ok(true),
            "full" => Ok(false),
            other => Err(format!("speed={other}: it may be recorded or full")),
        }
    }

    fn end(self) -> Result<(), String> {
        match self.0.first() {
            None => Ok(()),
            Some((name, _)) => Err(format!("it has no option {name}")),
        }
    }
}

impl fmt::Display for InputSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Serial { path, baud } => write!(f, "serial:{}?baud={baud}", path.display()),
            Self::Tcp { address } => write!(f, "tcp:{address}"),
            Self::Gpsd {
                address,
                device,
                as_nmea,
            } => {
                let watch = if *as_nmea { "nmea" } else { "raw" };
                write!(f, "gpsd:{address}?watch={watch}")?;
                device
                    .as_ref()
                    .map_or(Ok(()), |device| write!(f, "&device={device}"))
            }
            Self::File { path, paced } => {
                write!(f, "file:{}?speed={}", path.display(), speed(*paced))
            }
            Self::Stdin { paced } => write!(f, "stdin?speed={}", speed(*paced)),
        }
    }
}

fn speed(paced: bool) -> &'static str {
    if paced { "recorded" } else { "full" }
}

impl InputSpec {
    /// A relative path begins in `directory`.
    #[must_use]
    pub fn below(mut self, directory: &Path) -> Self {
        if let Self::Serial { path, .. } | Self::File { path, .. } = &mut self {
            *path = directory.join(&*path);
        }
        self
    }

    /// Whether it was recorded and ends, rather than being measured now.
    #[must_use]
    pub fn is_recording(&self) -> bool {
        matches!(self, Self::File { .. } | Self::Stdin { paced: true })
    }

    /// Whether it is played at the speed at which it was recorded.
    #[must_use]
    pub fn is_paced(&self) -> bool {
        matches!(
            self,
            Self::File { paced: true, .. } | Self::Stdin { paced: true }
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_shown_reads_as_the_same() {
        for text in [
            "serial:/dev/ttyUSB0?baud=115200",
            "tcp:10.0.0.2:5000",
            "gpsd:localhost:2947?watch=raw",
            "gpsd:[::1]:2947?watch=nmea&device=/dev/ttyS0",
            "file:/a/b.gz?speed=full",
            "stdin?speed=full",
        ] {
            let spec: InputSpec = text.parse().unwrap();
            assert_eq!(spec.to_string(), text);
        }
        for (short, long) in [
            ("serial:/dev/x", "serial:/dev/x?baud=9600"),
            ("gpsd", "gpsd:localhost:2947?watch=raw"),
            ("gpsd:robot", "gpsd:robot:2947?watch=raw"),
            ("gpsd:[::1]", "gpsd:[::1]:2947?watch=raw"),
            ("file:x", "file:x?speed=recorded"),
            ("stdin", "stdin?speed=full"),
        ] {
            assert_eq!(short.parse(), long.parse::<InputSpec>(), "{short}");
        }
    }

    #[test]
    fn what_is_wrong_is_refused_with_what_is_right() {
        for (text, said) in [
            ("usb:0", "write serial:/dev/NAME?baud=9600, tcp:"),
            ("serial:", "it lacks the device"),
            ("serial:/dev/x?baud=fast", "baud=fast: it may be 50 to"),
            ("serial:/dev/x?baud", "`baud` is no option"),
            ("serial:/dev/x?speed=full", "it has no option speed"),
            ("tcp:host", "it lacks host or port"),
            ("tcp::5", "it lacks host or port"),
            (
                "file:x?speed=slow",
                "speed=slow: it may be recorded or full",
            ),
            ("gpsd:x?watch=json", "watch=json: it may be raw or nmea"),
            ("", "write serial:"),
        ] {
            let refusal = text.parse::<InputSpec>().unwrap_err();
            assert!(refusal.starts_with(said), "{text}: {refusal}");
        }
    }
}
