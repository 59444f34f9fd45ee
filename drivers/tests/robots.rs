//! Configurations of all kinds of robots: what they make of their frames, and how wrong ones are refused.
#![allow(
    clippy::unwrap_used,
    clippy::float_cmp,
    reason = "a test; the values are exact"
)]

use std::io::Write;

use coloc_drivers::can::{Frame, Id, Received, StandardId};
use coloc_drivers::encoder::{FrameReject, OdometryConfig, OdometryDecoder};
use tempfile::NamedTempFile;

/// Both wheels in message 0x10; wheels and body in messages of their own in 0x20 to 0x22; floats in 0x30.
const DBC: &str = r#"VERSION ""

NS_ :

BS_:

BU_: Ecu

BO_ 16 Axle: 8 Ecu
 SG_ Left : 0|16@1- (1,0) [0|0] "" Ecu
 SG_ Right : 16|16@1- (1,0) [0|0] "" Ecu
 SG_ Narrow : 32|10@1+ (1,0) [0|0] "" Ecu
 SG_ Count : 48|8@1+ (1,0) [0|0] "" Ecu
 SG_ Sum : 56|8@1+ (1,0) [0|0] "" Ecu
 SG_ Crooked : 57|6@1+ (1,0) [0|0] "" Ecu

BO_ 32 Forward: 4 Ecu
 SG_ Speed : 7|16@0- (0.01,0) [0|0] "" Ecu

BO_ 33 Turn: 4 Ecu
 SG_ Rate : 7|16@0- (0.5,0) [0|0] "" Ecu

BO_ 34 Sideways: 4 Ecu
 SG_ Speed : 7|16@0- (0.01,0) [0|0] "" Ecu

BO_ 48 Floats: 8 Ecu
 SG_ Left : 0|32@1- (1,0) [0|0] "" Ecu
 SG_ Right : 32|32@1- (1,0) [0|0] "" Ecu

SIG_VALTYPE_ 48 Left : 1;
SIG_VALTYPE_ 48 Right : 1;
"#;

fn parse(toml: &str) -> (OdometryConfig, NamedTempFile) {
    let mut dbc = NamedTempFile::new().unwrap();
    dbc.write_all(DBC.as_bytes()).unwrap();
    let head = format!(
        "buses = ['socketcan:can0', 'socketcan:can1']\ndbc = '{}'\nmax_speed_mps = 20.0\n",
        dbc.path().display()
    );
    (toml::from_str(&(head + toml)).unwrap(), dbc)
}

fn decoder(toml: &str) -> OdometryDecoder {
    let (config, _dbc) = parse(toml);
    OdometryDecoder::new(&config).unwrap()
}

fn refusal(toml: &str) -> String {
    let (config, _dbc) = parse(toml);
    OdometryDecoder::new(&config).unwrap_err().to_string()
}

fn push(
    decoder: &mut OdometryDecoder,
    bus: u8,
    id: u16,
    data: &[u8],
    ms: i64,
) -> Result<Option<[f64; 3]>, FrameReject> {
    let frame = Frame::data_frame(StandardId::new(id).unwrap(), data).unwrap();
    let sample = decoder.push(&Received {
        frame,
        stamp_ns: ms * 1_000_000,
        bus,
    })?;
    Ok(sample.map(|sample| sample.velocity))
}

/// The velocity after two frames of `Axle`, 100 ms apart.
fn axle(wheel: &str, first: [i16; 2], second: [i16; 2]) -> [f64; 3] {
    let mut decoder = decoder(&both_wheels("Axle", wheel));
    let data = |[left, right]: [i16; 2]| {
        [left.to_le_bytes(), right.to_le_bytes(), [0; 2], [0; 2]].concat()
    };
    assert_eq!(push(&mut decoder, 0, 0x10, &data(first), 0), Ok(None));
    push(&mut decoder, 0, 0x10, &data(second), 100)
        .unwrap()
        .unwrap()
}

fn both_wheels(message: &str, wheel: &str) -> String {
    format!(
        "[wheels]\ntrack_m = 0.5\nleft = {{ message = '{message}', signal = 'Left', {wheel} }}\nright = {{ message = '{message}', signal = 'Right', {wheel} }}\n"
    )
}

fn assert_close(velocity: [f64; 3], expected: [f64; 3]) {
    assert!(
        velocity
            .iter()
            .zip(expected)
            .all(|(v, e)| (v - e).abs() < 1e-9),
        "{velocity:?}, expected {expected:?}"
    );
}

#[test]
fn every_quantity_of_a_wheel() {
    assert_close(
        axle("metres_per_tick = 0.01", [32_760, -5], [-32_766, 5]),
        [1.0, 0.0, 0.0],
    );
    assert_close(
        axle(
            "wheel_radius_m = 0.5, ticks_per_revolution = 100",
            [0, 0],
            [0, 10],
        ),
        [0.5 * PI, 0.0, 2.0 * PI],
    );
    let per_period = "quantity = 'ticks_per_period', metres_per_tick = 0.01, period_s = 0.05";
    assert_close(axle(per_period, [0, 0], [5, 5]), [1.0, 0.0, 0.0]);
    assert_close(
        axle("quantity = 'metres_per_second'", [0, 0], [2, 3]),
        [2.5, 0.0, 2.0],
    );
    assert_close(
        axle("quantity = 'kilometres_per_hour'", [0, 0], [36, 36]),
        [10.0, 0.0, 0.0],
    );
    assert_close(
        axle(
            "quantity = 'radians_per_second', wheel_radius_m = 0.25",
            [0, 0],
            [4, 4],
        ),
        [1.0, 0.0, 0.0],
    );
    assert_close(
        axle(
            "quantity = 'revolutions_per_minute', wheel_radius_m = 0.25",
            [0, 0],
            [60, 60],
        ),
        [0.5 * PI, 0.0, 0.0],
    );
    assert_close(
        axle("metres_per_tick = 0.01, reversed = true", [0, 0], [5, 5]),
        [-0.5, 0.0, 0.0],
    );
}

const PI: f64 = std::f64::consts::PI;

#[test]
fn speeds_as_floats_and_not_a_number() {
    let mut decoder = decoder(&both_wheels("Floats", "quantity = 'metres_per_second'"));
    let data = |left: f32, right: f32| [left.to_le_bytes(), right.to_le_bytes()].concat();
    push(&mut decoder, 0, 0x30, &data(0.0, 0.0), 0).unwrap();
    for garbage in [f32::NAN, f32::INFINITY, -f32::INFINITY, 21.0, f32::MAX] {
        assert_eq!(
            push(&mut decoder, 0, 0x30, &data(1.0, garbage), 20),
            Err(FrameReject::Implausible)
        );
    }
    assert_eq!(
        push(&mut decoder, 0, 0x30, &data(1.0, 2.0), 20),
        Ok(Some([1.5, 0.0, 2.0]))
    );
}

const BODY: &str = "[body]\nforward = { message = 'Forward', signal = 'Speed', unit = 'kilometres_per_hour' }\n\
    turn = { bus = 1, message = 'Turn', signal = 'Rate', unit = 'degrees_per_second', reversed = true }\n\
    sideways = { message = 'Sideways', signal = 'Speed' }\n";

#[test]
fn velocities_of_the_body_from_two_buses() {
    let mut decoder = decoder(BODY);
    let standard = |id| Id::from(StandardId::new(id).unwrap());
    assert_eq!(
        decoder.wanted_ids(0).collect::<Vec<_>>(),
        [standard(0x20), standard(0x22)]
    );
    assert_eq!(decoder.wanted_ids(1).collect::<Vec<_>>(), [standard(0x21)]);
    let word = |value: i16| value.to_be_bytes();
    let mut velocity = None;
    for ms in [0, 20] {
        assert_eq!(push(&mut decoder, 0, 0x20, &word(3600), ms), Ok(None));
        assert_eq!(push(&mut decoder, 0, 0x22, &word(-50), ms), Ok(None));
        velocity = push(&mut decoder, 1, 0x21, &word(-180), ms).unwrap();
    }
    assert_close(velocity.unwrap(), [10.0, -0.5, PI / 2.0]);
}

#[test]
fn a_speed_is_not_applied_to_a_long_silence() {
    let mut decoder = decoder(&both_wheels("Axle", "quantity = 'metres_per_second'"));
    for ms in [0, 20, 2000] {
        let sample = push(&mut decoder, 0, 0x10, &[1, 0, 1, 0, 0, 0, 0, 0], ms).unwrap();
        assert_eq!(sample.is_some(), ms == 20, "at {ms} ms");
    }
    assert_eq!(decoder.counters().gaps, 2, "one for each wheel");
}

#[test]
fn any_message_can_be_guarded() {
    let guard = "[[messages]]\nmessage = 'Axle'\nalive = 'Count'\nchecksum = 'Sum'\n";
    let mut decoder = decoder(&(both_wheels("Axle", "metres_per_tick = 0.01") + guard));
    let guarded = |count: u8| {
        let covered = [0x10, 0x00, 1, 0, 1, 0, 0, 0, count];
        [&covered[2..], &[coloc_drivers::crc::crc8_j1850(covered)]].concat()
    };
    push(&mut decoder, 0, 0x10, &guarded(255), 0).unwrap();
    assert_eq!(
        push(&mut decoder, 0, 0x10, &guarded(0), 20),
        Ok(Some([0.0; 3]))
    );
    assert_eq!(
        push(&mut decoder, 0, 0x10, &guarded(0), 40),
        Err(FrameReject::Repeated)
    );
    assert_eq!(
        push(&mut decoder, 0, 0x10, &[0; 8], 40),
        Err(FrameReject::Checksum)
    );
    assert_eq!(
        push(&mut decoder, 0, 0x10, &guarded(1)[..7], 40),
        Err(FrameReject::Short)
    );
}

#[test]
fn the_documented_example_is_a_configuration() {
    let text = "buses = ['socketcan:can0']\nmax_speed_mps = 2.0\n[wheels]\ntrack_m = 0.287\n\
        left = { message = 'WheelLeft', signal = 'Ticks', metres_per_tick = 1e-4 }\n\
        right = { message = 'WheelRight', signal = 'Ticks', metres_per_tick = 1e-4 }\n";
    let config: OdometryConfig = toml::from_str(text).unwrap();
    let bus = "socketcan:can0".parse().unwrap();
    assert_eq!(config, OdometryConfig::differential(bus, 0.287, 1e-4, 2.0));
    assert!(OdometryDecoder::new(&config).is_ok());
    assert_eq!(
        toml::from_str::<OdometryConfig>(&toml::to_string(&config).unwrap()).unwrap(),
        config
    );
}

#[test]
fn what_is_wrong_is_named_with_what_is_allowed() {
    let wheels = |wheel: &str| both_wheels("Axle", wheel);
    for (toml, expected) in [
        (
            String::new(),
            "wheels: give one of [odometry.wheels], [odometry.four_wheels], [odometry.bicycle]",
        ),
        (
            wheels("metres_per_tick = 0.01") + BODY,
            "body: is there beside [odometry.wheels]: give one of [odometry.wheels]",
        ),
        (
            wheels(""),
            "wheels.left: give metres_per_tick, or wheel_radius_m and ticks_per_revolution",
        ),
        (
            wheels("metres_per_tick = -1.0"),
            "wheels.left.metres_per_tick: is -1; it must be a positive number",
        ),
        (
            wheels("metres_per_tick = 0.01, bus = 2"),
            "wheels.left.bus: there is no bus 2",
        ),
        (
            wheels("quantity = 'radians_per_second'"),
            "wheels.left.wheel_radius_m: is needed",
        ),
        (
            both_wheels("Axel", "metres_per_tick = 1.0"),
            "no message 'Axel'; it has Axle, Forward",
        ),
        (
            both_wheels("Forward", "metres_per_tick = 1.0"),
            "Forward has no signal 'Left'; it has Speed",
        ),
        (
            both_wheels("Floats", "metres_per_tick = 1.0"),
            "must be an integer signal",
        ),
        (
            wheels("metres_per_tick = 1.0")
                + "[[messages]]\nmessage = 'Axle'\nchecksum = 'Crooked'\n",
            "must be 8 bits",
        ),
        (
            wheels("metres_per_tick = 1.0") + "[[messages]]\nmessage = 'Alxe'\n",
            "no message 'Alxe'",
        ),
    ] {
        let refusal = refusal(&toml);
        assert!(
            refusal.contains(expected),
            "{refusal}\nshould say: {expected}"
        );
    }
}

#[test]
fn an_unknown_setting_is_refused() {
    let text = "buses = ['socketcan:can0']\nmax_speed_mps = 2.0\ntrack = 1.0\n";
    let refusal = toml::from_str::<OdometryConfig>(text)
        .unwrap_err()
        .to_string();
    assert!(refusal.contains("unknown field `track`"), "{refusal}");
}

/// Signals as DBC files of the field have them: ranges that leave out codes, counters that wrap early, units.
const FIELD_DBC: &str = r#"VERSION ""

BU_: Ecu

BO_ 288 Counts: 8 Ecu
 SG_ Left : 0|16@1+ (1,0) [0|65534] "" Ecu
 SG_ Right : 16|16@1+ (1,0) [0|65534] "" Ecu
 SG_ Again : 24|16@1+ (1,0) [0|0] "" Ecu
 SG_ Toggle : 32|16@1+ (1,0) [0|0] "" Ecu

BO_ 289 Pulses: 8 Ecu
 SG_ Left : 0|8@1+ (1,0) [0|250] "" Ecu
 SG_ Right : 8|8@1+ (1,0) [0|250] "" Ecu

BO_ 290 Speeds: 8 Ecu
 SG_ Left : 0|16@1+ (0.01,0) [0|655.34] "km/h" Ecu
 SG_ Right : 16|16@1+ (0.01,0) [0|655.34] "km/h" Ecu

BO_ 291 Turns: 8 Ecu
 SG_ Left : 0|16@1- (1,0) [0|0] "rpm" Ecu
 SG_ Right : 16|16@1- (1,0) [0|0] "rpm" Ecu

BO_ 292 Wide: 8 Ecu
 SG_ Left : 0|8@1+ (1,0) [0|255] "" Ecu
 SG_ Right : 8|8@1+ (1,0) [0|255] "" Ecu
 SG_ Count : 16|48@1+ (1,0) [0|0] "" Ecu

BO_ 2566844926 Tractor: 8 Ecu
 SG_ Left : 0|16@1- (1,0) [0|0] "" Ecu
 SG_ Right : 16|16@1- (1,0) [0|0] "" Ecu

BO_ 419365120 Unmarked: 8 Ecu
 SG_ Left : 0|16@1- (1,0) [0|0] "" Ecu
 SG_ Right : 16|16@1- (1,0) [0|0] "" Ecu
"#;

fn field(toml: &str) -> (OdometryConfig, NamedTempFile) {
    let (mut config, _) = parse(toml);
    let mut dbc = NamedTempFile::new().unwrap();
    dbc.write_all(FIELD_DBC.as_bytes()).unwrap();
    config.dbc = Some(dbc.path().to_owned());
    config.max_speed_mps = 2.0;
    (config, dbc)
}

fn field_decoder(toml: &str) -> OdometryDecoder {
    let (config, _dbc) = field(toml);
    OdometryDecoder::new(&config).unwrap()
}

fn counts(
    decoder: &mut OdometryDecoder,
    id: u16,
    [left, right]: [u16; 2],
    ms: i64,
) -> Result<Option<[f64; 3]>, FrameReject> {
    let data = [left.to_le_bytes(), right.to_le_bytes(), [0; 2], [0; 2]].concat();
    push(decoder, 0, id, &data, ms)
}

#[test]
fn a_code_for_not_available_is_no_count_and_costs_no_way() {
    let mut decoder = field_decoder(&both_wheels("Counts", "metres_per_tick = 1e-3"));
    let mut way_m = 0.0;
    let mut end_ms = 0;
    for frame in 0..300_u16 {
        let ms = 20 * i64::from(frame);
        let value = if (100..200).contains(&frame) {
            65_535
        } else {
            20 * frame
        };
        match counts(&mut decoder, 0x120, [value, value], ms) {
            Ok(Some([v, ..])) => {
                #[expect(clippy::cast_precision_loss, reason = "small")]
                let dt_s = (ms - end_ms) as f64 * 1e-3;
                (way_m, end_ms) = (way_m + v * dt_s, ms);
            }
            outcome => assert_eq!(
                outcome,
                if value == 65_535 {
                    Err(FrameReject::OutOfRange)
                } else {
                    Ok(None)
                }
            ),
        }
    }
    assert!((way_m - 0.02 * 299.0).abs() < 1e-9, "{way_m}");
    assert_eq!(decoder.counters().of(FrameReject::OutOfRange), 100);
}

#[test]
fn a_speed_outside_of_its_range_is_none() {
    let mut decoder = field_decoder(&both_wheels("Speeds", "quantity = 'kilometres_per_hour'"));
    counts(&mut decoder, 0x122, [360, 360], 0).unwrap();
    assert_eq!(
        counts(&mut decoder, 0x122, [65_535, 360], 20),
        Err(FrameReject::OutOfRange)
    );
    assert_close(
        counts(&mut decoder, 0x122, [360, 360], 40)
            .unwrap()
            .unwrap(),
        [1.0, 0.0, 0.0],
    );
}

#[test]
fn a_counter_that_wraps_early_drives_straight() {
    let wheel = "metres_per_tick = 5e-3, modulus = 251";
    let mut decoder = field_decoder(&both_wheels("Pulses", wheel));
    for frame in 0..2000_u32 {
        let raw = |start: u32| u8::try_from((start + 4 * frame) % 251).unwrap();
        let data = [raw(0), raw(125), 0, 0, 0, 0, 0, 0];
        let sample = push(&mut decoder, 0, 0x121, &data, 20 * i64::from(frame)).unwrap();
        if frame > 0 {
            assert_close(sample.unwrap(), [1.0, 0.0, 0.0]);
        }
    }
    assert_eq!(
        push(&mut decoder, 0, 0x121, &[251, 0, 0, 0, 0, 0, 0, 0], 40_000),
        Err(FrameReject::OutOfRange)
    );
}

#[test]
fn what_the_dbc_file_of_the_field_leaves_open_is_asked() {
    let ticks = "metres_per_tick = 1e-3";
    for (toml, expected) in [
        (
            both_wheels("Pulses", ticks),
            "wheels.left.modulus: give how many different counts the 8 bits of signal Left have: 251 if they wrap after 250, as its range in the DBC file may mean, 256 if",
        ),
        (
            both_wheels("Pulses", "metres_per_tick = 1e-3, modulus = 257"),
            "modulus: is 257; the signal's 8 bits have 2 to 256",
        ),
        (
            both_wheels("Speeds", "quantity = 'kilometres_per_hour', modulus = 9"),
            "modulus: is for cumulative_ticks only",
        ),
        (
            both_wheels("Turns", ticks),
            "wheels.left.quantity: is cumulative_ticks, but the DBC file gives signal Left of message Turns the unit 'rpm'",
        ),
        (
            both_wheels("Speeds", "quantity = 'metres_per_second'"),
            "the unit 'km/h'",
        ),
        (
            both_wheels("Counts", ticks).replace("'Right'", "'Left'"),
            "wheels.right: signal Left of message Counts is made of the same bits as that of wheels.left",
        ),
        (
            both_wheels("Counts", ticks).replace("'Left'", "'Again'"),
            "wheels.right: signal Right of message Counts is made of the same bits",
        ),
        (
            both_wheels("Wide", ticks),
            "max_speed_mps: is 2; wheels.left has 256 counts of 1 mm, too few to tell forwards from backwards between frames 20 ms apart and up to 50 ms late: the largest speed that works is 1.828",
        ),
        (
            both_wheels("Wide", "metres_per_tick = 0.005")
                + "[[messages]]\nmessage = 'Wide'\nalive = 'Count'\n",
            "alive of message Wide: must be an integer of at most 32 bits",
        ),
        (
            both_wheels("Counts", ticks) + "[[messages]]\nmessage = 'Counts'\nalive = 'Left'\n",
            "alive of message Counts: is made of the same bits",
        ),
        (
            both_wheels("Unmarked", ticks),
            "message Unmarked in line 32 of the DBC file has the identifier 419365120 (0x18FF0100), which is wider than 11 bits and not marked as extended: an extended identifier is written with bit 31 set, here 2566848768",
        ),
    ] {
        let (config, _dbc) = field(&toml);
        let refusal = OdometryDecoder::new(&config).unwrap_err().to_string();
        assert!(
            refusal.contains(expected),
            "{refusal}\nshould say: {expected}"
        );
    }
}
