//! The second, ordinary thread: lines of the log, status, times, watchdog, why there is no odometry; and what goes to disk, by
//! threads that may stall.
//!
//! The robot does without it: what fails here is said and tried again. After a panic, a defect, it begins anew.

mod lines;
mod listening;
mod outlet;
mod place;
mod throttle;
mod watchdog;

use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use coloc_shm_types::{Lost, Space, Status, Timing};
use tracing::error;

use crate::account::Ledger;
use crate::config::Config;
use crate::event::{Event, Link};
use crate::record::Recorder;
use crate::retry::Retry;
use crate::saved::{Saved, Saver, When};
use listening::Listening;
use outlet::Outlet;
use place::Place;
use throttle::Throttle;
use watchdog::Watchdog;

/// How often the ring is emptied.
const PERIOD: Duration = Duration::from_millis(50);

/// How often the shared memory is looked after: its loss is noticed within a second.
const CHECK_PERIOD: Duration = Duration::from_millis(800);

/// How long disks may take for what is left at the end.
const LAST_WRITES: Duration = Duration::from_millis(100);

/// The thread's state.
pub struct Telemetry {
    link: Arc<Link>,
    robot: u16,
    status: Outlet<Status>,
    timing: Outlet<Timing>,
    /// After the ports, so that it is left when they are closed.
    place: Place,
    /// Latencies of all ticks since the start.
    total: Ledger,
    lines: Throttle,
    lost_events: u64,
    writers: Writers,
    watchdog: Watchdog,
    listening: Option<Listening>,
    defects: Retry,
    /// Not before this is anything done but watching, so that a defect that stays fills no log.
    resumes: Instant,
}

/// Those who write what is to be kept, each on a thread of its own.
#[derive(Debug, Default)]
pub struct Writers {
    saver: Option<Saver>,
    recorder: Option<Recorder>,
}

impl Writers {
    /// What `config` asks for.
    ///
    /// # Errors
    /// If there is no thread to be had.
    pub fn start(config: &Config) -> io::Result<Self> {
        let saver = config.initial.resume.then(|| Saver::start(config));
        let record = &config.telemetry.record;
        let recorder = (!record.as_os_str().is_empty()).then(|| Recorder::start(record));
        Ok(Self {
            saver: saver.transpose()?,
            recorder: recorder.transpose()?,
        })
    }

    fn finish(&mut self) {
        let deadline = Instant::now() + LAST_WRITES;
        let left = || deadline.saturating_duration_since(Instant::now());
        self.saver.iter().for_each(|saver| saver.finish(left()));
        self.recorder.iter_mut().for_each(|it| it.finish(left()));
    }
}

impl Telemetry {
    /// Opens nothing yet: its ports are opened, and opened again, as needed, in the space that comes from `spaces`. To
    /// be called on the thread that [`Self::run`]s.
    #[must_use]
    pub fn new(config: &Config, link: Arc<Link>, spaces: Receiver<Space>) -> Self {
        let patience = Duration::from_secs_f64(
            f64::from(config.telemetry.watchdog_ticks) / config.tick.rate_hz,
        );
        let now = Instant::now();
        Self {
            listening: Listening::new(config, Arc::clone(&link)),
            link,
            robot: config.robot.id,
            status: Outlet::new(config.robot.name.clone()),
            timing: Outlet::new(config.robot.name.clone()),
            place: Place::new(spaces),
            total: Ledger::default(),
            lines: Throttle::default(),
            lost_events: 0,
            writers: Writers::default(),
            watchdog: Watchdog::new(patience.max(2 * PERIOD), now),
            defects: Retry::default(),
            resumes: now,
        }
    }

    /// Has beliefs and the recording written as well.
    #[must_use]
    pub fn writing(self, writers: Writers) -> Self {
        Self { writers, ..self }
    }

    /// Works until the other end of `stop` is dropped, and once more after that.
    ///
    /// # Errors
    /// The shared memory was taken away: whoever comes now does not meet this robot.
    pub fn run(mut self, stop: &Receiver<()>) -> Result<(), Lost> {
        let result = loop {
            match catch_unwind(AssertUnwindSafe(|| self.work(stop))) {
                Ok(result) => break result,
                Err(_) => self.begin_anew(),
            }
            if has_ended(stop, Duration::ZERO) {
                break Ok(());
            }
        };
        self.finish();
        result
    }

    fn work(&mut self, stop: &Receiver<()>) -> Result<(), Lost> {
        let mut checked = Instant::now();
        while !has_ended(stop, PERIOD) {
            self.watch();
            if Instant::now() < self.resumes {
                continue;
            }
            self.drain();
            if let Some(listening) = &mut self.listening {
                listening.look(Instant::now());
            }
            if checked.elapsed() >= CHECK_PERIOD {
                checked = Instant::now();
                self.place.look_after()?;
            }
        }
        self.drain();
        Ok(())
    }

    fn watch(&mut self) {
        let beat = self.link.last_beat();
        if let Some(word) = self.watchdog.look(beat, Instant::now()) {
            word.say(beat);
        }
    }

    /// After a panic and a pause, in some doubt about the port and without the ledger that was at hand.
    fn begin_anew(&mut self) {
        let pause = self.defects.failed();
        error!(
            pause_s = pause.as_secs(),
            "telemetry begins anew after a defect of colocd; please report it with this log"
        );
        self.status.close();
        self.timing.close();
        self.link.give_back(Box::default());
        self.resumes = Instant::now() + pause;
    }

    fn finish(mut self) {
        self.lines.flush().for_each(lines::write);
        self.writers.finish();
        if let Some(listening) = self.listening {
            listening.finish();
        }
    }

    fn drain(&mut self) {
        while let Some(event) = self.link.next_event() {
            self.handle(event);
        }
        self.lines.due(Instant::now()).for_each(lines::write);
        self.writers.recorder.iter_mut().for_each(Recorder::hand_on);
    }

    fn handle(&mut self, event: Event) {
        match event {
            Event::Account(ledger) => self.publish(ledger),
            Event::Timing(timing) => self.timing.send(timing, &mut self.place),
            Event::Recorded(line) => self
                .writers
                .recorder
                .iter_mut()
                .for_each(|it| it.take(line)),
            Event::Belief {
                boot_ns,
                belief,
                velocity,
                gyro,
            } => self.save(boot_ns, |when, robot| Saved {
                gyro: gyro.map(|[bias, variance]| [bias, variance.sqrt()]),
                ..Saved::new(robot, when, &belief, velocity)
            }),
            other => self.lines.note(other),
        }
    }

    fn save(&mut self, boot_ns: i64, saved: impl Fn(When, u16) -> Saved) {
        let robot = self.robot;
        self.writers
            .saver
            .iter()
            .for_each(|saver| saver.offer(saved(saver.when(boot_ns), robot)));
    }

    fn publish(&mut self, mut ledger: Box<Ledger>) {
        self.total.add(&ledger);
        let lost = ledger.status.losses.events;
        if lost > self.lost_events {
            let events = lost - self.lost_events;
            self.lines.note(Event::Lost { events });
        }
        self.lost_events = lost;
        let mut status = ledger.status;
        status.latency = self.total.percentiles();
        self.status.send(status, &mut self.place);
        ledger.clear();
        self.link.give_back(ledger);
    }
}

/// Whether the other end of `stop` was dropped within `pause`.
fn has_ended(stop: &Receiver<()>, pause: Duration) -> bool {
    stop.recv_timeout(pause) != Err(RecvTimeoutError::Timeout)
}
