//! A robot in its [`Surroundings`], ticking as it does in `colocd`.

use std::sync::Arc;
use std::sync::mpsc::channel;
use std::thread;
use std::time::Duration;

use coloc_daemon::clock::{KernelTime, TimeSource};
use coloc_daemon::config::{Config, GyroSource, Trigger};
use coloc_daemon::event::Link;
use coloc_daemon::run::turn;
use coloc_daemon::telemetry::Telemetry;
use coloc_daemon::tick::{Outcome, Robot};
use coloc_daemon::wait::Wait;
use coloc_shm_types::Space;
use rustix::event::{EventfdFlags, eventfd};
use tempfile::TempDir;

use crate::surroundings::{Surroundings, config, config_carried, config_in_part};

/// Ticks until everybody is connected and has what it needs: the first message over a new connection maps its shared
/// memory.
pub const WARM_UP: u64 = 200;

/// The number of a group of this user's, as `shm.group` has it.
#[must_use]
pub fn own_group() -> String {
    rustix::process::getegid().as_raw().to_string()
}

/// The robot, what it waits for, and everything around it.
pub struct Scene {
    /// Five steps a tick.
    pub robot: Robot,
    /// Nothing happens in them by itself.
    pub surroundings: Surroundings,
    /// The robot's.
    pub config: Config,
    wait: Wait,
    link: Arc<Link>,
    /// Last, so that it is removed last.
    _directory: TempDir,
}

impl Scene {
    /// Under the kernel's clocks.
    #[must_use]
    pub fn new(trigger: Trigger) -> Self {
        let directory = tempfile::tempdir().unwrap();
        let config = config(directory.path(), trigger);
        Self::with(directory, config, Box::new(KernelTime))
    }

    /// The same, open to a group of this user's.
    #[must_use]
    pub fn for_group(trigger: Trigger) -> Self {
        let directory = tempfile::tempdir().unwrap();
        let mut config = config(directory.path(), trigger);
        config.shm.group = own_group();
        Self::with(directory, config, Box::new(KernelTime))
    }

    /// The same, of a robot that takes part in the exchange of what is seen in part.
    #[must_use]
    pub fn in_part(trigger: Trigger) -> Self {
        let directory = tempfile::tempdir().unwrap();
        let config = config_in_part(directory.path(), trigger);
        Self::with(directory, config, Box::new(KernelTime))
    }

    /// The same, of a robot that leaders carry.
    #[must_use]
    pub fn carried(trigger: Trigger) -> Self {
        let directory = tempfile::tempdir().unwrap();
        let config = config_carried(directory.path(), trigger);
        Self::with(directory, config, Box::new(KernelTime))
    }

    /// The same, with a gyro on its channel.
    #[must_use]
    pub fn with_gyro(trigger: Trigger) -> Self {
        let directory = tempfile::tempdir().unwrap();
        let mut config = config(directory.path(), trigger);
        config.gyro.source = GyroSource::Channel;
        Self::with(directory, config, Box::new(KernelTime))
    }

    /// With a configuration that was made by [`config`] for this directory, under the clocks of `time`.
    #[must_use]
    pub fn with(directory: TempDir, config: Config, time: Box<dyn TimeSource>) -> Self {
        let space = Space::open(&config.shm.root, &config.shm.prefix, "test").unwrap();
        let mut surroundings = Surroundings::new(directory.path(), &space);
        if config.sighting.heard {
            surroundings.take_part();
        }
        if config.assist.is_on() {
            surroundings.carry();
        }
        let link = Arc::new(Link::new());
        let robot = Robot::open(&config, &space, time, Arc::clone(&link)).unwrap();
        let stop = eventfd(0, EventfdFlags::CLOEXEC).unwrap();
        let now_ns = KernelTime.now_ns();
        let wait = Wait::new(config.tick.trigger, config.period_ns(), now_ns, stop).unwrap();
        robot
            .collect()
            .buses()
            .for_each(|bus| wait.watch(bus).unwrap());
        Self {
            robot,
            surroundings,
            config,
            wait,
            link,
            _directory: directory,
        }
    }

    /// Runs `body` while telemetry empties the ring on a thread of its own: else the ring would be full, and the way into
    /// it not exercised.
    pub fn with_telemetry<T>(&mut self, body: impl FnOnce(&mut Self) -> T) -> T {
        let (config, link) = (self.config.clone(), Arc::clone(&self.link));
        thread::scope(|threads| {
            let (running, stopped) = channel();
            threads.spawn(move || {
                let (entered, spaces) = channel();
                entered
                    .send(config.open_space("telemetry").unwrap())
                    .unwrap();
                Telemetry::new(&config, link, spaces).run(&stopped).unwrap();
            });
            let result = body(self);
            drop(running);
            result
        })
    }

    /// What the daemon's loop does; whether it came to a tick.
    pub fn turn(&mut self) -> bool {
        turn(&mut self.robot, &mut self.wait).unwrap() == Some(Outcome::Ticked)
    }

    /// From one deadline to the next.
    #[must_use]
    pub fn period(&self) -> Duration {
        Duration::from_nanos(self.config.period_ns().unsigned_abs())
    }

    /// Whether everybody is connected.
    #[must_use]
    pub fn is_warm(&self) -> bool {
        self.robot.account().tick() > WARM_UP
    }
}
