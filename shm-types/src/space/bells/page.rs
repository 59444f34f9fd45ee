//! Who waits for the messages of a service, in memory that all of its ports map.
#![expect(unsafe_code, reason = "memory that other processes map as well")]

use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use iceoryx2::prelude::SemanticString;
use iceoryx2_bb_posix::access_mode::AccessMode;
use iceoryx2_cal::named_concept::FileName;
use rustix::io::Errno;

use super::super::config::Place;
use super::super::leftovers::{self, Turn};
use super::super::transport::{Draft, Refusal, SHARED_MEMORY, Segment};
use super::{BELLS, PAGE};

/// All of it may be zero.
#[repr(C)]
#[derive(Debug)]
struct Table {
    /// The slots that were ever taken are so many, from the first on.
    used: AtomicU64,
    slots: [Slot; BELLS],
}

/// The place of a bell. The number of armings goes on when it changes hands.
#[repr(C)]
#[derive(Debug)]
pub(crate) struct Slot {
    /// Number of the bell, 0 if there is none.
    bell: AtomicU64,
    /// So many armings, times two; and one while it is armed.
    armings: AtomicU64,
}

/// An arming, by its number.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) struct Armed(u64);

/// Memory is had in such pieces (bytes).
const LENGTH: usize = 4096;
const _: () = assert!(size_of::<Table>() <= LENGTH);

/// Others make and remove it meanwhile: so often is it tried.
const TRIES: u32 = 20;
const PAUSE: Duration = Duration::from_millis(5);

/// The page of a service, mapped; removed by the last who has it. The order of the fields is that of leaving.
#[derive(Debug)]
pub(crate) struct Page {
    segment: Segment,
    _file: Shared,
}

/// A file that nobody needs whom the kernel does not know to have it.
#[derive(Debug)]
struct Shared(PathBuf);

impl Page {
    /// That of the service which iceoryx2 knows by `hash`; it is made if it is not there.
    pub(crate) fn open(place: &Place, hash: &str) -> Result<Self, Errno> {
        let name = format!("{}{hash}{PAGE}", place.prefix());
        let file = FileName::new(name.as_bytes()).map_err(|_| Errno::NAMETOOLONG)?;
        let mut last = Errno::BUSY;
        for _ in 0..TRIES {
            match open_or_make(&file) {
                Ok(segment) if segment.length() >= LENGTH => {
                    let path = format!("{SHARED_MEMORY}/{name}").into();
                    return Ok(Self {
                        segment,
                        _file: Shared(path),
                    });
                }
                // Cut off or half-made, by somebody who died: nobody may have it when it is removed, nor we.
                Ok(segment) => {
                    drop(segment);
                    leftovers::remove(place, Turn::ALL);
                }
                Err(Refusal::HalfMade) => {
                    leftovers::remove(place, Turn::ALL);
                }
                // Somebody has just made it; or makes sure that nobody has it, to remove it.
                Err(Refusal::System(error @ (Errno::AGAIN | Errno::EXIST))) => last = error,
                Err(Refusal::System(error)) => return Err(error),
                Err(Refusal::Missing) => {}
                Err(Refusal::NotOurs) => return Err(Errno::PERM),
            }
            std::thread::sleep(PAUSE);
        }
        Err(last)
    }

    fn table(&self) -> &Table {
        // SAFETY: it is long enough, begins at a page, is mapped for as long as this lives, and any bytes are a table.
        unsafe { self.segment.base().cast().as_ref() }
    }

    /// The slots that were ever taken.
    pub(crate) fn slots(&self) -> &[Slot] {
        let table = self.table();
        let used = usize::try_from(table.used.load(Ordering::Relaxed)).unwrap_or(BELLS);
        &table.slots[..used.min(BELLS)]
    }

    pub(crate) fn slot(&self, at: usize) -> &Slot {
        &self.table().slots[at]
    }

    /// A free slot for `bell`.
    pub(crate) fn take(&self, bell: u64) -> Option<usize> {
        let table = self.table();
        let at = table.slots.iter().position(|slot| slot.take(bell))?;
        table.used.fetch_max(at as u64 + 1, Ordering::SeqCst);
        Some(at)
    }
}

impl Drop for Shared {
    fn drop(&mut self) {
        leftovers::remove_unheld(&self.0);
    }
}

impl Slot {
    fn take(&self, bell: u64) -> bool {
        let taken = (self.bell).compare_exchange(0, bell, Ordering::SeqCst, Ordering::Relaxed);
        taken.is_ok()
    }

    /// For who has it, and for who knows that who has it is dead.
    pub(crate) fn free(&self, bell: u64) {
        let _ = (self.bell).compare_exchange(bell, 0, Ordering::SeqCst, Ordering::Relaxed);
    }

    pub(crate) fn bell(&self) -> u64 {
        self.bell.load(Ordering::Acquire)
    }

    /// For who has it: once more, whatever was.
    pub(crate) fn arm(&self) {
        let number = self.armings.load(Ordering::Relaxed) >> 1;
        let armed = (number.wrapping_add(1) << 1) | 1;
        self.armings.store(armed, Ordering::SeqCst);
    }

    /// For who has it.
    pub(crate) fn disarm(&self) {
        self.armings.fetch_and(!1, Ordering::SeqCst);
    }

    pub(crate) fn armed(&self) -> Option<Armed> {
        let armings = self.armings.load(Ordering::Acquire);
        (armings & 1 == 1).then_some(Armed(armings))
    }

    /// That arming was answered. It may have been armed again since.
    pub(crate) fn rung(&self, Armed(armings): Armed) {
        let _ = (self.armings).compare_exchange(
            armings,
            armings & !1,
            Ordering::SeqCst,
            Ordering::Relaxed,
        );
    }
}

fn open_or_make(name: &FileName) -> Result<Segment, Refusal> {
    match Segment::open(name, AccessMode::ReadWrite) {
        Err(Refusal::Missing) => {}
        result => return result,
    }
    let draft = Draft::new(name, LENGTH).map_err(Refusal::System)?;
    draft.publish().map_err(|(_, error)| Refusal::System(error))
}
