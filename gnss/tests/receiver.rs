//! What belongs to one moment is put together, whatever the order in which it comes.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use coloc_gnss::fix::Fix;
use coloc_gnss::frame::ubx_frame;
use coloc_gnss::receiver::{Event, Heading, Receiver};
use coloc_gnss::sentence::line;
use coloc_gnss::utc::iso;
use coloc_sensors::Moment;

/// A receiver, and what it has said.
#[derive(Default)]
struct Heard {
    receiver: Receiver,
    fixes: Vec<Fix>,
    headings: Vec<Heading>,
}

impl Heard {
    fn of(talker: Option<[u8; 2]>) -> Self {
        Self {
            receiver: Receiver::new(talker),
            ..Self::default()
        }
    }

    fn bytes(&mut self, bytes: &[u8]) {
        let (fixes, headings) = (&mut self.fixes, &mut self.headings);
        self.receiver
            .take(bytes, Moment::default(), &mut |event| match event {
                Event::Fix(fix, _) => fixes.push(fix),
                Event::Heading(heading, _) => headings.push(heading),
            });
    }

    fn say(&mut self, said: &str) -> usize {
        self.bytes(line(said).as_bytes());
        self.fixes.len()
    }

    fn pause(&mut self) -> usize {
        let fixes = &mut self.fixes;
        self.receiver.pause(&mut |event| {
            if let Event::Fix(fix, _) = event {
                fixes.push(fix);
            }
        });
        self.fixes.len()
    }

    fn times(&self) -> Vec<String> {
        let times = self.fixes.iter().map(|fix| fix.utc_ns.map(iso));
        times.map(Option::unwrap_or_default).collect()
    }
}

fn is_at(fix: &Fix, latitude: f64, longitude: f64) -> bool {
    (fix.place[0] - latitude).abs() < 1e-9 && (fix.place[1] - longitude).abs() < 1e-9
}

fn gga(time: &str) -> String {
    format!("GPGGA,{time},4800.0,N,01100.0,E,1,08,1.0,500.0,M,47.0,M,,")
}

fn rmc(time: &str, date: &str) -> String {
    format!("GPRMC,{time},A,4800.5,N,01100.5,E,10.0,90.0,{date},,,A")
}

fn gst(time: &str) -> String {
    format!("GPGST,{time},1,1,1,0,2.0,3.0,4.0")
}

#[test]
fn an_epoch_is_given_once_all_has_come_that_the_one_before_had() {
    let mut heard = Heard::default();
    assert_eq!(heard.say(&gga("120000")), 0);
    assert_eq!(heard.say(&rmc("120000", "010624")), 0);
    assert_eq!(heard.say(&gst("120000")), 0);
    assert_eq!(heard.say(&gga("120001")), 1, "the next one begins");
    assert_eq!(heard.say(&gst("120001")), 1);
    assert_eq!(heard.say(&rmc("120001", "010624")), 2, "it is complete");
    for fix in &heard.fixes {
        assert!((fix.worst_m().unwrap() - 3.0).abs() < 1e-12);
        assert!((fix.speed_m_s.unwrap() - 5.144).abs() < 1e-3);
        assert!(is_at(fix, 48.0, 11.0), "GGA has it, not RMC");
    }
}

#[test]
fn what_is_missing_is_not_waited_for_when_the_line_is_silent() {
    let mut heard = Heard::default();
    for said in [gga("120000"), gst("120000"), gga("120001")] {
        heard.say(&said);
    }
    assert_eq!(heard.fixes.len(), 1);
    assert_eq!(heard.pause(), 2);
    assert_eq!(heard.pause(), 2);
    assert_eq!(heard.say(&gst("120001")), 2, "it was given already");
    heard.say(&gga("120002"));
    assert_eq!(heard.say(&gst("120002")), 3);
}

#[test]
fn a_date_is_known_on_both_sides_of_midnight() {
    let mut heard = Heard::default();
    for said in [
        rmc("235958", "311223"),
        gga("235958"),
        gga("235959.5"),
        // In this receiver the date comes behind the position.
        gga("000000.5"),
        rmc("000000.5", "010124"),
        gga("000001.5"),
        gga("000002.5"),
    ] {
        heard.say(&said);
    }
    heard.pause();
    assert_eq!(
        heard.times(),
        [
            "2023-12-31T23:59:58.000Z",
            "2023-12-31T23:59:59.500Z",
            "2024-01-01T00:00:00.500Z",
            "2024-01-01T00:00:01.500Z",
            "2024-01-01T00:00:02.500Z",
        ]
    );
}

#[test]
fn the_four_digits_of_zda_come_before_the_two_of_rmc() {
    let mut heard = Heard::default();
    heard.say(&rmc("120000", "010684"));
    heard.say("GPZDA,120000,01,06,2084,00,00");
    heard.say(&gga("120000"));
    heard.pause();
    assert_eq!(heard.times(), ["2084-06-01T12:00:00.000Z"]);
}

#[test]
fn before_a_date_is_said_a_fix_has_none() {
    let mut heard = Heard::default();
    heard.say(&gga("120000"));
    heard.say(&gga("120001"));
    heard.say(&rmc("120002", "010624"));
    assert_eq!(heard.times(), ["", ""]);
}

#[test]
fn a_receiver_without_gga_is_understood_after_a_while() {
    let mut heard = Heard::default();
    for second in 10..20 {
        heard.say(&rmc(&format!("1200{second}"), "010624"));
    }
    assert_eq!(heard.times()[0], "2024-06-01T12:00:15.000Z");
    assert!(is_at(&heard.fixes[0], 48.0 + 0.5 / 60.0, 11.0 + 0.5 / 60.0));
    assert_eq!(heard.fixes.len(), 5, "the last is given at once");
}

#[test]
fn no_fix_is_a_word_too() {
    let mut heard = Heard::default();
    heard.say("GPGGA,120000,,,,,0,00,99.9,,M,,M,,");
    heard.pause();
    assert_eq!(heard.fixes[0].quality, 0);
}

#[test]
fn of_several_talkers_one_can_be_chosen_and_otherwise_the_first_counts() {
    let other = gga("120000")
        .replace("GPGGA", "GNGGA")
        .replace("4800.0", "4801.0");
    let mut heard = Heard::default();
    heard.say(&gga("120000"));
    heard.say(&other);
    heard.pause();
    assert!(heard.fixes.len() == 1 && is_at(&heard.fixes[0], 48.0, 11.0));
    let mut chosen = Heard::of(Some(*b"GN"));
    chosen.say(&gga("120000"));
    chosen.say(&other);
    chosen.pause();
    assert!(chosen.fixes.len() == 1 && is_at(&chosen.fixes[0], 48.0 + 1.0 / 60.0, 11.0));
}

/// NAV-PVT of 2024-06-01, an RTK fix.
fn solution(week_ms: u32, second: u8) -> Vec<u8> {
    let mut payload = vec![0; 92];
    payload[..4].copy_from_slice(&week_ms.to_le_bytes());
    payload[4..12].copy_from_slice(&[0xe8, 0x07, 6, 1, 12, 0, second, 0b111]);
    payload[20..24].copy_from_slice(&[3, 0x83, 0, 17]);
    payload[24..28].copy_from_slice(&110_000_000_i32.to_le_bytes());
    payload[28..32].copy_from_slice(&480_000_000_i32.to_le_bytes());
    payload[40..44].copy_from_slice(&14_u32.to_le_bytes());
    ubx_frame(1, 7, &payload)
}

#[test]
fn ubx_comes_before_nmea_while_it_is_there() {
    let mut heard = Heard::default();
    heard.bytes(&solution(518_400_000, 0));
    assert_eq!(heard.fixes.len(), 1);
    let fix = heard.fixes[0];
    assert_eq!((fix.quality, fix.satellites), (4, Some(17)));
    assert!(is_at(&fix, 48.0, 11.0));
    assert!((fix.worst_m().unwrap() - 0.014).abs() < 1e-12);
    for second in 10..18 {
        heard.say(&gga(&format!("1200{second}")));
    }
    heard.pause();
    assert_eq!(heard.fixes.len(), 1 + 3, "five are left out");
}

#[test]
fn a_baseline_has_the_time_of_its_week() {
    let mut heard = Heard::default();
    let baseline = |week_ms: u32| {
        let mut payload = vec![1; 64];
        payload[4..8].copy_from_slice(&week_ms.to_le_bytes());
        payload[24..28].copy_from_slice(&4_500_000_i32.to_le_bytes());
        payload[52..56].copy_from_slice(&50_000_u32.to_le_bytes());
        payload[60..64].copy_from_slice(&0x115_u32.to_le_bytes());
        ubx_frame(1, 0x3c, &payload)
    };
    heard.bytes(&baseline(0));
    assert_eq!(heard.headings[0].utc_ns, None);
    heard.bytes(&solution(604_799_900, 5));
    heard.bytes(&baseline(604_799_900));
    heard.bytes(&baseline(100));
    let times: Vec<_> = heard.headings[1..]
        .iter()
        .map(|it| iso(it.utc_ns.unwrap()))
        .collect();
    assert_eq!(
        times,
        ["2024-06-01T12:00:05.000Z", "2024-06-01T12:00:05.200Z"]
    );
    let heading = heard.headings[1];
    assert!(
        (heading.degrees - 45.0).abs() < 1e-9 && (heading.stated_deg.unwrap() - 0.5).abs() < 1e-9
    );
}
