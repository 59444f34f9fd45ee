//! The program, as a robot runs it: on a serial device that is pulled out, on servers that close, on files; heard over shared memory.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::net::{TcpListener, TcpStream};
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Output};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use coloc_gnss::sentence::line;
use coloc_gnss::utc::iso;
use coloc_rig::{PATIENCE, Rig};
use coloc_shm_types::{Clock, DriverStatus, Heading, Health, Message, Position, Subscriber};
use rustix::process::{Pid, Resource, Rlimit, prlimit};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};

const NORTH: f64 = 48.0;
const EAST: f64 = 11.0;

/// A robot with a datum, and a receiver.
fn robot(input: &str, more: &str) -> Rig {
    let datum = format!("latitude_deg = {NORTH}\nlongitude_deg = {EAST}\n");
    with_datum(input, more, &datum)
}

fn with_datum(input: &str, more: &str, datum: &str) -> Rig {
    let rig = Rig::new("gnss", env!("CARGO_BIN_EXE_coloc-gnss"));
    let more = format!(
        "[position]\nreceivers = 1\n[gnss]\ninput = \"{input}\"\nsource = 3\n{more}\n[gnss.datum]\n{datum}"
    );
    rig.configure("a", &["a"], &more);
    rig
}

fn start(robot: &mut Rig) -> u32 {
    robot.start(robot.command("run", "a"))
}

fn stop(robot: Rig) -> Output {
    robot.stop().swap_remove(0)
}

fn now_ns() -> i64 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap();
    now.as_nanos().try_into().unwrap()
}

/// What a receiver says of this moment, a thousandth of a minute north and east of the datum, with a heading to the east.
fn burst(utc_ns: i64) -> String {
    let utc = iso(utc_ns);
    let time = utc[11..23].replace(':', "");
    let date = format!("{}{}{}", &utc[8..10], &utc[5..7], &utc[2..4]);
    let place = "4800.001000,N,01100.001000,E";
    [
        format!("GNGGA,{time},{place},4,12,0.9,0.0,M,0.0,M,,"),
        format!("GNRMC,{time},A,{place},0.0,0.0,{date},,,R"),
        format!("GNGST,{time},1,1,1,0,0.01,0.02,0.03"),
        "GNHDT,90.0,T".to_owned(),
    ]
    .map(|said| line(&said))
    .concat()
}

/// Lets the receiver speak until `heard` hears what it wants.
fn until<T>(mut speak: impl FnMut(&str), mut heard: impl FnMut() -> Option<T>) -> T {
    let apart = Duration::from_millis(100);
    coloc_rig::until(&mut speak, apart, |it| it(&burst(now_ns())), |_| heard())
}

fn next<M: Message>(messages: &Subscriber<M>) -> Option<M> {
    messages.wait(Duration::from_millis(20)).unwrap()
}

fn assert_is_the_fix(position: &Position) {
    let [x, y] = position.position;
    assert!(
        (x - 1.243).abs() < 0.01 && (y - 1.853).abs() < 0.01,
        "{position:?}"
    );
    assert_eq!((position.quality, position.header.source), (4, 3));
    assert_eq!(position.header.clock(), Ok(Clock::Realtime));
    assert!((now_ns() - position.header.stamp_ns).abs() < 5_000_000_000);
    assert!(position.covariance[0] >= 0.02 * 0.02 && position.slow_sigma_m > 0.0);
}

/// The two ends of a line: what the receiver writes to, and where the device is.
struct Line {
    receiver: File,
    device: String,
}

impl Line {
    fn new() -> Self {
        let receiver =
            openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap();
        grantpt(&receiver).unwrap();
        unlockpt(&receiver).unwrap();
        let device = ptsname(&receiver, Vec::new()).unwrap();
        Self {
            device: device.into_string().unwrap(),
            receiver: receiver.into(),
        }
    }

    fn plug(&self, link: &Path) {
        let _ = std::fs::remove_file(link);
        symlink(&self.device, link).unwrap();
    }

    fn say(&mut self, text: &str) {
        // Where nobody reads, the line is full some time.
        let _ = self.receiver.write_all(text.as_bytes());
    }
}

#[test]
fn a_receiver_that_is_pulled_out_is_heard_again_once_it_is_back() {
    let mut robot = robot("serial:ttyGNSS?baud=115200", "");
    let link = robot.path("ttyGNSS");
    let positions = robot.subscriber::<Position>("a");
    let headings = robot.subscriber::<Heading>("a");
    let statuses = robot.subscriber::<DriverStatus>("a");
    start(&mut robot);
    let mut line = Line::new();
    line.plug(&link);
    let first = until(|text| line.say(text), || next(&positions));
    assert_is_the_fix(&first);
    let heading = until(|text| line.say(text), || next(&headings));
    assert_eq!((heading.what, heading.quality), (Heading::ANTENNAS, 4));
    assert!(heading.heading.abs() < 1e-4, "{heading:?}");
    // Pulled out in the middle of a sentence.
    line.say("$GNGGA,120000.00,4800");
    std::fs::remove_file(&link).unwrap();
    drop(line);
    let gone = |status: DriverStatus| status.open == 0 && status.opened >= 1;
    let heard = until(|_| {}, || next(&statuses).filter(|it| gone(*it)));
    assert!(heard.said > 0 && heard.name() == "gnss" && heard.header.source == 3);
    while positions.receive().unwrap().is_some() {}
    let mut line = Line::new();
    line.plug(&link);
    let again = until(|text| line.say(text), || next(&positions));
    assert_is_the_fix(&again);
    assert!(again.header.stamp_ns > first.header.stamp_ns);
    assert_eq!(again.header.session, first.header.session);
    let well = |it: &DriverStatus| it.opened >= 2 && it.health() == Health::Ok;
    until(|text| line.say(text), || next(&statuses).filter(well));
    let output = stop(robot);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{said}");
    assert!(
        said.contains("it is tried again") && said.contains("fixes pass"),
        "{said}"
    );
}

fn accept(server: &TcpListener) -> TcpStream {
    let begin = Instant::now();
    server.set_nonblocking(true).unwrap();
    while begin.elapsed() < PATIENCE {
        match server.accept() {
            Ok((stream, _)) => {
                stream.set_nonblocking(false).unwrap();
                return stream;
            }
            Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => {
                std::thread::sleep(Duration::from_millis(5));
            }
            Err(error) => panic!("{error}"),
        }
    }
    panic!("nobody came");
}

#[test]
fn a_server_that_closes_is_asked_again() {
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = server.local_addr().unwrap();
    let mut robot = robot(&format!("tcp:{address}"), "");
    let positions = robot.subscriber::<Position>("a");
    start(&mut robot);
    for _ in 0..3 {
        let mut stream = accept(&server);
        while positions.receive().unwrap().is_some() {}
        let say = |text: &str| drop(stream.write_all(text.as_bytes()));
        assert_is_the_fix(&until(say, || next(&positions)));
    }
    assert_eq!(stop(robot).status.code(), Some(0));
}

#[test]
fn gpsd_is_asked_for_what_the_receiver_says_and_its_own_words_do_no_harm() {
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = server.local_addr().unwrap();
    let mut robot = robot(&format!("gpsd:{address}?device=/dev/ttyS9"), "");
    let positions = robot.subscriber::<Position>("a");
    start(&mut robot);
    let mut stream = accept(&server);
    stream
        .write_all(b"{\"class\":\"VERSION\",\"release\":\"3.25\"}\r\n")
        .unwrap();
    let mut asked = String::new();
    BufReader::new(&stream).read_line(&mut asked).unwrap();
    assert_eq!(
        asked,
        "?WATCH={\"enable\":true,\"json\":false,\"raw\":2,\"device\":\"/dev/ttyS9\"};\n"
    );
    let say = |text: &str| {
        let said = format!("{{\"class\":\"DEVICE\",\"path\":\"/dev/ttyS9\"}}\r\n{text}");
        drop(stream.write_all(said.as_bytes()));
    };
    assert_is_the_fix(&until(say, || next(&positions)));
    assert_eq!(stop(robot).status.code(), Some(0));
}

#[test]
fn a_silent_server_is_left_and_asked_again() {
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = server.local_addr().unwrap();
    let mut robot = robot(&format!("tcp:{address}"), "silence_s = 1");
    start(&mut robot);
    let first = accept(&server);
    let second = accept(&server);
    drop((first, second));
    let output = stop(robot);
    assert!(
        String::from_utf8_lossy(&output.stderr).contains("silent for 1 s"),
        "{output:?}"
    );
}

#[test]
fn a_recording_is_read_to_its_end() {
    let mut robot = robot("file:log.nmea?speed=full", "");
    let begin_ns = 1_500_000_000_000_000_000;
    let bursts = (0..20).map(|fix| burst(begin_ns + fix * 1_000_000_000));
    std::fs::write(robot.path("log.nmea"), bursts.collect::<String>()).unwrap();
    let positions = robot.subscriber::<Position>("a");
    start(&mut robot);
    let mut stamps = Vec::new();
    while !robot.is_over() {
        stamps.extend(next(&positions).map(|position| position.header.stamp_ns));
    }
    assert!(robot.ended().status.success());
    let expected: Vec<_> = (0..20).map(|fix| begin_ns + fix * 1_000_000_000).collect();
    assert_eq!(stamps, expected);
}

#[test]
fn a_recording_is_shown_as_lines() {
    let robot = robot("stdin", "");
    let path = robot.path("log.nmea");
    let bursts = (0..20).map(|fix| burst(1_500_000_000_000_000_000 + fix * 1_000_000_000));
    std::fs::write(&path, bursts.collect::<String>()).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_coloc-gnss"));
    let output = command.arg("fixes").arg(&path).output().unwrap();
    let shown = String::from_utf8(output.stdout).unwrap();
    assert_eq!(
        shown.matches("\"latitude_deg\":48.0000166666").count(),
        20,
        "{shown}"
    );
    assert_eq!(shown.matches("\"heading_deg\":90.0").count(), 20, "{shown}");
    assert!(String::from_utf8_lossy(&output.stderr).contains("80 sentences"));
}

#[test]
fn a_recording_is_played_as_if_it_were_now_and_ends_when_it_is_asked_to() {
    let mut robot = robot("file:log.nmea", "");
    let bursts = (0..5000).map(|fix| burst(1_500_000_000_000_000_000 + fix * 100_000_000));
    std::fs::write(robot.path("log.nmea"), bursts.collect::<String>()).unwrap();
    let positions = robot.subscriber::<Position>("a");
    start(&mut robot);
    let [first, later] = [0, 1].map(|_| until(|_| {}, || next(&positions)));
    assert_eq!(first.header.clock(), Ok(Clock::Boottime));
    assert_eq!(later.header.stamp_ns - first.header.stamp_ns, 100_000_000);
    assert_eq!(stop(robot).status.code(), Some(0));
}

#[test]
fn what_is_wrong_is_said_and_has_its_status() {
    let ended = |input: &str, word: &str, more: &str| {
        let robot = robot(input, more);
        let output = robot.command(word, "a").output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code(), said)
    };
    let (status, said) = ended("usb:1", "run", "");
    assert!(
        status == Some(2) && said.contains("a.toml:10: gnss.input = \"usb:1\": write serial:"),
        "{said}"
    );
    let (status, said) = ended("stdin", "check", "baud = 1");
    assert!(
        status == Some(2) && said.contains("[gnss] has no baud"),
        "{said}"
    );
    let (status, said) = ended("file:missing", "run", "");
    assert!(status == Some(1) && said.contains("No such file"), "{said}");
    let (status, said) = ended("stdin", "check", "latency_s = 0.1");
    assert_eq!((status, said.as_str()), (Some(0), ""));
}

#[test]
fn check_says_what_it_understood() {
    let robot = robot("serial:/dev/ttyS0", "");
    let (status, said) = robot.said("check", "a", &["--strict"]);
    assert!(
        said.contains("input        serial:/dev/ttyS0?baud=9600\n"),
        "{said}"
    );
    assert!(said.contains("datum        48° north, 11° east"), "{said}");
    assert_eq!(status, Some(0), "{said}");
}

#[test]
fn who_deletes_the_shared_memory_ends_it() {
    let line = Line::new();
    let mut robot = robot("serial:ttyGNSS", "");
    line.plug(&robot.path("ttyGNSS"));
    let statuses = robot.subscriber::<DriverStatus>("a");
    start(&mut robot);
    until(|_| {}, || next(&statuses));
    std::fs::remove_dir_all(robot.path("shm")).unwrap();
    let output = robot.ended();
    assert_eq!(output.status.code(), Some(4), "{output:?}");
}

#[test]
fn there_is_one_of_it() {
    robot("serial:ttyGNSS", "").assert_alone("run", "a");
}

#[test]
fn nothing_is_left_of_a_datum_that_could_not_be_written() {
    let datum = "file = \"datum.toml\"\nfixes = 2\n";
    let mut robot = with_datum("serial:ttyGNSS", "", datum);
    let mut line = Line::new();
    line.plug(&robot.path("ttyGNSS"));
    let positions = robot.subscriber::<Position>("a");
    let statuses = robot.subscriber::<DriverStatus>("a");
    let process = start(&mut robot);
    until(|_| {}, || next(&statuses));
    // As on a full disk: what is there stays, and nothing more is written.
    let full = Rlimit {
        current: Some(0),
        maximum: Some(0),
    };
    let process = Pid::from_raw(process.cast_signed());
    prlimit(process, Resource::Fsize, full).unwrap();
    until(|text| line.say(text), || next(&positions));
    let left = std::fs::read_dir(robot.path("")).unwrap();
    let left = left.map(|it| it.unwrap().file_name().into_string().unwrap());
    let left: Vec<_> = left.filter(|name| name.starts_with("datum")).collect();
    let output = stop(robot);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("it could not be saved"), "{said}");
    assert_eq!(left, Vec::<String>::new());
}
