//! A laser scanner: whatever a log says, what is published can be used, and how its bytes were cut changes nothing.

use coloc_laser::beliefs::Beliefs;
use coloc_laser::driver::{LaserDriver, Outlet};
use coloc_laser::section::{Laser, LookSection, Shape};
use coloc_sensors::{Driver, EndError, Moment};
use coloc_shm_types::{BeliefState, Clock, Estimate, Header, RelativePose, Sighting};

use super::Target;

pub(super) const TARGET: Target = Target {
    name: "scans",
    run,
    samples,
};

const BOOT: u64 = 7;

/// What was published.
#[derive(Debug, Default, PartialEq)]
struct Said {
    poses: Vec<(i64, RelativePose)>,
    parts: Vec<(i64, Sighting)>,
}

impl Outlet for Said {
    fn hear(&mut self, beliefs: &mut Beliefs, now: Moment) -> Result<(), EndError> {
        let estimate = |pose| Estimate {
            header: Header {
                stamp_ns: now.boottime_ns,
                boot: BOOT,
                clock: Clock::Boottime as u8,
                ..Header::default()
            },
            pose,
            independent: [0.04, 0.0, 0.0, 0.0, 0.04, 0.0, 0.0, 0.0, 0.01],
            state: BeliefState::Ok as u8,
            ..Estimate::default()
        };
        beliefs.hear_own(&estimate([0.0; 3]), now);
        beliefs.hear(2, &estimate([2.0, 0.0, 0.0]), now);
        beliefs.hear(3, &estimate([0.0, 2.0, 1.0]), now);
        Ok(())
    }

    fn pose(&mut self, stamp_ns: i64, sighting: RelativePose) -> bool {
        self.poses.push((stamp_ns, sighting));
        true
    }

    fn range_bearing(&mut self, stamp_ns: i64, sighting: Sighting) -> bool {
        self.parts.push((stamp_ns, sighting));
        true
    }
}

fn run(bytes: &[u8]) {
    let log = log(bytes);
    let whole = heard(&log, 4096);
    check(&whole);
    let size = bytes.first().map_or(1, |byte| usize::from(byte >> 3) + 1);
    assert_eq!(whole, heard(&log, size), "the same bytes, cut elsewhere");
}

/// The bytes as they are, or as ranges: else nearly nothing would come through.
fn log(bytes: &[u8]) -> Vec<u8> {
    if bytes.first().is_none_or(|byte| byte % 2 == 0) {
        return bytes.to_vec();
    }
    let lines = bytes[1..]
        .chunks(180)
        .filter(|it| it.len() > 1)
        .map(|ranges| {
            let ranges: Vec<_> = ranges
                .iter()
                .map(|it| format!("{}", f64::from(*it) / 50.0))
                .collect();
            format!(
                "FLASER {} {} 0 0 0 0 0 0 0 h 0\n",
                ranges.len(),
                ranges.join(" ")
            )
        });
    lines.collect::<String>().into_bytes()
}

fn look(shape: Shape, robots: &[u16]) -> LookSection {
    LookSection {
        robots: robots.to_vec(),
        shape,
        radius_m: 0.25,
        length_m: 0.7,
        width_m: 0.5,
        centre_m: [0.1, 0.0],
        marks: Vec::new(),
        mark_radius_m: 0.0,
    }
}

fn heard(log: &[u8], size: usize) -> Said {
    let section = Laser::of(vec![
        look(Shape::Cylinder, &[2]),
        look(Shape::Rectangle, &[]),
    ]);
    let beliefs = Beliefs::new(BOOT, [0.0; 3], 1.0, &[(2, 0), (3, 1)]);
    let mut driver = LaserDriver::new(&section, beliefs, BOOT, Said::default());
    let at = Moment::default();
    for piece in log.chunks(size) {
        driver.take(piece, at).unwrap();
    }
    driver.end(at).unwrap();
    driver.into_outlet()
}

fn check(said: &Said) {
    for (_, it) in &said.poses {
        assert!(
            it.pose.iter().all(|it| it.is_finite()) && it.observed == 3,
            "{it:?}"
        );
        let [xx, xy, _, yx, yy, _, _, _, turn] = it.covariance;
        assert!(
            xx > 0.0 && yy > 0.0 && turn > 0.0 && xx * yy > xy * yx,
            "{it:?}"
        );
    }
    for (_, it) in &said.parts {
        let [range, bearing] = it.white;
        assert!(
            it.range > 0.0 && it.bearing.is_finite() && range > 0.0 && bearing > 0.0,
            "{it:?}"
        );
    }
}

fn samples() -> Vec<Vec<u8>> {
    // A cylinder of 0.25 m two metres ahead, in a hall of 5 m.
    let range = |place: u8| {
        let (sin, cos) = (f64::from(place) - 90.0).to_radians().sin_cos();
        let (along, aside) = (2.0 * cos, -2.0 * sin);
        let inside = 0.0625 - aside * aside;
        if inside > 0.0 && along > 0.0 {
            along - inside.sqrt()
        } else {
            5.0
        }
    };
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let bytes: Vec<u8> = (0..180)
        .map(|place| (range(place) * 50.0).round() as u8)
        .collect();
    let ranges: Vec<_> = (0..180)
        .map(|place| format!("{:.3}", range(place)))
        .collect();
    let line = format!("FLASER 180 {} 0 0 0 0 0 0 1.5 h 1.5\n", ranges.join(" "));
    let text = format!("PARAM x 1\n{line}ODOM 0 0 0 0 0 0 1 h 1\n{line}").into_bytes();
    assert!(!heard(&text, 4096).parts.is_empty(), "a robot stands there");
    vec![text, [&[1], &bytes[..], &bytes[..]].concat()]
}
