//! A serial device: eight bits, no parity, one stop bit, nothing translated, nothing written.

use std::io;
use std::os::fd::OwnedFd;
use std::path::Path;

use rustix::fs::{Mode, OFlags, open};
use rustix::io::Errno;
use rustix::termios::{
    ControlModes, OptionalActions, QueueSelector, ioctl_tiocexcl, tcflush, tcgetattr, tcsetattr,
};

/// Opens it for this program alone.
pub(super) fn open_serial(path: &Path, baud: u32) -> io::Result<OwnedFd> {
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
    let device = open(path, flags, Mode::empty())?;
    let mut modes = match tcgetattr(&device) {
        Err(Errno::NOTTY) => return Err(io::Error::other("it is no serial device")),
        modes => modes?,
    };
    // Two readers would get half of the bytes each.
    ioctl_tiocexcl(&device)?;
    modes.make_raw();
    modes.control_modes |= ControlModes::CLOCAL | ControlModes::CREAD;
    modes.control_modes -= ControlModes::CRTSCTS | ControlModes::CSTOPB | ControlModes::HUPCL;
    modes.set_speed(baud)?;
    tcsetattr(&device, OptionalActions::Now, &modes)?;
    // What waited came at another speed.
    tcflush(&device, QueueSelector::IFlush)?;
    Ok(device)
}
