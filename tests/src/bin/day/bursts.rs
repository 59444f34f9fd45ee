//! What a receiver says in each second of a day: a car that drives around a block.

use std::fmt::Write;

use coloc_gnss::datum::Origin;
use coloc_gnss::driver::{GnssDriver, Outlet};
use coloc_gnss::section::{DatumSection, Gnss};
use coloc_gnss::stamp::Stamper;

/// So many sentences a second.
pub(crate) const SENTENCES: u32 = 10;

/// Hears it, and tells `outlet`.
pub(crate) fn driver<O: Outlet>(outlet: O) -> GnssDriver<O> {
    let section = Gnss {
        datum: DatumSection {
            latitude_deg: Some(48.0),
            longitude_deg: Some(11.0),
            ..DatumSection::default()
        },
        ..Gnss::of("stdin")
    };
    let origin = Origin::begin(&section.datum, None).unwrap();
    GnssDriver::new(section, origin, outlet, Stamper::recording(false, 0))
}

/// Writes the sentences of that second of 2024-06-01.
pub(crate) fn write(second: u32, burst: &mut String) {
    burst.clear();
    let (hour, minute, of_minute) = (second / 3600, second / 60 % 60, second % 60);
    let time = format_args!("{hour:02}{minute:02}{of_minute:02}.00");
    let angle = f64::from(second) * 0.01;
    // A circle of 500 m, 5 m/s.
    let (north, east) = (0.27 * angle.sin(), 0.4 * angle.cos());
    let course = (-angle).to_degrees().rem_euclid(360.0);
    let place = format_args!(
        "4800.{:07.0},N,01100.{:07.0},E",
        (north + 0.5) * 1e7 % 1e7,
        (east + 0.5) * 1e7 % 1e7
    );
    sentence(
        burst,
        format_args!("GNGGA,{time},{place},2,12,0.70,520.1,M,47.0,M,,0000"),
    );
    sentence(
        burst,
        format_args!("GNRMC,{time},A,{place},9.72,{course:.2},010624,,,D,V"),
    );
    sentence(
        burst,
        format_args!("GNVTG,{course:.2},T,,M,9.72,N,18.0,K,D"),
    );
    sentence(
        burst,
        format_args!("GNGST,{time},12,1.2,0.8,45.0,0.9,0.8,1.9"),
    );
    sentence(burst, format_args!("GNZDA,{time},01,06,2024,00,00"));
    sentence(
        burst,
        format_args!("GNGSA,A,3,09,23,08,11,27,28,31,04,,,,,1.3,0.7,1.1,1"),
    );
    for number in 1..=3 {
        sentence(
            burst,
            format_args!(
                "GPGSV,3,{number},12,07,73,042,17,30,64,305,15,09,42,158,28,08,40,079,23,1"
            ),
        );
    }
    sentence(burst, format_args!("GNGLL,{place},{time},A,D"));
}

fn sentence(burst: &mut String, said: std::fmt::Arguments<'_>) {
    let begin = burst.len() + 1;
    // A text takes everything.
    let _ = write!(burst, "${said}");
    let sum = burst.as_bytes()[begin..]
        .iter()
        .fold(0, |sum, byte| sum ^ byte);
    let _ = write!(burst, "*{sum:02X}\r\n");
}
