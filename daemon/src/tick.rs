//! One tick, as the design draws it: wait ──► collect ──► estimate ──► publish ──► account.
//!
//! [`Robot`] is everything that a tick touches. The wait, the only step that blocks, is outside: whoever drives the
//! ticks (the daemon's loop, a test, a bench) says why it ended.

use std::sync::Arc;

use coloc_estimator::{Stamp, TickInputs};
use coloc_shm_types::{Sender, Space};

use crate::account::Account;
use crate::clock::{Moment, TimeSource, Timeline};
use crate::collect::Collect;
use crate::config::{ClockSource, Config};
use crate::estimate::{Estimate, initial};
use crate::event::{Event, Link};
use crate::publish::{Circumstances, Publish, Stages};
use crate::record::{self, Record, Step};
use crate::saved::{Saved, Unusable, When};
use crate::start::StartError;
use crate::wait::Wake;

/// A robot: its clocks, and the four steps after the wait.
pub struct Robot {
    time: Box<dyn TimeSource>,
    timeline: Timeline,
    /// Of the stamps that others see.
    clock: ClockSource,
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

/// Full drains that a tick has time for: as many frames as 2 buses with 100 frames a second hold after 10 s. More wait in the kernel
/// for the next tick.
const DRAINS: usize = 8;

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
        let stamp = Stamp::from_nanos(now.boot_ns);
        let resumed = config
            .initial
            .resume
            .then(|| Saved::resume(config, &When::now()));
        let belief = match &resumed {
            Some(Ok((belief, _))) => *belief,
            _ => initial(config),
        };
        let collect = Collect::open(config, space, Arc::clone(&link))?;
        let sender =
            Sender::start(config.robot.id, config.clock.source.into()).map_err(|error| {
                StartError::System {
                    what: "/dev/urandom cannot be read",
                    error,
                }
            })?;
        let mut account = Account::new(config, link, &sender);
        account.record([Record::begin(config.robot.id, stamp.as_nanos(), &belief)]);
        Ok(Self {
            time,
            timeline: Timeline::new(&now),
            clock: config.clock.source,
            collect,
            estimate: Estimate::new(config, stamp, belief),
            publish: Publish::open(config, space, &sender)?,
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
        if self.collect.drain(&*self.time) {
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
        let watch = Stopwatch(self.time.now_ns());
        if !self.collect.has_frames() {
            self.collect.drain(&*self.time);
        }
        let moment = self.frames();
        self.collect.supervise(&moment, &mut self.account);
        if wake == Wake::Frame && !self.collect.has_odometry() {
            return Outcome::Incomplete;
        }
        self.tick(wake, watch, &moment);
        Outcome::Ticked
    }

    /// Decodes what was drained, and what is left on the buses after a stall, as far as a tick has time for it.
    fn frames(&mut self) -> Moment {
        let mut moment = self.moment();
        self.decode(&moment);
        for _ in 1..DRAINS {
            if self.collect.emptied() {
                break;
            }
            self.collect.drain(&*self.time);
            moment = self.moment();
            self.decode(&moment);
        }
        moment
    }

    /// The estimator takes a bounded number of samples at once: those of a longer way go ahead of the tick. So no part of it is
    /// lost, nor taken as one mean velocity, which would not be the same in a turn.
    fn decode(&mut self, moment: &Moment) {
        while !self.collect.frames(moment, &mut self.account) {
            self.go_ahead(moment);
        }
    }

    fn go_ahead(&mut self, moment: &Moment) {
        let Some(inputs) = self.collect.way() else {
            return;
        };
        let outputs = self.estimate.step(&inputs);
        self.publish.neighbours(outputs.outgoing, moment);
        let lines = record::of_inputs(self.account.status.tick, Step::Ahead, &inputs);
        self.account.record(lines);
        self.account.record([Record::from(&outputs.estimate)]);
        self.account.outputs(&outputs, self.collect.samples());
        self.collect.taken();
    }

    /// There will be no more ticks: where the robot is now is worth saving.
    pub fn leave(&mut self) {
        let moment = self.moment();
        let estimate = self.estimate.at(moment.stamp);
        self.account.last(&estimate);
    }

    fn tick(&mut self, wake: Wake, mut watch: Stopwatch, moment: &Moment) {
        let lateness_ns = self.account.woke(wake, watch.0);
        // collect
        let behind = !self.collect.emptied();
        if behind {
            self.go_ahead(moment);
        } else {
            self.collect.messages(moment, &mut self.account);
        }
        let samples = self.collect.gather();
        let inputs = self.collect.inputs(moment);
        self.stages.collect_ns = watch.lap(&*self.time);
        // estimate
        let (step, outputs) = if behind {
            // A step up to now would make the frames that are left older than the history.
            (Step::Behind, self.estimate.idle(&inputs))
        } else {
            (Step::Own, self.estimate.step(&inputs))
        };
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
        self.publish
            .estimate(&outputs.estimate, &circumstances, moment);
        self.publish.neighbours(outputs.outgoing, moment);
        self.stages.publish_ns = watch.lap(&*self.time);
        // account
        let recorded = TickInputs {
            measurements: if behind { &[] } else { inputs.measurements },
            ..inputs
        };
        let lines = record::of_inputs(self.account.status.tick, step, &recorded);
        self.account.record(lines);
        self.account.record([Record::from(&outputs.estimate)]);
        self.account.outputs(&outputs, samples);
        self.collect.clear(behind);
        self.account
            .close(moment.stamp.as_nanos(), circumstances.latency_ns);
        self.stages.account_ns = watch.lap(&*self.time);
    }

    /// Reads the clocks; that one was set is told, and touches nothing.
    fn moment(&mut self) -> Moment {
        let moment = self
            .timeline
            .advance(&self.time.read(), self.collect.emptied());
        let sent_ns = moment.on(self.clock, moment.stamp.as_nanos());
        self.account.begin(moment.stamp, sent_ns);
        if let Some(step) = moment.step {
            self.account.tell(Event::ClockStepped(step));
        }
        moment
    }
}

/// When the last stage ended \[ns of the inner clock\].
struct Stopwatch(i64);

impl Stopwatch {
    /// How long the stage that ends now took \[ns\].
    fn lap(&mut self, time: &dyn TimeSource) -> u32 {
        let begin = std::mem::replace(&mut self.0, time.now_ns());
        u32::try_from((self.0 - begin).max(0)).unwrap_or(u32::MAX)
    }

    /// From the tick's stamp to the end of the last stage \[ns\].
    fn since(&self, moment: &Moment) -> u64 {
        u64::try_from(self.0 - moment.stamp.as_nanos()).unwrap_or(0)
    }
}
