//! The life of the process: start, two threads, signals, end.

use std::os::fd::OwnedFd;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{Builder, JoinHandle};

use coloc_shm_types::Space;
use rustix::event::{EventfdFlags, eventfd};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::{Handle, Signals};
use tracing::{error, info, warn};

use crate::clock::{KernelTime, TimeSource};
use crate::config::{Config, Trigger};
use crate::event::Link;
use crate::realtime;
use crate::record::Recorder;
use crate::start::StartError;
use crate::telemetry::{Telemetry, open_log};
use crate::tick::{Outcome, Robot};
use crate::wait::{Wait, Wake};

/// Beyond what is touched in advance: start-up is deeper than any tick.
const SPARE_STACK: usize = 2 << 20;

/// Localizes until SIGINT or SIGTERM.
///
/// # Errors
/// Why it did not start. Once it runs, nothing ends it but a signal or the loss of its clock.
pub fn run(config: &Config) -> Result<(), StartError> {
    open_log(&config.telemetry).map_err(system("telemetry.log_file cannot be opened"))?;
    let recorder = Recorder::create(&config.telemetry.record)
        .map_err(system("telemetry.record cannot be made"))?;
    // Before any thread, so that no signal finds its default action.
    let mut signals =
        Signals::new([SIGINT, SIGTERM]).map_err(system("signals cannot be handled"))?;
    let stop = eventfd(0, EventfdFlags::CLOEXEC)?;
    let link = Arc::new(Link::new());
    let ticking = Ticking::start(config, &link, &stop, signals.handle())?;
    let telemetry = Telemetering::start(config, &link, recorder);
    if let Some(signal) = signals.forever().next() {
        info!(signal, "ending");
    }
    // The counter of a new eventfd has room for one.
    let _ = rustix::io::write(&stop, &1_u64.to_ne_bytes());
    ticking.join();
    telemetry.map(Telemetering::join)
}

/// The real-time thread.
struct Ticking(JoinHandle<()>);

impl Ticking {
    fn start(
        config: &Config,
        link: &Arc<Link>,
        stop: &OwnedFd,
        signals: Handle,
    ) -> Result<Self, StartError> {
        let (started, outcome) = channel();
        let (config, link) = (config.clone(), Arc::clone(link));
        let stop = stop
            .try_clone()
            .map_err(system("a descriptor cannot be duplicated"))?;
        let stack = config.realtime.prefault_stack_kib * 1024 + SPARE_STACK;
        let body = move || {
            // However this thread ends, the main thread must not wait for a signal that nobody sends.
            let _end = EndOfTicks(signals);
            tick_until_stopped(&config, link, stop, &started);
        };
        let thread = Builder::new()
            .name("colocd-tick".into())
            .stack_size(stack)
            .spawn(body)
            .map_err(system("no thread"))?;
        match outcome.recv() {
            Ok(Ok(())) => Ok(Self(thread)),
            Ok(Err(problem)) => {
                let _ = thread.join();
                Err(problem)
            }
            Err(_) => Err(system("the real-time thread ended while it started")(
                std::io::ErrorKind::Other.into(),
            )),
        }
    }

    fn join(self) {
        if self.0.join().is_err() {
            error!(
                "the real-time thread panicked: this is a defect of colocd, please report it with this log"
            );
        }
    }
}

struct EndOfTicks(Handle);

impl Drop for EndOfTicks {
    fn drop(&mut self) {
        self.0.close();
    }
}

/// Everything about the ports stays on the thread that uses them, so start-up happens here too.
fn tick_until_stopped(
    config: &Config,
    link: Arc<Link>,
    stop: OwnedFd,
    started: &Sender<Result<(), StartError>>,
) {
    match start(config, link, stop) {
        Ok((robot, wait, _space)) => {
            // The main thread waits for this; if it is gone, so is the process.
            let _ = started.send(Ok(()));
            if let Err(problem) = ticks(robot, wait) {
                error!("the tick's clock failed: {problem}");
            }
        }
        Err(problem) => {
            let _ = started.send(Err(problem));
        }
    }
}

type Started = (Robot, Wait, (coloc_shm_types::Claim, Space));

fn start(config: &Config, link: Arc<Link>, stop: OwnedFd) -> Result<Started, StartError> {
    let space = config.open_space(&format!("colocd {}", config.robot.name))?;
    let claim = space.claim_robot(&config.robot.name, config.robot.id)?;
    let robot = Robot::open(config, &space, Box::new(KernelTime), link)?;
    report(config, &robot);
    let refused = realtime::set_up(&config.realtime);
    match refused.first() {
        Some(first) if config.realtime.required => {
            return Err(StartError::Realtime(first.to_string()));
        }
        _ => refused.iter().for_each(|refused| warn!("{refused}")),
    }
    let wait = Wait::new(
        config.tick.trigger,
        config.period_ns(),
        KernelTime.monotonic_ns(),
        stop,
    )?
    .polling(config.tick.wait);
    for bus in robot.collect().buses() {
        wait.watch(bus)?;
    }
    Ok((robot, wait, (claim, space)))
}

fn report(config: &Config, robot: &Robot) {
    match robot.resumed() {
        Some(Ok(age_s)) => info!(age_s, "going on from the saved belief"),
        Some(Err(problem)) => info!(
            "starting from [initial]: {}: {problem}",
            config.state_file().display()
        ),
        None => {}
    }
    let trigger = match config.tick.trigger {
        Trigger::Timer => "timer",
        Trigger::Encoder => "encoder",
    };
    info!(robot = %config.robot.name, id = config.robot.id, rate_hz = config.tick.rate_hz, trigger, "running");
}

/// From here on this thread neither allocates nor locks nor logs.
fn ticks(mut robot: Robot, mut wait: Wait) -> Result<(), rustix::io::Errno> {
    while turn(&mut robot, &mut wait)?.is_some() {}
    Ok(())
}

/// The picture of the design, once: waits, and does what there is to do. `None` if that is to end.
///
/// # Errors
/// The clock failed; there is no going on without it.
pub fn turn(robot: &mut Robot, wait: &mut Wait) -> Result<Option<Outcome>, rustix::io::Errno> {
    let wake = wait.wait(|| robot.listen())?;
    if wake == Wake::Stop {
        return Ok(None);
    }
    let outcome = robot.wake(wake);
    if wake == Wake::Frame && outcome == Outcome::Ticked {
        wait.frame_came(KernelTime.monotonic_ns())?;
    }
    Ok(Some(outcome))
}

/// The telemetry thread.
struct Telemetering {
    thread: JoinHandle<()>,
    stop: Sender<()>,
}

impl Telemetering {
    fn start(config: &Config, link: &Arc<Link>, recorder: Recorder) -> Result<Self, StartError> {
        let (stop, stopped) = channel();
        let (config, link) = (config.clone(), Arc::clone(link));
        let body = move || telemetry(&config, link, recorder, &stopped);
        let thread = Builder::new()
            .name("colocd-log".into())
            .spawn(body)
            .map_err(system("no thread"))?;
        Ok(Self { thread, stop })
    }

    fn join(self) {
        drop(self.stop);
        // A panic there was printed by itself; the ticks have ended in good order.
        let _ = self.thread.join();
    }
}

/// Without a status the robot still knows where it is, so a failure here is logged and survived.
fn telemetry(config: &Config, link: Arc<Link>, recorder: Recorder, stop: &Receiver<()>) {
    let open = || -> Result<_, StartError> {
        let space = config.open_space(&format!("colocd {} status", config.robot.name))?;
        Ok((Telemetry::open(config, &space, link)?, space))
    };
    match open() {
        Ok((telemetry, _space)) => telemetry.recording(recorder).run(stop),
        Err(problem) => error!("no status will be published, and nothing recorded: {problem}"),
    }
}

fn system(what: &'static str) -> impl Fn(std::io::Error) -> StartError {
    move |error| StartError::System { what, error }
}
