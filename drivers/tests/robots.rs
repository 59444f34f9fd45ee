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
        (String::new(), "either [wheels] or [body]"),
        (
            wheels("metres_per_tick = 0.01") + BODY,
            "either [wheels] or [body]",
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
