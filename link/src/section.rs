//! `[link]` of `robot.toml`.
use std::net::SocketAddr;
use std::path::PathBuf;

use coloc_daemon::config::{Config, Section};
use coloc_shm_types::places::{NoPlace, state_directory};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How the robot's link works. Who the others are, and where, stands in the team's `fleet.toml`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Link {
    /// Where others call it: an address of this computer and a UDP port; `[::]:7373` is every address.
    #[schemars(example = &"0.0.0.0:7373")]
    pub listen: String,
    /// Its own directory, with the robot's private key, the team's public one and the roster. Empty: `link-<robot>` where the belief is.
    pub directory: PathBuf,
    /// Members are found by multicast DNS too, and find this one. It is a hint where to call: the roster's keys decide. Off: no multicast.
    pub discover: bool,
    /// Everybody may make the keys of such a team: for trying things out on one computer, and refused for any address but loopback.
    pub insecure: bool,
    /// So many bytes a second may be sent to each member \[B/s\].
    #[schemars(range(min = 1000, max = 1_000_000_000))]
    pub max_bytes_per_s: u32,
    /// Estimates, status and so on go to stations that often \[Hz\].
    #[schemars(range(min = 0.01, max = 50))]
    pub watch_hz: f64,
    /// Messages of a member whose clock is off by more are refused \[s\].
    #[schemars(range(max = 3600), extend("exclusiveMinimum" = 0))]
    pub max_offset_s: f64,
    /// Stamps of a member whose clock is off are corrected instead.
    pub correct_offset: bool,
}

/// Where others call it, unless it is said otherwise.
pub const LISTEN: &str = "0.0.0.0:7373";

impl Default for Link {
    fn default() -> Self {
        Self {
            listen: LISTEN.into(),
            directory: PathBuf::new(),
            discover: false,
            insecure: false,
            max_bytes_per_s: 200_000,
            watch_hz: 2.0,
            max_offset_s: 0.05,
            correct_offset: false,
        }
    }
}

impl Section for Link {
    const NAME: &'static str = "link";

    fn refusals(&self) -> Vec<(String, String)> {
        let refusal = match self.listen.parse::<SocketAddr>() {
            Err(_) => "must be an address and a port, as in \"0.0.0.0:7373\" or \"[::]:7373\"",
            Ok(address) if self.insecure && !address.ip().is_loopback() => {
                "must be loopback, as in \"127.0.0.1:7373\", where link.insecure = true: everybody has the keys"
            }
            Ok(_) => return Vec::new(),
        };
        vec![("listen".into(), format!(" = {:?}: {refusal}", self.listen))]
    }
}

impl Link {
    /// The address of [`Self::listen`]; that it is one was checked before.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        let any = SocketAddr::from(([0, 0, 0, 0], 0));
        self.listen.parse().unwrap_or(any)
    }

    /// Its own directory.
    ///
    /// # Errors
    /// If none is configured and this user has no place for state.
    pub fn own_directory(&self, config: &Config) -> Result<PathBuf, NoPlace> {
        if !self.directory.as_os_str().is_empty() {
            return Ok(self.directory.clone());
        }
        Ok(state_directory()?.join(format!("link-{}", config.robot.name)))
    }
}
