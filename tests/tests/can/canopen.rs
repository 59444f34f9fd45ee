//! A drive that is mute until NMT start, is reset, and loses who sends SYNC: each time odometry is back, and the status says what was.

use coloc_daemon::config::{Config, Trigger};
use coloc_drivers::canopen::CanopenConfig;
use coloc_shm_types::{Health, Input, Status};

use super::mute_drive::{MuteDrive, NODE};
use super::robot::{Robot, configuration};

fn canopen() -> CanopenConfig {
    let lines = format!("nodes = [{NODE}]\nstart = true\nsync_period_s = 0.02");
    toml::from_str(&lines).unwrap()
}

/// On any bus.
pub(crate) fn a_drive_that_has_to_be_started(spec: &str) {
    let robot = Robot::configured(|root| Config {
        canopen: Some(canopen()),
        ..configuration(spec, spec, Trigger::Timer, root)
    });
    let drive = MuteDrive::on(spec);
    robot.estimate_until("odometry", |it| it.health_of(Input::Odometry) == Health::Ok);

    let before = robot.status_until("a status", |_| true);
    drive.reset();
    let reset = goes_on(&robot, "after the reset", &before, |it| {
        it.can.boot_ups == 1
    });

    drive.produce(true);
    let led = goes_on(&robot, "with another's SYNC", &reset, |_| true);
    drive.produce(false);
    let alone = goes_on(&robot, "without it", &led, |_| true);

    assert_eq!((alone.can.nodes_missing, alone.can.boot_ups), (0, 1));
    drop(drive);
    robot.status_until("the missing node", |it| it.can.nodes_missing == 1);
    robot.end();
}

/// Two more statuses with news of the wheels.
fn goes_on(robot: &Robot, what: &str, before: &Status, also: impl Fn(&Status) -> bool) -> Status {
    let more = |than: &Status| {
        let samples = than.can.samples;
        robot.status_until(what, |it| it.can.samples > samples + 10 && also(it))
    };
    more(&more(before))
}
