//! `colocd check`: what it says of a file, and how it ends.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

use std::path::Path;
use std::process::{Command, Output};

use tempfile::TempDir;

const ROBOT: &str = "[robot]\nname = \"robot1\"\nid = 1\n[shm]\nroot = \"/tmp/coloc-check\"\n";

const WHEELS: &str = "\
[odometry]
buses = [\"socketcan:can0\"]
max_speed_mps = 2.0
[odometry.wheels]
track_m = 0.287
left = { message = \"WheelLeft\", signal = \"Ticks\", metres_per_tick = 1e-4 }
right = { message = \"WheelRight\", signal = \"Ticks\", metres_per_tick = 1e-4 }
";

/// `{left}` and `{right}` are wheels.
const OWN_DBC: &str = "VERSION \"\"\nBU_: A\n
BO_ 288 Wheels: 8 A
 SG_ Left : 0|16@1+ (1,0) [0|0] \"{unit}\" A
 SG_ Right : 16|16@1+ (1,0) [0|0] \"{unit}\" A
 SG_ Alive : 32|16@1+ (1,0) [0|0] \"\" A
";

const OWN_WHEELS: &str = "\
[odometry]
buses = [\"socketcan:can0\"]
dbc = \"robot.dbc\"
max_speed_mps = 2.0
[odometry.wheels]
track_m = 0.287
left = { message = \"Wheels\", signal = \"Left\", metres_per_tick = 1e-3 }
right = { message = \"Wheels\", signal = \"Right\", metres_per_tick = 1e-3 }
";

struct Site(TempDir);

impl Site {
    fn new(config: &str) -> Self {
        Self::with_dbc(config, "")
    }

    fn with_dbc(config: &str, unit: &str) -> Self {
        let directory = tempfile::tempdir().unwrap();
        let write =
            |name: &str, text: &str| std::fs::write(directory.path().join(name), text).unwrap();
        write("robot.toml", config);
        write("robot.dbc", &OWN_DBC.replace("{unit}", unit));
        Self(directory)
    }

    fn check(&self, more: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_colocd-in-daemon-tests"));
        command
            .current_dir(self.0.path())
            .arg("check")
            .arg("robot.toml");
        command.args(more).output().unwrap()
    }
}

fn text(bytes: Vec<u8>) -> String {
    String::from_utf8(bytes).unwrap()
}

/// What it says of `config`, which it accepts.
fn understood(config: &str) -> String {
    let output = Site::new(config).check(&[]);
    let said = text(output.stdout);
    assert!(output.status.success(), "{said}{}", text(output.stderr));
    said
}

/// The lines of a subject, joined.
fn of<'t>(said: &'t str, subject: &str) -> String {
    let mut lines = said
        .lines()
        .skip_while(|line| !line.starts_with(&format!("{subject} ")));
    let first = lines.next().unwrap_or_default();
    let rest = lines.take_while(|line: &&'t str| line.starts_with(' '));
    let text = |line: &str| line.get(13..).unwrap_or_default().trim().to_owned();
    std::iter::once(first)
        .chain(rest)
        .map(text)
        .collect::<Vec<_>>()
        .join("; ")
}

/// What is said of a robot with two wheels and two in its team, by its subject.
const UNDERSTOOD: &[(&str, &str)] = &[
    ("robot", "robot1 (number 1), 2 in the team"),
    ("team", "this one, robot2 (number 2)"),
    ("clock", "realtime: CLOCK_REALTIME"),
    ("tick", "50 Hz, every 20 ms"),
    ("tick", "started by auto: A frame's arrival where"),
    (
        "start",
        "x 0 m ± 0.1 m, y 0 m ± 0.1 m, heading 0 rad ± 0.05 rad, which are 0° ± 2.86479°",
    ),
    (
        "bus 0",
        "socketcan:can0, from which is wanted 0x100 (WheelLeft), 0x101 (WheelRight)",
    ),
    ("bus 0", "the kernel is asked to keep their frames of 60 s"),
    ("dbc", "none: the messages are coloc's own"),
    (
        "wheels.right",
        "Ticks of WheelRight, identifier 0x101 on bus 0: 32 bits from bit 0, Intel (little-endian), unsigned, times 1 plus 0",
    ),
    (
        "wheels.right",
        "cumulative_ticks: one count is 0.1 mm; it wraps after 4294967296 counts, 429.497 km",
    ),
    ("wheels.left", "a frame every 20 ms (assumed"),
    (
        "wheels.left",
        "alive counter Alive, 4 bits; checksum Checksum in byte 5, CRC-8 SAE J1850",
    ),
    ("geometry", "two wheels of an axle, 0.287 m apart"),
    ("limits", "2 m/s: what is faster is garbage"),
    ("noise", "differential: Two driven wheels"),
    (
        "noise",
        "forward σ = 0.0141421 m/s at 0 m/s, 0.200499 m/s at 2 m/s, σ² growing by 0.005 for each rad/s; \
         sideways σ = 0.0141421 m/s at 0 m/s, 0.100995 m/s at 2 m/s, σ² growing by 0.005 for each rad/s; \
         turning σ = 0.0479583 rad/s at 0 m/s, 0.0479583 rad/s at 2 m/s, σ² growing by 0.02 for each rad/s",
    ),
    (
        "noise",
        "after 100 m straight at 1 m/s, the heading known at the start: ± 0.24 m along, ± 3.9 m across, heading ± 3.9°",
    ),
    (
        "noise",
        "after an hour of standing: heading ± 0.95°, ± 0.033 m along, ± 0.033 m across",
    ),
    (
        "stands by",
        "meanwhile it may creep by 0.1 m, 0.1 m sideways, 2.9° in an hour and be within 3 σ",
    ),
    (
        "no samples",
        "the last velocity is held for 200 ms, its variance growing by 0.5 of itself every 20 ms",
    ),
    (
        "no samples",
        "σ = 2.25278 m/s forward, 2.25278 m/s sideways, 0.587367 rad/s turning",
    ),
    (
        "fusion",
        "the weight minimises trace: The trace of the covariance",
    ),
    (
        "gates",
        "a neighbour's pose is accepted up to d² = 11.3449, 3.36821 σ",
    ),
    ("gates", "a fix is accepted up to d² = 9.21034, 3.03485 σ"),
    (
        "floors",
        "none: every source is believed to be as good as it says",
    ),
    (
        "history",
        "1024 measurements; older than 1 s is too old, more than 100 ms ahead of the clock is from the future",
    ),
    ("health", "odometry after 100 ms"),
    (
        "realtime",
        "fifo: SCHED_FIFO: the tick runs whenever it is due, priority 80",
    ),
    (
        "realtime",
        "processors: any; memory locked; stack 256 KiB; goes on with a warning where it is refused",
    ),
    ("shm", "/tmp/coloc-check, prefix coloc"),
    ("log", "standard error, from level info"),
    ("watchdog", "after 10 ticks"),
    (
        "not set",
        "initial.resume: every start is at initial.pose, nothing is saved; telemetry.record: nothing is recorded",
    ),
];

#[test]
fn it_says_everything_that_it_understood() {
    let said = understood(&format!(
        "{ROBOT}[[team]]\nname = \"robot2\"\nid = 2\n{WHEELS}"
    ));
    for (subject, expected) in UNDERSTOOD {
        let part = of(&said, subject);
        assert!(
            part.contains(expected),
            "{subject}: {part}\nshould say: {expected}\n{said}"
        );
    }
    assert_eq!(warnings(&said), Vec::<&str>::new());
}

#[test]
fn what_is_configured_otherwise_is_said_otherwise() {
    let said = understood(&format!(
        "{ROBOT}[initial]\nresume = true\n[telemetry]\nlog_file = \"log\"\nstate_file = \"/var/state\"\n\
         [fusion]\nposition_gate = inf\nposition_floor = [0.02, 0.03]\n[realtime]\nscheduler = \"other\"\ncpus = [2, 3]\n"
    ));
    let site = |name: &str| format!("/{name}, from level");
    for (subject, expected) in [
        ("team", "nobody else: it hears and sees no other robot"),
        (
            "wheels",
            "none: no [odometry]; fixes and neighbours alone tell where the robot is",
        ),
        ("start", "or the saved belief, if it is not older than 60 s"),
        ("log", &site("log")),
        ("state", "/var/state, saved 1 times a second"),
        ("gates", "a fix is accepted however far off"),
        (
            "floors",
            "fixes are never believed to be better than σ = 20 mm, 30 mm",
        ),
        ("realtime", "processors: 2, 3"),
        (
            "not set",
            "[odometry]: no wheels are heard; [[team]]: no other robot is heard or told anything",
        ),
    ] {
        let part = of(&said, subject);
        assert!(
            part.contains(expected),
            "{subject}: {part}\nshould say: {expected}\n{said}"
        );
    }
}

#[test]
fn what_sees_in_part_is_said_with_what_its_sigmas_mean() {
    let landmark = |number: u8, sigma_m: f64| {
        format!("[[landmark]]\nnumber = {number}\nposition = [1.0, 2.0]\nsigma_m = {sigma_m}\n")
    };
    let heard = "[sighting]\nheard = true\nmount = [0.1, 0.0, 1.5707963267948966]\n";
    let said = understood(&format!(
        "{ROBOT}{heard}{}{}[fusion]\nrelative_pose_floor = [0.02, 0.03, 0.0]\n",
        landmark(6, 0.01),
        landmark(7, 1.5)
    ));
    for (subject, expected) in [
        (
            "sightings",
            "range and bearing, or one of them, on the channel sighting",
        ),
        (
            "sightings",
            "10 cm ahead, 0 m to the left, turned 90° to the left",
        ),
        (
            "sightings",
            "white, new in every sighting, and slow, the same for seconds",
        ),
        (
            "sightings",
            "a bearing of σ 0.01 rad (0.572958°) is ± 5 cm at 5 m, a range of σ 1 % ± 5 cm",
        ),
        ("sightings", "more certain than ± 2 cm ahead, ± 3 cm across"),
        ("sightings", "memory of 300 ms"),
        ("landmarks", "2, known to ± 1 cm to ± 1.5 m (σ)"),
        ("landmarks", "that error never changes"),
    ] {
        let part = of(&said, subject);
        assert!(
            part.contains(expected),
            "{subject}: {part}\nshould say: {expected}\n{said}"
        );
    }
    let none = understood(&format!("{ROBOT}{heard}"));
    assert!(of(&none, "landmarks").contains("only robots are seen"));
    assert!(of(&understood(ROBOT), "sightings").is_empty());
}

#[test]
fn a_base_is_said_with_what_it_may_say() {
    let base = "[robot]\nname = \"a\"\nid = 1\n[odometry]\nmax_speed_mps = 2.0\n[odometry.base]\n";
    let said = understood(base);
    let page = of(&said, "base");
    for expected in ["coloc/a/odometry", "velocities", "as certain as it says"] {
        assert!(page.contains(expected), "{page}");
    }
    assert!(!page.contains("wheels"), "it cannot know them: {page}");
    let said = understood(&format!(
        "{base}track_m = 0.3\nmetres_per_count = [1e-4, 2e-4]\nfloor = [0.1, 0.2, 0.3]\n"
    ));
    let page = of(&said, "base");
    for expected in [
        "distances of two wheels, 0.3 m apart",
        "0.1 mm each on the left, 0.2 mm on the right",
        "0.3 rad/s turning",
    ] {
        assert!(page.contains(expected), "{page}");
    }
}

#[test]
fn a_base_in_unlikely_units_is_warned_of() {
    let base = "[robot]\nname = \"a\"\nid = 1\n[odometry]\nmax_speed_mps = 900.0\nmax_turn_rate_radps = 570.0\n\
                [odometry.base]\ntrack_m = 28.7\n";
    let said = understood(base);
    let found = warnings(&said);
    for expected in ["max_speed_mps", "max_turn_rate_radps", "base.track_m"] {
        let own = |warning: &&str| warning.contains(&format!("odometry.{expected}: "));
        assert!(found.iter().any(own), "{expected}: {said}");
    }
}

#[test]
fn nothing_is_opened_or_made() {
    let site = Site::new(&format!(
        "[robot]\nname = \"a\"\nid = 1\n[shm]\nroot = \"{{at}}/shm\"\n[telemetry]\nlog_file = \"log\"\nrecord = \"rec\"\n\
         [odometry]\nbuses = [\"local:bus\"]\n{}",
        WHEELS.split_once("can0\"]\n").unwrap().1
    ).replace("{at}", "/tmp/coloc-check-nothing"));
    assert!(site.check(&[]).status.success());
    let there = |name: &str| site.0.path().join(name).exists();
    assert!(
        !there("bus")
            && !there("log")
            && !there("rec")
            && !Path::new("/tmp/coloc-check-nothing").exists()
    );
}

/// Changes of a good file that nobody means, the line that is to be named, and what is said there.
const UNLIKELY: &[(&str, &str, &str)] = &[
    (
        "",
        "[health]\nfit_heading_rad = 5.0",
        "robot.toml:14: health.fit_heading_rad = 5: is half a turn or more",
    ),
    (
        "",
        "[health]\nfit_position_m = 0.0005",
        "robot.toml:14: health.fit_position_m = 0.0005: is less than a millimetre",
    ),
    (
        "",
        "[motion]\ncreep_per_hour = [0.1, 0.1, 2.9]",
        "robot.toml:14: motion.creep_per_hour = [0.1, 0.1, 2.9]: is more than 10 m or 0.5 rad",
    ),
    (
        "id = 1",
        "id = 0",
        "robot.toml:3: robot.id = 0: is also what a message says whose sender has set no number",
    ),
    (
        "track_m = 0.287",
        "track_m = 28.7",
        "robot.toml:10: odometry.wheels.track_m: the wheels are 28.7 m apart: is that the unit?",
    ),
    (
        "1e-4 }\nright",
        "0.1 }\nright",
        "robot.toml:11: odometry.wheels.left: one count is 0.1 m, which makes 0.4 counts a frame at 2 m/s",
    ),
    (
        "1e-4 }\nright",
        "1e-10 }\nright",
        "robot.toml:11: odometry.wheels.left: one count is 0.0001 µm, which makes 2e10 counts a second",
    ),
    (
        "max_speed_mps = 2.0",
        "max_speed_mps = 200.0",
        "robot.toml:8: odometry.max_speed_mps: 200 m/s are 720 km/h",
    ),
    (
        "[\"socketcan:can0\"]",
        "[\"socketcan:can0\", \"socketcan:can1\"]",
        "robot.toml:7: odometry.buses.1: no signal is wanted from it",
    ),
    (
        "",
        "[initial]\npose = [0, 0, 90]",
        "robot.toml:14: initial.pose = [0, 0, 90]: a heading of 90 rad is 14.3239 turns: are these degrees? 90° are 1.5708 rad",
    ),
    (
        "",
        "[initial]\npose = [3e7, 0, 0]",
        "robot.toml:14: initial.pose = [30000000, 0, 0]: is farther from the origin than any place on Earth",
    ),
    (
        "",
        "[initial]\nsigma = [0.1, 0, 0.1]",
        "robot.toml:14: initial.sigma = [0.1, 0, 0.1]: zero says that the robot starts exactly there",
    ),
    (
        "",
        "[initial]\nsigma = [1, 1, 10]",
        "robot.toml:14: initial.sigma = [1, 1, 10]: 10 rad are more than a turn: are these degrees?",
    ),
    (
        "",
        "[motion]\nforward = { a = 0, b = 0, c = 0 }",
        "robot.toml:14: motion.forward: has no noise at all: the robot never becomes less certain along its way",
    ),
    (
        "",
        "[motion]\nturning = { a = 0 }",
        "robot.toml:14: motion.turning: has no noise at all: the robot never becomes less certain in its heading",
    ),
    (
        "",
        "[motion]\nforward = { a = 1e5 }",
        "robot.toml:14: motion.forward: makes σ = 316.228 m/s of a speed of 2 m/s",
    ),
    (
        "",
        "[motion]\noutage_variance = [0, 1, 1]",
        "robot.toml:14: motion.outage_variance = [0, 1, 1]: zero says that a robot without odometry stands still exactly",
    ),
    (
        "",
        "[motion]\nhold_s = 0.02",
        "robot.toml:14: motion.hold_s = 0.02: is less than two frames take, 40 ms",
    ),
    (
        "",
        "[motion]\nhold_s = 60",
        "robot.toml:14: motion.hold_s = 60: for so long a robot whose encoders fall silent",
    ),
    (
        "",
        "[initial]\nresume = true\nresume_max_age_s = 0",
        "robot.toml:15: initial.resume_max_age_s = 0: no saved belief is so young",
    ),
    (
        "",
        "[fusion]\nposition_floor = [0.1, 500]",
        "robot.toml:14: fusion.position_floor.1 = 500: no such input is taken for more certain than 500 m",
    ),
    (
        "",
        "[fusion]\nneighbour_gate = inf",
        "robot.toml:14: fusion.neighbour_gate = inf: accepts everything",
    ),
    (
        "",
        "[fusion]\nposition_gate = 0.5",
        "robot.toml:14: fusion.position_gate = 0.5: refuses more than half of all honest inputs",
    ),
    (
        "",
        "[fusion]\nposition_gate = 400",
        "robot.toml:14: fusion.position_gate = 400: accepts what is 20 σ off",
    ),
    (
        "",
        "[fusion]\npaper = true\ndamping = 0.7",
        "robot.toml:14: fusion.paper = true: overrides",
    ),
    (
        "",
        "[fusion]\nneighbour_floor = [0.1, 0.1, 10]",
        "robot.toml:14: fusion.neighbour_floor.2 = 10: 10 rad are more than a turn",
    ),
    (
        "",
        "[history]\nlength_s = 0.03",
        "robot.toml:14: history.length_s = 0.03: is less than two ticks' periods at 50 Hz",
    ),
    (
        "",
        "[history]\nfuture_tolerance_s = 0",
        "robot.toml:14: history.future_tolerance_s = 0: rejects the word of a sender",
    ),
    (
        "",
        "[health]\nodometry_stale_s = 0.01",
        "robot.toml:14: health.odometry_stale_s = 0.01: is less than the time between two frames, 20 ms",
    ),
    (
        "",
        "[health]\nposition_stale_s = 0.01",
        "robot.toml:14: health.position_stale_s = 0.01: is less than a tick's period, 20 ms",
    ),
    (
        "",
        "[realtime]\npriority = 99",
        "robot.toml:14: realtime.priority = 99: is the priority of the kernel's own watchdogs",
    ),
    (
        "",
        "[telemetry]\nrecord = \"nowhere/rec\"",
        "robot.toml:14: telemetry.record = \"",
    ),
    (
        "",
        "[telemetry]\nlog_file = \"/usr\"",
        "robot.toml:14: telemetry.log_file = \"/usr\": that is a directory: name a file in it",
    ),
    (
        "socketcan:can0",
        "candump:nowhere.log",
        "robot.toml:7: odometry.buses.0 = \"candump:",
    ),
];

fn warnings(said: &str) -> Vec<&str> {
    let warnings = said.lines().filter_map(|line| line.strip_prefix("warning"));
    warnings.map(str::trim).collect()
}

#[test]
fn what_is_unlikely_is_said_on_its_line_and_refused_by_strict() {
    for (from, to, expected) in UNLIKELY {
        let good = format!("{ROBOT}{WHEELS}");
        let config = if from.is_empty() {
            good + to + "\n"
        } else {
            good.replacen(from, to, 1)
        };
        let site = Site::new(&config);
        let output = site.check(&[]);
        let said = text(output.stdout);
        assert_eq!(
            output.status.code(),
            Some(0),
            "{config}{}",
            text(output.stderr)
        );
        let found = warnings(&said);
        assert!(
            found.iter().any(|warning| warning.starts_with(expected)),
            "{found:?}\nshould say: {expected}"
        );
        let strict = site.check(&["--strict"]);
        assert_eq!(strict.status.code(), Some(1), "{config}");
        assert_eq!(warnings(&text(strict.stdout)), found);
        let reason = text(strict.stderr);
        assert!(
            reason.starts_with(
                "colocd: with --strict nothing may be unlikely, and there are warnings: "
            ),
            "{reason}"
        );
    }
}

#[test]
fn frames_that_are_to_start_ticks_and_come_over_no_bus_are_missed() {
    let site = Site::new(&format!("{ROBOT}[tick]\ntrigger = \"encoder\"\n"));
    let said = text(site.check(&[]).stdout);
    let expected = "robot.toml:7: tick.trigger = \"encoder\": no frame can start a tick";
    let found = warnings(&said);
    assert!(found[0].starts_with(expected), "{found:?}");
}

#[test]
fn a_file_in_another_encoding_is_said_to_be_one() {
    let site = Site::new("");
    let latin = b"[robot]\nname = \"k\xfcche\"\nid = 1\n";
    std::fs::write(site.0.path().join("robot.toml"), latin).unwrap();
    let output = site.check(&[]);
    let said = text(output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(
        said.contains("it is no text in UTF-8; save it as UTF-8"),
        "{said}"
    );
}

#[test]
fn the_defaults_and_the_documented_files_are_likely() {
    let documented =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/robot.toml")).unwrap();
    for config in [format!("{ROBOT}{WHEELS}"), ROBOT.to_owned(), documented] {
        let output = Site::new(&config).check(&["--strict"]);
        assert_eq!(output.status.code(), Some(0), "{}", text(output.stdout));
    }
}

#[test]
fn what_the_dbc_file_makes_unlikely_is_found_by_the_messages_name() {
    let alive = "[[odometry.messages]]\nmessage = \"Wheels\"\nalive = \"Alive\"\n";
    let output = Site::new(&format!("{ROBOT}{OWN_WHEELS}{alive}")).check(&[]);
    let said = text(output.stdout);
    assert_eq!(
        warnings(&said),
        [
            "robot.toml:15: odometry: alive of message Wheels: has 16 bits; counters of frames usually have 2 to 8: is it one?"
        ]
    );
}

#[test]
fn what_cannot_be_is_refused() {
    let good = format!("{ROBOT}{OWN_WHEELS}");
    for (unit, from, to, expected) in [
        (
            "rpm",
            "",
            "",
            "robot.toml:12: odometry.wheels.left.quantity: is cumulative_ticks, but the DBC file gives signal Left of message Wheels the unit 'rpm'",
        ),
        (
            "",
            "\"Right\"",
            "\"Left\"",
            "robot.toml:13: odometry.wheels.right: signal Left of message Wheels is made of the same bits as that of wheels.left",
        ),
        (
            "",
            "track_m = 0.287",
            "track_m = 287",
            "robot.toml:11: odometry.wheels.track_m = 287: must be a number above 0, at most 100 m",
        ),
        (
            "",
            "metres_per_tick = 1e-3 }\nright",
            "wheel_radius_m = 50, ticks_per_revolution = 9 }\nright",
            "robot.toml:12: odometry.wheels.left.wheel_radius_m = 50: must be a number above 0, at most 10 m",
        ),
        (
            "",
            "max_speed_mps = 2.0",
            "max_speed_mps = 0",
            "robot.toml:9: odometry.max_speed_mps = 0: must be a number above 0, at most 1000 m/s",
        ),
        (
            "",
            "max_speed_mps = 2.0",
            "max_speed_mps = 500.0",
            "robot.toml:9: odometry.max_speed_mps: is 500; wheels.left has 65536 counts of 1 mm",
        ),
        (
            "",
            "[\"socketcan:can0\"]",
            "[\"socketcan:can0\", \"socketcan:can0\"]",
            "robot.toml:7: odometry.buses.1 = \"socketcan:can0\": is listed twice",
        ),
    ] {
        let config = if from.is_empty() {
            good.clone()
        } else {
            good.replacen(from, to, 1)
        };
        let output = Site::with_dbc(&config, unit).check(&[]);
        let said = text(output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(expected), "{said}\nshould say: {expected}");
    }
}

#[test]
fn it_says_who_else_may_read() {
    let own = rustix::process::getegid().as_raw();
    let said = understood(&format!("{ROBOT}group = \"{own}\"\n"));
    let shm = of(&said, "shm");
    assert!(
        shm.contains("can be read by the users of the group") && shm.contains(&own.to_string()),
        "{said}"
    );
    assert!(!said.contains("shm.group"), "{said}");
    let said = understood(&format!("{ROBOT}group = \"no-such-group\"\n"));
    let warning = "warning       shm.group: a robot of this user could not start: there is no group `no-such-group` on \
                   this computer: make it (groupadd no-such-group), or name another one";
    assert!(said.lines().any(|line| line == warning), "{said}");
}

#[test]
fn a_running_daemon_logs_what_is_unlikely() {
    // It does not start: the bus is a log that is not there. The log has the warnings all the same.
    let site = Site::new(&format!(
        "{ROBOT}{}",
        WHEELS.replace("socketcan:can0", "candump:nowhere.log")
    ));
    let mut command = Command::new(env!("CARGO_BIN_EXE_colocd-in-daemon-tests"));
    let root = site.0.path().join("shm");
    let config = std::fs::read_to_string(site.0.path().join("robot.toml")).unwrap();
    let config = config.replace("/tmp/coloc-check", root.to_str().unwrap());
    std::fs::write(site.0.path().join("robot.toml"), config).unwrap();
    let output = command
        .current_dir(site.0.path())
        .args(["run", "robot.toml"])
        .output()
        .unwrap();
    let said = text(output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(
        said.contains("WARN robot.toml:7: odometry.buses.0 = \"candump:"),
        "{said}"
    );
}
