//! The events that are open at a child, each with its search, its sightings and the data that it took.
//!
//! There is room for [`OPEN_EVENTS`]; one more closes the oldest. What is refused leaves everything as it was.

use super::cross::Leader;
use super::datum::{Reading, carried, extend};
use super::delays::{Bounds, Delays};
use super::news::{Answering, News};
use super::path::Path;
use super::refusal::Refusal;
use super::search::{Answer, MOST_READINGS, Patience, Search, Settled};
use super::slot::{Slot, Slots};
use super::team::{MOST_LEADERS, Place, Rank, Robots, Team};
use super::transition::Past;
use crate::convert::GlobalPose;
use crate::kind::RobotId;
use crate::list::FixedList;
use crate::settings::Propagation;
use crate::stamp::Stamp;

/// So many events may be open at once.
pub const OPEN_EVENTS: usize = 8;

/// The same as a distance of slots.
#[allow(clippy::cast_possible_wrap)] // Eight.
const SPAN: i64 = OPEN_EVENTS as i64;

/// No robot is farther away \[m\].
const FARTHEST: f64 = 1e12;

/// What a datum says of its leader; every robot on its way hands it on as it is.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Word {
    /// Where it was, and how well it knew.
    pub leader: Leader,
    /// What became of its error.
    pub past: Past,
}

/// DATA, on its way from one robot to the next.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Data {
    /// Of which event.
    pub slot: Slot,
    /// When it holds.
    pub stamp: Stamp,
    /// Where it comes from and whom it is for.
    pub path: Path,
    /// It is fused and not handed on: leaders know all readings.
    pub is_final: bool,
    /// What its leader knew of the event, where leaders know all readings; else 0.
    pub digest: u32,
    /// y*, and R* in its parts.
    pub said: GlobalPose,
    /// Of the leader.
    pub word: Word,
}

/// How a team searches; the same for all its robots.
#[derive(Copy, Clone, Debug)]
pub struct Terms {
    /// Who is in it.
    pub team: Team,
    /// Which events there are.
    pub slots: Slots,
    /// How long a search goes on.
    pub patience: Patience,
    /// Leaders know all readings, and every datum is final.
    pub is_full: bool,
    /// How poses are composed.
    pub propagation: Propagation,
}

/// Now, at a child.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Now {
    /// The caller's count of ticks.
    pub tick: u32,
    /// The event of this moment.
    pub slot: Slot,
}

/// What is seen of a child.
#[derive(Copy, Clone, Debug, Default)]
struct Sighted {
    child: Place,
    stamp: Stamp,
    reading: Reading,
}

/// What was taken of a leader.
#[derive(Copy, Clone, Debug, Default)]
struct Datum {
    stamp: Stamp,
    digest: u32,
    said: GlobalPose,
    word: Word,
}

#[derive(Copy, Clone, Debug)]
struct Event {
    slot: Slot,
    /// The tick of its beginning.
    began: u32,
    search: Search,
    sighted: FixedList<Sighted, MOST_READINGS>,
    data: [Datum; MOST_LEADERS],
}

/// All that a child has to remember of searches.
#[derive(Clone, Debug)]
pub struct Events {
    own: Place,
    /// Earlier ones are over.
    first: Slot,
    /// Each at its slot modulo their number.
    open: [Option<Event>; OPEN_EVENTS],
    early: u64,
    late: u64,
    disagreed: u64,
    delays: Delays,
    answering: Answering,
}

impl Event {
    fn new(slot: Slot, began: u32) -> Self {
        Self {
            slot,
            began,
            search: Search::default(),
            sighted: FixedList::new(Sighted::default()),
            data: [Datum::default(); MOST_LEADERS],
        }
    }

    /// Ticks are counted round: one that began later than now is new.
    fn age(&self, tick: u32) -> u32 {
        let age = tick.wrapping_sub(self.began);
        if age > u32::MAX / 2 { 0 } else { age }
    }

    /// What is left in the place of one that was long ago is over.
    fn is_recent(&self, now: Now) -> bool {
        self.slot.0 > now.slot.0.saturating_sub(SPAN)
    }

    /// Whose datum was taken here that knew something else.
    fn disagrees(&self, terms: &Terms, data: &Data) -> Option<Place> {
        let mut leaders = terms.team.leaders().each();
        leaders.find(|leader| {
            let rank = terms.team.rank(*leader);
            let taken = rank.filter(|it| self.search.path_of(*it).is_some());
            let taken = taken.and_then(|it| self.data.get(it.index()));
            taken.is_some_and(|it| it.digest != data.digest)
        })
    }

    fn is_over(&self, tick: u32, patience: Patience) -> bool {
        self.age(tick) >= patience.close_after
    }

    /// Time-outs, then what can be handed on.
    fn work(
        &mut self,
        terms: &Terms,
        tick: u32,
        way: &impl Fn(Stamp, Stamp) -> Option<Reading>,
        send: &mut impl FnMut(&Data),
    ) -> Robots {
        let (age, patience) = (self.age(tick), terms.patience);
        let late = self.search.time_out(age, patience);
        let Self {
            slot,
            search,
            sighted,
            data,
            ..
        } = self;
        search.hand_on(age, patience, |leader, path| {
            let found = sighted.as_slice().iter().find(|it| it.child == path.end());
            let (Some(seen), Some(datum)) = (found, data.get(leader.index())) else {
                return false;
            };
            let Some(said) = datum.seen_further(seen, terms.propagation, way) else {
                return false;
            };
            send(&Data {
                slot: *slot,
                stamp: seen.stamp,
                path: *path,
                is_final: false,
                digest: 0,
                said,
                word: datum.word,
            });
            true
        });
        late
    }
}

impl Datum {
    /// What it makes of a sighting, carried to its stamp first.
    fn seen_further(
        &self,
        seen: &Sighted,
        propagation: Propagation,
        way: impl Fn(Stamp, Stamp) -> Option<Reading>,
    ) -> Option<GlobalPose> {
        let said = if seen.stamp == self.stamp {
            self.said
        } else {
            carried(&self.said, &way(self.stamp, seen.stamp)?, propagation)
        };
        Some(extend(&said, &seen.reading, propagation))
    }
}

impl Data {
    /// The datum's leader, if the datum is one of this event for this child.
    fn check(&self, own: Place, sender: Place, terms: &Terms, now: Now) -> Result<Rank, Refusal> {
        let leader = terms.team.rank(self.path.leader());
        let leader = leader.ok_or(Refusal::NotALeader)?;
        let is_next = self.slot.0 <= now.slot.0.saturating_add(1);
        let of_sender = if self.is_final {
            self.path.leader()
        } else {
            self.path.sender()
        };
        let checks = [
            (self.path.end() == own, Refusal::NotForMe),
            (terms.is_full || !self.is_final, Refusal::NotFinal),
            (!terms.is_full || self.is_final, Refusal::NotHandedOn),
            (sender == of_sender, Refusal::NotOfSender),
            (
                is_next && terms.slots.of(self.stamp) == self.slot,
                Refusal::WrongEvent,
            ),
            (self.is_near(), Refusal::NotFinite),
        ];
        let failed = checks.into_iter().find(|(holds, _)| !holds);
        failed.map_or(Ok(leader), |(_, refusal)| Err(refusal))
    }

    /// Whether all numbers are some. Covariances are by their type.
    fn is_near(&self) -> bool {
        let poses = [self.said.pose, self.word.leader.pose];
        let mut coordinates = poses.iter().flat_map(|it| [it.x, it.y, it.phi]);
        coordinates.all(|number| number.abs() <= FARTHEST) && self.word.past.is_near(FARTHEST)
    }
}

impl Events {
    /// Nothing is open; events before `first` are over.
    #[must_use]
    pub fn new(own: Place, first: Slot) -> Self {
        Self {
            own,
            first,
            open: core::array::from_fn(|_| None),
            early: 0,
            late: 0,
            disagreed: 0,
            delays: Delays::default(),
            answering: Answering::default(),
        }
    }

    /// How many were closed before their time, as one more came.
    #[must_use]
    pub fn closed_early(&self) -> u64 {
        self.early
    }

    /// How many sightings a "no" freed that came after they had counted as used.
    #[must_use]
    pub fn freed_late(&self) -> u64 {
        self.late
    }

    /// A tick begins.
    pub(super) fn begin(&mut self) {
        self.answering.begin();
    }

    /// What there is to say of this tick.
    #[must_use]
    pub fn news(&self) -> &[News] {
        self.answering.news()
    }

    pub(super) fn say(&mut self, news: News) {
        self.answering.say(news);
    }

    /// How many children are seen and mute, and the first of them.
    #[must_use]
    pub fn mutes(&self, team: &Team) -> (u16, RobotId) {
        self.answering.mutes(team)
    }

    /// How long an answer is waited for, by how long they took.
    #[must_use]
    pub fn ack_timeout(&self, bounds: Bounds) -> u32 {
        self.delays.timeout(bounds)
    }

    /// How many data came of a leader that knew something else of the event than one whose datum was taken.
    #[must_use]
    pub fn disagreed(&self) -> u64 {
        self.disagreed
    }

    /// A child is seen at an event that began in the tick `began`. False where that event is over, or the child sees too many.
    pub fn see(
        &mut self,
        terms: &Terms,
        now: Now,
        (child, stamp, reading): (Place, Stamp, Reading),
        began: u32,
    ) -> bool {
        let slot = terms.slots.of(stamp);
        if !terms.team.children().contains(child) || child == self.own {
            return false;
        }
        let Some(event) = self.opened(slot, began, now, terms.patience) else {
            return false;
        };
        let is_known = event.search.seen().contains(child);
        let sighted = Sighted {
            child,
            stamp,
            reading,
        };
        is_known || (event.sighted.push(sighted) && event.search.see(child))
    }

    /// A datum comes from `sender`, of an event that began in the tick `began`.
    ///
    /// # Errors
    /// Why it is not considered.
    pub fn hear(
        &mut self,
        terms: &Terms,
        now: Now,
        sender: Place,
        data: &Data,
        began: u32,
    ) -> Result<Answer, Refusal> {
        let leader = data.check(self.own, sender, terms, now)?;
        let Some(event) = self.opened(data.slot, began, now, terms.patience) else {
            return Ok(Answer::Closed);
        };
        let age = event.age(now.tick);
        let other = event.disagrees(terms, data).filter(|_| terms.is_full);
        // Leaders that know the same use no sighting twice; of those that do not the first one is believed.
        let is_used = other.is_some() && event.search.shares_a_sighting(leader, &data.path);
        let answer = if is_used {
            Answer::Declined
        } else {
            event.search.hear(leader, &data.path, age, terms.patience)
        };
        let place = event.data.get_mut(leader.index());
        if let (Answer::Accepted, Some(place)) = (answer, place) {
            *place = Datum {
                stamp: data.stamp,
                digest: data.digest,
                said: data.said,
                word: data.word,
            };
        }
        if let Some(other) = other {
            self.disagreed += 1;
            let leaders = [other, data.path.leader()].map(|it| terms.team.id(it));
            self.answering.say(News::Disagree { leaders });
        }
        Ok(answer)
    }

    /// An acknowledgement comes from `child`, of what was sent to it of this leader at this event.
    ///
    /// # Errors
    /// It cannot be one.
    pub fn answered(
        &mut self,
        terms: &Terms,
        now: Now,
        (child, leader, taken): (Place, Place, bool),
        slot: Slot,
    ) -> Result<Settled, Refusal> {
        if !terms.team.children().contains(child) {
            return Err(Refusal::NotAChild);
        }
        let leader = terms.team.rank(leader).ok_or(Refusal::NotALeader)?;
        let event = self.open[at(slot)].as_mut();
        let Some(event) = event.filter(|it| it.slot == slot && it.is_recent(now)) else {
            return Ok(Settled::Ignored);
        };
        let (age, search) = (event.age(now.tick), &mut event.search);
        let was_late = search.has_timed_out(child);
        if let Some(taken) = search.delay(child, leader, age) {
            self.delays.add(taken);
            self.answering.answered(&terms.team, child);
        }
        let settled = search.answered(child, leader, taken, age, terms.patience);
        self.late += u64::from(was_late && settled == Settled::Freed);
        Ok(settled)
    }

    /// The end of a tick, at every open event: time-outs, whose number is returned, then what can be handed on. `way` is this child's
    /// own way between two stamps, as far as it knows it.
    pub fn work(
        &mut self,
        terms: &Terms,
        now: Now,
        way: impl Fn(Stamp, Stamp) -> Option<Reading>,
        mut send: impl FnMut(&Data),
    ) -> usize {
        if terms.is_full {
            return 0;
        }
        let mut count = 0;
        let events = self.open.iter_mut().flatten();
        for event in events.filter(|event| event.is_recent(now)) {
            let late = event.work(terms, now.tick, &way, &mut send);
            self.answering.silent(&terms.team, late);
            count += late.count();
        }
        count
    }

    /// The search of an event, if it is remembered.
    #[must_use]
    pub fn search(&self, slot: Slot) -> Option<&Search> {
        let event = self.open[at(slot)].as_ref();
        event.filter(|it| it.slot == slot).map(|it| &it.search)
    }

    /// The clock was stepped: nothing is open any more.
    pub fn forget(&mut self, first: Slot) {
        self.first = first;
        for event in &mut self.open {
            *event = None;
        }
    }

    /// The event, opened if it was not; `None` if it is over.
    fn opened(
        &mut self,
        slot: Slot,
        began: u32,
        now: Now,
        patience: Patience,
    ) -> Option<&mut Event> {
        let oldest = now.slot.0.saturating_sub(SPAN);
        if slot < self.first || slot.0 <= oldest {
            return None;
        }
        let place = &mut self.open[at(slot)];
        if place.as_ref().is_some_and(|it| it.slot > slot) {
            return None;
        }
        if let Some(older) = place.take_if(|it| it.slot < slot) {
            self.early += u64::from(!older.is_over(now.tick, patience));
        }
        Some(place.get_or_insert_with(|| Event::new(slot, began)))
    }
}

/// Below [`OPEN_EVENTS`].
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // A remainder of eight.
fn at(slot: Slot) -> usize {
    slot.0.rem_euclid(SPAN) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_childs_state_is_48_kib() {
        let size = size_of::<Events>();
        assert!(size <= 48 * 1024, "{size} B");
    }
}
