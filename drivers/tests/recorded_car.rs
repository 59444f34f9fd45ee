//! The CAN bus of a real car (`rav4_can`): 98,680 recorded frames against what their recorder decoded.

#![allow(
    clippy::cast_precision_loss,
    clippy::float_cmp,
    reason = "a test; nothing moves sideways, exactly"
)]

use std::error::Error;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use coloc_drivers::Database;
use coloc_drivers::can::{BusSpec, Filter, Id, Log, LogFrame, Received, StandardId};
use coloc_drivers::encoder::{
    OdometryConfig, OdometryDecoder, Quantity, WheelConfig, WheelsConfig,
};
use flate2::read::GzDecoder;

type Fallible = Result<(), Box<dyn Error>>;

/// `COLOC_DATA`, or `../shared/data` from here or any directory above.
fn recording() -> Option<PathBuf> {
    let given = std::env::var_os("COLOC_DATA").map(PathBuf::from);
    let above = Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .map(|directory| directory.join("shared/data"));
    let found = given
        .into_iter()
        .chain(above)
        .map(|data| data.join("rav4_can"))
        .find(|data| data.is_dir());
    if found.is_none() {
        eprintln!("SKIPPED: no recorded car; set COLOC_DATA to the directory that holds rav4_can");
    }
    found
}

fn csv(path: &Path) -> Result<Vec<Vec<f64>>, Box<dyn Error>> {
    let lines = BufReader::new(GzDecoder::new(std::fs::File::open(path)?))
        .lines()
        .skip(1);
    lines
        .map(|line| Ok(line?.split(',').map(str::parse).collect::<Result<_, _>>()?))
        .collect()
}

fn wheel_frames(data: &Path) -> Result<Vec<LogFrame>, Box<dyn Error>> {
    let id = Id::Standard(StandardId::new(0x0AA).ok_or("no such identifier")?);
    let log = Log::read(
        &data.join("candump.log.gz"),
        Some("can0"),
        &Filter::ids([id]),
    )?;
    Ok(log.frames().to_vec())
}

#[test]
fn every_recorded_frame_is_read() -> Fallible {
    let Some(data) = recording() else {
        return Ok(());
    };
    let log = Log::read(&data.join("candump.log.gz"), None, &Filter::All)?;
    assert_eq!(log.frames().len(), 98_680);
    let (first, last) = (log.frames()[0], log.frames()[98_679]);
    assert_eq!(first.stamp_ns, 1_533_226_488_434_433_000);
    assert_eq!((last.stamp_ns - first.stamp_ns) / 10_000_000, 5999);
    Ok(())
}

#[test]
fn wheel_speeds_are_those_of_the_recorder_to_rounding() -> Fallible {
    let Some(data) = recording() else {
        return Ok(());
    };
    let database = Database::load(Some(&data.join("toyota_2017.dbc")))?;
    let message = database.message("WHEEL_SPEEDS")?;
    let expected = csv(&data.join("wheel_speed.csv.gz"))?;
    let frames = wheel_frames(&data)?;
    assert_eq!((frames.len(), expected.len()), (4974, 4974));
    for (wheel, name) in ["FL", "FR", "RL", "RR"].into_iter().enumerate() {
        let signal = database.signal(message, &format!("WHEEL_SPEED_{name}"))?;
        for (row, (log, expected)) in frames.iter().zip(&expected).enumerate() {
            let speed_kmh = signal.physical(log.frame.data()).ok_or("frame too short")?;
            let error_mps = speed_kmh / 3.6 - expected[wheel + 1];
            // Five decimals in the file.
            assert!(
                error_mps.abs() <= 0.500_001e-5,
                "{name}, row {row}: off by {error_mps} m/s"
            );
        }
    }
    Ok(())
}

/// The car's rear axle: 1.56 m of track, both wheels in one message on the car's bus.
fn car(data: &Path) -> OdometryConfig {
    let wheel = |name: &str| WheelConfig {
        bus: 0,
        message: "WHEEL_SPEEDS".to_owned(),
        signal: format!("WHEEL_SPEED_{name}"),
        quantity: Quantity::KilometresPerHour,
        metres_per_tick: None,
        wheel_radius_m: None,
        ticks_per_revolution: None,
        period_s: None,
        modulus: None,
        reversed: false,
    };
    OdometryConfig {
        buses: vec![BusSpec::Candump {
            path: data.join("candump.log.gz"),
            interface: Some("can0".to_owned()),
        }],
        dbc: Some(data.join("toyota_2017.dbc")),
        max_turn_rate_radps: 2.0,
        wheels: Some(WheelsConfig {
            track_m: 1.56,
            turning_scale: 1.0,
            left: wheel("RL"),
            right: wheel("RR"),
        }),
        ..OdometryConfig::of(70.0)
    }
}

#[test]
fn the_rear_wheels_go_as_far_as_the_reference_says() -> Fallible {
    let Some(data) = recording() else {
        return Ok(());
    };
    let mut decoder = OdometryDecoder::new(&car(&data))?;
    let (mut way_m, mut heading_rad, mut covered_ns, mut end_ns) = (0.0, 0.0, 0, None);
    for log in wheel_frames(&data)? {
        let received = Received {
            frame: log.frame,
            stamp_ns: log.stamp_ns,
            bus: 0,
        };
        let Some(sample) = decoder.push(&received)? else {
            continue;
        };
        assert!(
            end_ns.is_none_or(|end_ns| sample.start_ns == end_ns),
            "samples follow one another without a gap"
        );
        end_ns = Some(sample.stamp_ns);
        let dt_ns = sample.stamp_ns - sample.start_ns;
        covered_ns += dt_ns;
        way_m += sample.velocity[0] * dt_ns as f64 * 1e-9;
        heading_rad += sample.velocity[2] * dt_ns as f64 * 1e-9;
        assert_eq!(sample.velocity[1], 0.0);
    }
    let reference_m = reference_way_m(&csv(&data.join("pose.csv.gz"))?);
    let short = 1.0 - way_m / reference_m;
    println!(
        "{way_m:.1} m by the wheels, {reference_m:.1} m by the reference: {:.2} % short",
        short * 100.0
    );
    println!(
        "heading {heading_rad:+.3} rad in {:.2} s; {:?}",
        covered_ns as f64 * 1e-9,
        decoder.counters()
    );
    assert!(
        (0.005..0.012).contains(&short),
        "wheels {way_m} m, reference {reference_m} m"
    );
    assert!(covered_ns > 59_900_000_000);
    assert_eq!(decoder.counters().accepted, 4974);
    Ok(())
}

fn reference_way_m(poses: &[Vec<f64>]) -> f64 {
    let step_m = |a: &[f64], b: &[f64]| {
        (1..4)
            .map(|axis| (b[axis] - a[axis]).powi(2))
            .sum::<f64>()
            .sqrt()
    };
    poses
        .windows(2)
        .map(|pair| step_m(&pair[0], &pair[1]))
        .sum()
}
