//! A recorded car's CAN bus, played at its real speed by `canplayer`: the daemon's speed against the car's reference.

use std::path::{Path, PathBuf};
use std::process::{Child, Command};

use coloc_drivers::can::{Filter, Id, StandardId};

use super::robot::Robot;
use super::support::{Interface, frames};

/// When the log's first `WHEEL_SPEEDS` frame was recorded \[s\].
const FIRST_WHEEL_SPEEDS_S: f64 = 1_533_226_488.439_005;
const WHEEL_SPEEDS: u16 = 0x0AA;
/// Of 50 s and more; the log is a minute long.
const LEAST_ESTIMATES: usize = 2500;

/// `COLOC_DATA`, or `../shared/data` from here or any directory above.
fn recording() -> Option<PathBuf> {
    let given = std::env::var_os("COLOC_DATA").map(PathBuf::from);
    let above = Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .map(|directory| directory.join("shared/data"));
    let mut found = given
        .into_iter()
        .chain(above)
        .map(|data| data.join("rav4_can"));
    found.find(|data| data.is_dir())
}

fn configuration(data: &Path, bus: &str, root: &Path) -> String {
    let wheel = |name| {
        format!(
            "{{ message = \"WHEEL_SPEEDS\", signal = \"WHEEL_SPEED_{name}\", quantity = \"kilometres_per_hour\" }}"
        )
    };
    format!(
        "[robot]\nname = \"robot1\"\nid = 1\n\
         [shm]\nroot = \"{}\"\nprefix = \"can\"\n\
         [odometry]\nbuses = [\"{bus}\"]\nmax_speed_mps = 70.0\ndbc = \"{}\"\n\
         [odometry.wheels]\ntrack_m = 1.56\nleft = {}\nright = {}\n\
         [realtime]\nscheduler = \"other\"\nlock_memory = false\n",
        root.display(),
        data.join("toyota_2017.dbc").display(),
        wheel("RL"),
        wheel("RR"),
    )
}

fn play(data: &Path) -> Child {
    let player = Command::new("sh")
        .args(["-c", "zcat \"$0\" | canplayer vcan0=can0 vcan1=can1"])
        .arg(data.join("candump.log.gz"))
        .spawn();
    player.expect("a shell; canplayer is of the package can-utils")
}

/// The reference's times \[s\] and speeds \[m/s\].
fn reference(data: &Path) -> Vec<(f64, f64)> {
    let unpacked = Command::new("zcat")
        .arg(data.join("pose.csv.gz"))
        .output()
        .unwrap();
    let text = String::from_utf8(unpacked.stdout).unwrap();
    let row = |line: &str| {
        let row: Vec<f64> = line
            .split(',')
            .map(|number| number.parse().unwrap())
            .collect();
        (row[0], row[8].hypot(row[9]).hypot(row[10]))
    };
    text.lines().skip(1).map(row).collect()
}

/// The speed at `time_s`, between the two entries around it.
fn speed_at(reference: &[(f64, f64)], time_s: f64) -> Option<f64> {
    let after = reference.partition_point(|entry| entry.0 <= time_s);
    let ((t0, v0), (t1, v1)) = (
        *reference.get(after.checked_sub(1)?)?,
        *reference.get(after)?,
    );
    Some(v0 + (v1 - v0) * (time_s - t0) / (t1 - t0))
}

#[test]
fn a_recorded_car_at_real_speed_has_the_speed_of_its_reference() {
    let Some(data) = recording() else {
        eprintln!("SKIPPED: no recorded car; set COLOC_DATA to the directory that holds rav4_can");
        return;
    };
    let interface = Interface::new("vcan0");
    let robot = Robot::configured(|root| configuration(&data, &interface.spec(), root));
    let id = Id::from(StandardId::new(WHEEL_SPEEDS).unwrap());
    let mut witness = interface.bus(Filter::ids([id]));
    let mut player = play(&data);
    let first_ns = frames(&mut witness, 1)[0].stamp_ns;

    let reference = reference(&data);
    let mut errors_mps = Vec::new();
    while player.try_wait().unwrap().is_none() {
        std::thread::sleep(std::time::Duration::from_millis(50));
        for estimate in robot.estimates() {
            #[expect(clippy::cast_precision_loss, reason = "a minute")]
            let played_s = (estimate.frame_stamp_ns - first_ns) as f64 * 1e-9;
            if let Some(speed) = speed_at(&reference, FIRST_WHEEL_SPEEDS_S + played_s) {
                errors_mps.push(estimate.velocity[0] / speed - 1.0);
            }
        }
    }
    errors_mps.sort_by(f64::total_cmp);
    let count = errors_mps.len();
    assert!(count >= LEAST_ESTIMATES, "{count} estimates");
    let [low, median, high] =
        [count / 100, count / 2, count - 1 - count / 100].map(|place| errors_mps[place]);
    eprintln!(
        "speed against the reference: median {:+.2} %, 1 % below {:+.2} %, 1 % above {:+.2} %",
        100.0 * median,
        100.0 * low,
        100.0 * high
    );
    // These wheels are 0.8 % short of the reference.
    assert!((median + 0.008).abs() < 0.004, "median {median}");
    assert!(
        low > -0.05 && high < 0.05,
        "1 % below {low}, 1 % above {high}"
    );
    robot.end();
}
