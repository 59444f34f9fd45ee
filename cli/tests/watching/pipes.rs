//! Readers of standard output that go, stall, or are full disks.

use std::fs::OpenOptions;
use std::io::{BufRead, BufReader, PipeWriter, Read};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use serde_json::Value;

use crate::program::Coloc;
use crate::robot::{Ground, Robot};

/// `coloc listen r1 | head -3`, of a robot that then says nothing: there is nothing to write that could fail.
#[test]
fn a_reader_who_has_seen_enough_ends_it_without_a_word() {
    let ground = Ground::new();
    let mut robot = Robot::start(&ground, "r1", 1);
    let (reader, writer) = std::io::pipe().unwrap();
    let coloc = Coloc::start_into("listen r1 --json", &ground.root(), writer);
    let head = std::thread::spawn(|| BufReader::new(reader).lines().take(3).count());
    while !head.is_finished() {
        robot.say();
        std::thread::sleep(Duration::from_millis(2));
    }
    assert_eq!(head.join().unwrap(), 3);
    let ended = coloc.end(|| {});
    assert_eq!(ended.status, Some(141), "{ended:?}");
    let complains = |line: &String| line.contains("cannot write");
    assert!(!ended.said.iter().any(complains), "{ended:?}");
}

#[test]
fn who_waits_for_a_robot_ends_with_the_reader_too() {
    let ground = Ground::new();
    let (reader, writer) = std::io::pipe().unwrap();
    let mut coloc = Coloc::start_into("listen r1", &ground.root(), writer);
    coloc.wait_until_it_says("waiting", || {});
    drop(reader);
    assert_eq!(coloc.end(|| {}).status, Some(141));
}

/// Has the robot speak until nothing more fits into the pipe, and then more than waits for a listener.
fn stall(robot: &mut Robot, writer: &PipeWriter) {
    let nothing = Timespec {
        tv_sec: 0,
        tv_nsec: 0,
    };
    let is_open = || {
        let mut asked = [PollFd::new(writer, PollFlags::OUT)];
        poll(&mut asked, Some(&nothing)).unwrap() > 0
    };
    while is_open() {
        robot.say();
        std::thread::sleep(Duration::from_millis(1));
    }
    (0..100).for_each(|_| robot.say());
}

#[test]
fn a_reader_who_stalls_loses_estimates_which_are_counted() {
    let ground = Ground::new();
    let mut robot = Robot::start(&ground, "r1", 1);
    let (mut reader, writer) = std::io::pipe().unwrap();
    let own = writer.try_clone().unwrap();
    let mut coloc = Coloc::start_into("listen r1 --json", &ground.root(), writer);
    stall(&mut robot, &own);
    drop(own);
    let drain = std::thread::spawn(move || {
        let mut text = String::new();
        reader.read_to_string(&mut text).unwrap();
        text
    });
    coloc.wait_until_it_says("were lost", || robot.say());
    coloc.signal("INT");
    assert_eq!(coloc.end(|| robot.say()).status, Some(130));
    for line in drain.join().unwrap().lines() {
        assert!(serde_json::from_str::<Value>(line).is_ok(), "{line}");
    }
}

#[test]
fn a_reader_who_never_comes_back_does_not_keep_it_from_ending() {
    let ground = Ground::new();
    let mut robot = Robot::start(&ground, "r1", 1);
    let (reader, writer) = std::io::pipe().unwrap();
    let own = writer.try_clone().unwrap();
    let coloc = Coloc::start_into("listen r1 --json", &ground.root(), writer);
    stall(&mut robot, &own);
    coloc.signal("INT");
    assert_eq!(coloc.end(|| {}).status, Some(130));
    drop(reader);
}

#[test]
fn a_full_disk_is_a_sentence_and_a_failure() {
    let ground = Ground::new();
    let mut robot = Robot::start(&ground, "r1", 1);
    for words in ["list", "listen r1 --csv"] {
        let full = OpenOptions::new().write(true).open("/dev/full").unwrap();
        let ended = Coloc::start_into(words, &ground.root(), full).end(|| robot.say());
        assert_eq!(ended.status, Some(1), "{words}: {ended:?}");
        let said = ended.said.join("\n");
        assert!(said.contains("cannot write to standard output"), "{said}");
    }
}
