//! Step 2 of the tick: everything that has arrived, checked, converted and stamped by the inner clock.

pub mod assist;
pub(crate) mod backlog;
mod base;
mod drives;
pub mod frames;
pub mod list;
pub mod messages;
mod opinion;
pub mod parts;
mod port;
mod rounds;
pub mod sensors;
mod team;
pub mod way;
pub mod wheels;

use std::os::fd::BorrowedFd;
use std::sync::Arc;

use coloc_estimator::assist::assistant::Words;
use coloc_estimator::{Measurement, Span, Stamp, TickInputs};
use coloc_shm_types::{Input, Opinion, Space};

use crate::account::Account;
use crate::clock::{Moment, TimeSource};
use crate::config::Config;
use crate::event::Link;
use crate::pace::Arrivals;
use crate::start::StartError;
use base::Base;
use list::List;
use messages::Messages;
use way::Way;
use wheels::Wheels;

/// All inputs of a robot.
#[derive(Debug)]
pub struct Collect {
    wheels: Wheels,
    /// A base that does not speak CAN, if there is one.
    base: Option<Base>,
    way: Way,
    messages: Messages,
    /// What the tick takes in.
    measurements: List<Measurement>,
}

impl Collect {
    /// Opens the buses and subscribes; says through `link` what is heard.
    ///
    /// # Errors
    /// What could not be opened.
    pub fn open(config: &Config, space: &Space, link: Arc<Link>) -> Result<Self, StartError> {
        Ok(Self {
            base: Base::open(config, space)?,
            wheels: Wheels::open(config, link)?,
            way: Way::new(config),
            messages: Messages::open(config, space)?,
            measurements: List::with_capacity(way::WAITING + messages::MOST),
        })
    }

    /// The buses, to be waited on.
    pub fn buses(&self) -> impl Iterator<Item = BorrowedFd<'_>> {
        self.wheels.descriptors()
    }

    /// Takes frames off the buses, which wants to be done before the clocks are read: no frame is then younger than the
    /// tick. Whether there is anything to decode.
    pub fn drain(&mut self, time: &dyn TimeSource) -> bool {
        self.wheels.drain(time)
    }

    /// Whether frames have been drained and not decoded yet.
    #[must_use]
    pub fn has_frames(&self) -> bool {
        self.wheels.has_frames()
    }

    /// Whether the last drain left nothing behind.
    #[must_use]
    pub fn emptied(&self) -> bool {
        self.wheels.emptied()
    }

    /// Makes samples of the frames that were drained before `moment` and of what a base says; whether all that wait now can wait
    /// for the tick.
    pub fn odometry(&mut self, moment: &Moment, account: &mut Account) -> bool {
        let way = &mut self.way;
        let wheels = self.wheels.decode(moment, way, account);
        let base = self.base.as_mut();
        let base = base.is_none_or(|base| base.decode(moment, way, account));
        wheels && base && way.can_wait(moment.stamp)
    }

    /// Looks after the buses.
    pub fn supervise(&mut self, moment: &Moment, account: &mut Account) {
        self.wheels.supervise(moment, self.base.as_ref(), account);
    }

    /// When the last frame of a wheel came, a whole sample or not \[ns of the inner clock\].
    #[must_use]
    pub fn last_frame_ns(&self) -> i64 {
        self.wheels.newest_ns()
    }

    /// When samples of odometry have come.
    #[must_use]
    pub fn arrivals(&self) -> &Arrivals {
        self.way.arrivals()
    }

    /// The messages that this tick has taken in so far.
    #[must_use]
    pub fn heard(&self) -> &[Measurement] {
        self.measurements.as_slice()
    }

    /// Whether a whole odometry sample has come since the last tick.
    #[must_use]
    pub fn has_odometry(&self) -> bool {
        self.way.had_samples()
    }

    /// The samples that wait, as inputs up to the newest of them, but no further than `now`; `None` if there are none.
    #[must_use]
    pub fn way(&self, now: Stamp) -> Option<TickInputs<'_>> {
        self.way.inputs(now)
    }

    /// The estimator has taken the samples.
    pub fn taken(&mut self) {
        self.way.taken();
    }

    /// Drains the subscribers.
    pub fn messages(&mut self, moment: &Moment, account: &mut Account) {
        self.messages
            .receive(moment, &mut self.measurements, account);
    }

    /// Puts the samples that wait to the messages, and the slot that begins; `ahead`: how far the team's clock is ahead of the stamps.
    pub fn gather(&mut self, now: Stamp, ahead: impl FnOnce() -> Span) {
        let reached = Stamp::from_nanos(self.way.newest_ns(now));
        self.messages
            .slot(now, ahead, reached, &mut self.measurements);
        self.way.gather(&mut self.measurements);
        self.messages.gather();
    }

    /// What leaders say and children answer, if that is heard; `ahead`: how far the team's clock is ahead of the stamps.
    #[must_use]
    pub fn words(&self, ahead: impl FnOnce() -> Span) -> Words<'_> {
        self.messages.words(ahead)
    }

    /// What `coloc-bounds` said last, where it is asked.
    #[must_use]
    pub fn opinion(&self) -> Opinion {
        self.messages.opinion()
    }

    /// All that was collected, for the tick at `moment`.
    #[must_use]
    pub fn inputs(&self, moment: &Moment) -> TickInputs<'_> {
        TickInputs {
            stamp: moment.stamp,
            measurements: self.measurements.as_slice(),
        }
    }

    /// The inputs whose channels have no place for this robot.
    pub fn deaf(&self) -> impl Iterator<Item = Input> {
        let base = self.base.iter().filter_map(Base::deaf);
        self.messages.deaf().chain(base)
    }

    /// Says who speaks on the channels.
    pub fn tell_sessions(&self, now: Stamp, account: &mut Account) {
        self.messages.tell_sessions(now, account);
        if let Some(base) = &self.base {
            base.tell_sessions(now, account);
        }
    }

    /// The tick at `now` is over, and the inputs have been used, unless it is `behind`.
    pub fn clear(&mut self, now: Stamp, behind: bool) {
        if !behind {
            self.measurements.clear();
            self.messages.clear();
            if let Some(base) = &mut self.base {
                base.clear(now);
            }
        }
        self.way.clear();
    }

    /// Stamp of the newest odometry that is in the estimate at `stamp` \[ns\]; 0 if there was none.
    #[must_use]
    pub fn newest_frame_ns(&self, stamp: Stamp) -> i64 {
        self.way.newest_ns(stamp)
    }
}
