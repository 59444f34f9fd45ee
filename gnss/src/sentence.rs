//! One NMEA 0183 sentence: whole or not, standard or not, and what it says.
//!
//! The checksum comes before anything else. The time is read here, because a leap second is a time; all else is read by the crate `nmea`
//! and then held to what can be.

use chrono::NaiveDate;
use nmea::sentences::FaaMode;
use nmea::sentences::rmc::RmcStatusOfFix;
use nmea::sentences::{parse_gga, parse_gst, parse_hdt, parse_rmc, parse_vtg, parse_zda};
use nmea::{NmeaSentence, SentenceType};

use crate::utc::TimeOfDay;

/// Faster is nobody whom a receiver serves.
pub const FASTEST_M_S: f64 = 1000.0;

const KNOT_M_S: f64 = 1852.0 / 3600.0;

/// Who speaks: `GP`, `GN`, `SD` …
pub type Talker = [u8; 2];

/// A sentence whose checksum is right.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Sentence<'a> {
    /// One that the standard describes.
    Standard {
        /// Who speaks.
        talker: Talker,
        /// What kind it is: `GGA`.
        kind: &'a str,
        /// Everything between the comma behind that and the star.
        data: &'a str,
    },
    /// A manufacturer's own. It is no error, and nothing is known of it.
    Proprietary,
    /// Of another system (ships' AIS), or with an address that is none.
    Other,
}

/// The checksum is missing or wrong.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Broken;

impl<'a> Sentence<'a> {
    /// Reads a line, from its `$` on.
    ///
    /// # Errors
    /// If its checksum is not there or not right.
    pub fn read(line: &'a [u8]) -> Result<Self, Broken> {
        let text = std::str::from_utf8(line).map_err(|_| Broken)?;
        let (said, checksum) = text.trim_ascii_end().rsplit_once('*').ok_or(Broken)?;
        let is_hex = checksum.len() == 2 && checksum.bytes().all(|it| it.is_ascii_hexdigit());
        let right = said.bytes().skip(1).fold(0, |sum, byte| sum ^ byte);
        match u8::from_str_radix(checksum, 16) {
            Ok(sum) if is_hex && sum == right => Ok(Self::of(said)),
            _ => Err(Broken),
        }
    }

    fn of(said: &'a str) -> Self {
        let (address, data) = said.split_once(',').unwrap_or((said, ""));
        match (address.as_bytes(), address.get(3..)) {
            ([b'$', b'P', ..], _) => Self::Proprietary,
            ([b'$', a, b, _, _, _], Some(kind)) => Self::Standard {
                talker: [*a, *b],
                kind,
                data,
            },
            _ => Self::Other,
        }
    }
}

/// What a sentence says that is of use here.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Content {
    /// GGA: a position, or that there is none.
    Position(Position),
    /// RMC: position, velocity, date.
    Minimum(Minimum),
    /// GST: how good the position is.
    Noise(Noise),
    /// ZDA: the date.
    Date(TimeOfDay, NaiveDate),
    /// VTG: the velocity.
    Motion(Motion),
    /// HDT: where the body looks, from true north to the right (degrees).
    Heading(f64),
    /// Nothing that is of use.
    Nothing,
}

/// GGA.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Position {
    /// When.
    pub time: TimeOfDay,
    /// Latitude and longitude (degrees); none without a fix.
    pub place: Option<[f64; 2]>,
    /// Its quality field.
    pub quality: u8,
    /// Satellites used.
    pub satellites: Option<u32>,
    /// Horizontal dilution of precision.
    pub hdop: Option<f64>,
    /// Above the ellipsoid (m).
    pub height_m: Option<f64>,
}

/// RMC.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Minimum {
    /// When.
    pub time: TimeOfDay,
    /// The day.
    pub date: Option<NaiveDate>,
    /// Latitude and longitude (degrees).
    pub place: Option<[f64; 2]>,
    /// Its mode, as the quality field of GGA says it; 0 if it is not valid.
    pub quality: u8,
    /// How it moves.
    pub motion: Motion,
}

/// GST.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Noise {
    /// Of which fix.
    pub time: TimeOfDay,
    /// Standard deviation of the latitude and the longitude (m).
    pub sigma_m: [f64; 2],
}

/// A velocity over ground.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Motion {
    /// How fast (m/s).
    pub speed_m_s: Option<f64>,
    /// Whereto, from true north to the right (degrees).
    pub course_deg: Option<f64>,
}

/// The checksum is right, and what it says cannot be.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Malformed;

/// What a standard sentence says.
///
/// # Errors
/// If a field is not what the standard says, or a value cannot be.
pub fn content(kind: &str, data: &str) -> Result<Content, Malformed> {
    match kind {
        "GGA" => position(data),
        "RMC" => minimum(data),
        "GST" => noise(data),
        "ZDA" => date(data),
        "VTG" => motion(data),
        "HDT" => heading(data),
        _ => Ok(Content::Nothing),
    }
}

/// A sentence of the crate's, without its time; nothing if it has none.
fn timed(
    kind: SentenceType,
    data: &str,
) -> Result<Option<(TimeOfDay, NmeaSentence<'_>)>, Malformed> {
    let comma = data.find(',').ok_or(Malformed)?;
    let (time, rest) = data.split_at(comma);
    if time.is_empty() {
        return Ok(None);
    }
    let time = TimeOfDay::parse(time).ok_or(Malformed)?;
    Ok(Some((time, untimed(kind, rest))))
}

fn untimed(message_id: SentenceType, data: &str) -> NmeaSentence<'_> {
    NmeaSentence {
        talker_id: "GP",
        message_id,
        data,
        checksum: 0,
    }
}

fn position(data: &str) -> Result<Content, Malformed> {
    let Some((time, sentence)) = timed(SentenceType::GGA, data)? else {
        return Ok(Content::Nothing);
    };
    let gga = parse_gga(sentence).map_err(|_| Malformed)?;
    let quality = data.split(',').nth(5).and_then(|field| field.parse().ok());
    let place = place(data, 1, gga.latitude.zip(gga.longitude))?;
    let height = number(gga.altitude)?.zip(number(gga.geoid_separation)?);
    Ok(Content::Position(Position {
        time,
        place,
        quality: quality.ok_or(Malformed)?,
        satellites: gga.fix_satellites,
        hdop: not_negative(gga.hdop)?,
        height_m: height.map(|(above_sea, sea)| above_sea + sea),
    }))
}

fn minimum(data: &str) -> Result<Content, Malformed> {
    let Some((time, sentence)) = timed(SentenceType::RMC, data)? else {
        return Ok(Content::Nothing);
    };
    let rmc = parse_rmc(sentence).map_err(|_| Malformed)?;
    let quality = match (rmc.status_of_fix, rmc.faa_mode) {
        (RmcStatusOfFix::Invalid, _) => 0,
        (RmcStatusOfFix::Differential, None) => 2,
        (_, mode) => mode.map_or(1, quality),
    };
    Ok(Content::Minimum(Minimum {
        time,
        date: rmc.fix_date,
        place: place(data, 2, rmc.lat.zip(rmc.lon))?,
        quality,
        motion: moving(rmc.speed_over_ground, rmc.true_course)?,
    }))
}

/// Modes in the numbers of GGA.
fn quality(mode: FaaMode) -> u8 {
    match mode {
        FaaMode::Autonomous => 1,
        FaaMode::Differential => 2,
        FaaMode::Precise => 3,
        FaaMode::FixedRtk => 4,
        FaaMode::FloatRtk => 5,
        FaaMode::Estimated => 6,
        FaaMode::Manual => 7,
        FaaMode::Simulator => 8,
        _ => 0,
    }
}

fn noise(data: &str) -> Result<Content, Malformed> {
    let Some((time, sentence)) = timed(SentenceType::GST, data)? else {
        return Ok(Content::Nothing);
    };
    let gst = parse_gst(sentence).map_err(|_| Malformed)?;
    let latitude = not_negative(gst.lat_sd)?;
    let Some(both) = latitude.zip(not_negative(gst.long_sd)?) else {
        return Ok(Content::Nothing);
    };
    Ok(Content::Noise(Noise {
        time,
        sigma_m: both.into(),
    }))
}

fn date(data: &str) -> Result<Content, Malformed> {
    let Some((time, sentence)) = timed(SentenceType::ZDA, data)? else {
        return Ok(Content::Nothing);
    };
    let zda = parse_zda(sentence).map_err(|_| Malformed)?;
    let date = zda.utc_date();
    Ok(date.map_or(Content::Nothing, |date| Content::Date(time, date)))
}

fn motion(data: &str) -> Result<Content, Malformed> {
    let vtg = parse_vtg(untimed(SentenceType::VTG, data)).map_err(|_| Malformed)?;
    moving(vtg.speed_over_ground, vtg.true_course).map(Content::Motion)
}

fn heading(data: &str) -> Result<Content, Malformed> {
    let hdt = parse_hdt(untimed(SentenceType::HDT, data)).map_err(|_| Malformed)?;
    Ok(match number(hdt.heading)? {
        Some(heading) if heading.abs() <= 360.0 => Content::Heading(heading),
        Some(_) => return Err(Malformed),
        None => Content::Nothing,
    })
}

fn moving(knots: Option<f32>, course: Option<f32>) -> Result<Motion, Malformed> {
    let course_deg = number(course)?;
    if course_deg.is_some_and(|course| course.abs() > 360.0) {
        return Err(Malformed);
    }
    let speed_m_s = not_negative(knots)?.map(|knots| knots * KNOT_M_S);
    if speed_m_s.is_some_and(|speed| speed > FASTEST_M_S) {
        return Err(Malformed);
    }
    Ok(Motion {
        speed_m_s,
        course_deg,
    })
}

/// Latitude and longitude, whose fields begin with number `first`.
fn place(
    data: &str,
    first: usize,
    read: Option<(f64, f64)>,
) -> Result<Option<[f64; 2]>, Malformed> {
    let Some((latitude, longitude)) = read else {
        return Ok(None);
    };
    let mut fields = data.split(',').skip(first).step_by(2);
    let minutes = |field: Option<&str>, degrees: usize| {
        let minutes = field.and_then(|field| field.get(degrees..)?.parse().ok());
        minutes.is_some_and(|minutes: f64| (0.0..60.0).contains(&minutes))
    };
    let is_right = minutes(fields.next(), 2) && minutes(fields.next(), 3);
    let is_on_earth = latitude.abs() <= 90.0 && longitude.abs() <= 180.0;
    if is_right && is_on_earth {
        Ok(Some([latitude, longitude]))
    } else {
        Err(Malformed)
    }
}

fn number(value: Option<f32>) -> Result<Option<f64>, Malformed> {
    match value {
        Some(value) if !value.is_finite() => Err(Malformed),
        value => Ok(value.map(f64::from)),
    }
}

fn not_negative(value: Option<f32>) -> Result<Option<f64>, Malformed> {
    match number(value)? {
        Some(value) if value < 0.0 => Err(Malformed),
        value => Ok(value),
    }
}

/// A line with its checksum, for who plays a receiver: `said` is what stands between `$` and `*`.
#[must_use]
pub fn line(said: &str) -> String {
    let sum = said.bytes().fold(0, |sum, byte| sum ^ byte);
    format!("${said}*{sum:02X}\r\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(said: &str) -> Result<Content, Malformed> {
        let line = line(said);
        match Sentence::read(line.as_bytes()).unwrap() {
            Sentence::Standard { kind, data, .. } => content(kind, data),
            other => panic!("{said}: {other:?}"),
        }
    }

    #[test]
    fn the_checksum_comes_first() {
        let good = b"$GPGGA,,,,,,0,,,,M,,M,,*66";
        assert!(Sentence::read(good).is_ok());
        for place in 1..good.len() {
            let mut bad = *good;
            bad[place] ^= 1;
            assert_eq!(Sentence::read(&bad), Err(Broken), "{place}");
        }
        for bad in [
            "$GPGGA,1",
            "$GPGGA,1*",
            "$GPGGA,1*7",
            "$GPGGA,1*+F",
            "$",
            "*",
            "",
        ] {
            assert_eq!(Sentence::read(bad.as_bytes()), Err(Broken), "{bad}");
        }
        assert!(Sentence::read(b"$GPGGA,,,,,,0,,,,M,,M,,*66 ").is_ok());
    }

    #[test]
    fn what_is_not_standard_is_no_error() {
        let of = |said: &str| match Sentence::read(line(said).as_bytes()) {
            Ok(Sentence::Standard { kind, .. }) => kind.to_owned(),
            other => format!("{other:?}"),
        };
        assert_eq!(of("PSTI,030,1"), "Ok(Proprietary)");
        assert_eq!(of("PUBX,00"), "Ok(Proprietary)");
        assert_eq!(of("GPGGAX,1"), "Ok(Other)");
        assert_eq!(of("GP"), "Ok(Other)");
        assert_eq!(of("SDDBT,18.0,f"), "DBT");
        assert_eq!(read("GPGSV,4,1"), Ok(Content::Nothing));
    }

    #[test]
    fn a_position_is_read_with_all_its_parts() {
        let said =
            "GNGGA,213121.000,4404.1295864,N,12118.8685453,W,2,07,1.2,1102.537,M,-20.300,M,,0000";
        let Ok(Content::Position(it)) = read(said) else {
            panic!("no position");
        };
        assert_eq!(it.time, TimeOfDay::parse("213121").unwrap());
        let [latitude, longitude] = it.place.unwrap();
        assert!(
            (latitude - 44.068_826_44).abs() < 1e-9 && (longitude + 121.314_475_755).abs() < 1e-9
        );
        assert_eq!((it.quality, it.satellites), (2, Some(7)));
        assert!((it.hdop.unwrap() - 1.2).abs() < 1e-6);
        assert!((it.height_m.unwrap() - 1082.237).abs() < 1e-3);
    }

    #[test]
    fn no_fix_is_said_as_that() {
        let Ok(Content::Position(it)) =
            read("GPGGA,133605.0,5521.75946,N,03731.93769,E,0,00,,,M,,M,,")
        else {
            panic!("no position");
        };
        assert_eq!((it.quality, it.hdop, it.height_m), (0, None, None));
        assert_eq!(read("GPGGA,,,,,,0,,,,M,,M,,"), Ok(Content::Nothing));
        let Ok(Content::Minimum(it)) = read("GPRMC,133605.0,V,,,,,,,070416,,,N") else {
            panic!("no minimum");
        };
        assert_eq!((it.quality, it.place, it.date.is_some()), (0, None, true));
    }

    #[test]
    fn a_leap_second_is_a_time() {
        let Ok(Content::Minimum(it)) =
            read("GPRMC,235960.00,A,4404.1,N,12118.8,W,1.0,90.0,311216,,,A")
        else {
            panic!("no minimum");
        };
        assert_eq!(it.time.ns(), 86_400_000_000_000);
        assert!((it.motion.speed_m_s.unwrap() - 0.514_444).abs() < 1e-6);
    }

    #[test]
    fn modes_are_qualities() {
        for (mode, quality) in [
            ("A", 1),
            ("D", 2),
            ("P", 3),
            ("R", 4),
            ("F", 5),
            ("E", 6),
            ("M", 7),
            ("S", 8),
            ("N", 0),
        ] {
            let said = format!("GPRMC,120000,A,4404.1,N,12118.8,W,1.0,90.0,311216,,,{mode}");
            let Ok(Content::Minimum(it)) = read(&said) else {
                panic!("{said}");
            };
            assert_eq!(it.quality, quality, "{mode}");
        }
    }

    #[test]
    fn what_cannot_be_is_malformed() {
        for said in [
            "GPGGA,120000,4460.0,N,12118.8,W,1,07,1.2,1,M,1,M,,",
            "GPGGA,120000,9100.0,N,12118.8,W,1,07,1.2,1,M,1,M,,",
            "GPGGA,120000,44nan,N,12118.8,W,1,07,1.2,1,M,1,M,,",
            "GPGGA,120000,44-1.0,N,12118.8,W,1,07,1.2,1,M,1,M,,",
            "GPGGA,120000,4404.1,N,18118.8,W,1,07,1.2,1,M,1,M,,",
            "GPGGA,120000,4404.1,N,12118.8,W,9,07,1.2,1,M,1,M,,",
            "GPGGA,120000,4404.1,N,12118.8,W,1,07,inf,1,M,1,M,,",
            "GPGGA,126000,4404.1,N,12118.8,W,1,07,1.2,1,M,1,M,,",
            "GPGGA,120000",
            "GPRMC,120000,A,4404.1,N,12118.8,W,-1.0,90.0,311216,,,A",
            "GPGST,120000,1,1,1,1,-1,1,1",
            "GPHDT,400.0,T",
            "GPHDT",
        ] {
            assert_eq!(read(said), Err(Malformed), "{said}");
        }
    }

    #[test]
    fn noise_date_motion_and_heading_are_read() {
        let Ok(Content::Noise(it)) = read("GPGST,213121.000,16.1,22.2,10.2,2.0,0.4,0.6,1.4") else {
            panic!("no noise");
        };
        assert!((it.sigma_m[0] - 0.4).abs() < 1e-6 && (it.sigma_m[1] - 0.6).abs() < 1e-6);
        let date = NaiveDate::from_ymd_opt(2016, 4, 7).unwrap();
        let time = TimeOfDay::parse("213121").unwrap();
        assert_eq!(
            read("GPZDA,213121.000,07,04,2016,00,00"),
            Ok(Content::Date(time, date))
        );
        let Ok(Content::Motion(it)) = read("GPVTG,230.5,T,229.1,M,5.6,N,10.4,K,A") else {
            panic!("no motion");
        };
        assert!((it.speed_m_s.unwrap() - 2.88).abs() < 0.01 && it.course_deg == Some(230.5));
        assert_eq!(read("GPHDT,123.5,T"), Ok(Content::Heading(123.5)));
        assert_eq!(read("GPHDT,,T"), Ok(Content::Nothing));
    }
}
