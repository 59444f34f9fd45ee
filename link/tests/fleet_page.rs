//! The commands of `docs/fleet.md`, run as they stand there: one directory stands for each computer, loopback for the network.
#![allow(clippy::unwrap_used)] // A test may panic.

use std::fs;
use std::net::UdpSocket;
use std::path::Path;
use std::process::{Child, Command};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/fleet.md");
const PROGRAM: &str = env!("CARGO_BIN_EXE_coloc-link");

/// Ends the links whatever happens.
struct Running(Vec<Child>);

impl Drop for Running {
    fn drop(&mut self) {
        for link in &mut self.0 {
            let id = i32::try_from(link.id()).ok().and_then(Pid::from_raw);
            let _ = id.map(|id| kill_process(id, Signal::TERM));
            let _ = link.wait();
        }
    }
}

/// Blocks of the page and whose computer they are typed on.
fn blocks(page: &str) -> Vec<(String, String)> {
    let parts = page.split("\n```sh ").skip(1);
    let split = parts.map(|part| {
        let (whose, rest) = part.split_once('\n').unwrap();
        let (text, _) = rest.split_once("\n```").unwrap();
        (whose.to_owned(), text.to_owned())
    });
    split.collect()
}

fn free_port() -> u16 {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.local_addr().unwrap().port()
}

/// Until somebody listens on the port.
fn await_taken(port: u16) {
    let until = Instant::now() + Duration::from_secs(60);
    while UdpSocket::bind(("127.0.0.1", port)).is_ok() {
        assert!(Instant::now() < until, "nobody listens on {port}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn shell(home: &Path, whose: &str, text: &str) -> Command {
    let directory = home.join(whose);
    fs::create_dir_all(&directory).unwrap();
    let mut command = Command::new("bash");
    // Another computer is the directory beside this one.
    let copies = "scp() { cp -rp \"$2\" \"../${3/:/\\/}\"; }\n";
    let programs = Path::new(PROGRAM).parent().unwrap().display().to_string();
    let path = std::env::var("PATH").unwrap_or_default();
    command
        .args(["-euo", "pipefail", "-c", &format!("{copies}{text}")])
        .current_dir(directory)
        .env("PATH", format!("{programs}:{path}"))
        .env("XDG_RUNTIME_DIR", home.join(format!("run-{whose}")))
        .env("XDG_STATE_HOME", home.join("state"))
        .env("HOME", home);
    command
}

#[test]
fn two_robots_are_set_up_as_the_page_says() {
    let home = tempfile::tempdir().unwrap();
    for place in [
        "run-operator",
        "run-robot1",
        "run-robot2",
        "state",
        "robot1",
        "robot2",
    ] {
        fs::create_dir_all(home.path().join(place)).unwrap();
    }
    let page = fs::read_to_string(PAGE).unwrap();
    let ports = [free_port(), free_port()];
    let page = page.replace("192.168.1.11:7373", &format!("127.0.0.1:{}", ports[0]));
    let page = page.replace("192.168.1.12:7373", &format!("127.0.0.1:{}", ports[1]));
    let mut running = Running(Vec::new());
    let all = blocks(&page);
    assert_eq!(all.len(), 6);
    for (whose, text) in all {
        let (before, run) = match text.strip_suffix("\ncoloc-link run robot.toml") {
            Some(before) => (before.to_owned(), true),
            None => (text, false),
        };
        let ended = shell(home.path(), &whose, &before).status().unwrap();
        assert!(ended.success(), "{whose}: {before}");
        if run {
            let link = shell(home.path(), &whose, "exec coloc-link run robot.toml").spawn();
            running.0.push(link.unwrap());
            await_taken(ports[running.0.len() - 1]);
        }
    }
    let until = Instant::now() + Duration::from_secs(60);
    loop {
        let asked = shell(home.path(), "robot1", "coloc-link check robot.toml").output();
        let told = String::from_utf8(asked.unwrap().stdout).unwrap();
        let knows = |what: &str| {
            told.lines()
                .any(|it| it.starts_with("robot2") && it.contains(what))
        };
        if knows("runs coloc-link") && knows("ms off") {
            break;
        }
        assert!(Instant::now() < until, "{told}");
    }
    for link in &mut running.0 {
        assert!(link.try_wait().unwrap().is_none(), "a link has ended");
    }
}
