//! Bases with more than two wheels, and cars: what is understood of them, what is refused, and what they say of standing and slip.
#![allow(clippy::unwrap_used, reason = "a test")]

use std::io::Write;

use coloc_drivers::can::{Frame, Received, StandardId};
use coloc_drivers::encoder::{
    FrameReject, OdometryConfig, OdometryDecoder, Rest, WheelOdometry, describe, warnings,
};
use tempfile::NamedTempFile;

const DBC: &str = r#"VERSION ""

NS_ :

BS_:

BU_: Ecu

BO_ 16 Wheels: 8 Ecu
 SG_ A : 0|16@1- (1,0) [0|0] "" Ecu
 SG_ B : 16|16@1- (1,0) [0|0] "" Ecu
 SG_ C : 32|16@1- (1,0) [0|0] "" Ecu
 SG_ D : 48|16@1- (1,0) [0|0] "" Ecu

BO_ 17 Steering: 2 Ecu
 SG_ Angle : 0|16@1- (0.1,0) [0|0] "deg" Ecu
"#;

fn parse(tables: &str) -> (OdometryConfig, NamedTempFile) {
    let mut dbc = NamedTempFile::new().unwrap();
    dbc.write_all(DBC.as_bytes()).unwrap();
    let head = format!(
        "buses = ['socketcan:can0']\ndbc = '{}'\nmax_speed_mps = 2.0\n",
        dbc.path().display()
    );
    (toml::from_str(&(head + tables)).unwrap(), dbc)
}

fn wheel(signal: char) -> String {
    format!("{{ message = 'Wheels', signal = '{signal}', metres_per_tick = 0.001 }}")
}

fn corners() -> String {
    let [a, b, c, d] = ['A', 'B', 'C', 'D'].map(wheel);
    format!("front_left = {a}\nfront_right = {b}\nrear_left = {c}\nrear_right = {d}\n")
}

fn four() -> String {
    format!(
        "[four_wheels]\ntrack_m = 0.5\nturning_scale = 0.5\n{}",
        corners()
    )
}

fn mecanum() -> String {
    format!(
        "[mecanum]\nhalf_length_m = 0.25\nhalf_width_m = 0.2\n{}",
        corners()
    )
}

fn bicycle(more: &str, steering: &str) -> String {
    format!(
        "[bicycle]\nwheel_base_m = 1.0\n{more}wheel = {}\n\
         steering = {{ message = 'Steering', signal = 'Angle', unit = 'degrees', {steering} }}\n",
        wheel('A')
    )
}

fn omni(wheels: &[(f64, char)]) -> String {
    let one = |&(angle, signal): &(f64, char)| {
        let wheel = wheel(signal);
        format!("[[omni.wheels]]\nangle_deg = {angle:?}\ndistance_m = 0.2\nwheel = {wheel}\n")
    };
    format!("[omni]\n{}", wheels.iter().map(one).collect::<String>())
}

const THREE: [(f64, char); 3] = [(60.0, 'A'), (180.0, 'B'), (300.0, 'C')];

#[test]
fn what_is_understood_is_said() {
    let slips = "m/s and 10 % of the fastest wheel's speed";
    for (tables, expected) in [
        (
            four(),
            format!("two wheels on each side, 0.5 m apart, which turn 0.5 of what they say, as if they were 1 m apart; they slip where the two of a side differ by more than 0.05 {slips}"),
        ),
        (
            mecanum(),
            format!("four mecanum wheels, 0.5 m from the front to the rear axle and 0.4 m from left to right; they slip where one is off by more than 0.05 {slips}"),
        ),
        (
            bicycle("lateral_m = 0.4\n", "ratio = 15.0"),
            "a steered car, 1 m from axle to axle, its speed measured 0.4 m left of the middle of the rear axle".into(),
        ),
        (
            omni(&THREE),
            "3 omni wheels, 60° at 0.2 m, 180° at 0.2 m, 300° at 0.2 m; three say no more than there is to say, so slip is not seen".into(),
        ),
    ] {
        let (config, _dbc) = parse(&tables);
        let said = describe(&config).unwrap();
        assert_eq!((said.geometry, said.warnings), (expected, vec![]));
    }
    let (config, _dbc) = parse(&bicycle("", "straight = 3, ratio = 15, reversed = true"));
    assert_eq!(
        describe(&config).unwrap().signals[1].meaning,
        "degrees: 3 is straight on, and one more turns the road wheels by 0.00116355 rad to the right; 0.8 rad at most, σ of a \
         frame 0 rad"
    );
}

#[test]
fn what_is_wrong_is_refused_in_words() {
    let beside = (60.0, 'D');
    for (tables, expected) in [
        (
            four() + &mecanum(),
            "mecanum: is there beside [odometry.four_wheels]: give one of [odometry.wheels]",
        ),
        (
            omni(&THREE[..2]),
            "omni.wheels: are 2; three or four omni wheels are needed",
        ),
        (
            omni(&[THREE[0], beside, (240.0, 'B')]),
            "omni.wheels: so placed they leave a direction open",
        ),
        (
            bicycle("lateral_m = 1.5\n", ""),
            "bicycle.lateral_m: is 1.5 m: steered by 0.8 rad the robot would turn about a point beside that wheel",
        ),
        (
            mecanum().replace("signal = 'B'", "signal = 'A'"),
            "mecanum.front_right: signal A of message Wheels is made of the same bits as that of mecanum.front_left",
        ),
    ] {
        let (config, _dbc) = parse(&tables);
        let said = OdometryDecoder::new(&config).unwrap_err().to_string();
        assert!(said.contains(expected), "{said}");
    }
    let (config, _dbc) = parse(&bicycle("", "").replace("degrees", "radians"));
    let said = OdometryDecoder::new(&config).unwrap_err().to_string();
    assert!(said.contains("bicycle.steering.unit: is radians"), "{said}");
}

#[test]
fn what_is_unlikely_is_asked() {
    for (tables, expected) in [
        (
            four().replace("= 0.5\nfront", "= 1.9\nfront"),
            "four_wheels.turning_scale: is 1.9: the robot turns so much of what its wheels say",
        ),
        (
            mecanum().replace("0.25", "25"),
            "mecanum.half_length_m: is 25 m: is that the unit?",
        ),
        (
            bicycle("", "ratio = 150.0"),
            "bicycle.steering.ratio: is 150: a steering wheel turns about 15 times as far",
        ),
        (
            mecanum().replace(
                "'D', metres_per_tick = 0.001",
                "'D', metres_per_tick = 0.002",
            ),
            "mecanum.rear_right.metres_per_tick: is 0.002, and that of the front left wheel 0.001",
        ),
    ] {
        let (config, _dbc) = parse(&tables);
        let said = warnings(&config).unwrap();
        assert!(said.iter().any(|it| it.starts_with(expected)), "{said:?}");
    }
}

/// What comes of a frame of each message every 20 ms.
struct Base {
    decoder: OdometryDecoder,
    ms: i64,
}

impl Base {
    fn new(tables: &str) -> Self {
        let (config, _dbc) = parse(tables);
        let decoder = OdometryDecoder::new(&config).unwrap();
        Self { decoder, ms: 0 }
    }

    fn push(&mut self, id: u16, words: &[i16]) -> Result<Option<WheelOdometry>, FrameReject> {
        let data: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        let frame = Frame::data_frame(StandardId::new(id).unwrap(), &data).unwrap();
        self.decoder.push(&Received {
            frame,
            stamp_ns: self.ms * 1_000_000,
            bus: 0,
        })
    }

    fn step(&mut self, counts: [i16; 4], angle: i16) -> Result<Option<WheelOdometry>, FrameReject> {
        self.ms += 20;
        self.push(0x11, &[angle])?;
        self.push(0x10, &counts)
    }
}

#[test]
fn a_car_whose_wheels_stand_stands_however_it_is_steered() {
    let mut car = Base::new(&bicycle("", ""));
    let mut rest = Rest::Moving;
    for step in 0..80 {
        let made = car.step([7; 4], 10 * (step % 20)).unwrap();
        rest = made.map_or(rest, |it| it.rest);
    }
    assert_eq!(rest, Rest::Counts);
}

#[test]
fn an_angle_that_no_car_has_is_refused() {
    let mut car = Base::new(&bicycle("", ""));
    car.step([0; 4], 0).unwrap();
    assert_eq!(car.step([1; 4], 460), Err(FrameReject::Implausible));
    let made = car.step([20; 4], 450).unwrap().unwrap();
    assert!(made.velocity[2] > 0.1, "{made:?}");
}

#[test]
fn wheels_that_do_not_fit_are_named_and_make_noise() {
    for (tables, by) in [(four(), 1), (mecanum(), 1)] {
        let mut base = Base::new(&tables);
        let mut last = None;
        for step in 0..100_i16 {
            let slipped = 10 * (step - 50).max(0) * by;
            let made = base.step([20 * step, 20 * step, 20 * step + slipped, 20 * step], 0);
            last = made.unwrap().or(last);
            assert!(step > 50 || base.decoder.slip().is_none());
        }
        let slip = base.decoder.slip().unwrap();
        assert!(slip.wheel.ends_with(".rear_left"), "{slip:?}");
        assert!((slip.misfit_mps - 0.5).abs() < 0.01, "{slip:?}");
        assert_eq!(base.decoder.slips(), 1);
        for step in 100..200_i16 {
            let count = 20 * step;
            last = base.step([count, count, count + 490, count], 0).unwrap();
        }
        assert_eq!(base.decoder.slip(), None, "{tables}");
        assert!(last.unwrap().spread.iter().flatten().all(|&it| it == 0.0));
    }
}
