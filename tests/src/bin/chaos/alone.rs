//! A mount namespace of this program's own, so that file systems can be filled without anybody else noticing.

use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Command, Stdio};

use coloc_tests::output::complain;

use crate::files::SHARED_MEMORY;

/// Enough for everything but the scenes that fill it.
const SHARED_MEMORY_KIB: u64 = 128 << 10;
/// Few enough for all to be taken soon.
const FILES: u64 = 4000;

/// Begins again within one, where that is allowed.
pub(crate) fn begin_again() {
    if !can_unshare() {
        return;
    }
    let problem = Command::new("unshare")
        .args(["--mount", "--propagation", "private"])
        .arg(std::env::current_exe().unwrap())
        .args(std::env::args_os().skip(1))
        .arg("--alone")
        .exec();
    complain(&format!("chaos: no mount namespace: {problem}"));
}

fn can_unshare() -> bool {
    let probe = Command::new("unshare")
        .args(["--mount", "--propagation", "private", "true"])
        .stderr(Stdio::null())
        .status();
    probe.is_ok_and(|status| status.success())
}

/// Shared memory of its own.
pub(crate) fn settle_in() {
    mount_memory(Path::new(SHARED_MEMORY), SHARED_MEMORY_KIB);
}

/// A file system in memory of this size \[KiB\].
pub(crate) fn mount_memory(at: &Path, size_kib: u64) {
    let status = Command::new("mount")
        .args([
            "-t",
            "tmpfs",
            "-o",
            &format!("size={size_kib}k,nr_inodes={FILES}"),
            "tmpfs",
        ])
        .arg(at)
        .status()
        .unwrap();
    assert!(status.success(), "cannot mount on {}", at.display());
}

/// Whoever is still in it keeps it until they end.
pub(crate) fn unmount(at: &Path) {
    let _ = Command::new("umount").arg("--lazy").arg(at).status();
}
