//! What is said of a configuration before anything is opened: everything that will be read, and what is unlikely about it.
#![allow(clippy::unwrap_used, reason = "a test")]

use std::io::Write;

use coloc_drivers::can::{Frame, Id, Received, StandardId};
use coloc_drivers::encoder::{Description, FrameReject, OdometryConfig, OdometryDecoder, describe};
use tempfile::NamedTempFile;

const DBC: &str = r#"VERSION ""

BU_: Ecu

BO_ 288 Counts: 8 Ecu
 SG_ Left : 0|16@1+ (1,0) [0|65534] "" Ecu
 SG_ Right : 16|16@1+ (1,0) [0|65534] "" Ecu
 SG_ Toggle : 32|16@1+ (1,0) [0|0] "" Ecu
 SG_ Alive : 48|4@1+ (1,0) [0|0] "" Ecu
 SG_ Sum : 56|8@1+ (1,0) [0|0] "" Ecu

BO_ 290 Speeds: 8 Ecu
 SG_ Left : 0|16@1+ (0.01,0) [0|655.34] "km/h" Ecu
 SG_ Right : 16|16@1+ (0.01,0) [0|655.34] "km/h" Ecu

BO_ 291 Turns: 8 Ecu
 SG_ Left : 7|16@0- (1,0) [0|0] "rpm" Ecu
 SG_ Right : 23|16@0- (1,0) [0|0] "rpm" Ecu

BO_ 292 Narrow: 8 Ecu
 SG_ Left : 0|8@1+ (1,0) [0|0] "" Ecu
 SG_ Right : 8|10@1+ (1,0) [0|0] "ticks" Ecu

BO_ 293 Slow: 8 Ecu
 SG_ Left : 0|10@1+ (1,0) [0|0] "" Ecu
 SG_ Right : 16|10@1+ (1,0) [0|0] "" Ecu

BO_ 0 Zero: 8 Ecu
 SG_ Left : 0|32@1+ (1,0) [0|0] "" Ecu
 SG_ Right : 32|32@1+ (1,0) [0|0] "" Ecu

BO_ 2566844926 Tractor: 8 Ecu
 SG_ Left : 0|16@1- (1,0) [0|0] "" Ecu
 SG_ Right : 16|16@1- (1,0) [0|0] "" Ecu

BO_ 295 Body: 8 Ecu
 SG_ Speed : 0|16@1- (1,0) [0|0] "km/h" Ecu
 SG_ Rate : 16|16@1- (0.01,0) [0|0] "deg/s" Ecu

BO_ 296 Odd: 8 Ecu
 SG_ Left : 0|16@1- (0.001,0) [0|0] "furlong/s" Ecu
 SG_ Right : 16|16@1- (0.002,0) [0|0] "m/s" Ecu
 SG_ Forth : 32|16@1+ (0.001,0) [0|0] "m/s" Ecu
 SG_ Behind : 56|8@1+ (1,0) [0|0] "" Ecu
 SG_ Bare : 40|16@1- (0.001,0) [0|0] "-" Ecu
 SG_ Among : 8|8@1+ (1,0) [0|0] "" Ecu

BO_ 299 Lengths: 8 Ecu
 SG_ Left : 0|32@1- (0.5,0) [0|0] "mm" Ecu
 SG_ Right : 32|32@1- (0.5,0) [0|0] "mm" Ecu

BO_ 300 Angles: 8 Ecu
 SG_ Left : 0|32@1- (0.1,0) [0|0] "deg" Ecu
 SG_ Right : 32|32@1- (0.1,0) [0|0] "deg" Ecu

BO_ 301 Seldom: 8 Ecu
 SG_ Left : 0|16@1- (0.001,0) [0|0] "m/s" Ecu
 SG_ Right : 16|16@1- (0.001,0) [0|0] "m/s" Ecu

BO_ 298 FromOne: 8 Ecu
 SG_ Left : 0|8@1+ (1,0) [1|250] "" Ecu
 SG_ Right : 8|8@1+ (1,0) [1|250] "" Ecu

BO_ 297 Before: 8 Ecu
 SG_ Sum : 0|8@1+ (1,0) [0|0] "" Ecu
 SG_ Left : 8|16@1+ (1,0) [0|0] "" Ecu
 SG_ Right : 24|16@1+ (1,0) [0|0] "" Ecu

BA_DEF_ BO_ "GenMsgCycleTime" INT 0 10000;
BA_DEF_DEF_ "GenMsgCycleTime" 0;
BA_ "GenMsgCycleTime" BO_ 293 100;
BA_ "GenMsgCycleTime" BO_ 290 0;
BA_ "GenMsgCycleTime" BO_ 301 1000;
"#;

/// `head` is what stands before the tables.
fn parse(head: &str, tables: &str) -> (OdometryConfig, NamedTempFile) {
    let mut dbc = NamedTempFile::new().unwrap();
    dbc.write_all(DBC.as_bytes()).unwrap();
    let text = format!(
        "buses = ['socketcan:can0', 'socketcan:can1']\ndbc = '{}'\n{head}\n{tables}",
        dbc.path().display()
    );
    (toml::from_str(&text).unwrap(), dbc)
}

fn understood(head: &str, tables: &str) -> Description {
    let (config, _dbc) = parse(head, tables);
    describe(&config).unwrap()
}

fn refusal(head: &str, tables: &str) -> String {
    let (config, _dbc) = parse(head, tables);
    OdometryDecoder::new(&config).unwrap_err().to_string()
}

fn wheels(message: &str, left: &str, right: &str) -> String {
    let wheel = |side, rest| format!("{{ message = '{message}', signal = '{side}', {rest} }}");
    format!(
        "[wheels]\ntrack_m = 0.5\nleft = {}\nright = {}\n",
        wheel("Left", left),
        wheel("Right", right)
    )
}

fn both(message: &str, wheel: &str) -> String {
    wheels(message, wheel, wheel)
}

/// What is unlikely, but for the second bus, which none of these use.
fn warnings(head: &str, tables: &str) -> Vec<String> {
    let mut warnings = understood(head, tables).warnings;
    warnings.retain(|warning| !warning.starts_with("buses.1: no signal is wanted"));
    warnings
}

const SLOW: &str = "max_speed_mps = 2.0";

#[test]
fn every_part_of_a_counter_is_said() {
    let guard = "[[messages]]\nmessage = 'Counts'\nalive = 'Alive'\nchecksum = 'Sum'\n";
    let tables = both(
        "Counts",
        "wheel_radius_m = 0.05, ticks_per_revolution = 400, reversed = true",
    ) + guard;
    let understood = understood(SLOW, &tables);
    let right = &understood.signals[1];
    assert_eq!(right.setting, "wheels.right");
    assert_eq!(
        right.place,
        "Right of Counts, identifier 0x120 on bus 0: 16 bits from bit 16, Intel (little-endian), unsigned, \
         times 1 plus 0, 0 to 65534"
    );
    assert_eq!(
        right.meaning,
        "cumulative_ticks: one count is 0.785398 mm, a turn of the wheel 400 ticks, 0.314159 m (radius 50 mm), \
         counted backwards when the robot drives forwards; it wraps after 65535 counts, 51.4711 m"
    );
    assert_eq!(
        right.rhythm,
        "a frame every 20 ms (assumed: neither period_s nor GenMsgCycleTime says)"
    );
    assert_eq!(
        right.proof,
        "alive counter Alive, 4 bits; checksum Sum in byte 7, CRC-8 SAE J1850 over identifier and bytes before it"
    );
    assert_eq!(understood.geometry, "two wheels of an axle, 0.5 m apart");
    let expected: Vec<String> = understood
        .expected
        .iter()
        .map(ToString::to_string)
        .collect();
    assert_eq!(expected, ["0x120 (Counts)"]);
    assert_eq!(warnings(SLOW, &tables), Vec::<String>::new());
}

#[test]
fn every_part_of_a_speed_is_said() {
    let turns = understood(
        SLOW,
        &both(
            "Turns",
            "quantity = 'revolutions_per_minute', wheel_radius_m = 0.15, period_s = 0.01",
        ),
    );
    let left = &turns.signals[0];
    assert!(
        left.place.contains(
            "16 bits from bit 7, Motorola (big-endian), signed, times 1 plus 0, no range rpm"
        ),
        "{left:?}"
    );
    assert_eq!(
        left.meaning,
        "revolutions_per_minute: 1 is 0.015708 m/s, a turn of the wheel 0.942478 m (radius 0.15 m)"
    );
    assert_eq!(left.rhythm, "a frame every 10 ms (as configured)");
    assert!(
        left.proof
            .starts_with("no alive counter: a repeated frame counts as a new one; no checksum")
    );
    let body = understood(
        SLOW,
        "[body]\nforward = { message = 'Body', signal = 'Speed', unit = 'kilometres_per_hour' }\n\
         turn = { message = 'Body', signal = 'Rate', unit = 'degrees_per_second', reversed = true }\n",
    );
    let meanings: Vec<&str> = body
        .signals
        .iter()
        .map(|signal| signal.meaning.as_str())
        .collect();
    assert_eq!(
        meanings,
        [
            "kilometres_per_hour: 1 is 0.277778 m/s",
            "degrees_per_second: 1 is 0.0174533 rad/s, counted backwards when the robot drives forwards",
        ]
    );
    assert_eq!(
        body.geometry,
        "velocities of the body: forward and turning; it does not move sideways"
    );
}

#[test]
fn how_often_frames_come_the_dbc_file_may_say() {
    let slow = understood(
        "max_speed_mps = 1.0",
        &both("Slow", "metres_per_tick = 1e-3"),
    );
    assert_eq!(
        slow.signals[0].rhythm,
        "a frame every 100 ms (by GenMsgCycleTime of the DBC file)"
    );
    assert_eq!(slow.expected[0].period_us, 100_000);
    let own = understood(
        "max_speed_mps = 1.0",
        &both("Slow", "metres_per_tick = 1e-3, period_s = 0.05"),
    );
    assert_eq!(own.expected[0].period_us, 50_000);
    let none = understood(SLOW, &both("Speeds", "quantity = 'kilometres_per_hour'"));
    assert_eq!(
        none.expected[0].period_us, 20_000,
        "a cycle time of zero is none"
    );
}

#[test]
fn a_counter_that_is_too_narrow_is_refused_with_the_speed_that_works() {
    for (tables, expected) in [
        (
            both("Narrow", "metres_per_tick = 1e-3"),
            "wheels.left has 256 counts of 1 mm, too few to tell forwards from backwards between frames 20 ms apart and up to 50 \
             ms late: the largest speed that works is 1.828",
        ),
        (
            // The narrower of the two decides, whichever it is.
            wheels(
                "Narrow",
                "metres_per_tick = 1e-3, period_s = 0.02",
                "metres_per_tick = 1e-5, period_s = 0.02",
            ),
            "wheels.right has 1024 counts of 10 µm, too few to tell forwards from backwards between frames 20 ms apart and up to \
             50 ms late: the largest speed that works is 0.07314",
        ),
        (
            both("Slow", "metres_per_tick = 5e-4"),
            "between frames 100 ms apart and up to 50 ms late: the largest speed that works is 1.706",
        ),
        (
            both("Slow", "metres_per_tick = 5e-4, period_s = 0.2"),
            "between frames 200 ms apart and up to 50 ms late: the largest speed that works is 1.023",
        ),
        (
            both("Counts", "metres_per_tick = 0.2"),
            "max_speed_mps: is 2; one count of wheels.left is 0.2 m, farther than such a robot comes between frames 20 ms apart and \
             up to 50 ms late: no step of the counter would be believed",
        ),
    ] {
        let refusal = refusal(SLOW, &tables);
        assert!(
            refusal.contains(expected),
            "{refusal}\nshould say: {expected}"
        );
        if let Some((_, speed)) = refusal.split_once("that works is ") {
            let slower = format!("max_speed_mps = {speed}");
            let (config, _dbc) = parse(&slower, &tables);
            assert!(OdometryDecoder::new(&config).is_ok(), "{slower}");
        }
    }
}

/// Its counts are those of its range, if that has as many.
#[test]
fn a_modulus_goes_with_the_range_that_has_as_many_counts() {
    let tables = both("FromOne", "metres_per_tick = 1e-2, modulus = 250");
    let (config, _dbc) = parse(SLOW, &tables);
    let id = Id::Standard(StandardId::new(298).unwrap());
    let outcome = |counts: [u8; 2]| {
        let mut decoder = OdometryDecoder::new(&config).unwrap();
        decoder.push(&Received {
            frame: Frame::data_frame(id, &counts).unwrap(),
            stamp_ns: 1_000_000_000,
            bus: 0,
        })
    };
    assert_eq!(outcome([1, 250]), Ok(None));
    for beyond in [[0, 5], [5, 251]] {
        assert_eq!(outcome(beyond), Err(FrameReject::OutOfRange));
    }
}

#[test]
fn a_proof_that_proves_nothing_is_refused() {
    let proof =
        |message: &str, rest: &str| format!("[[messages]]\nmessage = '{message}'\n{rest}\n");
    let (ticks, odd) = ("metres_per_tick = 1e-3", "quantity = 'metres_per_second'");
    let both_odd = || both("Odd", odd).replace("'Right'", "'Forth'");
    for (tables, expected) in [
        (
            both("Before", ticks) + &proof("Before", "checksum = 'Sum'"),
            "checksum of message Before: covers the bytes before it, and the signal that it shall guard is not among them",
        ),
        (
            both_odd() + &proof("Odd", "checksum = 'Among'"),
            "checksum of message Odd: is made of bits that it shall guard",
        ),
        (
            both_odd() + &proof("Odd", "checksum = 'Behind'\nalive = 'Behind'"),
            "checksum of message Odd: is made of bits that it shall guard",
        ),
        (
            both("Counts", ticks)
                + &proof("Counts", "alive = 'Alive'")
                + &proof("Counts", "checksum = 'Sum'"),
            "messages: message Counts is there twice: write both into one",
        ),
    ] {
        let refusal = refusal(SLOW, &tables);
        assert!(
            refusal.contains(expected),
            "{refusal}\nshould say: {expected}"
        );
    }
}

fn assert_warns(head: &str, tables: &str, expected: &str) {
    let warnings = warnings(head, tables);
    assert!(
        warnings.iter().any(|warning| warning.starts_with(expected)),
        "{warnings:?}\nshould say: {expected}"
    );
}

#[test]
fn a_unit_that_says_nothing_is_no_reason_to_warn() {
    let bare = both("Odd", "quantity = 'metres_per_second'").replace("'Left'", "'Bare'");
    let warnings = warnings(SLOW, &bare);
    assert!(
        !warnings
            .iter()
            .any(|warning| warning.contains("is not known here")),
        "{warnings:?}"
    );
}

/// Every frame would come later than a speed says anything about: no odometry, and no word.
#[test]
fn a_speed_that_comes_too_seldom_is_refused() {
    let speeds = both("Seldom", "quantity = 'metres_per_second'");
    let refused = refusal(SLOW, &speeds);
    assert!(
        refused.contains("tolerance.longest_rate_s: is 500 ms, and wheels.left comes a frame every 1 s (by GenMsgCycleTime"),
        "{refused}"
    );
    let often = both("Seldom", "quantity = 'metres_per_second', period_s = 0.02");
    assert!(!understood(SLOW, &often).signals.is_empty());
    // What is only assumed refuses nobody.
    let short = format!("{SLOW}\ntolerance.longest_rate_s = 0.01");
    let unsaid = both(
        "Turns",
        "quantity = 'revolutions_per_minute', wheel_radius_m = 0.1",
    );
    assert!(!understood(&short, &unsaid).signals.is_empty());
}

#[test]
fn what_is_as_it_should_be_is_no_reason_to_warn() {
    for (message, wheel) in [
        (
            "Turns",
            "quantity = 'revolutions_per_minute', wheel_radius_m = 0.1",
        ),
        ("Lengths", "metres_per_tick = 0.00102"),
        ("Angles", "ticks_per_revolution = 360, wheel_radius_m = 0.1"),
        ("Angles", "metres_per_tick = 0.002"),
    ] {
        let warnings = warnings(SLOW, &both(message, wheel));
        assert_eq!(warnings, [""; 0], "{message}: {wheel}");
    }
}

#[test]
fn what_the_dbc_file_makes_unlikely_is_said() {
    for (head, tables, expected) in [
        (
            SLOW,
            both("Lengths", "metres_per_tick = 0.01"),
            "wheels.left: one tick is 10 mm, and the DBC file gives the signal in mm: is it 1 mm?",
        ),
        (
            SLOW,
            both(
                "Angles",
                "ticks_per_revolution = 4096, wheel_radius_m = 0.1",
            ),
            "wheels.left.ticks_per_revolution: is 4096, and the DBC file gives the signal in deg, of which a turn has 360: is there a gear between?",
        ),
        (
            SLOW,
            both("Odd", "quantity = 'metres_per_second'"),
            "wheels.left.quantity: the DBC file gives the unit 'furlong/s', which is not known here: is it metres_per_second?",
        ),
        (
            SLOW,
            both("Odd", "quantity = 'metres_per_second'").replace("'Left'", "'Forth'"),
            "wheels.left: the signal has no sign, so it cannot say that the robot moves the other way",
        ),
        (
            SLOW,
            both("Slow", "metres_per_tick = 1e-3, period_s = 0.05"),
            "wheels.left.period_s: is 50 ms, and GenMsgCycleTime of the DBC file 100 ms: which is right?",
        ),
        (
            SLOW,
            both("Odd", "quantity = 'metres_per_second'"),
            "wheels.right: one step of its signal is 2 times as long as one of the left wheel's",
        ),
    ] {
        assert_warns(head, &tables, expected);
    }
}

#[test]
fn what_is_unlikely_is_said() {
    let ticks = "metres_per_tick = 1e-3";
    let alive = "[[messages]]\nmessage = 'Counts'\nalive = 'Toggle'\n";
    let two_buses = both("Counts", ticks).replace("signal = 'Right'", "bus = 1, signal = 'Right'");
    let body = "[body]\nforward = { message = 'Body', signal = 'Speed', unit = 'kilometres_per_hour' }\n\
                turn = { message = 'Body', signal = 'Rate', unit = 'degrees_per_second' }\n";
    for (head, tables, expected) in [
        (
            SLOW,
            both("Counts", ticks) + alive,
            "alive of message Counts: has 16 bits; counters of frames usually have 2 to 8",
        ),
        (
            SLOW,
            both("Speeds", "quantity = 'kilometres_per_hour'"),
            "wheels.left: its range in the DBC file leaves one direction out",
        ),
        (
            SLOW,
            both("Tractor", ticks),
            "message Tractor: its identifier ends in FE, in J1939 the address of nobody",
        ),
        (
            SLOW,
            both("Zero", ticks),
            "message Zero: its identifier is 0",
        ),
        (
            SLOW,
            two_buses,
            "message Counts: its identifier is wanted from bus 0 and from bus 1",
        ),
        (
            SLOW,
            both("Counts", ticks).replace("0.5", "28.7"),
            "wheels.track_m: the wheels are 28.7 m apart: is that the unit?",
        ),
        (
            SLOW,
            both("Counts", "metres_per_tick = 0.05"),
            "wheels.left: one count is 50 mm, which makes 0.8 counts a frame at 2 m/s",
        ),
        (
            SLOW,
            both("Zero", "metres_per_tick = 1e-9"),
            "wheels.left: one count is 0.001 µm, which makes 2e9 counts a second at 2 m/s",
        ),
        (
            SLOW,
            both(
                "Turns",
                "quantity = 'revolutions_per_minute', wheel_radius_m = 6.5",
            ),
            "wheels.left.wheel_radius_m: is 6.5 m",
        ),
        (
            SLOW,
            wheels("Counts", ticks, "metres_per_tick = 1e-2"),
            "wheels.right.metres_per_tick: is 0.01, and that of the left wheel 0.001",
        ),
        (
            SLOW,
            both(
                "Turns",
                "quantity = 'revolutions_per_minute', wheel_radius_m = 0.1, metres_per_tick = 1e-3",
            ),
            "wheels.left.metres_per_tick: says nothing about this quantity, and is not used",
        ),
        (
            "max_speed_mps = 200.0",
            both("Zero", ticks),
            "max_speed_mps: 200 m/s are 720 km/h: is that the unit?",
        ),
        (
            "max_speed_mps = 2.0\nmax_turn_rate_radps = 90.0",
            body.into(),
            "max_turn_rate_radps: 90 rad/s are 14.3239 turns a second: are these degrees?",
        ),
        (
            "max_speed_mps = 0.5",
            body.into(),
            "body.forward: one step of the signal is 0.277778 m/s or rad/s, and the limit 0.5",
        ),
    ] {
        assert_warns(head, &tables, expected);
    }
    let unused = understood(SLOW, &both("Counts", ticks)).warnings;
    assert_eq!(unused, ["buses.1: no signal is wanted from it"]);
}
