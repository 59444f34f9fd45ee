//! Where readers connect: a socket that the group may write to, which is what connecting takes.
use std::path::{Path, PathBuf};

use rustix::fd::OwnedFd;
use rustix::fs::{AtFlags, CWD, Gid, Mode};
use rustix::io::{Errno, Result};
use rustix::net::{
    AddressFamily, SocketAddrUnix, SocketFlags, SocketType, bind, connect, listen, socket_with,
};

use super::super::bells;
use super::super::transport::SHARED_MEMORY;
use super::DOOR;
use super::users::Group;

const PRIVATE: Mode = Mode::RUSR.union(Mode::WUSR);
const FOR_GROUP: Mode = PRIVATE.union(Mode::RGRP).union(Mode::WGRP);

/// So many wait for the porter.
const QUEUE: i32 = 8;

/// That of the page with this beginning of its name.
pub(super) fn path(stem: &str) -> PathBuf {
    PathBuf::from(format!("{SHARED_MEMORY}/{stem}{DOOR}"))
}

/// Opens it to the group. Until then nobody else gets in, whatever the umask.
pub(super) fn open(path: &Path, group: &Group) -> Result<OwnedFd> {
    let socket = socket()?;
    rustix::fs::fchmod(&socket, PRIVATE)?;
    bind(&socket, &SocketAddrUnix::new(path)?)?;
    let opened = listen(&socket, QUEUE).and_then(|()| give_to(path, group));
    if opened.is_err() {
        let _ = rustix::fs::unlink(path);
    }
    opened.map(|()| socket)
}

fn give_to(path: &Path, group: &Group) -> Result<()> {
    let group = Gid::from_raw(group.id());
    rustix::fs::chownat(CWD, path, None, Some(group), AtFlags::SYMLINK_NOFOLLOW)?;
    rustix::fs::chmodat(CWD, path, FOR_GROUP, AtFlags::empty())
}

/// At once: `EAGAIN` if too many want to.
pub(super) fn connected(path: &Path) -> Result<OwnedFd> {
    let socket = socket()?;
    connect(&socket, &SocketAddrUnix::new(path)?)?;
    Ok(socket)
}

/// Whether nobody is behind it any more. Nobody behind it notices.
pub(crate) fn is_dead(path: &Path) -> bool {
    // In this order: it may be removed meanwhile.
    bells::is_dead(path) || matches!(rustix::fs::lstat(path), Err(Errno::NOENT))
}

fn socket() -> Result<OwnedFd> {
    socket_with(
        AddressFamily::UNIX,
        SocketType::SEQPACKET,
        SocketFlags::CLOEXEC | SocketFlags::NONBLOCK,
        None,
    )
}
