//! What a robot's history keeps beside its entries where errors are tracked: at a child what each datum said of its leader and what it
//! has in common with all of them after it, at a leader what became of its own error.
//!
//! All of it is a function of the history: it is kept so that a datum that comes late is fused as if it had come in time.

use super::bond::{Bonds, News};
use super::change::Change;
use super::events::Word;
use super::slot::Slot;
use crate::kind::Key;
use crate::stamp::Stamp;

/// So many data of all leaders can be in a child's history: of three leaders more than twenty events. What finds no place is fused as
/// of a leader of which nothing is known.
pub const TIES: usize = 65;

/// Of one datum.
#[derive(Copy, Clone, Debug, Default)]
pub struct Tie {
    key: Option<Key>,
    pub(crate) said: Said,
    /// After it.
    after: Bonds,
}

/// What a datum says beside the pose.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub(crate) struct Said {
    /// The leader's place among the leaders.
    pub(crate) place: usize,
    /// So many leaders there are.
    pub(crate) leaders: u8,
    /// By which count of events.
    pub(crate) count: u32,
    pub(crate) slot: Slot,
    pub(crate) word: Word,
}

impl Said {
    pub(crate) fn news(&self) -> News {
        News {
            slot: self.slot,
            word: self.word,
        }
    }
}

/// The storage, and how much of it is used. The first tie is of what has left the history.
#[derive(Clone, Debug)]
pub(crate) struct Ties<T, C> {
    each: T,
    changes: C,
    book: Book,
}

#[derive(Copy, Clone, Debug)]
struct Book {
    /// In use, without the first.
    ties: usize,
    /// How often the belief was replaced where the history begins.
    rulings: u32,
    /// When there was, of what has left the history, something last of which nobody can say what it did to the error.
    broken: Stamp,
}

/// The same, borrowed.
#[derive(Debug)]
pub(crate) struct Tied<'a> {
    ties: &'a mut [Tie],
    changes: &'a mut [Change],
    book: &'a mut Book,
}

impl<T: AsMut<[Tie]>, C: AsRef<[Change]> + AsMut<[Change]>> Ties<T, C> {
    /// Nothing is in the history; `is_own`: in the belief before it is no error of others.
    pub(crate) fn new(each: T, changes: C, is_own: bool) -> Self {
        let book = Book {
            ties: 0,
            rulings: 0,
            broken: Stamp::from_nanos(i64::MIN),
        };
        let mut ties = Self {
            each,
            changes,
            book,
        };
        if !is_own {
            ties.tied().lose_track();
        }
        ties
    }

    #[inline]
    pub(crate) fn tied(&mut self) -> Tied<'_> {
        Tied {
            ties: self.each.as_mut(),
            changes: self.changes.as_mut(),
            book: &mut self.book,
        }
    }

    pub(crate) fn change(&self, place: usize) -> Option<&Change> {
        self.changes.as_ref().get(place)
    }

    pub(crate) fn is_on(&self) -> bool {
        !self.changes.as_ref().is_empty()
    }

    pub(crate) fn rulings(&self) -> u32 {
        self.book.rulings
    }

    pub(crate) fn broken(&self) -> Stamp {
        self.book.broken
    }
}

impl Tied<'_> {
    /// Whether errors are tracked at all.
    #[inline]
    pub(crate) fn is_on(&self) -> bool {
        !self.changes.is_empty()
    }

    fn used(&self) -> &[Tie] {
        self.ties.get(1..=self.book.ties).unwrap_or(&[])
    }

    fn place_of(&self, key: &Key) -> Result<usize, usize> {
        self.used()
            .binary_search_by_key(&Some(*key), |it| it.key)
            .map(|it| it + 1)
            .map_err(|it| it + 1)
    }

    /// A datum with this `key` comes into the history; false if there is no place for it, or it has one.
    #[must_use]
    pub(crate) fn keep(&mut self, key: Key, said: &Said) -> bool {
        let Err(place) = self.place_of(&key) else {
            return false;
        };
        let Some(behind) = self.ties.get_mut(place..self.book.ties + 2) else {
            return false;
        };
        behind.rotate_right(1);
        if let Some(tie) = behind.first_mut() {
            (tie.key, tie.said) = (Some(key), *said);
        }
        self.book.ties += 1;
        true
    }

    /// It did not come after all.
    pub(crate) fn drop(&mut self, key: &Key) {
        let Ok(place) = self.place_of(key) else {
            return;
        };
        if let Some(behind) = self.ties.get_mut(place..=self.book.ties) {
            behind.rotate_left(1);
            self.book.ties -= 1;
        }
    }

    /// What the datum with this key says.
    pub(crate) fn said(&self, key: &Key) -> Option<&Said> {
        let place = self.place_of(key).ok()?;
        Some(&self.ties.get(place)?.said)
    }

    /// Such a datum was fused.
    pub(crate) fn settle(&mut self, key: &Key, after: &Bonds) {
        if let Ok(place) = self.place_of(key)
            && let Some(tie) = self.ties.get_mut(place)
        {
            tie.after = *after;
        }
    }

    /// An entry of the storage's `place` was applied.
    #[inline]
    pub(crate) fn changed(&mut self, place: usize, change: &Change) {
        if let Some(it) = self.changes.get_mut(place) {
            *it = *change;
        }
    }

    pub(crate) fn change(&self, place: usize) -> Change {
        self.changes.get(place).copied().unwrap_or_default()
    }

    /// What all data before `key` leave, and the key of the last of them, if it is in the history.
    pub(crate) fn before(&self, key: Option<&Key>) -> (Bonds, Option<Key>) {
        let place = match key {
            Some(key) => self.place_of(key).map_or_else(|it| it - 1, |it| it - 1),
            None => self.book.ties,
        };
        let tie = self.ties.get(place);
        let bonds = tie.map_or_else(Bonds::default, |it| it.after);
        (bonds, tie.and_then(|it| it.key).filter(|_| place > 0))
    }

    /// The oldest entry leaves the history.
    pub(crate) fn fold(&mut self, key: &Key, place: usize) {
        if self.place_of(key) == Ok(1) {
            if let Some(ties) = self.ties.get_mut(..=self.book.ties) {
                ties.rotate_left(1); // The first one becomes that of what has left.
                self.book.ties -= 1;
            }
            return;
        }
        let change = self.change(place);
        if change.by().is_none() {
            self.book.broken = key.stamp;
        }
        if let Some(base) = self.ties.first_mut() {
            base.after.follow(&change);
        }
    }

    /// The belief where the history begins goes on at `stamp` by what nobody can say.
    pub(crate) fn break_off(&mut self, stamp: Stamp) {
        self.book.broken = stamp;
        if let Some(base) = self.ties.first_mut() {
            base.after.lose_track();
        }
    }

    /// The belief where the history begins is another one.
    pub(crate) fn lose_track(&mut self) {
        self.book.rulings = self.book.rulings.wrapping_add(1);
        if let Some(base) = self.ties.first_mut() {
            base.after.lose_track();
        }
    }
}
