//! Recorded cars, whose receivers a small player lets speak NMEA: the program's own errors are none beside those of the receivers, which
//! `docs/sensors.md` states.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::io::Read;
use std::path::{Path, PathBuf};

use coloc_gnss::datum::Origin;
use coloc_gnss::driver::{GnssDriver, Outlet};
use coloc_gnss::refusal::Refusal;
use coloc_gnss::section::{CourseSection, DatumSection, Gnss};
use coloc_gnss::sentence::line;
use coloc_gnss::stamp::Stamper;
use coloc_gnss::utc::iso;
use coloc_sensors::{Driver, Moment};
use coloc_shm_types::{Heading, Position};
use flate2::read::GzDecoder;
use map_3d::{Ellipsoid, ecef2enu, enu2geodetic};

/// What was said: when, and where or whither.
#[derive(Debug, Default)]
struct Ears {
    places: Vec<(i64, [f64; 2])>,
    courses: Vec<(i64, f64)>,
}

impl Outlet for Ears {
    fn position(&mut self, stamp_ns: i64, position: Position) -> bool {
        self.places.push((stamp_ns, position.position));
        true
    }

    fn heading(&mut self, stamp_ns: i64, heading: Heading) -> bool {
        self.courses.push((stamp_ns, heading.heading));
        true
    }
}

/// A moment of a receiver.
#[derive(Copy, Clone, Debug)]
struct Fix {
    utc_ns: i64,
    latitude_deg: f64,
    longitude_deg: f64,
    height_m: f64,
    /// Speed \[m/s\] and course \[°\].
    moving: Option<[f64; 2]>,
}

/// Of the origin: latitude and longitude \[°\], height \[m\].
type Datum = [f64; 3];

/// Degrees and minutes, as NMEA has them.
fn angle(degrees: f64, digits: usize, letters: [char; 2]) -> String {
    let letter = letters[usize::from(degrees < 0.0)];
    // Whole ten-millionths of a minute: no minute is the sixtieth.
    #[allow(clippy::cast_possible_truncation)] // Below 1.1e11.
    let parts = (degrees.abs() * 6e8).round() as i64;
    let (degrees, rest) = (parts / 600_000_000, parts % 600_000_000);
    let (minutes, rest) = (rest / 10_000_000, rest % 10_000_000);
    format!("{degrees:0digits$}{minutes:02}.{rest:07},{letter}")
}

impl Fix {
    fn said(&self) -> String {
        let utc = iso(self.utc_ns);
        let time = utc[11..23].replace(':', "");
        let date = format!("{}{}{}", &utc[8..10], &utc[5..7], &utc[2..4]);
        let latitude = angle(self.latitude_deg, 2, ['N', 'S']);
        let longitude = angle(self.longitude_deg, 3, ['E', 'W']);
        let height = self.height_m;
        let moving = self.moving.map_or_else(
            || ",".to_owned(),
            |[speed, course]| format!("{:.4},{course:.4}", speed * 3600.0 / 1852.0),
        );
        line(&format!(
            "GPGGA,{time},{latitude},{longitude},1,10,0.9,{height:.3},M,0.0,M,,"
        )) + &line(&format!(
            "GPRMC,{time},A,{latitude},{longitude},{moving},{date},,,A"
        ))
    }
}

/// What `coloc-gnss` makes of the fixes.
fn played(fixes: &[Fix], datum: Datum) -> GnssDriver<Ears> {
    let section = Gnss {
        datum: DatumSection {
            latitude_deg: Some(datum[0]),
            longitude_deg: Some(datum[1]),
            height_m: datum[2],
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
    let mut driver = GnssDriver::new(section, origin, Ears::default(), stamper);
    for fix in fixes {
        driver
            .take(fix.said().as_bytes(), Moment::default())
            .unwrap();
    }
    driver.end(Moment::default()).unwrap();
    driver
}

fn rows<const N: usize>(folder: &str, file: &str) -> Option<Vec<[f64; N]>> {
    let given = std::env::var_os("COLOC_DATA").map(PathBuf::from);
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let above = here.ancestors().map(|folder| folder.join("../shared/data"));
    let mut files = given.into_iter().chain(above);
    let bytes = files.find_map(|data| std::fs::read(data.join(folder).join(file)).ok());
    let Some(bytes) = bytes else {
        eprintln!("SKIPPED: no recording {folder}; set COLOC_DATA to the folder that holds it");
        return None;
    };
    let mut text = String::new();
    if bytes.starts_with(&[0x1f, 0x8b]) {
        GzDecoder::new(&bytes[..])
            .read_to_string(&mut text)
            .unwrap();
    } else {
        text = String::from_utf8(bytes).unwrap();
    }
    let row = |line: &str| -> [f64; N] {
        let numbers: Vec<f64> = line
            .split(',')
            .map(|it| it.trim().parse().unwrap())
            .collect();
        numbers.try_into().unwrap()
    };
    Some(text.lines().skip(1).map(row).collect())
}

#[allow(clippy::cast_possible_truncation)] // Until the year 2262.
fn nanos(seconds: f64) -> i64 {
    // A float of today is good to a quarter of a microsecond; these are milliseconds.
    (seconds * 1e3).round() as i64 * 1_000_000
}

#[allow(clippy::cast_precision_loss)] // Some hundred.
fn mean_and_sigma(numbers: &[f64]) -> [f64; 2] {
    let count = numbers.len() as f64;
    let mean = numbers.iter().sum::<f64>() / count;
    let spread = numbers.iter().map(|it| (it - mean) * (it - mean));
    [mean, (spread.sum::<f64>() / count).sqrt()]
}

/// East and north of the reference \[m\], and how it moves, at its time \[ns\].
fn reference(poses: &[[f64; 11]], [latitude, longitude, height]: Datum) -> Vec<(f64, [f64; 4])> {
    let on_the_plane = |[x, y, z]: [f64; 3]| {
        let (latitude, longitude) = (latitude.to_radians(), longitude.to_radians());
        let (east, north, _) = ecef2enu(x, y, z, latitude, longitude, height, Ellipsoid::WGS84);
        [east, north]
    };
    let pose = |row: &[f64; 11]| {
        let at = [row[1], row[2], row[3]];
        let [east, north] = on_the_plane(at);
        let [to_east, to_north] = on_the_plane([0, 1, 2].map(|it| at[it] + row[8 + it]));
        (row[0], [east, north, to_east - east, to_north - north])
    };
    poses.iter().map(pose).collect()
}

fn between(reference: &[(f64, [f64; 4])], time_s: f64) -> Option<[f64; 4]> {
    let next = reference.partition_point(|it| it.0 < time_s);
    let (before, after) = (reference.get(next.checked_sub(1)?)?, reference.get(next)?);
    let part = (time_s - before.0) / (after.0 - before.0);
    Some([0, 1, 2, 3].map(|it| before.1[it] + part * (after.1[it] - before.1[it])))
}

#[test]
fn a_car_on_a_road_is_where_its_reference_says_as_well_as_its_receiver_knows() {
    let Some(rows) = rows::<7>("rav4_can", "gnss_ublox.csv") else {
        return;
    };
    let poses = self::rows::<11>("rav4_can", "pose.csv.gz").unwrap();
    let datum = [rows[0][1], rows[0][2], rows[0][5]];
    let fixes = rows.iter().map(|row| Fix {
        utc_ns: nanos(row[4]),
        latitude_deg: row[1],
        longitude_deg: row[2],
        height_m: row[5],
        moving: Some([row[3], row[6]]),
    });
    let fixes: Vec<_> = fixes.collect();
    let driver = played(&fixes, datum);
    let report = driver.report();
    assert_eq!((report.broken, report.refused), (0, [0; 16]));
    let reference = reference(&poses, datum);
    let ears = driver.into_outlet();
    assert_eq!(ears.places.len(), fixes.len());
    #[allow(clippy::cast_precision_loss)] // To a quarter of a microsecond.
    let at = |stamp_ns: i64| between(&reference, stamp_ns as f64 * 1e-9);
    let off = |axis: usize| {
        let off = ears.places.iter();
        let off = off.filter_map(|(stamp_ns, place)| Some(place[axis] - at(*stamp_ns)?[axis]));
        mean_and_sigma(&off.collect::<Vec<_>>())
    };
    // The page's figures.
    let ([east, east_sigma], [north, north_sigma]) = (off(0), off(1));
    assert!(
        (east + 0.3).abs() < 0.05 && (north - 2.0).abs() < 0.05,
        "{east} {north}"
    );
    assert!(
        (east_sigma - 0.10).abs() < 0.01 && (north_sigma - 0.37).abs() < 0.01,
        "{east_sigma} {north_sigma}"
    );
    let turned = ears.courses.iter().filter_map(|(stamp_ns, course)| {
        let [_, _, to_east, to_north] = at(*stamp_ns)?;
        let off = course - to_north.atan2(to_east);
        Some(off.sin().atan2(off.cos()))
    });
    let [_, sigma] = mean_and_sigma(&turned.collect::<Vec<_>>());
    assert!((sigma - 0.0055).abs() < 0.0005, "{sigma}");
}

#[test]
fn a_car_in_a_park_is_where_its_receiver_says_and_where_that_jumps_it_is_not() {
    let Some(rows) = rows::<3>("victoria_park", "gps.csv.gz") else {
        return;
    };
    // Sydney, so that south and east are tried too.
    let datum: Datum = [-33.885, 151.194, 20.0];
    let [latitude, longitude] = [0, 1].map(|it: usize| datum[it].to_radians());
    let fixes = rows.iter().map(|[time_s, east, north]| {
        let (latitude, longitude, height) = enu2geodetic(
            *east,
            *north,
            0.0,
            latitude,
            longitude,
            datum[2],
            Ellipsoid::WGS84,
        );
        Fix {
            utc_ns: nanos(time_s + 1e9),
            latitude_deg: latitude.to_degrees(),
            longitude_deg: longitude.to_degrees(),
            height_m: height,
            moving: None,
        }
    });
    let fixes: Vec<_> = fixes.collect();
    let driver = played(&fixes, datum);
    let report = driver.report();
    let jumps = report.refused[Refusal::Jump as usize];
    let refused: u64 = report.refused.iter().sum();
    assert_eq!((report.broken, refused), (0, jumps));
    let said = driver.into_outlet().places;
    assert_eq!(said.len() as u64 + jumps, fixes.len() as u64);
    assert!(jumps < 100, "{jumps}");
    for (stamp_ns, [x, y]) in said {
        let of = fixes.iter().position(|it| it.utc_ns == stamp_ns).unwrap();
        let [_, east, north] = rows[of];
        assert!((x - east).hypot(y - north) < 1e-3, "{of}");
    }
}
