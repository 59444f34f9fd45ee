//! A wrong configuration is refused with file, line, value and what is allowed.

use std::path::Path;

use coloc_daemon::config::Config;

const MINIMAL: &str = "[robot]\nname = \"robot1\"\nid = 1\n";

fn refusal(text: &str) -> String {
    Config::parse(text, Path::new("robot.toml"))
        .expect_err("must be refused")
        .to_string()
}

/// The minimal configuration with `lines` from line 4 on.
fn refusal_of(lines: &str) -> String {
    refusal(&format!("{MINIMAL}{lines}\n"))
}

const WHEELS: &str = r#"
[odometry]
buses = ["socketcan:can0"]
max_speed_mps = 2.0
[odometry.wheels]
track_m = 0.3
left = { message = "WheelLeft", signal = "Ticks", metres_per_tick = 1e-4 }
right = { message = "WheelRight", signal = "Ticks", metres_per_tick = 1e-4 }
"#;

#[test]
fn the_documented_example_is_the_defaults() {
    let example = Config::load(Path::new(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/robot.toml"
    )))
    .expect("the example parses");
    let defaults = Config::parse(&format!("{MINIMAL}{WHEELS}"), Path::new("minimal"))
        .expect("the minimum parses");
    assert_eq!(example, defaults);
}

#[test]
fn no_output_is_a_file_that_is_read_or_lies_where_only_coloc_may_write() {
    for (lines, said) in [
        (
            "[telemetry]\nlog_file = \"x/../robot.toml\"",
            "telemetry.log_file = \"/etc/robot.toml\": is the file of this configuration too",
        ),
        (
            "[telemetry]\nlog_file = \"x/../same\"\nrecord = \"./same\"",
            "telemetry.record = \"/etc/same\": is the file of telemetry.log_file too",
        ),
        (
            "[shm]\nroot = \"/srv/coloc\"\n[telemetry]\nrecord = \"/srv/coloc/record\"",
            "lies in the shared-memory root, where no file may be but coloc's own",
        ),
    ] {
        let text = format!("{MINIMAL}{lines}\n");
        let refused = Config::parse(&text, Path::new("/etc/robot.toml")).unwrap_err();
        assert!(refused.to_string().contains(said), "{refused}");
    }
}

#[test]
fn a_root_that_cannot_be_is_refused_with_the_reason() {
    for root in ["/tmp/ü", "/a\\nb", "/a\\u0000b"] {
        let text = format!("{MINIMAL}[shm]\nroot = \"{root}\"\n");
        let refused = Config::parse(&text, Path::new("robot.toml")).unwrap_err();
        let said = refused.to_string();
        let right = "must be at most 100 bytes long, of ASCII characters alone";
        assert!(said.contains(right) && said.lines().count() == 1, "{said}");
    }
}

#[test]
fn a_file_without_an_end_is_no_configuration() {
    for endless in ["/dev/zero", "/dev/full"] {
        let refused = Config::load(Path::new(endless)).unwrap_err();
        assert!(
            refused.to_string().contains("is it the right file?"),
            "{refused}"
        );
    }
    let line = format!("[robot]\nname = \"a\" {}", "x".repeat(20_000));
    let refused = Config::parse(&line, Path::new("robot.toml")).unwrap_err();
    assert!(refused.to_string().len() < 500);
}

#[test]
fn what_is_serialized_is_read_as_the_same() {
    let text =
        format!("{MINIMAL}[fusion]\nposition_gate = inf\n[[team]]\nname = \"b\"\nid = 2\n{WHEELS}");
    let config = Config::parse(&text, Path::new("/etc/robot.toml")).unwrap();
    let written = toml::to_string(&config).unwrap();
    assert_eq!(
        Config::parse(&written, Path::new("/elsewhere/robot.toml")).unwrap(),
        config
    );
    let minimal = Config::parse(MINIMAL, Path::new("robot.toml")).unwrap();
    assert_eq!(Config::of(minimal.robot.clone()), minimal);
}

#[test]
fn polling_is_refused_for_a_real_time_class() {
    let said = refusal_of("[tick]\nwait = \"poll\"");
    assert!(
        said.contains("robot.toml:5") && said.contains("realtime.scheduler"),
        "{said}"
    );
    let polling = format!("{MINIMAL}[tick]\nwait = \"poll\"\n[realtime]\nscheduler = \"other\"\n");
    assert!(Config::parse(&polling, Path::new("robot.toml")).is_ok());
}

#[test]
fn wheels_that_make_no_sense_name_their_line() {
    let said = refusal(&format!(
        "{MINIMAL}{}",
        WHEELS.replace("track_m = 0.3", "track_m = -0.3")
    ));
    assert_eq!(
        said,
        "robot.toml:9: odometry.wheels.track_m = -0.3: must be a number above 0, at most 100 m"
    );
    let said = refusal(&format!(
        "{MINIMAL}{}",
        WHEELS.replace("socketcan:can0", "usb:can0")
    ));
    assert!(
        said.starts_with("robot.toml:6: odometry.buses: ")
            && said.contains("usb:can0")
            && said.contains("socketcan:INTERFACE"),
        "{said}"
    );
    let said = refusal(&format!(
        "{MINIMAL}{}",
        WHEELS.replace("\"WheelLeft\"", "\"Wheel\"")
    ));
    assert!(
        said.starts_with("robot.toml:10: odometry: ")
            && said.contains("'Wheel'")
            && said.contains("WheelLeft"),
        "{said}"
    );
}

#[test]
fn a_name_that_cannot_be_a_service_is_refused() {
    let said = refusal("[robot]\nname = \"my robot\"\nid = 1\n");
    assert!(
        said.starts_with("robot.toml:2: ") && said.contains("my robot"),
        "{said}"
    );
}

#[test]
fn a_value_out_of_range_names_line_value_and_range() {
    assert_eq!(
        refusal_of("[tick]\nrate_hz = 5000"),
        "robot.toml:5: tick.rate_hz = 5000: must be a number, 1 to 1000 Hz"
    );
    assert_eq!(
        refusal_of("[realtime]\n\npriority = 100"),
        "robot.toml:6: realtime.priority = 100: must be a whole number, 1 to 99"
    );
    assert_eq!(
        refusal_of("[initial]\nsigma = [0.1,\n  -0.5,\n 1.0]"),
        "robot.toml:6: initial.sigma.1 = -0.5: must be a number, 0 to 1e6"
    );
    assert_eq!(
        refusal_of("[motion]\nforward = { b = nan }"),
        "robot.toml:5: motion.forward.b = nan: must be a number, 0 to 1e6"
    );
    assert_eq!(
        refusal_of("[shm]\nroot = \"here\""),
        "robot.toml:5: shm.root = \"here\": must be an absolute path, as \"/run/coloc\" is"
    );
    assert_eq!(
        refusal_of("[shm]\nprefix = \"a-b\""),
        "robot.toml:5: shm.prefix = \"a-b\": must have letters, digits and `_` only"
    );
    assert_eq!(
        refusal_of("[fusion]\ndamping = 0"),
        "robot.toml:5: fusion.damping = 0: must be a number above 0, at most 1"
    );
    assert_eq!(
        refusal_of("[fusion]\nposition_gate = 0.0"),
        "robot.toml:5: fusion.position_gate = 0.0: must be a number above 0"
    );
}

#[test]
fn the_limits_themselves_are_allowed() {
    let allowed = "[tick]\nrate_hz = 1000\n[fusion]\ndamping = 1\nneighbour_gate = inf\n\
                   [realtime]\npriority = 99\ncpus = [0, 1023]\n[history]\nlength_s = 0.2775\ncapacity = 555";
    assert!(Config::parse(&format!("{MINIMAL}{allowed}"), Path::new("robot.toml")).is_ok());
}

#[test]
fn a_value_of_the_wrong_kind_is_refused_in_a_persons_words() {
    assert_eq!(
        refusal("[robot]\nname = \"robot1\"\nid = \"one\""),
        "robot.toml:3: robot.id = \"one\": must be a whole number, 0 to 65535"
    );
    assert_eq!(
        refusal_of("[tick]\nrate_hz = \"fast\""),
        "robot.toml:5: tick.rate_hz = \"fast\": must be a number, 1 to 1000 Hz"
    );
    assert_eq!(
        refusal_of("[realtime]\npriority = 80.5\nlock_memory = 1"),
        "robot.toml:5: realtime.priority = 80.5: must be a whole number, 1 to 99\n\
         robot.toml:6: realtime.lock_memory = 1: must be true or false"
    );
    assert_eq!(
        refusal_of("[initial]\npose = [0, 0]"),
        "robot.toml:5: initial.pose = [0, 0]: must be a list of 3, each a number, -1e9 to 1e9 [m, m, rad], or \"unknown\""
    );
    assert_eq!(
        refusal_of("[tick]\ntrigger = \"sometimes\""),
        "robot.toml:5: tick.trigger = \"sometimes\": must be \"auto\", \"timer\" or \"encoder\""
    );
}

#[test]
fn a_setting_in_the_wrong_section_is_told_its_own() {
    assert_eq!(
        refusal_of("[clock]\nrate_hz = 50"),
        "robot.toml:5: rate_hz belongs in [tick], [gyro] or [rounds]"
    );
    assert_eq!(
        refusal_of("rate_hz = 50"),
        "robot.toml:4: rate_hz belongs in [tick], [gyro] or [rounds]"
    );
    assert_eq!(
        refusal_of("[wheels]\ntrack_m = 0.3"),
        "robot.toml:4: wheels belongs in [odometry] or [odometry.omni]"
    );
}

#[test]
fn a_setting_that_is_none_is_told_the_nearest() {
    assert_eq!(
        refusal_of("[tick]\nrate = 50"),
        "robot.toml:5: [tick] has no rate; did you mean rate_hz?"
    );
    assert_eq!(
        refusal_of("[realtme]\npriority = 50"),
        "robot.toml:4: the file has no realtme; did you mean realtime?"
    );
    assert_eq!(
        refusal_of("[tick]\nsnooze = 50"),
        "robot.toml:5: [tick] has no snooze; it has rate_hz, trigger, wait"
    );
    assert_eq!(
        refusal_of("[[team]]\nname = \"b\"\nid = 2\n\n[[team]]\nname = \"c\"\nid = 3\ncolour = 1"),
        "robot.toml:11: [[team]] has no colour; it has name, id"
    );
}

#[test]
fn what_must_be_written_is_shown() {
    assert_eq!(
        refusal("[tick]\nrate_hz = 50\n"),
        "robot.toml: the file lacks robot; write, for example:\n    [robot]\n    name = \"robot1\"\n    id = 1"
    );
    assert_eq!(
        refusal("[robot]\nname = \"robot1\"\n"),
        "robot.toml:1: [robot] lacks id; write, for example:\n    id = 1"
    );
    assert_eq!(
        refusal_of(&WHEELS.replace("right = ", "# ")),
        "robot.toml:8: [odometry.wheels] lacks right; write, for example:\n    \
         right = { message = \"WheelRight\", signal = \"Ticks\", metres_per_tick = 0.0001 }"
    );
}

#[test]
fn everything_that_is_wrong_is_said_at_once() {
    assert_eq!(
        refusal_of("[tick]\nrate_hz = 0\ntriger = \"timer\"\n[health]\nodometry_stale_s = 0"),
        "robot.toml:5: tick.rate_hz = 0: must be a number, 1 to 1000 Hz\n\
         robot.toml:6: [tick] has no triger; did you mean trigger?\n\
         robot.toml:8: health.odometry_stale_s = 0: must be a number, 0.001 to 60 s"
    );
}

#[test]
fn the_team_must_agree_with_the_robot_and_with_itself() {
    let member = |name: &str, id: u16| format!("[[team]]\nname = \"{name}\"\nid = {id}\n");
    let twice = refusal_of(&(member("b", 2) + &member("c", 2)));
    assert_eq!(
        twice,
        "robot.toml:9: team.1.id = 2: is already the number of `b`; numbers must differ"
    );
    let taken = refusal_of(&member("b", 1));
    assert_eq!(
        taken,
        "robot.toml:6: team.0.id = 1: is the number of this robot, `robot1`"
    );
    let other = refusal_of(&member("robot1", 7));
    assert_eq!(
        other,
        "robot.toml:6: team.0.id = 7: this robot is number 1 in [robot]"
    );
}

#[test]
fn a_default_that_no_longer_fits_names_the_setting_that_made_it_so() {
    let refusal = refusal_of("[history]\n\nlength_s = 40");
    assert_eq!(
        refusal,
        "robot.toml:6: history.capacity = 1024: must be 4000 or more, two places for every tick of history.length_s"
    );
}

#[test]
fn a_history_that_a_tick_cannot_go_through_in_time_is_refused() {
    assert_eq!(
        refusal_of("[history]\ncapacity = 200_000"),
        "robot.toml:5: history.capacity = 200_000: must be a whole number, 64 to 4096"
    );
    assert_eq!(
        refusal_of("[tick]\nrate_hz = 200\n[history]\ncapacity = 3000"),
        "robot.toml:7: history.capacity = 3000: must be 2777 or less, for a tick to apply all of them again in a quarter of \
         its period"
    );
    assert_eq!(
        refusal_of("[history]\nlength_s = 60"),
        "robot.toml:5: history.length_s = 60: must be 40.96 s or less at 50 Hz: a tick can apply 4096 measurements again in a \
         quarter of its period, and there are two places for each"
    );
}

#[test]
fn a_history_without_length_is_refused() {
    assert_eq!(
        refusal_of("[history]\nlength_s = 0"),
        "robot.toml:5: history.length_s = 0: must be a number above 0, at most 60 s"
    );
    assert_eq!(
        refusal_of("[history]\nlength_s = 0.01"),
        "robot.toml:5: history.length_s = 0.01: must be 0.02 s or more at 50 Hz, a tick's period: what came right after the last \
         tick would be rejected as too old"
    );
}

#[test]
fn noise_that_computes_to_none_or_to_infinity_is_refused() {
    for (setting, value) in [
        ("[motion]\nforward.b", "1e308"),
        ("[motion]\nturning.c", "inf"),
        ("[motion]\nhold_growth", "1e308"),
        ("[motion]\noutage_variance", "[1.0, 1.0, 1e308]"),
        ("[initial]\nsigma", "[1e308, 1.0, 1.0]"),
        ("[fusion]\nposition_floor", "[1e308, 1.0]"),
    ] {
        let said = refusal_of(&format!("{setting} = {value}"));
        assert!(said.starts_with("robot.toml:5: "), "{said}");
        assert!(said.contains(": must be a number, 0 to 1"), "{said}");
    }
    assert_eq!(
        refusal_of("[motion]\noutage_variance = [1.0, 1e-300, 1.0]"),
        "robot.toml:5: motion.outage_variance.1 = 1e-300: must be 0, or 1e-18 or more: less is lost in rounding"
    );
    assert_eq!(
        refusal_of("[initial]\nsigma = [0.1, 1e-10, 0.1]"),
        "robot.toml:5: initial.sigma.1 = 1e-10: must be 0, or 1e-9 or more: less is lost in rounding"
    );
}

#[test]
fn a_team_for_which_there_are_no_ports_is_refused() {
    let member = |id: u16| format!("[[team]]\nname = \"r{id}\"\nid = {id}\n");
    let team = |last: u16| (2..=last).map(member).collect::<String>();
    assert_eq!(
        refusal_of(&team(66)),
        "robot.toml:4: team: has 65 other robots, and there is room for 64: list those only that this robot can see or hear"
    );
    assert!(Config::parse(&format!("{MINIMAL}{}", team(65)), Path::new("robot.toml")).is_ok());
}

#[test]
fn two_things_in_one_place_are_refused() {
    assert_eq!(
        refusal_of("[telemetry]\nlog_file = \"/tmp/x\"\nrecord = \"/tmp/x\""),
        "robot.toml:6: telemetry.record = \"/tmp/x\": is the file of telemetry.log_file too"
    );
    let twice = WHEELS.replace(
        "\"socketcan:can0\"",
        "\"socketcan:can0\", \"socketcan:can0\"",
    );
    assert_eq!(
        refusal(&format!("{MINIMAL}{twice}")),
        "robot.toml:6: odometry.buses.1 = \"socketcan:can0\": is listed twice; frames of one bus are heard once"
    );
}

#[test]
fn what_is_no_toml_names_its_line_and_shows_it() {
    let said = |lines: &str| refusal_of(lines);
    assert_eq!(
        said("[tick\nrate_hz = 50"),
        "robot.toml:4: not TOML: unclosed table, expected `]`: [tick"
    );
    assert_eq!(
        said("[tick]\ntrigger = timer"),
        "robot.toml:5: not TOML: a text stands in quotes: trigger = timer"
    );
    assert_eq!(
        said("[tick]\nrate_hz = 50\nrate_hz = 60"),
        "robot.toml:6: rate_hz is written twice; keep one: rate_hz = 60"
    );
    assert_eq!(
        said("[tick]\nrate_hz = 50\n[tick]\nwait = \"sleep\""),
        "robot.toml:6: tick is written twice; keep one: [tick]"
    );
}

#[test]
fn an_unreadable_file_is_named() {
    let error = Config::load(Path::new("/nonexistent/robot.toml"))
        .expect_err("there is none")
        .to_string();
    assert!(
        error.starts_with("/nonexistent/robot.toml: cannot be read: "),
        "{error}"
    );
}
