//! What a leader says of its error: at each event Φ of the error that it *sent* at each of the last eight, whatever came since.
//!
//! One event has one error: the belief at the stamp of the first child that is seen in it. What is seen later in the event, or came to be
//! known of it, does not change it. Sent with the covariance P, of which by what came later P′ is left, it becomes
//!
//! ```text
//! e′ = P′ P⁻¹ e + news     Φ = Ψ P′ P⁻¹     Ψ of the history from there to here (change.rs)
//! ```
//!
//! as the error after more data is uncorrelated with all that is known then, and so with the difference of the two. Of an event that the
//! history has forgotten, Φ is that of the last one that it has not, after what was said there.

use nalgebra::Matrix3;

use super::cross::Leader;
use super::events::Word;
use super::slot::Slot;
use super::transition::{Past, SAID, TRANSITIONS, said};
use crate::belief::Belief;
use crate::estimator::{Estimator, Since};
use crate::history::Storage;
use crate::stamp::Stamp;

/// What was sent at an event.
#[derive(Copy, Clone, Debug)]
pub(super) struct Reference {
    slot: Slot,
    pub(super) stamp: Stamp,
    pub(super) belief: Belief,
    pub(super) word: Word,
}

/// The last events with a child, the latest first.
#[derive(Copy, Clone, Debug, Default)]
pub(super) struct Sent {
    events: [Option<Reference>; TRANSITIONS + 1],
    /// The first event since which the error goes its way.
    began: Option<Slot>,
    rulings: u32,
}

impl Sent {
    /// Nothing is known of before.
    pub(super) fn forget(&mut self) {
        *self = Self::default();
    }

    /// What is sent at the event `slot`, in which a child is seen at `stamp`. `None` if it is not known where the robot is, or if the event
    /// is an old one of which nothing was sent.
    pub(super) fn at<S: Storage>(
        &mut self,
        estimator: &Estimator<S>,
        slot: Slot,
        stamp: Stamp,
    ) -> Option<Reference> {
        let mut events = self.events.iter().flatten();
        if let Some(same) = events.find(|it| it.slot == slot) {
            return Some(*same);
        }
        let [latest, ..] = &self.events;
        if latest.is_some_and(|it| it.slot > slot) {
            return None;
        }
        let belief = estimator.known_at(stamp)?;
        if self.rulings != estimator.rulings() {
            self.forget();
            self.rulings = estimator.rulings();
        }
        let past = self.past(estimator, slot, stamp);
        let word = Word {
            leader: Leader {
                pose: belief.pose,
                covariance: belief.total(),
            },
            past,
        };
        let reference = Reference {
            slot,
            stamp,
            belief,
            word,
        };
        self.events.rotate_right(1);
        if let Some(first) = self.events.first_mut() {
            *first = Some(reference);
        }
        Some(reference)
    }

    fn past<S: Storage>(&mut self, estimator: &Estimator<S>, slot: Slot, stamp: Stamp) -> Past {
        let mut past = Past {
            transitions: [said(&Matrix3::identity()); TRANSITIONS],
            said: SAID,
            known: 0,
        };
        let mut began = self.began;
        let mut oldest = slot;
        let mut last: Option<(Reference, Matrix3<f64>)> = None;
        for it in &mut self.events {
            let Some(reference) = *it else {
                continue;
            };
            let events = slot.0.saturating_sub(reference.slot.0);
            let covariance = reference.word.leader.covariance;
            match estimator.error_since(reference.stamp, &covariance, stamp) {
                // What is older has come that way too.
                Since::Broken => {
                    began = Some(oldest);
                    break;
                }
                Since::Known(by) => {
                    past.say(events, &by);
                    last = Some((reference, by));
                }
                Since::Forgotten => match last.as_ref().and_then(|it| through(it, &reference)) {
                    Some(by) => past.say(events, &by),
                    None => past.end(events),
                },
            }
            oldest = reference.slot;
        }
        self.events.iter_mut().for_each(|it| {
            it.take_if(|it| began.is_some_and(|began| it.slot < began));
        });
        let began = *self.began.insert(began.unwrap_or(slot));
        let known = slot.0.saturating_sub(began.0);
        past.known = u8::try_from(known).unwrap_or(u8::MAX);
        past.said = past.said.min(past.known);
        let unsaid = past.transitions.iter_mut().skip(usize::from(past.said));
        unsaid.for_each(|it| *it = [[0.0; 3]; 3]);
        past
    }
}

/// Φ since `earlier`, by what was said at a later event and by what became of the error since.
fn through((later, by): &(Reference, Matrix3<f64>), earlier: &Reference) -> Option<Matrix3<f64>> {
    let between = later.slot.0.checked_sub(earlier.slot.0)?;
    let before = later.word.past.from(u8::try_from(between).ok()?)?;
    Some(by * before)
}

impl Past {
    /// Since so many events.
    fn say(&mut self, events: i64, by: &Matrix3<f64>) {
        let place = usize::try_from(events - 1).ok();
        if let Some(it) = place.and_then(|place| self.transitions.get_mut(place)) {
            *it = said(by);
        }
    }

    /// Not of so many events ago, nor of more.
    fn end(&mut self, events: i64) {
        let most = u8::try_from(events - 1).unwrap_or(SAID);
        self.said = self.said.min(most);
    }
}
