//! A TCP server. Finding and reaching it may take long, so that is done aside.

use std::io::{self, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::os::unix::net::UnixStream;
use std::sync::mpsc::{Receiver, channel};
use std::thread::Builder;
use std::time::Duration;

use super::InputSpec;

/// For each number that a name has.
const PATIENCE: Duration = Duration::from_secs(5);

/// A connection that is being made.
#[derive(Debug)]
pub(super) struct Attempt {
    /// Closed when it is over.
    pub(super) over: UnixStream,
    result: Receiver<io::Result<TcpStream>>,
}

impl Attempt {
    /// Begins to connect to `address`, and will say `first` there.
    pub(super) fn begin(address: &str, first: String) -> io::Result<Self> {
        let (over, done) = UnixStream::pair()?;
        let (send, result) = channel();
        let address = address.to_owned();
        Builder::new().name("connect".into()).spawn(move || {
            // Nobody may be left to hear it.
            let _ = send.send(connect(&address, &first));
            drop(done);
        })?;
        Ok(Self { over, result })
    }

    /// What came of it, once it is over.
    pub(super) fn result(&self) -> io::Result<TcpStream> {
        self.result
            .recv()
            .unwrap_or_else(|_| Err(io::Error::other("the attempt was given up")))
    }
}

fn connect(address: &str, first: &str) -> io::Result<TcpStream> {
    let mut problem = io::Error::other("the name has no number");
    for address in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, PATIENCE) {
            Ok(mut stream) => {
                stream.write_all(first.as_bytes())?;
                stream.set_nonblocking(true)?;
                return Ok(stream);
            }
            Err(error) => problem = error,
        }
    }
    Err(problem)
}

/// What is said to a server first: gpsd is asked for what its receiver says.
pub(super) fn greeting(spec: &InputSpec) -> String {
    let InputSpec::Gpsd {
        device, as_nmea, ..
    } = spec
    else {
        return String::new();
    };
    // 2: as it came, not in hexadecimal.
    let what = if *as_nmea {
        "\"nmea\":true"
    } else {
        "\"raw\":2"
    };
    let device = device
        .iter()
        .map(|device| format!(",\"device\":\"{}\"", device.escape_default()));
    let device: String = device.collect();
    format!("?WATCH={{\"enable\":true,\"json\":false,{what}{device}}};\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gpsd_alone_is_asked() {
        let said = |spec: &str| greeting(&spec.parse().unwrap());
        assert_eq!(said("tcp:a:1"), "");
        assert_eq!(
            said("gpsd:a"),
            "?WATCH={\"enable\":true,\"json\":false,\"raw\":2};\n"
        );
        assert_eq!(
            said("gpsd:a?watch=nmea&device=/dev/x"),
            "?WATCH={\"enable\":true,\"json\":false,\"nmea\":true,\"device\":\"/dev/x\"};\n"
        );
    }
}
