//! From a publication to a program that sleeps until it comes, beside a Unix datagram of the same size: the least that two
//! processes can do.
//!
//! ```text
//! wake_up [SECONDS]    each by turns at 50 Hz, in real time where that is granted; prints microseconds and ratios
//! ```
//!
//! All are measured by turns, so that whatever else the machine does meets each. Between them everybody sleeps: caches are as cold as on
//! a robot. `rehearsed`: the publisher did everything but the message just before, as one may who waits for a last input.

#![warn(clippy::print_stdout, clippy::print_stderr)]

use std::error::Error;
use std::fs::read_to_string;
use std::io::{BufRead, BufReader};
use std::os::unix::net::UnixDatagram;
use std::path::Path;
use std::process::{Child, Command, ExitCode, Stdio};
use std::time::Instant;

use coloc_daemon::config::{Realtime, Scheduler};
use coloc_daemon::realtime;
use coloc_shm_types::{Estimate, Group, Header, Reader as GroupReader, RobotName, Space};
use coloc_tests::output::{end, print_line};
use coloc_tests::scene::own_group;
use rustix::thread::clock_nanosleep_absolute;
use rustix::time::{ClockId, Timespec, clock_gettime};

const PREFIX: &str = "wakeup";
const ROBOT: &str = "robot1";
/// Open to a group, and nobody else listens to it.
const OPEN: &str = "robot2";
const READY: &str = "ready";
const SECOND_NS: i64 = 1_000_000_000;
/// Each.
const PERIOD_NS: i64 = SECOND_NS / 50;
/// At the start, when everything is touched for the first time.
const WARM_UP: usize = 25;
/// Who hears nothing for so long ends.
const PATIENCE: std::time::Duration = std::time::Duration::from_secs(2);

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let result = match words.as_slice() {
        ["--read-datagrams", directory] => read_datagrams(Path::new(directory)),
        ["--read-estimates", directory] => read_estimates(Path::new(directory)),
        ["--read-page", directory] => read_page(Path::new(directory)),
        [] => measure(60),
        [seconds] => seconds.parse().map_or_else(|_| Err(USAGE.into()), measure),
        _ => Err(USAGE.into()),
    };
    end("wake_up", result.map(|()| ExitCode::SUCCESS))
}

const USAGE: &str = "usage: wake_up [SECONDS]";

/// Whose, and how long \[ns\].
type Duration = (u16, i64);
/// As sources of estimates.
const COLD: u16 = 0;
const REHEARSED: u16 = 1;
const PAGE: u16 = 2;
const EXPECTED: u16 = 3;
/// As between the frames of two wheels.
const AHEAD_NS: i64 = 250_000;

type Done = Result<(), Box<dyn Error>>;

fn measure(seconds: usize) -> Done {
    let directory = tempfile::tempdir()?;
    let mut readers = [
        Reader::start("--read-datagrams", directory.path())?,
        Reader::start("--read-estimates", directory.path())?,
        Reader::start("--read-page", directory.path())?,
    ];
    publish(directory.path(), WARM_UP + 50 * seconds)?;
    let [datagrams, estimates, page] = readers.each_mut().map(Reader::finish);
    let (datagrams, estimates, page) = (datagrams?, estimates?, page?);
    let floor = sorted(&datagrams, 0)?;
    print_line(&row("Unix datagram", &floor, &floor));
    for (name, source) in [("estimate", COLD), ("estimate, rehearsed", REHEARSED)] {
        print_line(&row(name, &sorted(&estimates, source)?, &floor));
    }
    for (name, source) in [("page of a group", PAGE), ("the same, expected", EXPECTED)] {
        print_line(&row(name, &sorted(&page, source)?, &floor));
    }
    let load = read_to_string("/proc/loadavg").unwrap_or_default();
    print_line(&format!("load {}", load.trim()));
    Ok(())
}

/// As the daemon's thread does: asleep, then a message at once.
fn publish(directory: &Path, count: usize) -> Done {
    let space = Space::open(&directory.join("shm"), PREFIX, "publisher")?;
    let estimates = space.publisher::<Estimate>(&RobotName::new(ROBOT)?)?;
    let (name, group) = (RobotName::new(OPEN)?, Group::find(&own_group())?);
    let open = space.publisher::<Estimate>(&name)?;
    let page = open.open_to(&group, &name, 2)?;
    let socket = UnixDatagram::unbound()?;
    socket.connect(directory.join("datagrams"))?;
    estimates.refresh()?;
    settle(1);
    if let Err(refused) = page.hasten(Realtime::default().priority - 1) {
        coloc_tests::output::complain(&format!("wake_up: behind the publisher: {refused}"));
    }
    let mut due_ns = now_ns() + PERIOD_NS;
    for _ in 0..count {
        sleep_until(due_ns);
        socket.send(&bytes(now_ns()))?;
        for (turn, source) in (1..).zip([COLD, REHEARSED]) {
            sleep_until(due_ns + turn * PERIOD_NS / 5);
            if source == REHEARSED {
                estimates.rehearse();
            }
            estimates.send(estimate(source))?;
        }
        for (turn, source) in (3..).zip([PAGE, EXPECTED]) {
            let at_ns = due_ns + turn * PERIOD_NS / 5;
            if source == EXPECTED {
                sleep_until(at_ns - AHEAD_NS);
                page.expect();
            }
            sleep_until(at_ns);
            open.rehearse();
            let last = estimate(source);
            page.write(&last);
            open.send(last)?;
            page.settle();
        }
        due_ns += PERIOD_NS;
    }
    // Who leaves takes what was not received along.
    sleep_until(due_ns);
    Ok(())
}

fn estimate(source: u16) -> Estimate {
    let header = Header {
        stamp_ns: now_ns(),
        source,
        ..Header::default()
    };
    Estimate {
        header,
        ..Estimate::default()
    }
}

/// An estimate's, as far as it matters how many.
fn bytes(stamp_ns: i64) -> [u8; size_of::<Estimate>()] {
    let mut bytes = [0; size_of::<Estimate>()];
    bytes[..8].copy_from_slice(&stamp_ns.to_ne_bytes());
    bytes
}

fn read_datagrams(directory: &Path) -> Done {
    let socket = UnixDatagram::bind(directory.join("datagrams"))?;
    socket.set_read_timeout(Some(PATIENCE))?;
    print_line(READY);
    settle(0);
    let (mut buffer, mut durations) = (bytes(0), Vec::with_capacity(1 << 20));
    while socket.recv(&mut buffer).is_ok() {
        let now = now_ns();
        let (stamp, _) = buffer.split_first_chunk().ok_or("too short")?;
        durations.push((0, now - i64::from_ne_bytes(*stamp)));
    }
    print(&durations);
    Ok(())
}

fn read_estimates(directory: &Path) -> Done {
    let space = Space::open(&directory.join("shm"), PREFIX, "reader")?;
    let estimates = space.subscriber::<Estimate>(&RobotName::new(ROBOT)?)?;
    estimates.bell()?;
    print_line(READY);
    settle(0);
    let mut durations = Vec::with_capacity(1 << 20);
    // The first one may take as long as the publisher takes to start.
    while let Some(estimate) = estimates.wait(PATIENCE)? {
        let duration = now_ns() - estimate.header.stamp_ns;
        durations.push((estimate.header.source, duration));
    }
    print(&durations);
    Ok(())
}

/// As another user would.
fn read_page(directory: &Path) -> Done {
    print_line(READY);
    settle(0);
    let robot = RobotName::new(OPEN)?;
    let start = Instant::now();
    let page = loop {
        match GroupReader::open(&directory.join("shm"), &robot) {
            Ok(page) => break page,
            Err(error) if start.elapsed() > PATIENCE => return Err(error.into()),
            Err(_) => std::thread::sleep(std::time::Duration::from_millis(1)),
        }
    };
    let mut durations = Vec::with_capacity(1 << 20);
    // In the end the publisher is gone.
    while let Ok(Some(estimate)) = page.wait(PATIENCE) {
        durations.push((estimate.header.source, now_ns() - estimate.header.stamp_ns));
    }
    print(&durations);
    Ok(())
}

fn print(durations: &[Duration]) {
    for (source, ns) in durations {
        print_line(&format!("{source} {ns}"));
    }
}

/// A process that reads.
struct Reader {
    child: Child,
    lines: std::io::Lines<BufReader<std::process::ChildStdout>>,
}

impl Reader {
    fn start(part: &str, directory: &Path) -> Result<Self, Box<dyn Error>> {
        let mut child = Command::new(std::env::current_exe()?)
            .arg(part)
            .arg(directory)
            .stdout(Stdio::piped())
            .spawn()?;
        let output = child.stdout.take().ok_or("no output")?;
        let mut lines = BufReader::new(output).lines();
        match lines.next() {
            Some(Ok(line)) if line == READY => Ok(Self { child, lines }),
            _ => Err(format!("{part} did not start").into()),
        }
    }

    /// What it saw.
    fn finish(&mut self) -> Result<Vec<Duration>, Box<dyn Error>> {
        let mut durations = Vec::new();
        for line in self.lines.by_ref() {
            let line = line?;
            let (source, ns) = line.split_once(' ').ok_or("not a duration")?;
            durations.push((source.parse()?, ns.parse()?));
        }
        Ok(durations)
    }
}

/// Those of `source`, after the warm-up, by length \[ns\].
fn sorted(durations: &[Duration], source: u16) -> Result<Vec<i64>, Box<dyn Error>> {
    let own = durations.iter().filter(|(of, _)| *of == source);
    let mut own: Vec<i64> = own.skip(WARM_UP).map(|(_, ns)| *ns).collect();
    if own.is_empty() {
        return Err("nothing was received".into());
    }
    own.sort_unstable();
    Ok(own)
}

impl Drop for Reader {
    fn drop(&mut self) {
        // Both fail only if it has ended.
        let _ = (self.child.kill(), self.child.wait());
    }
}

/// The publisher's processor is not the readers', where there are two.
fn settle(cpu: usize) {
    let wanted = Realtime {
        scheduler: Scheduler::Fifo,
        cpus: vec![cpu],
        ..Realtime::default()
    };
    for refused in realtime::set_up(&wanted) {
        coloc_tests::output::complain(&format!("wake_up: {refused}"));
    }
}

fn row(name: &str, sorted: &[i64], floor: &[i64]) -> String {
    let percents = [50, 90, 99];
    let [p50, p90, p99] = percents.map(|percent| at(sorted, percent));
    let [r50, r90, r99] = percents.map(|percent| at(sorted, percent) / at(floor, percent));
    let count = sorted.len();
    format!(
        "{name:<22} p50 {p50:>6.1} µs, p90 {p90:>6.1}, p99 {p99:>6.1} ({count}); \
         ratio p50 {r50:.2}, p90 {r90:.2}, p99 {r99:.2}"
    )
}

/// That percentile \[µs\].
#[allow(clippy::cast_precision_loss)] // A second in nanoseconds is far below 2^53.
fn at(sorted: &[i64], percent: usize) -> f64 {
    let place = (sorted.len() * percent / 100).min(sorted.len().saturating_sub(1));
    sorted.get(place).map_or(f64::NAN, |ns| *ns as f64 / 1e3)
}

fn now_ns() -> i64 {
    let now = clock_gettime(ClockId::Boottime);
    now.tv_sec * SECOND_NS + now.tv_nsec
}

fn sleep_until(at_ns: i64) {
    let until = Timespec {
        tv_sec: at_ns / SECOND_NS,
        tv_nsec: at_ns % SECOND_NS,
    };
    while clock_nanosleep_absolute(ClockId::Boottime, &until) == Err(rustix::io::Errno::INTR) {}
}
