//! One tick, as the design draws it: wait ──► collect ──► estimate ──► publish ──► account.
//!
//! [`Robot`] is everything that a tick touches. The wait, the only step that blocks, is outside: whoever drives the
//! ticks (the daemon's loop, a test, a bench) says why it ended.

use std::sync::Arc;

use coloc_estimator::{Span, Stamp};
use coloc_shm_types::Space;

use crate::account::Account;
use crate::clock::{Moment, TimeSource, Timeline};
use crate::collect::Collect;
use crate::config::Config;
use crate::estimate::{Estimate, initial};
use crate::event::{Event, Link};
use crate::publish::{Circumstances, Publish, Stages};
use crate::record::{self, Record};
use crate::saved::{Saved, Unusable, When};
use crate::start::StartError;
use crate::wait::Wake;

/// A robot: its clocks, and the four steps after the wait.
pub struct Robot {
    time: Box<dyn TimeSource>,
    timeline: Timeline,
    /// The last tick's stamp.
    last: Stamp,
    collect: Collect,
    estimate: Estimate,
    publish: Publish,
    account: Account,
    /// Of the tick before, where this one has none yet.
    stages: Stages,
    listens: u32,
    resumed: Option<Result<f64, Unusable>>,
}

/// Buses are asked so much more often: it is frames that start a tick.
const LISTENS_PER_REHEARSAL: u32 = 16;

/// What a wake-up led to.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// A tick: an estimate was published.
    Ticked,
    /// Only a part of an odometry sample came: the rest is worth waiting for.
    Incomplete,
}

impl Robot {
    /// Opens every port and bus. Allocates, and is the last thing that does.
    ///
    /// # Errors
    /// What could not be opened.
    pub fn open(
        config: &Config,
        space: &Space,
        time: Box<dyn TimeSource>,
        link: Arc<Link>,
    ) -> Result<Self, StartError> {
        let now = time.read();
        let stamp = Stamp::from_nanos(now.of(config.clock.source));
        let resumed = config
            .initial
            .resume
            .then(|| Saved::resume(config, &When::now()));
        let belief = match &resumed {
            Some(Ok((belief, _))) => *belief,
            _ => initial(config),
        };
        let mut account = Account::new(config, link, stamp.as_nanos());
        account.record([Record::begin(config.robot.id, stamp.as_nanos(), &belief)]);
        Ok(Self {
            time,
            timeline: Timeline::new(&config.clock, now),
            last: stamp,
            collect: Collect::open(config, space)?,
            estimate: Estimate::new(config, stamp, belief),
            publish: Publish::open(config, space, stamp.as_nanos())?,
            account,
            stages: Stages::default(),
            listens: 0,
            resumed: resumed.map(|outcome| outcome.map(|(_, age_s)| age_s)),
        })
    }

    /// Whether the saved belief was taken up, if that was asked for: its age \[s\], or why not.
    #[must_use]
    pub fn resumed(&self) -> Option<&Result<f64, Unusable>> {
        self.resumed.as_ref()
    }

    /// The steps of the tick that give a reason to wait for.
    #[must_use]
    pub fn collect(&self) -> &Collect {
        &self.collect
    }

    /// All counters since the start.
    #[must_use]
    pub fn account(&self) -> &Account {
        &self.account
    }

    /// For those who would rather ask than wait: whether there are frames for [`Self::wake`].
    pub fn listen(&mut self) -> bool {
        if self.collect.drain() {
            return true;
        }
        self.listens = self.listens.wrapping_add(1);
        if self.listens.is_multiple_of(LISTENS_PER_REHEARSAL) {
            self.rehearse();
        }
        false
    }

    /// While there are no frames, it is time for messages and joining subscribers; and what a tick will need stays in the
    /// caches.
    fn rehearse(&mut self) {
        let moment = self.moment();
        self.collect.messages(&moment, &mut self.account);
        self.estimate.rehearse(moment.stamp);
        self.publish.rehearse();
    }

    /// What follows the wait: a tick, unless a frame ended it that is not yet a whole odometry sample.
    pub fn wake(&mut self, wake: Wake) -> Outcome {
        let watch = Stopwatch(self.time.monotonic_ns());
        if !self.collect.has_frames() {
            self.collect.drain();
        }
        let moment = self.moment();
        self.collect.frames(&moment, &mut self.account);
        self.collect.supervise(&moment, &mut self.account);
        if wake == Wake::Frame && !self.collect.has_odometry() {
            return Outcome::Incomplete;
        }
        self.tick(wake, watch, &moment);
        Outcome::Ticked
    }

    /// There will be no more ticks: where the robot is now is worth saving.
    pub fn leave(&mut self) {
        let moment = self.moment();
        let estimate = self.estimate.at(moment.stamp);
        self.account.last(&estimate, &moment.reading);
    }

    fn tick(&mut self, wake: Wake, mut watch: Stopwatch, moment: &Moment) {
        let lateness_ns = self.account.woke(wake, watch.0);
        // collect
        self.collect.messages(moment, &mut self.account);
        let inputs = self.collect.inputs(moment);
        self.stages.collect_ns = watch.lap(&*self.time);
        // estimate
        let outputs = self.estimate.step(&inputs);
        self.stages.estimate_ns = watch.lap(&*self.time);
        // publish
        let circumstances = Circumstances {
            tick: self.account.status.tick,
            frame_stamp_ns: self.collect.newest_frame_ns(moment.stamp),
            latency_ns: watch.since(moment),
            lateness_ns,
            stages: self.stages,
            health: self.account.health(),
        };
        self.publish.estimate(&outputs, &circumstances);
        self.publish.neighbours(outputs.outgoing);
        self.stages.publish_ns = watch.lap(&*self.time);
        // account
        let lines = record::of_inputs(self.account.status.tick, &inputs);
        self.account.record(lines);
        self.account.record([Record::from(&outputs.estimate)]);
        self.account
            .outputs(&outputs, self.collect.samples(), &moment.reading);
        self.collect.clear();
        self.account
            .close(moment.reading.monotonic_ns, circumstances.latency_ns);
        self.stages.account_ns = watch.lap(&*self.time);
        self.last = moment.stamp;
    }

    /// Reads the clocks; if one was stepped, everybody who remembers a stamp is told.
    fn moment(&mut self) -> Moment {
        let moment = self.timeline.advance(self.time.read());
        self.account.begin(moment.stamp);
        if moment.frames_unreliable || moment.shift != Span::ZERO {
            self.account.tell(Event::ClockStepped {
                shift_ns: moment.shift.as_nanos(),
            });
        }
        if moment.shift != Span::ZERO && !cfg!(coloc_break = "clock_step") {
            self.shift(moment.shift);
        }
        moment
    }

    fn shift(&mut self, shift: Span) {
        let old = self.last;
        self.last = old + shift;
        self.account.record([Record::Rebase {
            old_ns: old.as_nanos(),
            new_ns: self.last.as_nanos(),
        }]);
        self.estimate.rebase(old, self.last);
        self.collect.shift(shift);
        self.account.shift(shift);
    }
}

/// When the last stage ended \[ns of `CLOCK_MONOTONIC`\].
struct Stopwatch(i64);

impl Stopwatch {
    /// How long the stage that ends now took \[ns\].
    fn lap(&mut self, time: &dyn TimeSource) -> u32 {
        let begin = std::mem::replace(&mut self.0, time.monotonic_ns());
        u32::try_from((self.0 - begin).max(0)).unwrap_or(u32::MAX)
    }

    /// From the tick's stamp to the end of the last stage \[ns\].
    fn since(&self, moment: &Moment) -> u64 {
        u64::try_from(self.0 - moment.reading.monotonic_ns).unwrap_or(0)
    }
}
