//! Devices that come and go, and files that are whole or not.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::fs::File;
use std::io::Write;
use std::os::fd::OwnedFd;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::time::{Duration, Instant};

use coloc_sensors::input::Step;
use coloc_sensors::{Input, InputSpec, Stop};
use flate2::Compression;
use flate2::write::GzEncoder;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};

const PATIENCE: Duration = Duration::from_secs(30);
const MOMENT: Duration = Duration::from_millis(20);

fn input(spec: &str, directory: &Path) -> Input {
    let spec: InputSpec = spec.parse().unwrap();
    Input::new(spec.below(directory), Duration::from_secs(10))
}

/// The next step that is not quiet.
fn next(input: &mut Input, stop: &Stop) -> Step {
    let begin = Instant::now();
    while begin.elapsed() < PATIENCE {
        match input.step(stop, MOMENT).unwrap() {
            Step::Quiet => {}
            step => return step,
        }
    }
    panic!("nothing happened for {PATIENCE:?}");
}

/// What comes until the end, or why there is none.
fn all(input: &mut Input, stop: &Stop) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    loop {
        match next(input, stop) {
            Step::Opened => {}
            Step::Bytes => bytes.extend_from_slice(input.bytes()),
            Step::End => return Ok(bytes),
            Step::Unreadable(why) => return Err(why),
            step => panic!("{step:?}"),
        }
    }
}

/// A line whose far end is ours; the device's name.
fn line() -> (OwnedFd, String) {
    let ours = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap();
    grantpt(&ours).unwrap();
    unlockpt(&ours).unwrap();
    let name = ptsname(&ours, Vec::new()).unwrap();
    (ours, name.into_string().unwrap())
}

#[test]
fn a_file_is_read_plain_or_out_of_gzip_and_a_cut_one_is_said() {
    let directory = tempfile::tempdir().unwrap();
    let (stop, _asks) = Stop::by_hand().unwrap();
    let text = b"some lines\n".repeat(5000);
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(&text).unwrap();
    let zipped = encoder.finish().unwrap();
    for (name, bytes) in [
        ("plain", &text[..]),
        ("zipped", &zipped),
        ("cut", &zipped[..zipped.len() - 9]),
    ] {
        std::fs::write(directory.path().join(name), bytes).unwrap();
    }
    let read = |name: &str| all(&mut input(&format!("file:{name}"), directory.path()), &stop);
    assert_eq!(read("plain").unwrap(), text);
    assert_eq!(read("zipped").unwrap(), text);
    assert!(read("cut").unwrap_err().contains("cut"));
    assert!(read("missing").unwrap_err().contains("No such file"));
    // As after a loss of power while it was written: what is there is handed on first.
    let mut cut = input("file:cut", directory.path());
    let mut bytes = Vec::new();
    let why = loop {
        match next(&mut cut, &stop) {
            Step::Opened => {}
            Step::Bytes => bytes.extend_from_slice(cut.bytes()),
            Step::Unreadable(why) => break why,
            step => panic!("{step:?}"),
        }
    };
    assert!(why.contains("cut") && bytes.len() > text.len() / 2 && text.starts_with(&bytes));
}

#[test]
fn a_pipe_that_nobody_writes_to_holds_nobody() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("pipe");
    rustix::fs::mkfifoat(rustix::fs::CWD, &path, rustix::fs::Mode::RWXU).unwrap();
    let (stop, mut asks) = Stop::by_hand().unwrap();
    let mut pipe = input("file:pipe", directory.path());
    assert!(matches!(next(&mut pipe, &stop), Step::Opened));
    assert!(matches!(pipe.step(&stop, MOMENT).unwrap(), Step::Quiet));
    let mut writer = File::options().write(true).open(&path).unwrap();
    writer.write_all(b"a line\n").unwrap();
    drop(writer);
    assert_eq!(all(&mut pipe, &stop).unwrap(), b"a line\n");
    let mut pipe = input("file:pipe", directory.path());
    assert!(matches!(next(&mut pipe, &stop), Step::Opened));
    asks.write_all(&[1]).unwrap();
    assert!(matches!(next(&mut pipe, &stop), Step::Stop));
}

#[test]
fn a_serial_device_is_waited_for_and_found_again() {
    let directory = tempfile::tempdir().unwrap();
    let (stop, _asks) = Stop::by_hand().unwrap();
    let link = directory.path().join("tty");
    let mut input = input("serial:tty?baud=115200", directory.path());
    assert!(matches!(next(&mut input, &stop), Step::Lost(why) if why.contains("No such file")));
    for round in 0..2 {
        let (ours, name) = line();
        symlink(name, &link).unwrap();
        while !matches!(next(&mut input, &stop), Step::Opened) {}
        let mut ours: File = ours.into();
        // Neither an end of line nor an interrupt is changed on the way.
        let said = [b'$', round, b'\r', b'\n', 3, 0xff];
        ours.write_all(&said).unwrap();
        let mut heard = Vec::new();
        while heard.len() < said.len() {
            assert!(matches!(next(&mut input, &stop), Step::Bytes));
            heard.extend_from_slice(input.bytes());
        }
        assert_eq!(heard, said);
        std::fs::remove_file(&link).unwrap();
        drop(ours);
        assert!(matches!(next(&mut input, &stop), Step::Lost(_)));
        assert!(!input.is_open());
    }
}

#[test]
fn what_is_no_serial_device_is_not_taken_for_one() {
    let directory = tempfile::tempdir().unwrap();
    let (stop, _asks) = Stop::by_hand().unwrap();
    std::fs::write(directory.path().join("tty"), "").unwrap();
    let mut input = input("serial:tty", directory.path());
    assert!(matches!(next(&mut input, &stop), Step::Lost(why) if why.contains("no serial device")));
}

#[test]
fn who_is_asked_to_end_does_so_wherever_it_waits() {
    let directory = tempfile::tempdir().unwrap();
    let (stop, mut asks) = Stop::by_hand().unwrap();
    asks.write_all(b"!").unwrap();
    let (_ours, name) = line();
    symlink(name, directory.path().join("tty")).unwrap();
    for spec in ["serial:tty", "serial:missing", "tcp:127.0.0.1:9"] {
        let mut input = input(spec, directory.path());
        let mut steps = (0..5).map(|_| input.step(&stop, PATIENCE).unwrap());
        assert!(steps.any(|step| matches!(step, Step::Stop)), "{spec}");
    }
}
