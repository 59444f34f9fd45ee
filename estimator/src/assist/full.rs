//! A robot's part where leaders know all readings: it says what it saw of an event, a leader gathers that and says of each child that it
//! reaches where that one is.
//!
//! ```text
//! event over + half of the deadline    every robot: what it saw, to all leaders
//! event over + the deadline            every leader: the trees, and final data along its own
//! ```
//!
//! Nothing is waited for beyond that: who heard less comes to other trees, and its digest says so.

use super::datum::{Reading, first};
use super::events::{Data, Terms};
use super::gathered::Gathered;
use super::readings::{Readings, Sight};
use super::refusal::Refusal;
use super::search::MOST_READINGS;
use super::sent::{Reference, Sent};
use super::slot::Slot;
use super::team::Place;
use super::trail::{STRETCHES, Trail};
use super::way::{said_of, way_of};
use crate::estimator::Estimator;
use crate::history::Storage;
use crate::list::FixedList;
use crate::pose::Pose;
use crate::stamp::{Span, Stamp};

/// Events whose own sightings are kept: one that goes on, one that is to be told.
const KEPT: usize = 2;

/// What this robot saw at an event.
#[derive(Copy, Clone, Debug)]
struct Own {
    slot: Slot,
    is_said: bool,
    /// What a leader believes of itself then, once that is said.
    sent: Option<Reference>,
    sights: FixedList<(Place, Stamp, Reading), MOST_READINGS>,
}

/// See above.
#[derive(Clone, Debug)]
pub(super) struct Full {
    deadline: Span,
    own: [Own; KEPT],
    gathered: Gathered,
    said: FixedList<Readings, KEPT>,
}

impl Own {
    fn of(slot: Slot) -> Self {
        Self {
            slot,
            is_said: false,
            sent: None,
            sights: FixedList::new((Place::default(), Stamp::default(), Reading::default())),
        }
    }

    /// What it is to the team.
    fn readings<S: Storage>(&self, terms: &Terms, estimator: &Estimator<S>) -> Readings {
        let (begin, period) = (terms.slots.begin(self.slot), terms.slots.period());
        let mut readings = Readings {
            slot: self.slot,
            stamp: begin + Span::from_nanos(period.as_nanos() / 2),
            trace: self
                .sent
                .map(|it| it.word.leader.covariance.variances().iter().sum()),
            trail: trail(estimator, begin, period),
            ..Readings::default()
        };
        for (child, stamp, reading) in self.sights.as_slice() {
            let _ = readings.push(Sight {
                observed: terms.team.id(*child),
                since: *stamp - begin,
                reading: *reading,
            }); // There is room for as many.
        }
        readings
    }
}

impl Full {
    pub(super) fn new(deadline: Span) -> Self {
        Self {
            deadline,
            own: [Own::of(Slot(i64::MIN)); KEPT],
            gathered: Gathered::default(),
            said: FixedList::new(Readings::default()),
        }
    }

    /// A tick begins.
    pub(super) fn begin(&mut self) {
        self.said.clear();
    }

    /// The clock was stepped: nothing is open any more.
    pub(super) fn forget(&mut self) {
        self.own = [Own::of(Slot(i64::MIN)); KEPT];
        self.gathered.forget();
    }

    /// What is to be told to all leaders.
    pub(super) fn said(&self) -> &[Readings] {
        self.said.as_slice()
    }

    /// A child is seen. False where that event is over, or too many are seen; of one child the first sighting counts.
    pub(super) fn see(
        &mut self,
        terms: &Terms,
        (child, stamp, reading): (Place, Stamp, Reading),
    ) -> bool {
        let slot = terms.slots.of(stamp);
        let Some(own) = self.own.get_mut(usize::from(slot.0 & 1 == 1)) else {
            return false;
        };
        if own.slot < slot {
            *own = Own::of(slot);
        }
        if own.slot > slot || own.is_said {
            return false;
        }
        let mut sights = own.sights.as_slice().iter();
        sights.any(|it| it.0 == child) || own.sights.push((child, stamp, reading))
    }

    /// Another robot says what it saw. False where that comes too late or once more.
    ///
    /// # Errors
    /// It cannot be what that robot saw; nothing has changed.
    pub(super) fn hear(
        &mut self,
        terms: &Terms,
        speaker: Place,
        readings: &Readings,
        now: Stamp,
    ) -> Result<bool, Refusal> {
        let is_open = now < over(terms, readings.slot) + self.deadline;
        self.gathered.hear(terms, speaker, readings, now, is_open)
    }

    /// Says what was seen of events that are over; a leader keeps it too.
    pub(super) fn say<S: Storage>(
        &mut self,
        terms: &Terms,
        estimator: &Estimator<S>,
        (me, sent): (Place, &mut Sent),
        now: Stamp,
    ) {
        let half = Span::from_nanos(self.deadline.as_nanos() / 2);
        for own in &mut self.own {
            let [(_, stamp, _), ..] = own.sights.as_slice() else {
                continue;
            };
            if own.is_said || now < over(terms, own.slot) + half {
                continue;
            }
            own.is_said = true;
            let leads = terms.team.leaders().contains(me);
            own.sent = leads
                .then(|| sent.at(estimator, own.slot, *stamp))
                .flatten();
            let readings = own.readings(terms, estimator);
            let _ = self.said.push(readings); // There is room for as many.
            if leads {
                // What it says itself is sound, and said once.
                let _ = self.gathered.hear(terms, me, &readings, now, true);
            }
        }
    }

    /// A leader's data, once it is time.
    pub(super) fn reach<S: Storage>(
        &mut self,
        terms: &Terms,
        estimator: &Estimator<S>,
        me: Place,
        now: Stamp,
        mut send: impl FnMut(&Data),
    ) {
        let due = self.gathered.slot();
        let due = due.filter(|slot| now >= over(terms, *slot) + self.deadline);
        let Some(slot) = due else {
            return;
        };
        let own = self.own.iter().find(|it| it.slot == slot);
        if let Some(sent) = own.and_then(|it| it.sent) {
            let digest = self.gathered.digest();
            let first = |stamp, reading: &Reading| {
                if stamp == sent.stamp {
                    return Some(first(&sent.belief, reading, terms.propagation));
                }
                let way = way_of(estimator, sent.stamp, stamp)?;
                Some(said_of(
                    &sent.belief,
                    Some(&way),
                    reading,
                    terms.propagation,
                ))
            };
            self.gathered.reach(terms, me, first, |reached| {
                send(&Data {
                    slot,
                    stamp: reached.stamp,
                    path: reached.path,
                    is_final: true,
                    digest,
                    said: reached.said,
                    word: sent.word,
                });
            });
        }
        self.gathered.forget();
    }
}

/// When an event is over.
fn over(terms: &Terms, slot: Slot) -> Stamp {
    terms.slots.begin(slot) + terms.slots.period()
}

/// The robot's own way through an event, if the history has all of it.
#[allow(clippy::cast_possible_wrap)] // Eight.
fn trail<S: Storage>(estimator: &Estimator<S>, begin: Stamp, period: Span) -> Option<Trail> {
    let mut ends = [Pose::default(); STRETCHES];
    let mut last = Reading::default();
    for (place, end) in (1_i64..).zip(&mut ends) {
        let since = period.as_nanos() / STRETCHES as i64 * place;
        last = estimator.way(begin, begin + Span::from_nanos(since))?;
        *end = last.relative;
    }
    Some(Trail {
        ends,
        noise: last.covariance,
    })
}
