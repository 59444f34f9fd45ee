//! The newest estimate in memory that others read: written without waiting for them, read without writing.
//!
//! Two slots, by turns; a count says how often they were written, and so which one was last. A reader takes that one and looks at
//! the count again: if it is the same, the writer was busy with the other slot at most. So a writer that is stopped or killed,
//! wherever, leaves a slot that is whole. Every word is an atomic, so that reading what is just being written is no data race but
//! a word to be thrown away.
#![expect(unsafe_code, reason = "memory that other processes map as well")]

use std::array::from_fn;
use std::cell::Cell;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering, fence};

use iceoryx2_cal::named_concept::FileName;

use super::super::transport::{Draft, Refusal, Segment};
use super::users::Group;
use crate::{Estimate, Message};

const WORD: usize = size_of::<u64>();
const WORDS: usize = size_of::<Estimate>() / WORD;
const _: () = assert!(WORDS * WORD == size_of::<Estimate>());
const _: () = assert!(align_of::<Estimate>() == align_of::<u64>());

/// Of the page's text (bytes): the root is the longest part, at most 100.
const TEXT: usize = 256;

/// All of it may be zero.
#[repr(C, align(64))]
struct Sheet {
    /// Never changes: [`About`].
    text: [AtomicU64; TEXT / WORD],
    count: Count,
    slots: [Slot; 2],
}

/// Estimates so far.
#[repr(C, align(64))]
struct Count(AtomicU64);

#[repr(C, align(64))]
struct Slot([AtomicU64; WORDS]);

/// Memory is had in such pieces (bytes).
const LENGTH: usize = 4096;
const _: () = assert!(size_of::<Sheet>() <= LENGTH);

/// What a page says of itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct About {
    /// Of what it holds.
    pub(super) type_name: String,
    /// The robot's number in the team.
    pub(super) id: u16,
    /// The process that writes it.
    pub(super) process: u32,
    pub(super) root: String,
}

impl About {
    pub(super) fn new(id: u16, root: &Path) -> Self {
        Self {
            type_name: Estimate::TYPE_NAME.into(),
            id,
            process: std::process::id(),
            root: root.display().to_string(),
        }
    }

    fn text(&self) -> [u8; TEXT] {
        let Self {
            type_name,
            id,
            process,
            root,
        } = self;
        let text = format!("{type_name} {id} {process} {root}");
        let text = text.as_bytes();
        from_fn(|at| text.get(at).copied().unwrap_or_default())
    }

    /// `None` if it is no page.
    fn parse(text: &[u8; TEXT]) -> Option<Self> {
        let text = text.split(|byte| *byte == 0).next()?;
        let mut words = std::str::from_utf8(text).ok()?.splitn(4, ' ');
        Some(Self {
            type_name: words.next()?.into(),
            id: words.next()?.parse().ok()?,
            process: words.next()?.parse().ok()?,
            root: words.next()?.into(),
        })
    }
}

/// The page, for the only one who writes it.
#[derive(Debug)]
pub(super) struct Pen {
    segment: Segment,
    count: Cell<u64>,
}

impl Pen {
    /// Makes it, for `group` to read; nobody finds it before it is complete.
    pub(super) fn new(name: &FileName, group: &Group, about: &About) -> rustix::io::Result<Self> {
        let draft = Draft::new(name, LENGTH)?;
        let text = about.text();
        let (words, _) = text.as_chunks::<WORD>();
        for (place, word) in sheet(draft.segment()).text.iter().zip(words) {
            place.store(u64::from_ne_bytes(*word), Ordering::Relaxed);
        }
        Ok(Self {
            segment: draft.publish_to(group.id()).map_err(|(_, error)| error)?,
            count: Cell::new(0),
        })
    }

    /// In bounded time: neither waits for anybody, nor allocates, nor makes a system call.
    pub(super) fn write(&self, estimate: &Estimate) {
        let sheet = sheet(&self.segment);
        let count = self.count.get().wrapping_add(1);
        self.count.set(count);
        // A reader that finds a word of this one finds that the one before was out.
        fence(Ordering::Release);
        for (place, word) in sheet.slot(count).iter().zip(words(estimate)) {
            place.store(*word, Ordering::Relaxed);
        }
        sheet.count.0.store(count, Ordering::Release);
    }
}

/// The page, for anyone else.
#[derive(Debug)]
pub(super) struct View(Segment);

/// A writer that is faster than this is none of ours.
const TRIES: u32 = 1000;

impl View {
    /// That of the user `owner` at `path`.
    pub(super) fn open(path: &Path, owner: u32) -> Result<Self, Refusal> {
        let segment = Segment::open_to_read(path, owner)?;
        if segment.length() < LENGTH {
            return Err(Refusal::HalfMade);
        }
        Ok(Self(segment))
    }

    pub(super) fn about(&self) -> Option<About> {
        let mut text = [0; TEXT];
        let (words, _) = text.as_chunks_mut::<WORD>();
        for (word, place) in words.iter_mut().zip(&sheet(&self.0).text) {
            *word = place.load(Ordering::Relaxed).to_ne_bytes();
        }
        About::parse(&text)
    }

    /// The newest estimate and how many there were, if that is not `known`.
    pub(super) fn newer_than(&self, known: u64) -> Option<(u64, Estimate)> {
        let sheet = sheet(&self.0);
        for _ in 0..TRIES {
            let count = sheet.count.0.load(Ordering::Acquire);
            if count == known || count == 0 {
                return None;
            }
            let slot = sheet.slot(count);
            let words = from_fn(|at| slot[at].load(Ordering::Relaxed));
            fence(Ordering::Acquire);
            if sheet.count.0.load(Ordering::Relaxed) == count {
                return Some((count, estimate(&words)));
            }
        }
        None
    }
}

impl Sheet {
    fn slot(&self, count: u64) -> &[AtomicU64; WORDS] {
        &self.slots[usize::from(count & 1 == 1)].0
    }
}

fn sheet(segment: &Segment) -> &Sheet {
    // SAFETY: both makers of a `Pen` or `View` see to its length; it begins at a page, is mapped for as long as the segment lives,
    // and any bytes are a sheet. Of a `View` it is read-only, and nobody stores.
    unsafe { segment.base().cast().as_ref() }
}

fn words(estimate: &Estimate) -> &[u64; WORDS] {
    // SAFETY: it is as long and as aligned, and has no padding: `layout!` holds it to that.
    unsafe { &*std::ptr::from_ref(estimate).cast() }
}

fn estimate(words: &[u64; WORDS]) -> Estimate {
    // SAFETY: a payload is plain numbers, of which any bytes are some, and as long and as aligned.
    unsafe { std::ptr::from_ref(words).cast::<Estimate>().read() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_page_says_of_itself_is_read_as_it_was_written() {
        let about = About::new(3, Path::new("/run/with spaces/coloc"));
        assert_eq!(About::parse(&about.text()), Some(about));
        assert_eq!(About::parse(&[0; TEXT]), None);
        assert_eq!(About::parse(&[0xFF; TEXT]), None);
    }

    #[test]
    fn the_longest_root_fits() {
        let about = About {
            root: "/".repeat(100),
            process: u32::MAX,
            ..About::new(u16::MAX, Path::new("/"))
        };
        assert_eq!(About::parse(&about.text()), Some(about));
    }

    #[test]
    fn an_estimate_is_its_words() {
        let told = Estimate {
            tick: 7,
            pose: [1.5, -2.0, 0.25],
            fit_limit: 0.5,
            ..Estimate::default()
        };
        assert_eq!(estimate(words(&told)), told);
    }
}
