//! One tick, as the design draws it: wait ──► collect ──► estimate ──► publish ──► account.
//!
//! [`Robot`] is everything that a tick touches. The wait, the only step that blocks, is outside: whoever drives the
//! ticks (the daemon's loop, a test, a bench) says why it ended.

use std::sync::Arc;

use coloc_estimator::assist::assistant::{Carried, Words};
use coloc_estimator::{Span, Stamp, Start, TickInputs};
use coloc_shm_types::{Sender, Space, Timing};

use crate::account::Account;
use crate::clock::{Drain, Moment, TimeSource, Timeline};
use crate::collect::Collect;
use crate::config::{ClockSource, Config, Realtime, Scheduler};
use crate::estimate::{Estimate, settings_knowing, start};
use crate::event::{Event, Link};
use crate::publish::{Circumstances, Publish};
use crate::record::{self, Record, Step};
use crate::rehearsal::{Gaps, Length, Understudy};
use crate::saved::{Saved, Unusable, When};
use crate::start::StartError;
use crate::stopwatch::{Stages, Stopwatch};
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
    /// Stamps what is told of each tick's time.
    timings: Sender,
    /// When the newest frame of the tick before came \[ns of the inner clock\].
    last_frame_ns: i64,
    /// The last tick's stamp.
    last_tick: Stamp,
    listens: u32,
    /// When it was found that only a part of a sample has come.
    incomplete: Option<Moment>,
    gaps: Gaps,
    acts: [Length; ACTS.len()],
    understudy: Box<Understudy>,
    resumed: Option<Result<f64, Unusable>>,
}

/// Buses are asked so much more often: it is frames that start a tick.
const LISTENS_PER_REHEARSAL: u32 = 16;

/// Full drains that a tick has time for: as many frames of each bus as one with 200 frames a second holds after 10 s. More wait in the kernel
/// for the next tick.
const DRAINS: usize = 8;

/// A part of the rehearsal.
type Act = fn(&mut Robot, &Moment);

/// Those that save most come first: there may be no time for all.
const ACTS: [Act; 4] = [
    Robot::take_messages,
    Robot::rehearse_step,
    Robot::rehearse_words,
    Robot::rehearse_sending,
];

/// Where a tick's time went.
struct Times {
    tick: u64,
    since_tick_ns: u64,
    lateness_ns: u64,
    /// When the estimate had been sent \[ns of the inner clock\].
    sent_ns: i64,
    stages: Stages,
}

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
        let (start, gyro) = match &resumed {
            Some(Ok(resumed)) => (Start::Known(resumed.belief), resumed.gyro),
            _ => (start(config), None),
        };
        let settings = settings_knowing(config, gyro);
        let collect = Collect::open(config, space, Arc::clone(&link))?;
        let sender = sender(config)?;
        let publish = Publish::open(config, space, &sender)?;
        let mut account = Account::new(config, link, &sender);
        collect.deaf().for_each(|input| account.deaf(input));
        publish.unreachable().for_each(|it| account.unreachable(it));
        let begin = Record::begin(config.robot.id, stamp.as_nanos(), &start, settings.gyro);
        account.record([begin]);
        Ok(Self {
            time,
            timeline: Timeline::new(&now),
            clock: config.clock.source,
            collect,
            estimate: Estimate::with(settings, config.history.capacity, stamp, &start)
                .with_part(config.assistant()),
            publish,
            account,
            timings: sender.beside(),
            last_frame_ns: 0,
            last_tick: stamp,
            listens: 0,
            incomplete: None,
            gaps: Gaps::default(),
            acts: [Length::default(); ACTS.len()],
            understudy: Understudy::new(config, stamp, &start),
            resumed: resumed.map(|outcome| outcome.map(|it| it.age_s)),
        })
    }

    /// Whether the saved belief was taken up, if that was asked for: its age \[s\], or why not.
    #[must_use]
    pub fn resumed(&self) -> Option<&Result<f64, Unusable>> {
        self.resumed.as_ref()
    }

    /// Who wakes readers of a group is in real time as well, behind the tick.
    pub fn hasten(&self, realtime: &Realtime) {
        let is_asked = realtime.scheduler != Scheduler::Other;
        if is_asked && realtime.priority > 1 {
            self.publish.hasten(realtime.priority - 1);
        }
    }

    /// The steps of the tick that give a reason to wait for.
    #[must_use]
    pub fn collect(&self) -> &Collect {
        &self.collect
    }

    /// The last tick's stamp.
    #[must_use]
    pub fn last_tick(&self) -> Stamp {
        self.last_tick
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
        let moment = self.moment(i64::MIN);
        self.collect.messages(&moment, &mut self.account);
        self.estimate.rehearse(moment.stamp);
        self.publish.rehearse();
    }

    /// For those who sleep: what there is time for while the rest of a sample is on the wire. It changes nothing but that the tick
    /// will be faster; messages that have come by now are taken in.
    pub fn prepare(&mut self) {
        let sure_ns = self.gaps.sure_ns();
        let Some(moment) = self.incomplete.take().filter(|_| sure_ns > 0) else {
            return;
        };
        let end_ns = moment.stamp.as_nanos() + sure_ns;
        let mut now_ns = self.time.now_ns();
        for (number, act) in ACTS.into_iter().enumerate() {
            now_ns = self.play(number, act, &moment, [now_ns, end_ns]);
        }
    }

    /// Plays an act, if it will be over in time; when it was.
    fn play(
        &mut self,
        number: usize,
        act: Act,
        moment: &Moment,
        [begin_ns, end_ns]: [i64; 2],
    ) -> i64 {
        let length = self.acts.get(number).copied().unwrap_or_default();
        let is_time = begin_ns + length.ns() <= end_ns;
        if is_time {
            act(self, moment);
        }
        let now_ns = self.time.now_ns();
        match self.acts.get_mut(number) {
            Some(length) if is_time => length.took(now_ns - begin_ns),
            Some(length) => length.left_out(),
            None => {}
        }
        now_ns
    }

    fn take_messages(&mut self, moment: &Moment) {
        self.collect.messages(moment, &mut self.account);
    }

    fn rehearse_step(&mut self, moment: &Moment) {
        self.understudy.play(moment.stamp, self.collect.heard());
    }

    fn rehearse_words(&mut self, moment: &Moment) {
        let estimate = self.estimate.at(moment.stamp);
        self.account
            .rehearse(&estimate.belief, self.estimate.finding());
    }

    fn rehearse_sending(&mut self, _: &Moment) {
        self.publish.expect();
        self.publish.rehearse();
    }

    /// What follows the wait: a tick, unless a frame ended it that is not yet a whole odometry sample.
    pub fn wake(&mut self, wake: Wake) -> Outcome {
        let watch = Stopwatch::start(&*self.time);
        let mut not_before_ns = i64::MIN;
        if !self.collect.has_frames() {
            not_before_ns = watch.last_ns();
            self.collect.drain(&*self.time);
        }
        let moment = self.frames(not_before_ns);
        let frame_ns = self.collect.last_frame_ns();
        self.gaps.end(frame_ns);
        self.collect.supervise(&moment, &mut self.account);
        if wake == Wake::Frame && !self.collect.has_odometry() {
            self.gaps.begin(moment.stamp.as_nanos(), frame_ns);
            self.incomplete = Some(moment);
            return Outcome::Incomplete;
        }
        self.tick(wake, watch, &moment);
        Outcome::Ticked
    }

    /// Decodes what was drained, and what is left on the buses after a stall, as far as a tick has time for it.
    /// The first drain began no earlier than `not_before_ns`.
    fn frames(&mut self, not_before_ns: i64) -> Moment {
        let mut moment = self.moment(not_before_ns);
        self.decode(&moment);
        for _ in 1..DRAINS {
            if self.collect.emptied() {
                break;
            }
            self.collect.drain(&*self.time);
            moment = self.moment(i64::MIN);
            self.decode(&moment);
        }
        moment
    }

    /// The estimator takes a bounded number of samples at once: those of a longer way go ahead of the tick. So no part of it is
    /// lost, nor taken as one mean velocity, which would not be the same in a turn.
    fn decode(&mut self, moment: &Moment) {
        while !self.collect.odometry(moment, &mut self.account) {
            self.go_ahead(moment);
        }
    }

    fn go_ahead(&mut self, moment: &Moment) {
        let Some(inputs) = self.collect.way(moment.stamp) else {
            return;
        };
        let outputs = self.estimate.step(&inputs);
        self.publish.others(&outputs, moment);
        let lines = record::of_inputs(self.account.tick(), Step::Ahead, &inputs);
        self.account.record(lines);
        self.account.record([Record::from(&outputs.estimate)]);
        self.account.outputs(&outputs, inputs.measurements);
        self.collect.taken();
    }

    /// There will be no more ticks: where the robot is now is worth saving.
    pub fn leave(&mut self) {
        let moment = self.moment(i64::MIN);
        let estimate = self.estimate.at(moment.stamp);
        self.account.last(&estimate, self.estimate.finding());
    }

    fn tick(&mut self, wake: Wake, mut watch: Stopwatch, moment: &Moment) {
        let lateness_ns = self.account.woke(wake, watch.last_ns());
        // collect
        let behind = !self.collect.emptied();
        let inputs = if behind {
            self.go_ahead(moment);
            // Messages that are there already wait for the tick that has caught up.
            TickInputs {
                stamp: moment.stamp,
                measurements: &[],
            }
        } else {
            self.collect.messages(moment, &mut self.account);
            self.collect
                .gather(moment.stamp, || ahead(moment, self.clock));
            self.collect.inputs(moment)
        };
        let words = if behind {
            Words::default()
        } else {
            self.collect.words(|| ahead(moment, self.clock))
        };
        let mut stages = Stages {
            collect_ns: watch.lap(&*self.time),
            ..Stages::default()
        };
        // estimate
        let (step, (outputs, carried)) = if behind {
            // A step up to now would make the frames that are left older than the history.
            let idle = self.estimate.idle(&inputs);
            (Step::Behind, (idle, Carried::default()))
        } else {
            (Step::Own, self.estimate.step_among(&inputs, &words))
        };
        stages.estimate_ns = watch.lap(&*self.time);
        let since_tick_ns = watch.since(moment);
        // publish
        let (health, standing) = self
            .account
            .health(&outputs.estimate.belief, outputs.finding);
        let opinion = self.account.opinion(self.collect.opinion(), health);
        let circumstances = Circumstances {
            tick: self.account.tick(),
            health,
            standing,
            opinion,
        };
        self.publish
            .estimate(&outputs.estimate, &circumstances, moment);
        let sent_ns = self.time.now_ns();
        self.publish.others(&outputs, moment);
        self.publish.carried(&carried, moment);
        if let Some(shared) = &outputs.shared {
            self.publish.share(shared, moment);
        }
        self.publish.ring();
        stages.publish_ns = watch.lap(&*self.time);
        // account
        let lines = record::of_words(self.account.tick(), step, &inputs, &words);
        self.account.record(lines);
        self.account
            .record([Record::published(&outputs.estimate, opinion)]);
        self.account.outputs(&outputs, inputs.measurements);
        if self.gaps.sure_ns() > 0 {
            self.understudy.learn(inputs.measurements);
        }
        self.collect.clear(moment.stamp, behind);
        self.last_tick = moment.stamp;
        self.close_books(moment, since_tick_ns);
        stages.account_ns = watch.lap(&*self.time);
        let times = Times {
            tick: circumstances.tick,
            since_tick_ns,
            lateness_ns,
            sent_ns,
            stages,
        };
        self.tell_times(&times, moment);
    }

    fn close_books(&mut self, moment: &Moment, latency_ns: u64) {
        let now = moment.stamp;
        self.account.undelivered(self.publish.undelivered);
        if let Some(counts) = self.estimate.assisted() {
            self.account.assisted(&counts);
            self.account.assist_news(self.estimate.assist_news());
        }
        if self.account.is_report_due(now.as_nanos()) {
            self.collect.tell_sessions(now, &mut self.account);
        }
        self.account.close(now.as_nanos(), latency_ns);
    }

    fn tell_times(&mut self, times: &Times, moment: &Moment) {
        let frame_ns = self.collect.newest_frame_ns(moment.stamp);
        let is_new = frame_ns > std::mem::replace(&mut self.last_frame_ns, frame_ns);
        let latency_ns = u64::try_from(times.sent_ns - frame_ns).unwrap_or(0);
        let stamp_ns = moment.on(self.clock, moment.stamp.as_nanos());
        self.account.tell_timing(Timing {
            header: self.timings.header(stamp_ns),
            boot_ns: moment.stamp.as_nanos(),
            tick: times.tick,
            frame_stamp_ns: match frame_ns {
                0 => 0,
                inner_ns => moment.on(self.clock, inner_ns),
            },
            latency_ns: if is_new { latency_ns } else { 0 },
            since_tick_ns: times.since_tick_ns,
            lateness_ns: times.lateness_ns,
            collect_ns: times.stages.collect_ns,
            estimate_ns: times.stages.estimate_ns,
            publish_ns: times.stages.publish_ns,
            account_ns: times.stages.account_ns,
        });
    }

    /// Reads the clocks after a drain that began no earlier than `not_before_ns`; that one was set is told, and touches nothing.
    fn moment(&mut self, not_before_ns: i64) -> Moment {
        let drain = Drain {
            emptied: self.collect.emptied(),
            not_before_ns,
        };
        let moment = self.timeline.advance(&self.time.read(), drain);
        let sent_ns = moment.on(self.clock, moment.stamp.as_nanos());
        self.account.begin(moment.stamp, sent_ns);
        if let Some(step) = moment.step {
            self.account.tell(Event::ClockStepped(step));
        }
        moment
    }
}

/// How far a clock is ahead of the inner one.
fn ahead(moment: &Moment, clock: ClockSource) -> Span {
    let inner_ns = moment.stamp.as_nanos();
    Span::from_nanos(moment.on(clock, inner_ns).saturating_sub(inner_ns))
}

fn sender(config: &Config) -> Result<Sender, StartError> {
    let sender = Sender::start(config.robot.id, config.clock.source.into());
    sender.map_err(|error| StartError::System {
        what: "/dev/urandom cannot be read",
        error,
    })
}
