//! UBX as an encoder makes it that others wrote: pyubx2, a Python package.
//!
//! `COLOC_UBX_MESSAGES` says how many messages, `PYTHONPATH` where pyubx2 is if it is not installed; `tests/run` sets both.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::process::Command;

use chrono::{DateTime, NaiveDate};
use coloc_gnss::frame::{Frame, Splitter};
use coloc_gnss::ubx::{Ubx, content};

const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/ubx/messages.py");
const SEED: &str = "7";

/// Stream and meaning, if there is an encoder.
fn made() -> Option<(Vec<u8>, Vec<Vec<String>>)> {
    let has_encoder = Command::new("python3")
        .args(["-c", "import pyubx2"])
        .output();
    if !has_encoder.is_ok_and(|output| output.status.success()) {
        println!(
            "SKIPPED: no pyubx2 (python3 -m pip install pyubx2): UBX is not held against another encoder"
        );
        return None;
    }
    let directory = tempfile::tempdir().unwrap();
    let [stream, expected] = ["stream", "expected"].map(|name| directory.path().join(name));
    let count = std::env::var("COLOC_UBX_MESSAGES").unwrap_or_else(|_| "3000".into());
    let mut command = Command::new("python3");
    command
        .args([SCRIPT, &count, SEED])
        .args([&stream, &expected]);
    let output = command.output().unwrap();
    assert!(output.status.success(), "{output:?}");
    let expected = std::fs::read_to_string(expected).unwrap();
    let fields = |line: &str| line.split('\t').map(ToOwned::to_owned).collect();
    Some((
        std::fs::read(stream).unwrap(),
        expected.lines().map(fields).collect(),
    ))
}

#[allow(clippy::cast_precision_loss)] // None has more than 32 bits.
fn scaled(whole: i64, scale: f64) -> f64 {
    whole as f64 * scale
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * a.abs().max(1.0)
}

/// By the table of u-blox' protocol specification.
fn carrier(carrier: i64, is_differential: i64) -> u8 {
    match (carrier, is_differential) {
        (0, 0) => 1,
        (0, _) => 2,
        (1, _) => 5,
        (2, _) => 4,
        _ => 0,
    }
}

fn check_solution(found: Ubx, meant: &[i64]) {
    let &[
        week_ms,
        year,
        month,
        day,
        hour,
        minute,
        second,
        nano,
        valid_date,
        valid_time,
        fix,
        ok,
        differential,
        carried,
        satellites,
        height,
        accuracy,
        speed,
        latitude,
        longitude,
        course,
    ] = meant
    else {
        panic!("{meant:?}");
    };
    let Ubx::Solution(found) = found else {
        panic!("{found:?}");
    };
    let small = |value: i64| u32::try_from(value).unwrap();
    let date = NaiveDate::from_ymd_opt(year.try_into().unwrap(), small(month), small(day)).unwrap();
    let time = date
        .and_hms_opt(small(hour), small(minute), small(second))
        .unwrap();
    let unix_ns = DateTime::<chrono::Utc>::from_naive_utc_and_offset(time, chrono::Utc).timestamp()
        * 1_000_000_000;
    let utc_ns = (valid_date == 1 && valid_time == 1).then_some(unix_ns + nano);
    let quality = match (fix, ok) {
        (1, _) => 6,
        (2..=4, 1) => carrier(carried, differential),
        _ => 0,
    };
    assert_eq!(
        (found.utc_ns, found.quality),
        (utc_ns, quality),
        "{meant:?}"
    );
    assert_eq!(
        (i64::from(found.week_ms), i64::from(found.satellites)),
        (week_ms, satellites)
    );
    assert!(
        near(found.place[0], scaled(latitude, 1e-7))
            && near(found.place[1], scaled(longitude, 1e-7))
    );
    assert!(
        near(found.height_m, scaled(height, 1e-3)) && near(found.sigma_m, scaled(accuracy, 1e-3))
    );
    assert!(
        near(found.speed_m_s, scaled(speed, 1e-3)) && near(found.course_deg, scaled(course, 1e-5))
    );
}

fn check_baseline(found: Ubx, meant: &[i64]) {
    let &[
        week_ms,
        length,
        ok,
        differential,
        valid,
        carried,
        heading_valid,
        heading,
        sigma,
    ] = meant
    else {
        panic!("{meant:?}");
    };
    let Ubx::Baseline(found) = found else {
        panic!("{found:?}");
    };
    let all = [ok, valid, heading_valid].iter().all(|flag| *flag == 1);
    let quality = if all {
        carrier(carried, differential)
    } else {
        0
    };
    assert_eq!(
        (i64::from(found.week_ms), found.quality),
        (week_ms, quality),
        "{meant:?}"
    );
    assert!(
        near(found.heading_deg, scaled(heading, 1e-5))
            && near(found.sigma_deg, scaled(sigma, 1e-5)),
        "{found:?} {meant:?}"
    );
    assert!(near(found.length_m, scaled(length, 1e-2)));
}

#[test]
fn another_encoders_messages_are_read_as_they_were_meant() {
    let Some((stream, expected)) = made() else {
        return;
    };
    let mut found = Vec::new();
    let mut splitter = Splitter::default();
    for piece in stream.chunks(37) {
        splitter.take(piece, |frame| match frame {
            Frame::Ubx { class, id, payload } => found.push(content(class, id, payload)),
            Frame::Line(line) => panic!("{line:?}"),
        });
    }
    assert_eq!(
        (splitter.broken, splitter.foreign, found.len()),
        (0, 0, expected.len())
    );
    for (found, meant) in found.into_iter().zip(&expected) {
        let numbers: Vec<i64> = meant[1..]
            .iter()
            .map(|field| field.parse().unwrap())
            .collect();
        match meant[0].as_str() {
            "pvt" => check_solution(found.unwrap(), &numbers),
            "relposned" => check_baseline(found.unwrap(), &numbers),
            _ => assert_eq!(found, Ok(Ubx::Nothing)),
        }
    }
    println!("{} messages", expected.len());
}
