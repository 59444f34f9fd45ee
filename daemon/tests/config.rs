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
fn polling_is_refused_for_a_real_time_class() {
    let said = refusal_of("[tick]\nwait = \"poll\"");
    assert!(
        said.contains("robot.toml:5") && said.contains("realtime.scheduler"),
        "{said}"
    );
    let polling = format!("{MINIMAL}[tick]\nwait = \"poll\"\n[realtime]\nscheduler = \"other\"\n");
    assert!(Config::parse(&polling, Path::new("robot.toml")).is_ok());
}

/// A key that the example leaves out would be a default that nobody can look up.
#[test]
fn the_documented_example_has_every_key() {
    let example = include_str!("../robot.toml");
    let sections = include_str!("../src/config/sections.rs");
    let keys = sections
        .lines()
        .filter_map(|line| line.strip_prefix("    pub ")?.split_once(':'))
        .map(|(key, _)| key);
    let missing: Vec<_> = keys
        .filter(|key| !example.contains(&format!("{key} =")))
        .collect();
    assert!(missing.is_empty(), "{missing:?}");
}

#[test]
fn wheels_that_make_no_sense_name_their_line() {
    let said = refusal(&format!(
        "{MINIMAL}{}",
        WHEELS.replace("track_m = 0.3", "track_m = -0.3")
    ));
    assert!(
        said.starts_with("robot.toml:9: odometry.wheels.track_m"),
        "{said}"
    );
    let said = refusal(&format!(
        "{MINIMAL}{}",
        WHEELS.replace("socketcan:can0", "usb:can0")
    ));
    assert!(
        said.starts_with("robot.toml:6: ")
            && said.contains("usb:can0")
            && said.contains("socketcan:INTERFACE"),
        "{said}"
    );
    let said = refusal(&format!(
        "{MINIMAL}{}",
        WHEELS.replace("\"WheelLeft\"", "\"Wheel\"")
    ));
    assert!(
        said.contains("'Wheel'") && said.contains("WheelLeft"),
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
        "robot.toml:5: tick.rate_hz = 5000: must be in 1..=1000"
    );
    assert_eq!(
        refusal_of("[realtime]\n\npriority = 100"),
        "robot.toml:6: realtime.priority = 100: must be in 1..=99"
    );
    assert_eq!(
        refusal_of("[initial]\nsigma = [0.1,\n  -0.5,\n 1.0]"),
        "robot.toml:6: initial.sigma.1 = -0.5: must be in 0..=1000000"
    );
    assert_eq!(
        refusal_of("[motion]\nforward = { b = nan }"),
        "robot.toml:5: motion.forward.b = NaN: must be a finite number, 0 or more"
    );
    assert_eq!(
        refusal_of("[shm]\nroot = \"here\""),
        "robot.toml:5: shm.root = here: must be an absolute path"
    );
    assert_eq!(
        refusal_of("[fusion]\ndamping = 0"),
        "robot.toml:5: fusion.damping = 0: must be above 0 and at most 1"
    );
}

#[test]
fn an_unknown_key_names_its_line_and_the_known_ones() {
    let refusal = refusal_of("[tick]\nrate = 50");
    assert!(refusal.starts_with("robot.toml:5: "), "{refusal}");
    assert!(
        refusal.contains("`rate`") && refusal.contains("rate_hz"),
        "{refusal}"
    );
}

#[test]
fn an_unknown_word_names_its_line_and_the_allowed_words() {
    let refusal = refusal_of("[tick]\ntrigger = \"sometimes\"");
    assert!(refusal.starts_with("robot.toml:5: "), "{refusal}");
    assert!(
        ["sometimes", "timer", "encoder"]
            .iter()
            .all(|word| refusal.contains(word)),
        "{refusal}"
    );
}

#[test]
fn a_wrong_type_names_its_line_and_value() {
    let refusal = refusal_of("[tick]\nrate_hz = \"fast\"");
    assert!(
        refusal.starts_with("robot.toml:5: ") && refusal.contains("fast"),
        "{refusal}"
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
fn a_default_that_no_longer_fits_names_the_section_that_made_it_so() {
    let refusal = refusal_of("[history]\nlength_s = 60");
    assert_eq!(
        refusal,
        "robot.toml:4: history.capacity = 1024: must be in 6000..=1048576: two places for every tick of history.length_s"
    );
}

#[test]
fn broken_toml_names_its_line() {
    assert!(refusal_of("[tick\nrate_hz = 50").starts_with("robot.toml:4: "));
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
