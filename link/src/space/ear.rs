//! What is said on a channel, as bytes.
use std::fmt;
use std::io;
use std::os::fd::BorrowedFd;
use std::os::unix::net::UnixDatagram as Socket;

use coloc_shm_types::{
    Channel, Header, Message, OnPayload, PortError, RobotName, Space, Subscriber,
};
use tokio::io::Interest;
use tokio::net::UnixDatagram;

/// Listens to a channel of a robot.
pub struct Ear {
    port: Box<dyn Port>,
    bell: Option<UnixDatagram>,
    bytes: Vec<u8>,
}

impl Ear {
    /// Listens to that robot's channel, which is made if nobody has it yet: who speaks finds somebody who listens. It costs who speaks
    /// nothing.
    ///
    /// # Errors
    /// If the channel cannot be opened.
    pub fn open(space: &Space, robot: &RobotName, channel: Channel) -> Result<Self, PortError> {
        Ok(Self {
            port: channel.with_payload(Open { space, robot })?,
            bell: None,
            bytes: vec![0; channel.told().size],
        })
    }

    /// The same, to be woken by what is said: [`Self::wait`] returns then.
    ///
    /// # Errors
    /// If the channel cannot be opened, or there is nothing to be woken by.
    ///
    /// # Panics
    /// Outside of a runtime.
    pub fn open_to_wait(
        space: &Space,
        robot: &RobotName,
        channel: Channel,
    ) -> Result<Self, PortError> {
        let mut ear = Self::open(space, robot, channel)?;
        let bell = bell(ear.port.bell()?).map_err(|source| PortError::Refused {
            service: format!("coloc/{robot}/{}", channel.name()),
            source,
            advice: "see what limits descriptors (ulimit -n)",
        })?;
        ear.bell = Some(bell);
        Ok(ear)
    }

    /// Waits until there may be something to hear, after [`Self::hear`] has found nothing more; for ever if nothing wakes it.
    pub async fn wait(&self) {
        let Some(bell) = &self.bell else {
            return std::future::pending().await;
        };
        let rung = bell.readable().await;
        // The byte is the port's to read; here it only counts that it came.
        let forget = || Err::<(), _>(io::ErrorKind::WouldBlock.into());
        if rung.is_ok() {
            let _ = bell.try_io(Interest::READABLE, forget);
        }
    }

    /// Hands everything to `take` that was said since, the oldest first. Whether all of it could be read.
    pub fn hear(&mut self, take: &mut dyn FnMut(&Header, &[u8])) -> bool {
        self.port.hear(&mut self.bytes, take)
    }
}

impl fmt::Debug for Ear {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Ear").finish_non_exhaustive()
    }
}

/// The port's bell, for this runtime: a socket of which nothing is read.
fn bell(bell: BorrowedFd<'_>) -> io::Result<UnixDatagram> {
    let socket = Socket::from(bell.try_clone_to_owned()?);
    socket.set_nonblocking(true)?;
    UnixDatagram::from_std(socket)
}

trait Port {
    fn bell(&self) -> Result<BorrowedFd<'_>, PortError>;

    fn hear(&self, bytes: &mut [u8], take: &mut dyn FnMut(&Header, &[u8])) -> bool;
}

impl<M: Message> Port for Subscriber<M> {
    fn bell(&self) -> Result<BorrowedFd<'_>, PortError> {
        Self::bell(self)
    }

    fn hear(&self, bytes: &mut [u8], take: &mut dyn FnMut(&Header, &[u8])) -> bool {
        loop {
            match self.receive() {
                Ok(Some(message)) => {
                    if message.put(bytes).is_some() {
                        take(message.header(), bytes);
                    }
                }
                Ok(None) => return true,
                Err(_) => return false,
            }
        }
    }
}

struct Open<'a> {
    space: &'a Space,
    robot: &'a RobotName,
}

impl OnPayload for Open<'_> {
    type Out = Result<Box<dyn Port>, PortError>;

    fn on<M: Message>(self) -> Self::Out {
        let port = self.space.subscriber::<M>(self.robot)?;
        Ok(Box::new(port))
    }
}
