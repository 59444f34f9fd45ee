//! A bus that other nodes fill: no encoder frame is lost, and nobody is woken for the rest.

use std::process::{Child, Command, Stdio};

use coloc_daemon::config::Trigger;

use super::robot::Robot;
use super::support::Interface;
use super::wheels::Wheels;

const SECONDS: u32 = 30;
const PAIRS: u32 = 50 * SECONDS;

/// `cangen`, sending as fast as it can; it ends with this.
struct Generator(Child);

impl Generator {
    fn start(interface: &str, identifiers: &[&str]) -> Self {
        let mut command = Command::new("cangen");
        command.args([interface, "-g", "0", "-i"]).args(identifiers);
        Self(
            command
                .stdout(Stdio::null())
                .spawn()
                .expect("cangen, of the package can-utils"),
        )
    }
}

impl Drop for Generator {
    fn drop(&mut self) {
        let _ = (self.0.kill(), self.0.wait()); // It ends by this only.
    }
}

#[test]
fn at_full_load_no_frame_is_lost_and_foreign_frames_wake_nobody() {
    let interface = Interface::new("vcan0");
    let robot = Robot::start(&interface.spec(), &interface.spec(), Trigger::Encoder);
    let mut wheels = Wheels::new(&interface, &interface);
    wheels.turn([1000, 1000], 50);
    let frames_before = frames_on(&interface);
    let generators = [
        Generator::start("vcan0", &["-I", "200"]),
        // Our own identifier's number, and another kind of identifier.
        Generator::start("vcan0", &["-e", "-I", "100"]),
    ];
    let sleeps_before = robot.sleeps();
    wheels.turn([1000, 1000], PAIRS);
    let sleeps = robot.sleeps() - sleeps_before;
    let foreign = frames_on(&interface) - frames_before - u64::from(2 * PAIRS);
    drop(generators);

    let all = u64::from(2 * (50 + PAIRS));
    let status = robot.status_until("an account of all frames", |status| {
        status.can.frames >= all
    });
    assert_eq!(
        (status.can.frames, status.can.alive_skips),
        (all, 0),
        "{:?}",
        status.can
    );
    assert_eq!(status.can.rx_overflows, 0);
    eprintln!(
        "{foreign} foreign frames in {SECONDS} s, {sleeps} wake-ups for {} frames of ours",
        2 * PAIRS
    );
    assert!(
        foreign > 10 * u64::from(PAIRS),
        "{foreign} frames are no load"
    );
    // Each of our frames may wake it by itself, and the timer once a period.
    assert!(
        sleeps <= u64::from(3 * PAIRS + PAIRS / 10),
        "{sleeps} wake-ups, {foreign} foreign frames"
    );
    robot.end();
}

fn frames_on(interface: &Interface) -> u64 {
    let path = format!("/sys/class/net/{}/statistics/tx_packets", interface.name());
    std::fs::read_to_string(path)
        .unwrap()
        .trim()
        .parse()
        .unwrap()
}
