//! One way of waiting, measured: floors, then the daemon; in turns, so that what else the machine does meets both.

use std::fs::File;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use coloc_drivers::can::BusSpec;
use coloc_shm_types::{Estimate, RobotName, Space};
use rustix::process::{Pid, Signal, kill_process};
use serde::Serialize;

use super::args::{LatencyArgs, TriggerArg, WaitArg};
use super::busy::{Busy, Snapshot};
use super::error::LatencyError;
use super::facts::scheduling_class;
use super::floors::Floors;
use super::interrupted;
use super::matching::{Account, Matched, Seen, Sent, matched};
use super::percentiles::{Durations, Percentiles};
use super::place::PREFIX;
use super::placement::Placement;
use super::plain::Plain;
use super::reader::Reader;
use super::robot_file::{ROBOT, Wanted, write};
use super::sender::{Schedule, Sender};
use crate::daemon::PARENT_VARIABLE;
use crate::demo::bus::Buses;
use crate::demo::clock::now_ns;
use crate::home::Home;
use crate::pictures::PercentileCurve;

/// How long a daemon may take to come up, or to end.
const PATIENCE: Duration = Duration::from_secs(10);
/// From the opening of everything to the first frame.
const AHEAD_NS: i64 = 300_000_000;
/// Frames at the start that are not measured: everything is touched for the first time, and what starts the ticks is not decided yet.
const WARM_UP_NS: i64 = 1_000_000_000;
/// How long the last frame may take.
const GRACE_NS: i64 = 500_000_000;
/// How long each floor is measured, as a part of the run.
const FLOOR_PART: f64 = 0.5;
/// Turns, and how long one is at least.
const MOST_TURNS: u32 = 5;
const TURN_S: f64 = 3.0;

/// What is the same for every way of waiting.
pub(crate) struct Setting {
    directory: PathBuf,
    root: PathBuf,
    /// One, or one for each wheel.
    buses: Vec<BusSpec>,
    placement: Placement,
    seconds: f64,
    rate_hz: f64,
    gap_ns: i64,
    clock_ppm: i32,
    trigger: TriggerArg,
    neighbours: u16,
    reader: Option<WaitArg>,
    /// The plain program, if it is to be measured too.
    plain: Option<Plain>,
    /// Whose daemon.
    program: PathBuf,
}

impl Setting {
    pub(crate) fn new(
        args: &LatencyArgs,
        home: &Home,
        buses: &Buses,
    ) -> Result<Self, LatencyError> {
        let plain = args.plain.then(|| Plain::compile(home.path()));
        let own = std::env::current_exe();
        let own = own.map_err(|error| LatencyError::Spawn(format!("colocd: {error}")))?;
        Ok(Self {
            directory: home.path().to_owned(),
            root: home.shm_root(),
            buses: buses.specs.clone(),
            placement: Placement::choose(),
            seconds: args.seconds,
            rate_hz: args.rate,
            gap_ns: gap_ns(args),
            clock_ppm: args.clock_ppm,
            trigger: args.trigger,
            neighbours: args.neighbours,
            reader: args.reader,
            plain: plain.transpose()?,
            program: args.colocd.clone().unwrap_or(own),
        })
    }

    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // A day at most.
    fn turns(&self) -> u32 {
        ((self.seconds / TURN_S) as u32).clamp(1, MOST_TURNS)
    }

    /// The daemon's frames in a turn, after the warm-up's.
    fn schedule(&self) -> Schedule {
        self.schedule_of(self.seconds / f64::from(self.turns()), WARM_UP_NS)
    }

    fn floor_schedule(&self) -> Schedule {
        self.schedule_of(FLOOR_PART * self.seconds / f64::from(self.turns()), 0)
    }

    #[allow(clippy::cast_possible_truncation)] // Whole nanoseconds and deadlines of a day at most.
    fn schedule_of(&self, seconds: f64, before_ns: i64) -> Schedule {
        let nominal_ns = 1e9 / self.rate_hz;
        let count = (seconds * self.rate_hz).ceil() as i64;
        Schedule {
            start_ns: now_ns() + AHEAD_NS,
            period_ns: (nominal_ns * (1.0 + 1e-6 * f64::from(self.clock_ppm))) as i64,
            count: count + before_ns / nominal_ns as i64,
            gap_ns: self.gap_ns,
        }
    }
}

/// Half a period at most, so that a pair stays one.
#[allow(clippy::cast_possible_truncation)] // A second at most.
fn gap_ns(args: &LatencyArgs) -> i64 {
    i64::min(1000 * i64::from(args.gap_us), (0.5e9 / args.rate) as i64)
}

/// What was measured.
pub(crate) struct Pass {
    pub(crate) mode: WaitArg,
    trigger: TriggerArg,
    /// Scheduling class that the daemon's tick obtained.
    pub(crate) class: String,
    pub(crate) floors: Floors,
    pub(crate) frames: Durations,
    pub(crate) account: Account,
    pub(crate) from_kernel: Durations,
    /// From the kernel's stamp until the estimate was ready to be sent.
    pub(crate) ready: Durations,
    pub(crate) stages: Vec<(&'static str, Durations)>,
    /// The longest publication around the moments when a subscriber joined, one in each turn, if one was seen \[ns\].
    pub(crate) join_ns: Option<u64>,
    /// Where the time of the slowest frame went.
    pub(crate) worst: Option<Worst>,
    /// The same way with the plain program in the daemon's place, if it was asked for.
    pub(crate) plain: Option<Durations>,
    /// Who else had the processors.
    pub(crate) busy: Busy,
}

/// A frame, from the kernel to the reader \[ns\].
#[derive(Clone, Copy, Debug, Serialize)]
#[allow(clippy::struct_field_names)] // The unit belongs to the name.
pub(crate) struct Worst {
    pub(crate) from_kernel_ns: i64,
    pub(crate) wake_up_ns: i64,
    pub(crate) collect_ns: u32,
    pub(crate) estimate_ns: u32,
    pub(crate) publish_ns: u32,
    pub(crate) transfer_ns: i64,
}

impl Worst {
    /// The worst of `ticks`.
    fn of(ticks: &[Seen]) -> Option<Self> {
        let took = |tick: &&Seen| tick.received_ns - tick.frame_stamp_ns;
        let worst = ticks.iter().max_by_key(took)?;
        Some(Self {
            from_kernel_ns: took(&worst),
            wake_up_ns: woken_ns(worst) - worst.frame_stamp_ns,
            collect_ns: worst.collect_ns,
            estimate_ns: worst.estimate_ns,
            publish_ns: worst.publish_ns,
            transfer_ns: worst.received_ns - published_ns(worst),
        })
    }
}

impl Pass {
    /// Counts another turn.
    fn add(&mut self, more: &Self) {
        self.floors.add(&more.floors);
        self.frames.add(&more.frames);
        self.account.add(&more.account);
        self.from_kernel.add(&more.from_kernel);
        self.ready.add(&more.ready);
        for ((_, all), (_, durations)) in self.stages.iter_mut().zip(&more.stages) {
            all.add(durations);
        }
        self.join_ns = self.join_ns.max(more.join_ns);
        let worsts = [self.worst, more.worst].into_iter().flatten();
        self.worst = worsts.max_by_key(|worst| worst.from_kernel_ns);
        if let (Some(all), Some(plain)) = (&mut self.plain, &more.plain) {
            all.add(plain);
        }
        self.busy.add(&more.busy);
    }
}

impl Pass {
    /// From the kernel to the reader, as a multiple of the floors' sum at the same percentile. With deadlines a frame waits for
    /// the next one, which is no question of speed. Nothing where one of them is not known.
    #[allow(clippy::cast_precision_loss)] // A minute in nanoseconds is far below 2^53.
    pub(crate) fn ratio(&self, percentile: fn(&Percentiles) -> Option<u64>) -> Option<f64> {
        let at = |durations: &Durations| Some(percentile(&durations.percentiles())? as f64);
        let Floors {
            frame,
            transport,
            clock,
            ..
        } = &self.floors;
        let sum = at(frame)? + at(transport)? + at(clock)?;
        (self.is_comparable() && sum > 0.0).then_some(at(&self.from_kernel)? / sum)
    }

    /// From the kernel to the reader, as a multiple of what the plain program takes at the same percentile.
    #[allow(clippy::cast_precision_loss)] // A minute in nanoseconds is far below 2^53.
    pub(crate) fn ratio_to_plain(
        &self,
        percentile: fn(&Percentiles) -> Option<u64>,
    ) -> Option<f64> {
        let at = |durations: &Durations| Some(percentile(&durations.percentiles())? as f64);
        let plain = at(self.plain.as_ref()?)?;
        (self.is_comparable() && plain > 0.0).then_some(at(&self.from_kernel)? / plain)
    }

    /// Whether frames start ticks, and do not wait for the next one.
    pub(crate) fn is_comparable(&self) -> bool {
        self.trigger != TriggerArg::Timer
    }

    /// What is wrong with these figures; nothing if they are worth comparing.
    pub(crate) fn objections(&self) -> Vec<&'static str> {
        let mut objections = self.busy.objections();
        if self.mode == WaitArg::Sleep && !self.class.starts_with("SCHED_FIFO") {
            objections.push("the daemon did not run in real time");
        }
        if 100 * (self.account.never_estimated + self.account.with_newer) > self.account.sent {
            objections.push("more than one frame in a hundred came to no estimate of its own");
        }
        objections
    }

    /// Names and curves for the picture.
    pub(crate) fn curves(&self) -> Vec<PercentileCurve> {
        let curve = |name: &str, durations: &Durations| PercentileCurve {
            name: format!("{name}, {}", self.mode.describe()),
            points: durations.curve(),
        };
        let mut curves = vec![
            curve("frame to estimate", &self.frames),
            curve("floor: frame read", &self.floors.frame),
            curve("floor: transport", &self.floors.transport),
        ];
        curves.extend(self.plain.iter().map(|it| curve("plain program in C", it)));
        curves
    }
}

/// Measures one way of waiting.
pub(crate) fn run(setting: &Setting, mode: WaitArg) -> Result<Pass, LatencyError> {
    let mut all = turn(setting, mode)?;
    for _ in 1..setting.turns() {
        all.add(&turn(setting, mode)?);
    }
    Ok(all)
}

fn turn(setting: &Setting, mode: WaitArg) -> Result<Pass, LatencyError> {
    let Setting {
        buses,
        root,
        directory,
        placement,
        ..
    } = setting;
    interrupted::check()?;
    let wait = setting.reader.unwrap_or(mode);
    let floors = Floors::measure(buses, [directory, root], [mode, wait], placement, || {
        setting.floor_schedule()
    })?;
    let plain = setting.plain.as_ref().filter(|_| mode == WaitArg::Sleep);
    let plain = plain
        .map(|plain| plain.measure(buses, directory, placement, setting.floor_schedule()))
        .transpose()?;
    let daemon = Daemon::start(setting, mode)?;
    let class = scheduling_class(daemon.child.id(), "colocd-tick");
    let schedule = setting.schedule();
    let until_ns = schedule.end_ns() + GRACE_NS;
    let expect = 2 * usize::try_from(schedule.count).unwrap_or(0);
    let reader = Reader::start(root, ROBOT, until_ns, expect, wait, placement)?;
    let own = [daemon.child.id(), reader.process()];
    let before = Snapshot::take();
    let sender = Sender::of_everything(buses, root, setting.neighbours, schedule, placement)?;
    // Who sends is told the same, and is waited for in any case.
    let _ = interrupted::sleep_until(schedule.due_ns(schedule.count * 4 / 5));
    let joined_ns = now_ns();
    let late_joiner = daemon.listen()?;
    let sent = sender.finish()?;
    // While all of them live.
    let busy = before.until(&Snapshot::take(), &own);
    let seen = reader.finish()?;
    drop((late_joiner, daemon));

    let from_ns = schedule.start_ns + WARM_UP_NS;
    let Matched {
        from_due_ns,
        from_kernel_ns,
        account,
    } = matched(&sent, &seen, from_ns);
    let measured = sent.iter().filter(|sent| sent.due_ns >= from_ns);
    let ticks = ticks_with_frames(&seen, from_ns);
    Ok(Pass {
        mode,
        trigger: setting.trigger,
        class,
        floors,
        frames: Durations::of(from_due_ns),
        account,
        from_kernel: Durations::of(from_kernel_ns),
        ready: Durations::of(
            ticks
                .iter()
                .map(|tick| published_ns(tick) - tick.frame_stamp_ns),
        ),
        worst: Worst::of(&ticks),
        plain,
        stages: stages(measured, &ticks, setting.trigger),
        join_ns: cost_of_joining(&seen, joined_ns),
        busy,
    })
}

/// Ticks that brought a new frame.
fn ticks_with_frames(seen: &[Seen], from_ns: i64) -> Vec<Seen> {
    let pairs = seen.iter().zip(seen.iter().skip(1));
    pairs
        .filter(|(before, tick)| {
            tick.frame_stamp_ns > before.frame_stamp_ns && tick.frame_stamp_ns >= from_ns
        })
        .map(|(_, tick)| *tick)
        .collect()
}

fn stages<'a>(
    sent: impl Iterator<Item = &'a Sent>,
    ticks: &[Seen],
    trigger: TriggerArg,
) -> Vec<(&'static str, Durations)> {
    let of = |stage: fn(&Seen) -> i64| Durations::of(ticks.iter().map(stage));
    let wake_up = match trigger {
        TriggerArg::Auto | TriggerArg::Encoder => {
            ("wake-up", of(|tick| woken_ns(tick) - tick.frame_stamp_ns))
        }
        TriggerArg::Timer => (
            "wake-up",
            of(|tick| i64::try_from(tick.lateness_ns).unwrap_or(i64::MAX)),
        ),
    };
    let sender = sent.map(|sent| sent.sent_ns - sent.due_ns);
    vec![
        ("sender", Durations::of(sender)),
        wake_up,
        ("collect", of(|tick| tick.collect_ns.into())),
        ("estimate", of(|tick| tick.estimate_ns.into())),
        ("publish", of(|tick| tick.publish_ns.into())),
        ("account", of(|tick| tick.account_ns.into())),
        ("transfer", of(|tick| tick.received_ns - published_ns(tick))),
    ]
}

/// When the estimate was complete, and its publication began.
fn published_ns(tick: &Seen) -> i64 {
    let since_tick_ns = i64::try_from(tick.since_tick_ns).unwrap_or(i64::MAX);
    tick.stamp_ns.saturating_add(since_tick_ns)
}

/// When the daemon's wait ended. The stamp is a little later: frames are drained first.
fn woken_ns(tick: &Seen) -> i64 {
    published_ns(tick) - i64::from(tick.collect_ns) - i64::from(tick.estimate_ns)
}

/// Of the publications within 100 ms after the join.
fn cost_of_joining(seen: &[Seen], joined_ns: i64) -> Option<u64> {
    let around = seen
        .iter()
        .filter(|tick| (joined_ns..joined_ns + 100_000_000).contains(&tick.stamp_ns));
    around.map(|tick| tick.publish_ns.into()).max()
}

/// A real daemon.
struct Daemon {
    child: Child,
    root: PathBuf,
}

impl Daemon {
    /// Starts it, and waits until it speaks.
    fn start(setting: &Setting, mode: WaitArg) -> Result<Self, LatencyError> {
        let spawn = |error: std::io::Error| LatencyError::Spawn(format!("colocd: {error}"));
        let file = write(&Wanted {
            directory: &setting.directory,
            root: &setting.root,
            buses: &setting.buses,
            placement: &setting.placement,
            rate_hz: setting.rate_hz,
            trigger: setting.trigger,
            neighbours: setting.neighbours,
            wait: mode,
        })?;
        let log = file.with_extension("log");
        let output = File::create(&log).map_err(spawn)?;
        let child = Command::new(&setting.program)
            .arg0("colocd")
            .arg("run")
            .arg(&file)
            .env(PARENT_VARIABLE, std::process::id().to_string())
            .process_group(0)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(output)
            .spawn()
            .map_err(spawn)?;
        let mut daemon = Self {
            child,
            root: setting.root.clone(),
        };
        daemon.wait_until_up(&log)?;
        Ok(daemon)
    }

    fn wait_until_up(&mut self, log: &Path) -> Result<(), LatencyError> {
        let (_space, estimates) = self.listen()?;
        let deadline = Instant::now() + PATIENCE;
        while estimates.receive().map_err(LatencyError::shm)?.is_none() {
            let gone = self.child.try_wait().is_ok_and(|status| status.is_some());
            if gone || Instant::now() > deadline {
                let text = std::fs::read_to_string(log).unwrap_or_default();
                return Err(LatencyError::NotUp(text.trim().to_owned()));
            }
            interrupted::check()?;
            std::thread::sleep(Duration::from_millis(5));
        }
        Ok(())
    }

    /// Joins those who hear its estimates.
    fn listen(&self) -> Result<(Space, coloc_shm_types::Subscriber<Estimate>), LatencyError> {
        let space = Space::open(&self.root, PREFIX, "coloc-latency").map_err(LatencyError::shm)?;
        let robot = RobotName::new(ROBOT).map_err(LatencyError::shm)?;
        let estimates = space.subscriber(&robot).map_err(LatencyError::shm)?;
        Ok((space, estimates))
    }
}

impl Drop for Daemon {
    fn drop(&mut self) {
        let pid = i32::try_from(self.child.id()).ok().and_then(Pid::from_raw);
        // It fails only if the process is gone, which is what is wanted.
        let _ = pid.map(|pid| kill_process(pid, Signal::TERM));
        let deadline = Instant::now() + PATIENCE;
        while self.child.try_wait().is_ok_and(|status| status.is_none()) {
            if Instant::now() > deadline {
                let _ = self.child.kill();
            }
            std::thread::sleep(Duration::from_millis(10));
        }
    }
}
