//! What a UBX message says: NAV-PVT and NAV-RELPOSNED. All others are nothing that is of use here.

use chrono::NaiveDate;
use ublox::proto31::{PacketRef, Proto31};
use ublox::{GnssFixType, UbxProtocol};

use crate::sentence::FASTEST_M_S;
use crate::utc::{TimeOfDay, unix_ns};

const NAV: u8 = 1;
const PVT: u8 = 0x07;
const RELPOSNED: u8 = 0x3c;

/// Bits of the flags of RELPOSNED. The library knows neither the last of them nor a fourth value of the carrier's.
const FIX_OK: u32 = 1;
const DIFFERENTIAL: u32 = 1 << 1;
const VALID: u32 = 1 << 2;
const HEADING_VALID: u32 = 1 << 8;

/// What is of use.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Ubx {
    /// NAV-PVT.
    Solution(Solution),
    /// NAV-RELPOSNED, with a heading.
    Baseline(Baseline),
    /// Nothing.
    Nothing,
}

/// NAV-PVT.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Solution {
    /// GPS time of week (ms): messages of one epoch have the same.
    pub week_ms: u32,
    /// Since 1970 (ns); none while the receiver does not know the time.
    pub utc_ns: Option<i64>,
    /// Latitude and longitude (degrees).
    pub place: [f64; 2],
    /// Above the ellipsoid (m).
    pub height_m: f64,
    /// As the quality field of GGA says it.
    pub quality: u8,
    /// Satellites used.
    pub satellites: u32,
    /// Standard deviation (m).
    pub sigma_m: f64,
    /// How fast (m/s).
    pub speed_m_s: f64,
    /// Whereto, from true north to the right (degrees).
    pub course_deg: f64,
}

/// NAV-RELPOSNED: from one antenna to another.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Baseline {
    /// GPS time of week (ms).
    pub week_ms: u32,
    /// From true north to the right (degrees).
    pub heading_deg: f64,
    /// Its standard deviation (degrees).
    pub sigma_deg: f64,
    /// From one to the other (m).
    pub length_m: f64,
    /// As the quality field of GGA says it; 0 if the heading is not valid.
    pub quality: u8,
}

/// It is not as long as it should be, or says what cannot be.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Malformed;

/// What a message says whose checksum is right.
///
/// # Errors
/// If it cannot be.
pub fn content(class: u8, id: u8, payload: &[u8]) -> Result<Ubx, Malformed> {
    if class != NAV || ![PVT, RELPOSNED].contains(&id) {
        return Ok(Ubx::Nothing);
    }
    match Proto31::match_packet(class, id, payload) {
        Ok(PacketRef::NavPvt(packet)) => {
            let [latitude, longitude] = [packet.latitude(), packet.longitude()];
            within(latitude, 90.0)?;
            within(longitude, 180.0)?;
            within(packet.heading_motion(), 360.0)?;
            within(packet.ground_speed_2d(), FASTEST_M_S)?;
            let fix = packet.fix_type();
            Ok(Ubx::Solution(Solution {
                week_ms: packet.itow(),
                utc_ns: utc_ns(payload)?,
                place: [latitude, longitude],
                height_m: packet.height_above_ellipsoid(),
                quality: quality(fix, packet.flags_raw()),
                satellites: packet.num_satellites().into(),
                sigma_m: packet.horizontal_accuracy(),
                speed_m_s: packet.ground_speed_2d(),
                course_deg: packet.heading_motion(),
            }))
        }
        Ok(PacketRef::NavRelPosNed(packet)) => {
            within(packet.rel_pos_heading_degrees(), 360.0)?;
            let length_cm = packet.rel_pos_length_cm() + packet.rel_pos_hp_length_mm() * 0.1;
            Ok(Ubx::Baseline(Baseline {
                week_ms: packet.itow(),
                heading_deg: packet.rel_pos_heading_degrees(),
                sigma_deg: packet.acc_heading_degrees(),
                length_m: length_cm * 0.01,
                quality: baseline_quality(packet.flags_raw()),
            }))
        }
        _ => Err(Malformed),
    }
}

fn within(value: f64, most: f64) -> Result<(), Malformed> {
    (value.abs() <= most).then_some(()).ok_or(Malformed)
}

/// Year to fraction of a NAV-PVT, where its flags say that date and time are known.
fn utc_ns(payload: &[u8]) -> Result<Option<i64>, Malformed> {
    let field = |at: usize| payload.get(at).copied().map(u32::from).ok_or(Malformed);
    if field(11)? & 0b11 != 0b11 {
        return Ok(None);
    }
    let year = i32::try_from(field(4)? + 256 * field(5)?).map_err(|_| Malformed)?;
    let date = NaiveDate::from_ymd_opt(year, field(6)?, field(7)?).ok_or(Malformed)?;
    let time = TimeOfDay::new(field(8)?, field(9)?, field(10)?, 0).ok_or(Malformed)?;
    let fraction = payload.get(16..20).and_then(|it| it.first_chunk());
    let fraction_ns = i64::from(i32::from_le_bytes(*fraction.ok_or(Malformed)?));
    if fraction_ns.abs() > 1_000_000_000 {
        return Err(Malformed);
    }
    Ok(unix_ns(date, time).map(|ns| ns + fraction_ns))
}

fn quality(fix: GnssFixType, flags: u8) -> u8 {
    match fix {
        GnssFixType::DeadReckoningOnly => 6,
        GnssFixType::Fix2D | GnssFixType::Fix3D | GnssFixType::GPSPlusDeadReckoning
            if flags & 1 == 1 =>
        {
            carrier(u32::from(flags >> 6), flags & 2 == 2)
        }
        _ => 0,
    }
}

fn baseline_quality(flags: u32) -> u8 {
    const ALL: u32 = FIX_OK | VALID | HEADING_VALID;
    if flags & ALL == ALL {
        carrier(flags >> 3 & 0b11, flags & DIFFERENTIAL != 0)
    } else {
        0
    }
}

/// Both messages say in two bits whether the carrier's phase is used.
fn carrier(solution: u32, is_differential: bool) -> u8 {
    match (solution, is_differential) {
        (0, false) => 1,
        (0, true) => 2,
        (1, _) => 5,
        (2, _) => 4,
        _ => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As `[(offset, bytes)]`.
    fn payload(length: usize, fields: &[(usize, &[u8])]) -> Vec<u8> {
        let mut payload = vec![0; length];
        for (at, bytes) in fields {
            payload[*at..*at + bytes.len()].copy_from_slice(bytes);
        }
        payload
    }

    fn solution(fields: &[(usize, &[u8])]) -> Solution {
        match content(NAV, PVT, &payload(92, fields)) {
            Ok(Ubx::Solution(solution)) => solution,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_time_counts_once_it_is_known_and_its_fraction_may_be_negative() {
        let date: (usize, &[u8]) = (4, &[0xe8, 0x07, 1, 2, 3, 4, 5, 3]);
        let late = solution(&[date, (16, &(-1_000_000_i32).to_le_bytes())]);
        assert_eq!(
            crate::utc::iso(late.utc_ns.unwrap()),
            "2024-01-02T03:04:04.999Z"
        );
        let unknown: (usize, &[u8]) = (4, &[0xe8, 0x07, 1, 2, 3, 4, 5, 2]);
        assert_eq!(solution(&[unknown]).utc_ns, None);
        let no_month: (usize, &[u8]) = (4, &[0xe8, 0x07, 13, 2, 3, 4, 5, 3]);
        assert_eq!(content(NAV, PVT, &payload(92, &[no_month])), Err(Malformed));
    }

    #[test]
    fn what_cannot_be_is_malformed() {
        let [far, fast, around] = [1_000_000_000_i32, 1_000_001, 36_000_001].map(i32::to_le_bytes);
        for (at, bytes) in [(28, far), (60, fast), (64, around)] {
            assert_eq!(
                content(NAV, PVT, &payload(92, &[(at, &bytes)])),
                Err(Malformed)
            );
        }
        let turned = payload(64, &[(24, &around)]);
        assert_eq!(content(NAV, RELPOSNED, &turned), Err(Malformed));
    }

    #[test]
    fn fix_type_and_flags_are_a_quality() {
        for (fix, flags, quality) in [
            (0_u8, 1_u8, 0),
            (1, 1, 6),
            (3, 0, 0),
            (3, 1, 1),
            (2, 3, 2),
            (4, 3, 2),
            (3, 0x41, 5),
            (3, 0x83, 4),
            (3, 0xc1, 0),
            (5, 1, 0),
            (9, 1, 0),
        ] {
            assert_eq!(
                solution(&[(20, &[fix, flags])]).quality,
                quality,
                "{fix} {flags}"
            );
        }
    }

    #[test]
    fn a_baseline_without_a_valid_heading_has_no_quality() {
        for (flags, quality) in [
            (0x115_u32, 4),
            (0x10d, 5),
            (0x015, 0),
            (0x114, 0),
            (0x11d, 0),
            (0x107, 2),
            (u32::MAX, 0),
        ] {
            let bytes = payload(
                64,
                &[
                    (24, &9_000_000_i32.to_le_bytes()),
                    (60, &flags.to_le_bytes()),
                ],
            );
            let Ok(Ubx::Baseline(it)) = content(NAV, RELPOSNED, &bytes) else {
                panic!("{flags:x}");
            };
            assert!((it.heading_deg - 90.0).abs() < 1e-9);
            assert_eq!(it.quality, quality, "{flags:x}");
        }
    }

    #[test]
    fn a_length_that_is_not_right_is_malformed_and_another_message_is_not() {
        for id in [PVT, RELPOSNED] {
            for length in [0, 40, 63, 84, 91, 93] {
                assert_eq!(content(NAV, id, &vec![0; length]), Err(Malformed));
            }
        }
        assert_eq!(content(NAV, 0x35, &[1, 2]), Ok(Ubx::Nothing));
        assert_eq!(content(2, PVT, &[]), Ok(Ubx::Nothing));
    }
}
