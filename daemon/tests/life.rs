//! Whatever becomes of the outputs, the clock or the start-up: colocd goes on, or ends with a status and a sentence.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

mod support;

use std::fs::File;
use std::io::{BufRead, BufReader, PipeReader, PipeWriter, Read};
use std::os::fd::AsFd;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use coloc_daemon::record::Recording;
use coloc_shm_types::Status;
use rustix::fs::OFlags;
use rustix::io::Errno;
use rustix::process::Signal;
use support::{Daemon, Site, wait_for};

/// Health changes, rejects and the like are lines; this makes a few of them.
fn provoke_lines(site: &Site) {
    let mut drive = site.drive();
    (0..3).for_each(|_| {
        drive.straight(3, 0.5);
        std::thread::sleep(std::time::Duration::from_millis(150)); // Stale: `odometry_stale_s` is 0.1.
    });
}

/// It ticks, publishes its status and ends as it should.
fn assert_lives(site: &Site, daemon: &mut Daemon) {
    let listener = site.listen();
    let first = listener.until("an estimate", |_| true);
    provoke_lines(site);
    listener.until("more estimates", |estimate| estimate.tick > first.tick + 20);
    site.status_until("a status", |status| status.tick > first.tick);
    drop(listener);
    daemon.terminate();
    site.assert_nothing_left();
}

fn open_to_write(path: &str) -> File {
    File::options().write(true).open(path).unwrap()
}

#[test]
fn a_log_that_nobody_reads_any_more_is_no_reason_to_end() {
    let site = Site::new("robot1", "");
    let mut child = site.run_command();
    let mut daemon = Daemon::spawn(child.stderr(Stdio::piped()));
    drop(daemon.standard_error());
    assert_lives(&site, &mut daemon);
}

#[test]
fn a_full_disk_under_the_log_is_no_reason_to_end() {
    let site = Site::new("robot1", "");
    let full = open_to_write("/dev/full");
    let mut daemon = Daemon::spawn(site.run_command().stderr(full));
    assert_lives(&site, &mut daemon);
}

/// A recording of some seconds is longer than that, and whatever is made at the start is shorter.
#[test]
fn a_limit_on_the_size_of_files_is_like_a_full_disk() {
    let section =
        "[tick]\nrate_hz = 500\n[telemetry]\nrecord = \"{at}/record\"\nlog_file = \"{at}/log\"\n";
    let site = Site::new("robot1", section);
    let script = "ulimit -f 1024 && exec \"$@\"";
    let mut daemon = Daemon::spawn(&mut shell(script, &site.run_command()));
    wait_for_line(&site.path("log"), "has a gap from here on: File too large");
    assert_lives(&site, &mut daemon);
}

#[test]
fn outputs_that_were_closed_at_the_start_are_no_reason_to_end() {
    let site = Site::new("robot1", "");
    let mut daemon = Daemon::spawn(&mut shell("exec \"$@\" >&- 2>&-", &site.run_command()));
    assert_lives(&site, &mut daemon);
}

/// A pipe without room, and the end at which nobody reads.
fn full_pipe() -> (PipeReader, PipeWriter) {
    let (reader, writer) = std::io::pipe().unwrap();
    set_waiting(&writer, false);
    while rustix::io::write(&writer, &[b'.'; 512]) != Err(Errno::AGAIN) {}
    set_waiting(&writer, true);
    (reader, writer)
}

fn set_waiting(pipe: impl AsFd, waits: bool) {
    let flags = rustix::fs::fcntl_getfl(&pipe).unwrap() - OFlags::NONBLOCK;
    let wanted = if waits {
        OFlags::empty()
    } else {
        OFlags::NONBLOCK
    };
    rustix::fs::fcntl_setfl(&pipe, flags | wanted).unwrap();
}

#[test]
fn a_stalled_log_holds_nobody_up() {
    let site = Site::new("robot1", "");
    let (_reader, writer) = full_pipe();
    let mut daemon = Daemon::spawn(site.run_command().stderr(writer));
    assert_lives(&site, &mut daemon);
}

#[test]
fn lines_that_were_lost_are_said_as_soon_as_there_is_room() {
    let site = Site::new("robot1", "");
    let (mut reader, writer) = full_pipe();
    set_waiting(&writer, false); // Refused at once, rather than kept for later.
    let mut daemon = Daemon::spawn(site.run_command().stderr(writer));
    site.listen().until("an estimate", |_| true);
    reader.read_exact(&mut vec![0; 1 << 15]).unwrap();
    daemon.terminate();
    let said = std::io::read_to_string(reader).unwrap();
    assert!(said.contains("lines were lost lines="), "{said}");
}

#[test]
fn a_start_that_fails_before_a_stalled_log_still_ends() {
    let site = Site::new("robot1", "[tick]\nrate_hz = 0\n");
    let (_reader, writer) = full_pipe();
    let mut daemon = Daemon::spawn(site.run_command().stderr(writer));
    assert_eq!(daemon.wait(), Some(2));
}

fn with_log_file(lines: &str) -> (Site, PathBuf) {
    let section = format!("{lines}[telemetry]\nlog_file = \"{{at}}/log\"\n");
    let site = Site::new("robot1", &section);
    let log = site.path("log");
    (site, log)
}

fn wait_for_line(path: &Path, line: &str) {
    wait_for(line, || {
        let text = std::fs::read_to_string(path).unwrap_or_default();
        if text.contains(line) {
            Ok(())
        } else {
            Err(text)
        }
    });
}

#[test]
fn frames_that_the_kernel_will_not_keep_are_said_once_with_the_remedy() {
    let queue = std::fs::read_to_string("/proc/sys/net/unix/max_dgram_qlen").unwrap();
    if queue.trim().parse::<u32>().unwrap() >= 6000 {
        println!("SKIPPED: a queue that is too short: here it is long enough");
        return;
    }
    let (site, log) = with_log_file("");
    let mut daemon = site.start();
    wait_for_line(&log, "running");
    daemon.terminate();
    let text = std::fs::read_to_string(&log).unwrap();
    let remedies = text.matches("sysctl -w net.unix.max_dgram_qlen=6000");
    assert_eq!(remedies.count(), 1, "{text}");
}

#[test]
fn a_log_that_was_rotated_away_is_opened_again_on_sighup() {
    let (site, log) = with_log_file("");
    let mut daemon = site.start();
    wait_for_line(&log, "running");
    let rotated = site.path("log.1");
    std::fs::rename(&log, &rotated).unwrap();
    daemon.signal(Signal::HUP);
    wait_for_line(&log, "the log was opened again");
    assert_lives(&site, &mut daemon);
    wait_for_line(&log, "ending");
    assert!(
        !std::fs::read_to_string(&rotated)
            .unwrap()
            .contains("ending")
    );
}

#[test]
fn a_log_whose_directory_comes_late_is_opened_then_and_says_so() {
    let section = "[telemetry]\nlog_file = \"{at}/late/log\"\n";
    let site = Site::new("robot1", section);
    let mut daemon = Daemon::spawn(site.run_command().stderr(Stdio::piped()));
    let mut said = BufReader::new(daemon.standard_error()).lines();
    let refused = said.find(|line| line.as_ref().unwrap().contains("ERROR"));
    let refused = refused.unwrap().unwrap();
    assert!(
        refused.contains("lines go to standard error, and it is tried again in 1 s"),
        "{refused}"
    );
    std::fs::create_dir(site.path("late")).unwrap();
    daemon.signal(Signal::HUP);
    wait_for_line(
        &site.path("late/log"),
        "the log was opened again: before, lines went to standard error",
    );
    assert_lives(&site, &mut daemon);
}

#[test]
fn a_log_file_that_cannot_be_made_is_no_reason_not_to_start() {
    let site = Site::new(
        "robot1",
        "[telemetry]\nlog_file = \"/nonexistent/colocd.log\"\n",
    );
    let mut daemon = Daemon::spawn(site.run_command().stderr(Stdio::piped()));
    let said = daemon.standard_error();
    assert_lives(&site, &mut daemon);
    let said = std::io::read_to_string(said).unwrap();
    assert!(
        said.contains("telemetry.log_file = \"/nonexistent/colocd.log\": cannot"),
        "{said}"
    );
}

#[test]
fn every_signal_that_asks_for_the_end_gets_a_clean_one() {
    let asks = ["--default-signal=HUP,INT,QUIT,TERM"];
    for signal in [Signal::TERM, Signal::INT, Signal::QUIT, Signal::HUP] {
        let site = Site::new("robot1", "");
        let mut daemon = Daemon::spawn(&mut environment(&asks, &site.run_command()));
        site.listen().until("a first estimate", |_| true);
        daemon.signal(signal);
        assert_eq!(daemon.wait(), Some(0), "{signal:?}");
        site.assert_nothing_left();
    }
}

/// What `nohup` does.
#[test]
fn who_was_started_to_outlive_its_terminal_does() {
    let site = Site::new("robot1", "");
    let mut daemon = Daemon::spawn(&mut environment(
        &["--ignore-signal=HUP"],
        &site.run_command(),
    ));
    site.listen().until("a first estimate", |_| true);
    daemon.signal(Signal::HUP);
    assert_lives(&site, &mut daemon);
}

/// The log that is to be played is a pipe into which nobody writes: opening it waits without end.
#[test]
fn a_signal_ends_a_start_that_does_not_come_forward() {
    let site = Site::new("robot1", "");
    let pipe = site.path("frames");
    let made = Command::new("mkfifo").arg(&pipe).status().unwrap();
    assert!(made.success());
    let local = format!("local:{}", site.path("bus").display());
    let played = format!("candump:{}", pipe.display());
    let config = site.config().replace(&local, &played);
    std::fs::write(site.config_path(), config).unwrap();
    let mut daemon = site.start();
    wait_for("the claim", || {
        let claim = site.root().join("claims/robot1");
        if claim.exists() {
            handles_sigterm(&daemon)
        } else {
            Err("no claim".into())
        }
    });
    daemon.signal(Signal::TERM);
    assert_eq!(daemon.wait(), Some(0));
}

/// Bit 14 of the mask of caught signals.
fn handles_sigterm(daemon: &Daemon) -> Result<(), String> {
    let status = std::fs::read_to_string(format!("/proc/{}/status", daemon.pid())).unwrap();
    let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
    let mask = u64::from_str_radix(caught.unwrap_or("0").trim(), 16).unwrap();
    if mask >> 14 & 1 == 1 && status.contains("colocd") {
        Ok(())
    } else {
        Err(status)
    }
}

#[test]
fn without_its_clock_it_ends_with_a_status_and_nothing_is_left() {
    let site = Site::new("robot1", "");
    let failing = "epoll_pwait,epoll_wait,epoll_pwait2:error=EBADF:when=50+";
    let Some(mut traced) = traced(failing, &site.run_command()) else {
        return;
    };
    let mut daemon = Daemon::spawn(traced.stderr(Stdio::piped()));
    let said = daemon.standard_error();
    assert_eq!(daemon.wait(), Some(3));
    let said = std::io::read_to_string(said).unwrap();
    assert!(
        said.contains("colocd: the real-time thread has ended")
            && said.contains("its clock failed"),
        "{said}"
    );
    site.assert_nothing_left();
}

/// Who listens in on a silent bus does so through a socket of its own.
#[test]
fn no_socket_is_left_on_the_bus_whenever_it_ends() {
    for after_ms in (1150..1650).step_by(50) {
        let site = Site::new("robot1", "");
        let mut daemon = site.start();
        site.listen().until("an estimate", |_| true);
        std::thread::sleep(std::time::Duration::from_millis(after_ms));
        daemon.terminate();
        let left: Vec<_> = std::fs::read_dir(site.bus()).unwrap().collect();
        assert!(left.is_empty(), "{left:?}");
    }
}

/// What is said by a start under this limit, which fails.
fn refused_under(limit: &str) -> String {
    let site = Site::new("robot1", "");
    let script = format!("ulimit {limit} && exec \"$@\"");
    let output = shell(&script, &site.run_command()).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{limit}: {said}");
    said
}

#[test]
fn too_few_files_are_refused_with_the_limit_wherever_they_are_missing_first() {
    for files in 4..20 {
        let said = refused_under(&format!("-n {files}"));
        let advised = said.contains("Too many open files") && said.contains("LimitNOFILE=");
        assert!(advised, "{files} files: {said}");
    }
}

#[test]
fn too_little_memory_is_refused_with_the_limit_before_it_is_missing() {
    for (option, name, setting, limits_mib) in [
        (
            "-v",
            "an address space",
            "ulimit -v; LimitAS=",
            [16, 64, 511],
        ),
        ("-d", "a data segment", "ulimit -d; LimitDATA=", [2, 4, 31]),
    ] {
        for limit_mib in limits_mib {
            let said = refused_under(&format!("{option} {}", limit_mib << 10));
            let refusal = format!("colocd: {name} of {limit_mib} MiB is too small");
            assert!(
                said.starts_with(&refusal) && said.contains(setting),
                "{said}"
            );
        }
    }
}

#[test]
fn as_much_memory_as_it_asks_for_is_enough_for_everything() {
    let all = "[initial]\nresume = true\n[telemetry]\nlog = \"debug\"\nlog_file = \"{at}/log\"\n\
        record = \"{at}/record\"\n[realtime]\nscheduler = \"other\"\nlock_memory = false\n";
    let site = Site::new("robot1", all);
    let (addresses, data) = (512 << 10, 32 << 10);
    let script = format!("ulimit -v {addresses} && ulimit -d {data} && exec \"$@\"");
    let mut daemon = Daemon::spawn(&mut shell(&script, &site.run_command()));
    site.saved_until("a belief", |_| true);
    assert_lives(&site, &mut daemon);
}

#[test]
fn when_its_place_is_taken_away_it_ends_with_a_status_and_starts_again() {
    let site = Site::new("robot1", "");
    let mut daemon = Daemon::spawn(site.run_command().stderr(Stdio::piped()));
    let said = daemon.standard_error();
    site.listen().until("an estimate", |_| true);
    std::fs::remove_dir_all(site.root()).unwrap();
    assert_eq!(daemon.wait(), Some(4));
    let said = std::io::read_to_string(said).unwrap();
    assert!(said.contains("was deleted or exchanged"), "{said}");
    assert_lives(&site, &mut site.start());
}

#[test]
fn what_it_could_not_find_again_is_removed_by_the_next_start_which_says_so() {
    let site = Site::new("robot1", "");
    let (mut daemon, _) = started(&site);
    std::fs::rename(site.root(), site.path("elsewhere")).unwrap();
    assert_eq!(daemon.wait(), Some(4));
    // Nobody else enters before: he would remove it.
    let (mut next, said) = started(&site);
    let reason = "processes that were killed or had lost their root";
    assert!(said.contains(reason), "{said}");
    next.terminate();
}

/// A daemon that runs, and what it said until then.
fn started(site: &Site) -> (Daemon, String) {
    let mut daemon = Daemon::spawn(site.run_command().stderr(Stdio::piped()));
    let mut lines = BufReader::new(daemon.standard_error());
    let mut said = String::new();
    while !said.contains("running") {
        let length = lines.read_line(&mut said).unwrap();
        assert!(length > 0, "it ended: {said}");
    }
    (daemon, said)
}

#[test]
fn without_a_place_for_its_status_the_robot_is_watched_and_the_place_is_taken_later() {
    let (site, log) = with_log_file("");
    let space = site.space();
    let others: Vec<_> =
        std::iter::from_fn(|| space.publisher::<Status>(&site.robot()).ok()).collect();
    let stalls = "epoll_pwait,epoll_wait,epoll_pwait2:delay_exit=1000000:when=60";
    let Some(mut traced) = traced(stalls, &site.run_command()) else {
        return;
    };
    let mut daemon = Daemon::spawn(&mut traced);
    wait_for_line(&log, "no status is published until this works");
    wait_for_line(&log, "no tick: the real-time thread does not run");
    drop((others, space));
    assert_lives(&site, &mut daemon);
}

#[test]
fn check_ends_with_a_sentence_where_nobody_takes_its_answer() {
    let site = Site::new("robot1", "");
    let check = || Daemon::command(&["check", site.config_path().to_str().unwrap()]);
    let (reader, closed) = std::io::pipe().unwrap();
    drop(reader);
    for output in [closed.into(), Stdio::from(open_to_write("/dev/full"))] {
        let output = check()
            .stdout(output)
            .stderr(Stdio::piped())
            .output()
            .unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(
            said.starts_with("colocd: standard output cannot be written"),
            "{said}"
        );
    }
    let full = || open_to_write("/dev/full");
    let both = check().stdout(full()).stderr(full()).status().unwrap();
    assert_eq!(both.code(), Some(1));
    let help = Daemon::command(&["--help"])
        .stdout(full())
        .stderr(full())
        .status()
        .unwrap();
    assert_eq!(help.code(), Some(1));
    let nonsense = Daemon::command(&["--nonsense"])
        .stderr(full())
        .status()
        .unwrap();
    assert_eq!(nonsense.code(), Some(2));
}

#[test]
fn a_saved_belief_that_was_spoiled_is_a_warning() {
    let (site, log) = with_log_file("[initial]\nresume = true\n");
    std::fs::write(site.path("belief.toml"), "spoiled").unwrap();
    let mut daemon = site.start();
    wait_for_line(&log, "WARN starting from [initial]");
    assert_lives(&site, &mut daemon);
}

#[test]
fn who_is_started_again_goes_on_from_the_last_tick() {
    let lines =
        "[initial]\nsigma = [0.1, 0.1, 0.001]\nresume = true\n[telemetry]\nstate_hz = 0.1\n";
    let site = Site::new("robot1", lines);
    let mut daemon = site.start();
    let mut drive = site.drive();
    drive.straight(50, 0.5);
    drive.stand();
    let way_m = drive.way_m();
    let there = |x: f64| (x - way_m).abs() < 1e-3;
    let before = site
        .listen()
        .until("the way driven", |estimate| there(estimate.pose[0]));
    daemon.terminate();
    let mut again = site.start();
    let after = site.listen().until("the next session", |estimate| {
        estimate.header.session != before.header.session
    });
    assert!(there(after.pose[0]), "{} instead of {way_m}", after.pose[0]);
    again.terminate();
}

#[test]
fn each_start_has_a_recording_of_its_own() {
    let site = Site::new("robot1", "[telemetry]\nrecord = \"{at}/robot1.jsonl\"\n");
    for _ in 0..2 {
        let mut daemon = site.start();
        site.listen()
            .until("an estimate", |estimate| estimate.tick > 10);
        daemon.terminate();
    }
    for name in ["robot1.jsonl", "robot1.jsonl.1"] {
        let recording = Recording::read(&site.path(name)).unwrap();
        assert!(
            recording.ticks.len() > 10 && recording.gaps.ticks == 0,
            "{name}"
        );
    }
}

/// `command` under an injected fault, as `strace` describes it; `None` where that is not possible.
fn traced(fault: &str, command: &Command) -> Option<Command> {
    let works = Command::new("strace")
        .args(["-o", "/dev/null", "true"])
        .status();
    if !works.is_ok_and(|status| status.success()) {
        println!("SKIPPED: faults of system calls: they need strace, and leave to trace");
        return None;
    }
    let mut traced = Command::new("strace");
    // -D: the daemon, not strace, is the child that is waited for.
    traced.args(["-D", "-f", "-qq", "-o", "/dev/null", "-e"]);
    traced.arg(format!("inject={fault}"));
    Some(then(traced, command))
}

fn shell(script: &str, command: &Command) -> Command {
    let mut shell = Command::new("sh");
    shell.args(["-c", script, "sh"]);
    then(shell, command)
}

fn environment(arguments: &[&str], command: &Command) -> Command {
    let mut environment = Command::new("env");
    environment.args(arguments);
    then(environment, command)
}

fn then(mut first: Command, command: &Command) -> Command {
    first.arg(command.get_program()).args(command.get_args());
    first
}
