//! CANopen drives on one of the buses: started, given SYNC, listened to.

use coloc_drivers::can::{BusSpec, Errno, Filter, Frame, Received, Sender};
use coloc_drivers::canopen::Canopen;

use crate::account::Account;
use crate::config::Config;
use crate::start::StartError;

/// The nodes, and what speaks to them. Sending neither blocks nor allocates.
#[derive(Debug)]
pub(super) struct Drives {
    canopen: Canopen,
    spec: BusSpec,
    /// None where nothing is to be sent.
    sender: Option<Sender>,
}

impl Drives {
    /// None where none are configured.
    ///
    /// # Errors
    /// A bus to which nothing can be sent.
    pub(super) fn open(config: &Config) -> Result<Option<Self>, StartError> {
        let Some((canopen, spec)) = config.canopen.as_ref().zip(spec(config)) else {
            return Ok(None);
        };
        let sends = canopen.start || canopen.sync_period_s.is_some();
        Ok(Some(Self {
            canopen: Canopen::new(canopen),
            sender: sends.then(|| Sender::awaiting(spec)).transpose()?,
            spec: spec.clone(),
        }))
    }

    /// What they want from bus `number`, beside `filter`.
    pub(super) fn widen(&self, number: u8, filter: Filter) -> Filter {
        match filter {
            Filter::Ids(ids) if number == self.canopen.bus() => {
                Filter::ids(ids.into_iter().chain(self.canopen.wanted_ids()))
            }
            other => other,
        }
    }

    /// Whether the frame was theirs.
    pub(super) fn hear(&mut self, received: &Received) -> bool {
        received.bus == self.canopen.bus() && self.canopen.hear(&received.frame)
    }

    /// Sends what is due at `now_ns`, and tells what has happened.
    pub(super) fn look(&mut self, now_ns: i64, account: &mut Account) {
        let Self {
            canopen,
            spec,
            sender,
        } = self;
        let mut send = |frame: &Frame| {
            let Some(sender) = sender else { return false };
            match sender.send(frame) {
                Ok(()) => true,
                Err(Errno::NODEV | Errno::NXIO | Errno::NETDOWN) => {
                    // Where it is not back yet the next frame tries again.
                    let _ = sender.reopen(spec);
                    false
                }
                Err(_) => false,
            }
        };
        canopen.look(now_ns, &mut send, &mut |event| account.canopen(event));
    }

    /// Boot-ups, and nodes whose heartbeat is missing.
    pub(super) fn counts(&self) -> [u64; 2] {
        [self.canopen.boots(), self.canopen.missing()]
    }
}

fn spec(config: &Config) -> Option<&BusSpec> {
    let number = usize::from(config.canopen.as_ref()?.bus);
    config.odometry.as_ref()?.buses.get(number)
}
