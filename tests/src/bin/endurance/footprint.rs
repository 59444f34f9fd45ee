//! What this process holds.

use std::fs;
use std::path::Path;
use std::thread::sleep;
use std::time::Duration;

const LOOKS: u32 = 20;
const BETWEEN_LOOKS: Duration = Duration::from_millis(1);

/// What must not grow.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) struct Footprint {
    /// Memory that is its own \[KiB\].
    pub(crate) own_kib: u64,
    /// Open descriptors.
    pub(crate) descriptors: usize,
    /// Files in shared memory's root.
    pub(crate) files: usize,
}

impl Footprint {
    /// Now; `root` is where shared memory has its files.
    pub(crate) fn now(root: &Path) -> Self {
        Self {
            own_kib: own_kib(),
            descriptors: descriptors(),
            files: files(root),
        }
    }
}

/// What the process has for itself, from the page tables: the counters of `statm` lag behind. Shared memory is in files of fixed
/// size, of which a busy machine's slow reader uses more.
fn own_kib() -> u64 {
    let rollup = fs::read_to_string("/proc/self/smaps_rollup").unwrap();
    let own = rollup
        .lines()
        .find_map(|line| line.strip_prefix("Anonymous:"));
    let kib = own.and_then(|rest| rest.split_whitespace().next());
    kib.unwrap().parse().unwrap()
}

/// The fewest of several looks: telemetry has some more while it looks what the dead have left.
fn descriptors() -> usize {
    let look = |_| {
        sleep(BETWEEN_LOOKS);
        fs::read_dir("/proc/self/fd").unwrap().count()
    };
    (0..LOOKS).map(look).min().unwrap()
}

fn files(directory: &Path) -> usize {
    let entries = fs::read_dir(directory).unwrap().map(Result::unwrap);
    entries
        .map(|entry| {
            if entry.file_type().unwrap().is_dir() {
                files(&entry.path())
            } else {
                1
            }
        })
        .sum()
}
