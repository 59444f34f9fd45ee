//! Messages of shared memory, whatever they hold: refused, or through the estimator to a belief that can be.

use std::sync::LazyLock;

use coloc_daemon::collect::messages::{fix, heading, neighbour, said, sighting, turn};
use coloc_daemon::collect::parts::{self, Landmarks};
use coloc_daemon::collect::sensors::Sensors;
use coloc_daemon::config::Config;
use coloc_estimator::{
    Belief, Bend, Covariance3, Estimator, GyroSettings, Measurement, Motion, OdometrySample, Parts,
    Pose, Settings, Slot, Stamp, TickInputs, TickOutputs, step,
};
use coloc_shm_types::{
    Answer, Clock, Estimate, Gyro, Header, Heading, Limits, Neighbour, Odometry, Pose as SaidPose,
    Position, Present, RelativePose, Seen, Sighting, Status,
};

use super::Target;
use super::bytes::Bytes;

pub(super) const TARGET: Target = Target {
    name: "payloads",
    run,
    samples,
};

const PERIOD_NS: i64 = 20_000_000;
const HISTORY_NS: i64 = 1_000_000_000;
const TOLERANCE_NS: i64 = 100_000_000;
const BOOT: u64 = 7;
const ROBOTS: [u16; 3] = [1, 2, 3];
/// Few, so that they overflow.
const SLOTS: usize = 24;
/// Ticks of an execution.
const TICKS: i64 = 8;

fn run(bytes: &[u8]) {
    let mut bytes = Bytes(bytes);
    let initial = Belief {
        pose: Pose::new(1.0, 2.0, 0.5),
        parts: Parts {
            independent: Covariance3::diagonal([0.02, 0.02, 0.01]).unwrap(),
            dependent: Covariance3::diagonal([0.02, 0.02, 0.0]).unwrap(),
        },
        bend: Bend::ZERO,
    };
    let mut now_ns = 10 * HISTORY_NS;
    let slots = vec![Slot::default(); SLOTS].into_boxed_slice();
    let settings = Settings {
        gyro: Some(GyroSettings::ORDINARY),
        ..Settings::default()
    };
    let mut robot = Estimator::new(settings, Stamp::from_nanos(now_ns), initial, slots);
    for _ in 0..TICKS {
        if bytes.is_empty() {
            return;
        }
        now_ns += PERIOD_NS;
        let count = bytes.byte() % 8;
        let measurements: Vec<_> = (0..count)
            .filter_map(|_| measurement(&mut bytes, now_ns))
            .collect();
        let inputs = TickInputs {
            stamp: Stamp::from_nanos(now_ns),
            measurements: &measurements,
        };
        check(&step(&mut robot, &inputs), &measurements);
    }
}

fn check(outputs: &TickOutputs<'_>, given: &[Measurement]) {
    let estimate = &outputs.estimate;
    let Pose { x, y, phi } = estimate.belief.pose;
    let finite = [x, y, phi].into_iter().chain(estimate.velocity);
    assert!(
        finite.into_iter().all(f64::is_finite),
        "{estimate:?} of {given:?}"
    );
    let Parts {
        independent,
        dependent,
    } = estimate.belief.parts;
    let total = estimate.belief.total();
    let as_told = Parts::from_row_major(independent.to_row_major(), dependent.to_row_major());
    assert_eq!(as_told.err(), None, "{estimate:?} of {given:?}");
    for covariance in [total, independent, estimate.velocity_covariance] {
        let rows = covariance.to_row_major();
        assert_eq!(
            Covariance3::from_row_major(rows).err(),
            None,
            "{covariance:?} of {given:?}"
        );
    }
    assert!(total.contains(&independent), "{estimate:?} of {given:?}");
}

/// What comes of the next message, if it is valid.
fn measurement(bytes: &mut Bytes<'_>, now_ns: i64) -> Option<Measurement> {
    let limits = Limits {
        now: Present::only(Clock::Boottime, now_ns),
        boot: BOOT,
        history_ns: HISTORY_NS,
        future_tolerance_ns: TOLERANCE_NS,
        own: ROBOTS[0],
        robots: &ROBOTS,
    };
    let sensors = &*SENSORS;
    let kind = bytes.byte();
    let header = header(bytes, now_ns);
    match kind % 12 {
        0 => {
            let seen = sighting(&seen(header, bytes), &limits).ok()?;
            Some(sensors.of_body(&seen).into())
        }
        1 => fix(&placed(header, bytes), &limits, sensors).ok(),
        6 => heading(&looking(header, bytes), &limits, sensors).ok(),
        2 => neighbour(&told(header, bytes), &limits).ok(),
        3 => moved(header, bytes, &limits),
        4 => said(&set(header, bytes), &limits).ok(),
        7 => turn(&turned(header, bytes), &limits, sensors).ok(),
        9 => parts::sighting(&in_part(header, bytes), &limits, sensors, &LANDMARKS).ok(),
        10 => parts::seen(&seen_at(header, bytes), &limits).ok(),
        11 => parts::answer(&answered(header, bytes), &limits).ok(),
        5 => {
            let _ = published(header, bytes).validate(&limits);
            None
        }
        _ => {
            let status = Status {
                header,
                bus: bytes.byte(),
                ..Status::default()
            };
            let _ = status.validate(&limits);
            None
        }
    }
}

fn header(bytes: &mut Bytes<'_>, now_ns: i64) -> Header {
    let how = bytes.byte();
    Header {
        stamp_ns: match how % 8 {
            0 => bytes.long(),
            _ => now_ns.saturating_sub(i64::from(bytes.short()) * 10_000),
        },
        session: u64::from(how >> 4 & 1),
        sequence: u64::from(bytes.byte()),
        boot: BOOT + u64::from(how == 0xFF),
        source: u16::from(bytes.byte() % 5),
        clock: if how >> 5 == 7 {
            bytes.byte()
        } else {
            Clock::Boottime as u8
        },
        ..Header::default()
    }
}

fn seen(header: Header, bytes: &mut Bytes<'_>) -> RelativePose {
    RelativePose {
        header,
        observed: u16::from(bytes.byte() % 5),
        pose: bytes.numbers(),
        covariance: bytes.covariance(),
        ..RelativePose::default()
    }
}

fn in_part(header: Header, bytes: &mut Bytes<'_>) -> Sighting {
    let [range, bearing] = bytes.numbers();
    let [scale, scale_s, turn, turn_s] = bytes.numbers();
    let how = bytes.byte();
    Sighting {
        header,
        observed: u16::from(bytes.byte() % 5),
        has: how % 5,
        who: how / 64,
        range,
        bearing,
        white: bytes.numbers(),
        slow: [scale, scale_s, turn, turn_s],
        mount: bytes.numbers(),
        ..Sighting::default()
    }
}

/// Where it was seen, or what is asked of it.
fn seen_at(header: Header, bytes: &mut Bytes<'_>) -> Seen {
    let flags = bytes.byte() % 4;
    let blank = Seen {
        header,
        sensor: u16::from(bytes.byte() % 3),
        flags,
        sighting: u64::from(bytes.byte()),
        ..Seen::default()
    };
    if flags & Seen::NOTHING_TOLD != 0 {
        return blank;
    }
    Seen {
        position: bytes.numbers(),
        independent: bytes.covariance(),
        dependent: bytes.covariance(),
        ..blank
    }
}

fn answered(header: Header, bytes: &mut Bytes<'_>) -> Answer {
    Answer {
        header,
        sensor: u16::from(bytes.byte() % 3),
        sighting: u64::from(bytes.byte()),
        position: bytes.numbers(),
        independent: bytes.covariance(),
        dependent: bytes.covariance(),
        ..Answer::default()
    }
}

fn placed(header: Header, bytes: &mut Bytes<'_>) -> Position {
    Position {
        header,
        quality: bytes.byte() % 8,
        position: bytes.numbers(),
        covariance: bytes.covariance(),
        slow_sigma_m: f64::from(bytes.byte() / 32),
        slow_time_s: f64::from(bytes.byte() / 32),
        lever_m: [0; 2].map(|_| f64::from(bytes.byte()) / 100.0),
        ..Position::default()
    }
}

fn looking(header: Header, bytes: &mut Bytes<'_>) -> Heading {
    let [heading, variance] = bytes.numbers();
    Heading {
        header,
        what: bytes.byte() % 4,
        quality: bytes.byte() % 8,
        heading,
        variance,
        slow_sigma_rad: f64::from(bytes.byte()) / 256.0,
        slow_time_s: f64::from(bytes.byte()),
        ..Heading::default()
    }
}

/// A laser that sits at a corner.
static SENSORS: LazyLock<Sensors> = LazyLock::new(|| {
    let text = "[robot]\nname = \"a\"\nid = 1\n[relative_pose]\nmount = [0.3, -0.2, 2.0]\n";
    Sensors::of(&Config::parse(text, "fuzz.toml".as_ref()).unwrap())
});

/// One, which is number 3.
static LANDMARKS: LazyLock<Landmarks> = LazyLock::new(|| {
    let text = "[robot]\nname = \"a\"\nid = 1\n[sighting]\nheard = true\n\
                [[landmark]]\nnumber = 3\nposition = [2.0, 1.0]\nsigma_m = 0.1\n";
    Landmarks::of(&Config::parse(text, "fuzz.toml".as_ref()).unwrap().landmark)
});

fn told(header: Header, bytes: &mut Bytes<'_>) -> Neighbour {
    Neighbour {
        header,
        pose: bytes.numbers(),
        independent: bytes.covariance(),
        dependent: bytes.covariance(),
    }
}

fn set(header: Header, bytes: &mut Bytes<'_>) -> SaidPose {
    SaidPose {
        header,
        set: bytes.byte() % 3,
        pose: bytes.numbers(),
        covariance: bytes.covariance(),
        ..SaidPose::default()
    }
}

fn turned(header: Header, bytes: &mut Bytes<'_>) -> Gyro {
    let [rate_radps, noise] = bytes.numbers();
    Gyro {
        header,
        rate_radps,
        noise,
        ..Gyro::default()
    }
}

/// The noise of a velocity that says none.
const USUAL: [f64; 9] = [0.01, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.0, 0.01];

/// A velocity with its interval and covariance, as the daemon takes it; other kinds need a base's decoder.
fn moved(header: Header, bytes: &mut Bytes<'_>, limits: &Limits<'_>) -> Option<Measurement> {
    let message = Odometry {
        header,
        start_ns: header
            .stamp_ns
            .saturating_sub(i64::from(bytes.short()) * 10_000),
        kind: bytes.byte() % 4,
        values: bytes.numbers(),
        covariance: bytes.covariance(),
        ..Odometry::default()
    };
    message.validate(limits).ok()?;
    let unsaid = message.covariance.iter().all(|it| *it == 0.0);
    let noise =
        Covariance3::from_row_major(if unsaid { USUAL } else { message.covariance }).ok()?;
    let [x, y, turn, _] = message.values;
    let (start, stamp) = (message.start_ns, header.stamp_ns);
    let sample = OdometrySample {
        source: header.source,
        start: Stamp::from_nanos(start),
        stamp: Stamp::from_nanos(stamp),
        motion: Motion::Holonomic {
            velocity: [x, y, turn],
            noise,
        },
    };
    (start < stamp && [x, y, turn].iter().all(|it| it.abs() <= 1000.0)).then(|| sample.into())
}

fn published(header: Header, bytes: &mut Bytes<'_>) -> Estimate {
    Estimate {
        header,
        pose: bytes.numbers(),
        velocity: bytes.numbers(),
        independent: bytes.covariance(),
        dependent: bytes.covariance(),
        velocity_covariance: bytes.covariance(),
        state: bytes.byte(),
        fit: bytes.byte(),
        ..Estimate::default()
    }
}

fn samples() -> Vec<Vec<u8>> {
    let number = |value: i16| [&[0][..], &value.to_le_bytes()].concat();
    let unit = |n: usize| {
        let entries = (0..n * n).map(|k| number(if k % (n + 1) == 0 { 300 } else { 0 }));
        [vec![1], entries.flatten().collect()].concat()
    };
    // Kind, how, stamp, sequence, source.
    let head = |kind: u8, source: u8| vec![kind, 1, 10, 0, kind + source, source];
    let numbers = |values: &[i16]| values.iter().copied().flat_map(number).collect::<Vec<u8>>();
    let fix = [
        head(1, 0),
        vec![2],
        numbers(&[1024, 2048]),
        unit(2),
        vec![32, 64, 100, 50],
    ]
    .concat();
    let looking = [head(6, 0), numbers(&[500, 100]), vec![0, 1, 10, 60]].concat();
    let sighting = [head(0, 0), vec![2], numbers(&[2048, 100, 30]), unit(3)].concat();
    let told = [head(2, 2), numbers(&[1100, 2000, 500]), unit(3), unit(3)].concat();
    let moved = [
        head(3, 0),
        vec![100, 0, 0],
        numbers(&[900, 0, 100, 0]),
        unit(3),
    ]
    .concat();
    let set = [head(4, 0), vec![1], numbers(&[1000, 2100, 400]), unit(3)].concat();
    let turned = [head(7, 0), numbers(&[100, 0])].concat();
    let both = [
        head(9, 0),
        numbers(&[2048, 100, 30, 3000, 10, 5000]),
        vec![68, 2],
        numbers(&[10, 10, 0, 0, 0]),
    ]
    .concat();
    let mark = [
        head(9, 1),
        numbers(&[1000, 100, 30, 3000, 10, 5000]),
        vec![133, 3],
        numbers(&[10, 10, 100, 0, 500]),
    ]
    .concat();
    let told_part = [
        head(10, 2),
        vec![0, 0, 5],
        numbers(&[1100, 2000]),
        unit(2),
        unit(2),
    ]
    .concat();
    let answer = [
        // Of the sighting `both`.
        vec![11, 1, 10, 0, 1, 2],
        vec![0, 9],
        numbers(&[3000, 2000]),
        unit(2),
        unit(2),
    ]
    .concat();
    let parts = [vec![4], both, mark, told_part, answer].concat();
    let tick = [
        vec![7],
        fix.clone(),
        sighting,
        told,
        moved,
        set,
        looking,
        turned,
    ]
    .concat();
    vec![
        tick.clone(),
        [vec![1], fix].concat(),
        [tick.clone(), tick.clone()].concat(),
        [parts, tick].concat(),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How many measurements of an input are valid.
    fn valid(input: &[u8]) -> usize {
        let (mut bytes, mut valid) = (Bytes(input), 0);
        while !bytes.is_empty() {
            let count = bytes.byte() % 8;
            valid += (0..count)
                .filter_map(|_| measurement(&mut bytes, 10 * HISTORY_NS))
                .count();
        }
        valid
    }

    #[test]
    fn inputs_come_through_to_the_estimator() {
        assert_eq!(
            samples().iter().map(|it| valid(it)).collect::<Vec<_>>(),
            [7, 1, 14, 11]
        );
        let inputs = TARGET.inputs(1, 1000);
        let come_through = inputs.filter(|input| valid(input) > 0).count();
        assert!(come_through > 300, "{come_through} of 1000");
    }
}
