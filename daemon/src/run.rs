//! The life of the process: start, threads, signals, end.
//!
//! The main thread only waits: for a signal, or for the end of one of its two threads. It never opens, writes or locks
//! anything that can stall, so a signal is answered at any moment, also during start-up. Who does not come back in time at
//! the end is left behind; the kernel takes back what it held, and the next start removes what it left.

mod signals;
mod thread;

use std::os::fd::OwnedFd;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::Builder;
use std::time::{Duration, Instant};

use coloc_shm_types::{Claim, Lost, Space};
use rustix::event::{EventfdFlags, eventfd};
use tracing::{error, info, warn};

use crate::clock::{KernelTime, TimeSource};
use crate::config::{Config, Trigger};
use crate::end::EndError;
use crate::event::Link;
use crate::log::Log;
use crate::realtime;
use crate::saved::Unusable;
use crate::start::StartError;
use crate::telemetry::{Telemetry, Writers};
use crate::tick::{Outcome, Robot};
use crate::wait::{Wait, Wake};
use signals::{Call, Calls};
use thread::{Ending, Watched};

/// Beyond what is touched in advance: start-up is deeper than any tick.
const SPARE_STACK: usize = 2 << 20;

/// When those who have not ended are left behind, from the moment when the end was asked for: the process is gone within a
/// second.
const TICKS_END: Duration = Duration::from_millis(550);
const TELEMETRY_ENDS: Duration = Duration::from_millis(800);
const LOG_ENDS: Duration = Duration::from_millis(100);

/// Localizes until a signal asks it to end. `warnings` are what is unlikely about the configuration: the log says it.
///
/// # Errors
/// Why it did not start, or what ended it otherwise.
pub fn run(config: &Config, warnings: &[String]) -> Result<(), EndError> {
    // Before any thread, so that no signal finds its default action; and before anything that may stall.
    let mut calls = Calls::listen(config).map_err(system("signals cannot be handled"))?;
    let log = Log::open(&config.telemetry).map_err(StartError::Thread)?;
    for warning in warnings {
        warn!("{warning}");
    }
    let result = live(config, &log, &mut calls);
    if let Err(problem) = &result
        && log.is_file()
    {
        error!("{problem}");
    }
    log.finish(LOG_ENDS);
    result
}

fn live(config: &Config, log: &Log, calls: &mut Calls) -> Result<(), EndError> {
    let stop = eventfd(0, EventfdFlags::CLOEXEC).map_err(StartError::from)?;
    let link = Arc::new(Link::new());
    let (entered, spaces) = channel();
    let telemetry = Telemetering::start(config, &link, spaces, calls)?;
    let ticking = start_ticking(config, &link, &stop, entered, calls)?;
    wait_for_the_end(log, calls);
    let since = Instant::now();
    // The counter of a new eventfd has room for one.
    let _ = rustix::io::write(&stop, &1_u64.to_ne_bytes());
    let ticks = ticking.join_until(since + TICKS_END);
    let telemetry = telemetry.join_until(since + TELEMETRY_ENDS);
    judge(ticks).and(telemetry)
}

/// Until a signal asks for it, or one of the threads has ended.
fn wait_for_the_end(log: &Log, calls: &mut Calls) {
    while let Some(call) = calls.next() {
        match call {
            Call::Hangup => log.reopen(),
            Call::End(signal) => {
                info!(signal, "ending");
                return;
            }
        }
    }
}

fn judge(ending: Ending<Result<(), EndError>>) -> Result<(), EndError> {
    match ending {
        Ending::Returned(result) => result,
        Ending::Panicked => Err(EndError::RealTime(
            "it panicked, which is a defect of colocd; please report it with the log".into(),
        )),
        Ending::Stuck => {
            warn!(
                "the real-time thread does not come back; what it leaves in shared memory is removed by the next start"
            );
            Ok(())
        }
    }
}

fn start_ticking(
    config: &Config,
    link: &Arc<Link>,
    stop: &OwnedFd,
    entered: Sender<Space>,
    calls: &Calls,
) -> Result<Watched<Result<(), EndError>>, StartError> {
    let (config, link) = (config.clone(), Arc::clone(link));
    let stop = stop
        .try_clone()
        .map_err(system("a descriptor cannot be duplicated"))?;
    let builder = Builder::new()
        .name("colocd-tick".into())
        .stack_size(config.realtime.prefault_stack_kib * 1024 + SPARE_STACK);
    let body = move || tick_until_stopped(&config, link, stop, &entered);
    Watched::start(builder, body, calls.closer()).map_err(StartError::Thread)
}

/// Everything about the ports stays on the thread that uses them, so start-up happens here too.
fn tick_until_stopped(
    config: &Config,
    link: Arc<Link>,
    stop: OwnedFd,
    entered: &Sender<Space>,
) -> Result<(), EndError> {
    let (robot, wait, _claim) = start(config, link, stop, entered)?;
    ticks(robot, wait).map_err(|problem| EndError::RealTime(format!("its clock failed, {problem}")))
}

type Started = (Robot, Wait, Claim);

fn start(
    config: &Config,
    link: Arc<Link>,
    stop: OwnedFd,
    entered: &Sender<Space>,
) -> Result<Started, StartError> {
    let space = config.open_space(&format!("colocd {}", config.robot.name))?;
    (space.remarks().iter()).for_each(|remark| warn!("{remark}"));
    let claim = space.claim_robot(&config.robot.name, config.robot.id)?;
    let robot = Robot::open(config, &space, Box::new(KernelTime), link)?;
    report_beginning(&robot);
    let refused = realtime::set_up(&config.realtime);
    match refused.first() {
        Some(first) if config.realtime.required => {
            return Err(StartError::Realtime(first.to_string()));
        }
        _ => refused.iter().for_each(|refused| warn!("{refused}")),
    }
    robot.hasten(&config.realtime);
    report_running(config);
    let wait = Wait::new(
        config.tick.trigger,
        config.period_ns(),
        KernelTime.now_ns(),
        stop,
    )?
    .polling(config.tick.wait);
    for bus in robot.collect().buses() {
        wait.watch(bus)?;
    }
    // Telemetry may have ended already, with the process.
    let _ = entered.send(space);
    Ok((robot, wait, claim))
}

fn report_beginning(robot: &Robot) {
    match robot.resumed() {
        Some(Ok(age_s)) => info!(age_s, "going on from the saved belief"),
        Some(Err(Unusable::Missing)) => info!("starting from [initial]: no belief was saved yet"),
        Some(Err(problem)) => {
            warn!("starting from [initial], not from the saved belief: {problem}");
        }
        None => {}
    }
}

fn report_running(config: &Config) {
    let trigger = match config.tick.trigger {
        Trigger::Auto => "auto",
        Trigger::Timer => "timer",
        Trigger::Encoder => "encoder",
    };
    info!(robot = %config.robot.name, id = config.robot.id, rate_hz = config.tick.rate_hz, trigger, "running");
}

/// From here on this thread neither allocates nor locks nor logs.
fn ticks(mut robot: Robot, mut wait: Wait) -> Result<(), rustix::io::Errno> {
    while turn(&mut robot, &mut wait)?.is_some() {}
    robot.leave();
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
    match outcome {
        Outcome::Ticked => {
            let tick_ns = robot.last_tick().as_nanos();
            wait.ticked(wake, tick_ns, robot.collect().arrivals())?;
        }
        Outcome::Incomplete if wait.sleeps() => robot.prepare(),
        Outcome::Incomplete => {}
    }
    Ok(Some(outcome))
}

/// The telemetry thread.
struct Telemetering {
    thread: Watched<Result<(), Lost>>,
    stop: Sender<()>,
}

impl Telemetering {
    fn start(
        config: &Config,
        link: &Arc<Link>,
        spaces: Receiver<Space>,
        calls: &Calls,
    ) -> Result<Self, StartError> {
        let (stop, stopped) = channel();
        let writers = Writers::start(config).map_err(StartError::Thread)?;
        let (config, link) = (config.clone(), Arc::clone(link));
        let body = move || {
            Telemetry::new(&config, link, spaces)
                .writing(writers)
                .run(&stopped)
        };
        let builder = Builder::new().name("colocd-log".into());
        let thread = Watched::start(builder, body, calls.closer()).map_err(StartError::Thread)?;
        Ok(Self { thread, stop })
    }

    fn join_until(self, deadline: Instant) -> Result<(), EndError> {
        drop(self.stop);
        match self.thread.join_until(deadline) {
            Ending::Returned(result) => Ok(result?),
            // The estimates have ended in good order: how this thread does is no reason to fail.
            Ending::Panicked | Ending::Stuck => {
                warn!("the telemetry thread does not come back: the last status may be missing");
                Ok(())
            }
        }
    }
}

fn system(what: &'static str) -> impl Fn(std::io::Error) -> StartError {
    move |error| StartError::System { what, error }
}
