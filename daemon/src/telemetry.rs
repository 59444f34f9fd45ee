//! The second, ordinary thread: logs, status, state file, watchdog. It may be slow, block and allocate.

mod log;
mod throttle;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use coloc_shm_types::{Publisher, Space, Status};
use tracing::{error, info, warn};

use crate::config::Config;
use crate::event::{Event, Link};
use crate::ledger::Ledger;
use crate::record::Recorder;
use crate::saved::Saved;
use throttle::Throttle;

pub use log::open_log;

/// How often the ring is emptied.
const PERIOD: Duration = Duration::from_millis(50);

/// The thread's state.
pub struct Telemetry {
    link: Arc<Link>,
    robot: u16,
    status: Publisher<Status>,
    sequence: u64,
    /// Latencies of all ticks since the start.
    total: Ledger,
    rejects: Throttle,
    state_file: PathBuf,
    state_file_works: bool,
    recorder: Option<Recorder>,
    watchdog: Watchdog,
}

/// Notices when the ticks stop.
struct Watchdog {
    patience: Duration,
    last_beat: u64,
    since: Instant,
    barked: bool,
}

impl Telemetry {
    /// Opens the status port. To be called on the thread that [`Self::run`]s.
    ///
    /// # Errors
    /// If the port cannot be opened.
    pub fn open(
        config: &Config,
        space: &Space,
        link: Arc<Link>,
    ) -> Result<Self, coloc_shm_types::PortError> {
        let patience = Duration::from_secs_f64(
            f64::from(config.telemetry.watchdog_ticks) / config.tick.rate_hz,
        );
        Ok(Self {
            link,
            robot: config.robot.id,
            status: space.publisher(&config.robot.name)?,
            sequence: 0,
            total: Ledger::default(),
            rejects: Throttle::default(),
            state_file: config.state_file(),
            state_file_works: true,
            recorder: None,
            watchdog: Watchdog {
                patience: patience.max(2 * PERIOD),
                last_beat: 0,
                since: Instant::now(),
                barked: false,
            },
        })
    }

    /// Writes the recording as well.
    #[must_use]
    pub fn recording(self, recorder: Recorder) -> Self {
        Self {
            recorder: Some(recorder),
            ..self
        }
    }

    /// Works until the other end of `stop` is dropped, and once more after that.
    pub fn run(mut self, stop: &Receiver<()>) {
        loop {
            let ended = !matches!(stop.recv_timeout(PERIOD), Err(RecvTimeoutError::Timeout));
            self.drain();
            if ended {
                return self.rejects.flush();
            }
            self.watchdog.look(self.link.last_beat());
        }
    }

    fn drain(&mut self) {
        while let Some(event) = self.link.next_event() {
            self.handle(event);
        }
        self.rejects.tick();
        self.recorder.iter_mut().for_each(Recorder::flush);
    }

    fn handle(&mut self, event: Event) {
        match event {
            Event::Account(ledger) => self.publish(ledger),
            Event::Rejected { input, reason } => self.rejects.note(input, reason),
            Event::Recorded(line) => self
                .recorder
                .iter_mut()
                .for_each(|recorder| recorder.write(&line)),
            Event::Belief {
                realtime_ns,
                belief,
                ..
            } => self.save(&Saved::new(self.robot, realtime_ns, &belief)),
            other => log::log(&other),
        }
    }

    fn publish(&mut self, mut ledger: Box<Ledger>) {
        self.total.add(&ledger);
        let mut status = ledger.status;
        status.header.sequence = self.sequence;
        status.latency = self.total.percentiles();
        self.sequence += 1;
        if let Err(problem) = self.status.send(status) {
            warn!("status: {problem}");
        }
        ledger.clear();
        self.link.give_back(ledger);
    }

    fn save(&mut self, belief: &Saved) {
        match belief.write(&self.state_file) {
            Ok(()) if !self.state_file_works => {
                info!("the belief is saved to {} again", self.state_file.display());
            }
            Err(problem) if self.state_file_works => {
                warn!(
                    "the belief cannot be saved to {}: {problem}; set telemetry.state_file",
                    self.state_file.display()
                );
            }
            _ => return,
        }
        self.state_file_works = !self.state_file_works;
    }
}

impl Watchdog {
    fn look(&mut self, beat: u64) {
        if beat != self.last_beat {
            if self.barked {
                info!(
                    silent_ms = self.since.elapsed().as_millis(),
                    "the tick is back"
                );
            }
            (self.last_beat, self.since, self.barked) = (beat, Instant::now(), false);
        } else if self.since.elapsed() > self.patience && !self.barked {
            error!(
                tick = beat,
                silent_ms = self.since.elapsed().as_millis(),
                "no tick: the real-time thread does not run"
            );
            self.barked = true;
        }
    }
}
