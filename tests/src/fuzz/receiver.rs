//! A satellite receiver: however its bytes come, what is published can be used, and how they were cut changes nothing.

use coloc_gnss::datum::Origin;
use coloc_gnss::driver::{GnssDriver, Outlet};
use coloc_gnss::frame::ubx_frame;
use coloc_gnss::section::{CourseSection, DatumSection, Gnss};
use coloc_gnss::sentence::line;
use coloc_gnss::stamp::Stamper;
use coloc_sensors::{Driver, Moment};
use coloc_shm_types::{Heading, Position};

use super::Target;

pub(super) const TARGET: Target = Target {
    name: "receiver",
    run,
    samples,
};

/// What was published.
#[derive(Debug, Default, PartialEq)]
struct Said {
    positions: Vec<(i64, Position)>,
    headings: Vec<(i64, Heading)>,
}

impl Outlet for Said {
    fn position(&mut self, stamp_ns: i64, position: Position) -> bool {
        self.positions.push((stamp_ns, position));
        true
    }

    fn heading(&mut self, stamp_ns: i64, heading: Heading) -> bool {
        self.headings.push((stamp_ns, heading));
        true
    }
}

fn run(bytes: &[u8]) {
    let stream = stream(bytes);
    let whole = heard(&stream, 4096);
    check(&whole);
    let size = bytes.first().map_or(1, |byte| usize::from(byte >> 3) + 1);
    assert_eq!(whole, heard(&stream, size), "the same bytes, cut elsewhere");
}

/// The bytes as they are, with right checksums, or as what UBX messages say: else nearly nothing would come through.
fn stream(bytes: &[u8]) -> Vec<u8> {
    match bytes.first().map(|byte| byte % 3) {
        Some(1) => {
            let lines = bytes.split(|byte| *byte == b'\n');
            lines.flat_map(repaired).collect()
        }
        Some(2) => bytes.chunks(92).flat_map(message).collect(),
        _ => bytes.to_vec(),
    }
}

fn repaired(said: &[u8]) -> Vec<u8> {
    let begin = said.iter().position(|byte| *byte == b'$');
    let said = begin.map_or(said, |begin| &said[begin + 1..]);
    let end = said.iter().position(|byte| *byte == b'*');
    let said = String::from_utf8_lossy(end.map_or(said, |end| &said[..end]));
    line(&said).into_bytes()
}

fn message(payload: &[u8]) -> Vec<u8> {
    match payload.len() {
        92 => ubx_frame(1, 0x07, payload),
        64.. => ubx_frame(1, 0x3c, &payload[..64]),
        _ => ubx_frame(1, 0x07, payload),
    }
}

fn heard(stream: &[u8], size: usize) -> Said {
    let section = Gnss {
        datum: DatumSection {
            latitude_deg: Some(48.0),
            longitude_deg: Some(11.0),
            ..DatumSection::default()
        },
        course: CourseSection {
            publish: true,
            ..CourseSection::default()
        },
        ..Gnss::of("stdin")
    };
    let origin = Origin::begin(&section.datum, None).unwrap();
    let stamper = Stamper::recording(false, 0);
    let mut driver = GnssDriver::new(section, origin, Said::default(), stamper);
    let at = Moment::default();
    for piece in stream.chunks(size) {
        driver.take(piece, at).unwrap();
    }
    driver.end(at).unwrap();
    let report = driver.report();
    let said = driver.into_outlet();
    let count = said.positions.len() + said.headings.len();
    assert_eq!(report.said, count as u64);
    said
}

fn check(said: &Said) {
    let rises = |stamps: Vec<i64>| stamps.windows(2).all(|pair| pair[0] < pair[1]);
    assert!(rises(said.positions.iter().map(|it| it.0).collect()));
    assert!(rises(said.headings.iter().map(|it| it.0).collect()));
    for (_, it) in &said.positions {
        assert!(
            it.position.iter().all(|metres| metres.abs() <= 50_000.0),
            "{it:?}"
        );
        let [xx, xy, yx, yy] = it.covariance;
        let is_round = xx >= 4e-4 && xx.total_cmp(&yy).is_eq() && xy == 0.0 && yx == 0.0;
        assert!(is_round && xx < 1.0, "{it:?}");
        assert!(
            it.slow_sigma_m >= 0.01 && it.slow_sigma_m.is_finite(),
            "{it:?}"
        );
        assert!((1..=5).contains(&it.quality), "{it:?}");
    }
    for (_, it) in &said.headings {
        assert!(
            it.heading.abs() < 20.0 && it.variance > 0.0 && it.variance.is_finite(),
            "{it:?}"
        );
        assert!((1..=5).contains(&it.quality), "{it:?}");
    }
}

fn samples() -> Vec<Vec<u8>> {
    let at = |second: u32| {
        format!(
            "$GNGGA,2359{second}.50,4800.00{second}00,N,01100.00{second}00,E,2,12,0.70,520.1,M,47.0,M,,0000*00\r\n\
             $GNRMC,2359{second}.50,A,4800.00{second}00,N,01100.00{second}00,E,3.00,123.4,311216,,,D,V*00\r\n\
             $GNGST,2359{second}.50,12,1.2,0.8,45.0,0.9,0.8,1.9*00\r\n$GNVTG,123.4,T,,M,3.00,N,5.6,K,D*00\r\n\
             $GNZDA,2359{second}.50,31,12,2016,00,00*00\r\n$GNHDT,123.4,T*00\r\n$PUBX,00,1*00\r\n"
        )
    };
    let lines = format!("\x01\n{}", (55..62).map(at).collect::<String>());
    let mut solution = [0; 92];
    solution[4..12].copy_from_slice(&[0xe8, 0x07, 6, 1, 12, 0, 30, 0b111]);
    solution[20..24].copy_from_slice(&[3, 0x83, 0, 17]);
    solution[24..28].copy_from_slice(&110_000_000_i32.to_le_bytes());
    solution[28..32].copy_from_slice(&480_000_000_i32.to_le_bytes());
    // The first byte says how they are read; here it is part of the time of the week.
    solution[0] = 2;
    let mut baseline = [0; 64];
    baseline[24..28].copy_from_slice(&4_500_000_i32.to_le_bytes());
    baseline[60..64].copy_from_slice(&0x115_u32.to_le_bytes());
    let good = heard(&stream(lines.as_bytes()), 4096);
    assert!(
        good.positions.len() > 3 && good.headings.len() > 3,
        "{good:?}"
    );
    vec![
        lines.into_bytes(),
        [&solution.repeat(3)[..], &baseline].concat(),
    ]
}
