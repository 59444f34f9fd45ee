//! Wheels count in whole ticks. What is short in one interval is too much in the next: that is no noise of the robot.
#![allow(clippy::unwrap_used)] // A test may panic.

use coloc_calibrate::{
    Coefficients, Drive, Fix, Gyro, Parameter, Receiver, Robot, State, Way, Wheels, fit,
};

const TRACK_M: f64 = 0.287;
const TICK_M: f64 = 1e-3;
const DT_S: f64 = 0.02;

/// Forward and turning: loops to either side.
fn velocity(time_s: f64) -> [f64; 2] {
    if time_s < 10.0 {
        return [0.0; 2];
    }
    [0.8, 0.6 * (time_s / 6.0).sin()]
}

/// A drive of two minutes, exact but for the wheels' counts, with a fix in each second.
fn drive() -> Drive {
    let [mut x, mut y, mut heading] = [0.0; 3];
    let (mut rolled, mut counted) = ([0.0; 2], [0.0; 2]);
    let (mut ways, mut fixes) = (Vec::new(), Vec::new());
    for tick in 0..6000 {
        let start_s = DT_S * f64::from(tick);
        let [v, omega] = velocity(start_s);
        let (way, turn) = (v * DT_S, omega * DT_S);
        let sides = [way - 0.5 * turn * TRACK_M, way + 0.5 * turn * TRACK_M];
        let read = [0, 1].map(|side: usize| {
            rolled[side] += sides[side];
            let before = counted[side];
            counted[side] = (rolled[side] / TICK_M).floor() * TICK_M;
            counted[side] - before
        });
        (x, y) = (
            x + way * (heading + 0.5 * turn).cos(),
            y + way * (heading + 0.5 * turn).sin(),
        );
        heading += turn;
        ways.push(Way {
            start_s,
            end_s: start_s + DT_S,
            read,
            state: if v > 0.0 {
                State::Rolling
            } else {
                State::Standing
            },
            gyro: Some(turn),
        });
        if tick % 50 == 49 {
            fixes.push(Fix {
                receiver: 0,
                stamp_s: start_s + DT_S,
                position: [x, y],
            });
        }
    }
    Drive::new(ways, fixes)
}

fn robot() -> Robot {
    let noise = |per_s, per_m, per_rad| Coefficients {
        per_s,
        per_m,
        per_rad,
        squares: [0.0; 2],
    };
    Robot {
        wheels: Wheels::axle(TRACK_M),
        noise: [
            noise(4e-6, 4e-4, 1e-4),
            noise(4e-6, 1e-4, 1e-4),
            noise(4.6e-5, 0.0, 4e-4),
        ],
        standing: [1e-10, 1e-10, 1e-10],
        missing: [1.0, 1.0, 0.1],
        gyro: Some(Gyro {
            scale: 1.0,
            bias_radps: 0.0,
            per_s: 3e-8,
        }),
        receivers: vec![Receiver {
            sigma_m: 0.05,
            slow_sigma_m: 0.025,
            slow_time_s: 60.0,
            lever_m: [0.0; 2],
            delay_s: 0.0,
        }],
        heading_rad: 0.0,
    }
}

#[test]
fn the_track_beside_a_gyro_is_that_of_the_axle_however_coarse_the_counts_are() {
    let fit = fit(&drive(), &robot(), &|_| {}).unwrap();
    let track = fit.found.iter().find(|it| it.parameter == Parameter::Track);
    let track = track.unwrap();
    assert!(track.shown, "{track:?}");
    let off = track.after / TRACK_M - 1.0;
    assert!(off.abs() < 0.005, "{off} {track:?}");
}
