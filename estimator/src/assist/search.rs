//! The search that needs no centre: which data a child takes at one event, and to whom it hands them on.
//!
//! A child takes the first datum of each leader. It offers it to every child that it sees, but each of its sightings serves one leader
//! only: as long as an answer is awaited, and for good once the other one took it. Where no answer comes the sighting counts as used;
//! a late "no" frees it.
//!
//! ```text
//! edge: free → pending(l) → consumed(l) on Ack 1, free on Ack 0, timed out(l) without any; timed out(l) → free on Ack 0
//! ```
//!
//! No clock: the caller counts ticks, from the event on.

use super::path::Path;
use super::team::{MOST_LEADERS, Place, Rank, Robots};
use crate::list::FixedList;

/// So many children may one child see at one event.
pub const MOST_READINGS: usize = 16;

/// How long it goes on, in ticks; the same for all robots of a team.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Patience {
    /// A sighting counts as used if no answer came in so many ticks.
    pub ack_timeout: u32,
    /// From this tick on nothing is taken and nothing is sent.
    pub close_after: u32,
}

/// What became of a datum.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// It is the first of its leader: it is taken, and to be fused.
    Accepted,
    /// It was taken before, and came once more.
    Repeated,
    /// Another one of its leader was taken.
    Declined,
    /// Too late.
    Closed,
}

/// What became of an acknowledgement.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Settled {
    /// The sighting is used.
    Consumed,
    /// It may serve another leader.
    Freed,
    /// It answers nothing that is open.
    Ignored,
}

/// What a sighting of a child is doing.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub enum Use {
    /// It can serve any leader.
    #[default]
    Free,
    /// A datum of this leader is on its way.
    Pending(Rank),
    /// A datum of this leader was taken.
    Consumed(Rank),
    /// A datum of this leader may have been taken.
    TimedOut(Rank),
}

/// A sighting.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Sight {
    /// Who is seen.
    pub child: Place,
    /// For whom.
    pub used: Use,
    /// When it was offered last.
    sent: u32,
    /// The leaders whose data it was offered for, a bit for each rank.
    tried: u8,
}

/// A datum taken.
#[derive(Copy, Clone, Debug)]
struct Taken {
    leader: Rank,
    path: Path,
}

/// One event at one child.
#[derive(Copy, Clone, Debug)]
pub struct Search {
    /// In the order in which they were taken.
    taken: FixedList<Taken, MOST_LEADERS>,
    /// By ascending numbers.
    sights: FixedList<Sight, MOST_READINGS>,
}

impl Answer {
    /// The bit of the acknowledgement.
    #[must_use]
    pub fn acknowledges(self) -> bool {
        matches!(self, Self::Accepted | Self::Repeated)
    }
}

impl Sight {
    fn was_tried(self, leader: Rank) -> bool {
        self.tried & 1 << leader.index() != 0
    }

    /// From now on for this leader.
    fn offer(&mut self, leader: Rank, since: u32) {
        self.tried |= 1 << leader.index();
        self.used = Use::Pending(leader);
        self.sent = since;
    }

    fn settle(&mut self, leader: Rank, taken: bool) -> Settled {
        let (used, settled) = match self.used {
            Use::Pending(of) if of == leader && taken => (Use::Consumed(leader), Settled::Consumed),
            Use::Pending(of) | Use::TimedOut(of) if of == leader && !taken => {
                (Use::Free, Settled::Freed)
            }
            other => (other, Settled::Ignored),
        };
        self.used = used;
        settled
    }
}

impl Default for Search {
    fn default() -> Self {
        let nothing = Taken {
            leader: Rank::default(),
            path: Path::first(Place::default(), Place::default()),
        };
        Self {
            taken: FixedList::new(nothing),
            sights: FixedList::new(Sight::default()),
        }
    }
}

impl Search {
    /// Sees a child; a second sighting of it is none. False if it sees too many already.
    #[must_use]
    pub fn see(&mut self, child: Place) -> bool {
        let before = self.sights();
        let Err(at) = before.binary_search_by_key(&child, |it| it.child) else {
            return true;
        };
        let sight = Sight {
            child,
            ..Sight::default()
        };
        self.sights.insert(at, sight)
    }

    /// Takes a datum or not.
    pub fn hear(&mut self, leader: Rank, path: &Path, tick: u32, patience: Patience) -> Answer {
        let answer = self.judge(leader, path, tick, patience);
        if answer == Answer::Accepted {
            let taken = Taken {
                leader,
                path: *path,
            };
            let _ = self.taken.push(taken); // There is room for one of each leader.
        }
        answer
    }

    fn judge(&self, leader: Rank, path: &Path, tick: u32, patience: Patience) -> Answer {
        if tick >= patience.close_after {
            return Answer::Closed;
        }
        match self.path_of(leader) {
            None => Answer::Accepted,
            Some(taken) if taken == path => Answer::Repeated,
            Some(_) => Answer::Declined,
        }
    }

    /// What the child answered to whom a datum was offered.
    pub fn answered(
        &mut self,
        child: Place,
        leader: Rank,
        taken: bool,
        tick: u32,
        patience: Patience,
    ) -> Settled {
        if tick >= patience.close_after {
            return Settled::Ignored;
        }
        let sight = self.sight_mut(child);
        sight.map_or(Settled::Ignored, |sight| sight.settle(leader, taken))
    }

    /// How long an answer took that comes now; `None` if it is not the first to what was offered last.
    #[must_use]
    pub fn delay(&self, child: Place, leader: Rank, tick: u32) -> Option<u32> {
        let sight = self.sights().iter().find(|it| it.child == child)?;
        match sight.used {
            Use::Pending(of) | Use::TimedOut(of) if of == leader => {
                Some(tick.saturating_sub(sight.sent))
            }
            _ => None,
        }
    }

    /// Whether what was offered to the child counts as used because no answer came.
    #[must_use]
    pub fn has_timed_out(&self, child: Place) -> bool {
        let of = self.sights().iter().find(|it| it.child == child);
        of.is_some_and(|it| matches!(it.used, Use::TimedOut(_)))
    }

    /// Counts as used what was not answered in time; by whom.
    pub fn time_out(&mut self, tick: u32, patience: Patience) -> Robots {
        if tick >= patience.close_after {
            return Robots::NONE;
        }
        let mut late = Robots::NONE;
        for sight in self.sights.as_mut_slice() {
            if let Use::Pending(leader) = sight.used
                && tick.saturating_sub(sight.sent) >= patience.ack_timeout
            {
                sight.used = Use::TimedOut(leader);
                late = late.with(sight.child);
            }
        }
        late
    }

    /// Hands on what can be handed on, the datum first that came first. `send` hears whose datum goes by what path; if it says that it
    /// cannot, the sighting stays free for other leaders.
    pub fn hand_on(
        &mut self,
        tick: u32,
        patience: Patience,
        mut send: impl FnMut(Rank, &Path) -> bool,
    ) {
        if tick >= patience.close_after {
            return;
        }
        for Taken { leader, path } in self.taken.as_slice() {
            for sight in self.sights.as_mut_slice() {
                let is_open = sight.used == Use::Free && !sight.was_tried(*leader);
                if is_open && let Ok(longer) = path.to(sight.child) {
                    sight.tried |= 1 << leader.index();
                    if send(*leader, &longer) {
                        sight.offer(*leader, tick);
                    }
                }
            }
        }
    }

    /// Offers the datum of this leader to one child, whether or not it was offered to it before: for a driver with rules of its own.
    /// False where the sighting is in use, or there is none.
    #[must_use]
    pub fn offer(&mut self, leader: Rank, child: Place, tick: u32) -> bool {
        let sight = self.sight_mut(child);
        let Some(sight) = sight.filter(|it| it.used == Use::Free) else {
            return false;
        };
        sight.offer(leader, tick);
        true
    }

    /// The path of the datum that was taken of this leader.
    #[must_use]
    pub fn path_of(&self, leader: Rank) -> Option<&Path> {
        let mut taken = self.taken.as_slice().iter();
        taken.find(|it| it.leader == leader).map(|it| &it.path)
    }

    /// Whether a sighting of this path is in that of another leader's datum that was taken.
    #[must_use]
    pub fn shares_a_sighting(&self, leader: Rank, path: &Path) -> bool {
        let mut others = self
            .taken
            .as_slice()
            .iter()
            .filter(|it| it.leader != leader);
        others.any(|it| {
            let mut used = path.places().windows(2);
            used.any(|one| it.path.places().windows(2).any(|other| one == other))
        })
    }

    /// How many data were taken.
    #[must_use]
    pub fn count(&self) -> usize {
        self.taken.as_slice().len()
    }

    /// All sightings, by ascending numbers.
    #[must_use]
    pub fn sights(&self) -> &[Sight] {
        self.sights.as_slice()
    }

    /// Whom it sees.
    #[must_use]
    pub fn seen(&self) -> Robots {
        let sights = self.sights().iter();
        sights.fold(Robots::NONE, |seen, it| seen.with(it.child))
    }

    fn sight_mut(&mut self, child: Place) -> Option<&mut Sight> {
        let sights = self.sights.as_mut_slice();
        sights.iter_mut().find(|it| it.child == child)
    }
}
