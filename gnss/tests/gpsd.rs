//! Recordings of real receivers, as gpsd reads them and as we do.
//!
//! Every difference stands in `gpsd_differences.tsv` with its reason, which is found in the sentences themselves.
//! `COLOC_WRITE=1 cargo test -p coloc-gnss --test gpsd` writes it anew.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use coloc_gnss::fix::Fix;
use coloc_gnss::receiver::{Event, Receiver};
use coloc_gnss::utc::iso;
use coloc_sensors::Moment;
use flate2::read::MultiGzDecoder;
use serde_json::Value;

const TABLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/gpsd_differences.tsv");
/// gpsd writes nine decimals of a degree.
const SAME_DEG: f64 = 1e-8;
const LOGS: [&str; 8] = [
    "bundg_zeus_9",
    "cat-ms352",
    "haicom-305N",
    "hemi",
    "rx210",
    "skytraq-dgps",
    "ublox-8",
    "ublox-neo-m9n-nmea",
];

/// `COLOC_DATA`, or `../shared/data` of this folder or of one above it.
fn folder() -> Option<PathBuf> {
    let given = std::env::var_os("COLOC_DATA").map(PathBuf::from);
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let above = here.ancestors().map(|folder| folder.join("../shared/data"));
    let mut folders = given.into_iter().chain(above);
    let found = folders.find_map(|folder| {
        let folder = folder.join("gpsd_nmea");
        folder.is_dir().then_some(folder)
    });
    if found.is_none() {
        println!("SKIPPED: no recordings gpsd_nmea: set COLOC_DATA to the folder that has them");
    }
    found
}

fn unzipped(path: &Path) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut file = MultiGzDecoder::new(File::open(path).unwrap());
    file.read_to_end(&mut bytes).unwrap();
    bytes
}

fn fixes(log: &[u8]) -> Vec<Fix> {
    let mut fixes = Vec::new();
    let mut note = |event| match event {
        Event::Fix(fix, _) if fix.quality > 0 => fixes.push(fix),
        _ => {}
    };
    let mut receiver = Receiver::new(None);
    // Cut at places that have nothing to do with lines.
    for piece in log.chunks(61) {
        receiver.take(piece, Moment::default(), &mut note);
    }
    receiver.cut(Moment::default(), &mut note);
    fixes
}

/// Positions of gpsd by time, in milliseconds as it writes them.
fn positions_of_gpsd(check: &[u8]) -> BTreeMap<String, Vec<[f64; 2]>> {
    let mut positions = BTreeMap::<_, Vec<_>>::new();
    for line in String::from_utf8_lossy(check).lines() {
        let Ok(object) = serde_json::from_str::<Value>(line) else {
            continue;
        };
        let place = object["lat"].as_f64().zip(object["lon"].as_f64());
        if let ("TPV", Some(place)) = (object["class"].as_str().unwrap_or_default(), place) {
            let time = object["time"].as_str().unwrap_or_default().to_owned();
            positions.entry(time).or_default().push(place.into());
        }
    }
    positions
}

/// A position in a sentence, read by nothing that is tested.
#[derive(Clone, Debug)]
struct Said {
    kind: String,
    /// `hhmmss` with what decimals it has.
    time: String,
    place: Option<[f64; 2]>,
    /// Of a GGA.
    quality: u8,
    satellites: u8,
}

fn said(log: &[u8]) -> Vec<Said> {
    let text = String::from_utf8_lossy(log);
    text.lines().filter_map(sentence).collect()
}

fn sentence(line: &str) -> Option<Said> {
    let fields: Vec<&str> = line.split('*').next()?.split(',').collect();
    let kind = fields[0].get(3..)?;
    let (time, first) = match kind {
        "GGA" => (1, 2),
        "RMC" => (1, 3),
        "GLL" => (5, 1),
        _ => return None,
    };
    let angle = |at: usize, digits: usize| -> Option<f64> {
        let (degrees, minutes) = fields.get(at)?.split_at_checked(digits)?;
        let angle = degrees.parse::<f64>().ok()? + minutes.parse::<f64>().ok()? / 60.0;
        let is_negative = ["S", "W"].contains(fields.get(at + 1)?);
        Some(if is_negative { -angle } else { angle })
    };
    let number = |at: usize| fields.get(at).and_then(|field| field.parse().ok());
    Some(Said {
        kind: kind.into(),
        time: (*fields.get(time)?).to_owned(),
        place: angle(first, 2).zip(angle(first + 2, 3)).map(Into::into),
        quality: number(6).filter(|_| kind == "GGA").unwrap_or(0),
        satellites: number(7).filter(|_| kind == "GGA").unwrap_or(0),
    })
}

fn same(a: [f64; 2], b: [f64; 2]) -> bool {
    (a[0] - b[0]).abs() <= SAME_DEG && (a[1] - b[1]).abs() <= SAME_DEG
}

/// `2018-08-20T09:47:37.500Z` as `hhmmss` and milliseconds.
fn time_of_day(time: &str) -> String {
    let digits = time.get(11..23).unwrap_or_default();
    digits.replace([':', '.'], "")
}

fn is_of(said: &Said, time: &str) -> bool {
    let (whole, decimals) = said.time.split_once('.').unwrap_or((&said.time, ""));
    format!(
        "{whole}{:0<3}",
        decimals.get(..3.min(decimals.len())).unwrap()
    ) == time_of_day(time)
}

/// Why gpsd has another position at this time, or none.
fn reason(fix: &Fix, time: &str, gpsd: &BTreeMap<String, Vec<[f64; 2]>>, said: &[Said]) -> String {
    let now: Vec<&Said> = said.iter().filter(|it| is_of(it, time)).collect();
    if let Some(others) = gpsd.get(time) {
        let of_another = |place: &[f64; 2]| {
            let matches = |it: &&&Said| it.place.is_some_and(|said| same(said, *place));
            now.iter().find(matches).filter(|it| it.kind != "GGA")
        };
        let mut kinds: Vec<_> = others
            .iter()
            .map(|place| of_another(place).map(|it| it.kind.as_str()))
            .collect();
        kinds.sort_unstable();
        kinds.dedup();
        let Some(kinds) = kinds.into_iter().collect::<Option<Vec<_>>>() else {
            return "unexplained".into();
        };
        return format!(
            "gpsd's is of {} of this time, where the receiver says another position",
            kinds.join(" and ")
        );
    }
    let gga = now.iter().find(|it| it.kind == "GGA");
    if gga.is_some_and(|it| it.satellites == 0) {
        return "the GGA has 0 satellites: gpsd takes it for none".into();
    }
    let elsewhere = gpsd
        .iter()
        .find(|(_, places)| places.iter().any(|place| same(*place, fix.place)));
    match elsewhere {
        Some((other, _)) => format!("gpsd dates it by the GLL behind it: {other}"),
        None => "unexplained".into(),
    }
}

/// Why gpsd has a position at a time at which we have none.
fn reason_of_more(
    time: &str,
    places: &[[f64; 2]],
    said: &[Said],
    ours: &[(String, Fix)],
) -> String {
    if time.is_empty() {
        let is_ours = |place: &[f64; 2]| {
            let by_sentence = said
                .iter()
                .any(|it| it.place.is_some_and(|it| same(it, *place)));
            by_sentence || ours.iter().any(|(_, fix)| same(fix.place, *place))
        };
        return if places.iter().all(is_ours) {
            "gpsd says positions of sentences without their time".into()
        } else {
            "unexplained".into()
        };
    }
    let now: Vec<&Said> = said.iter().filter(|it| is_of(it, time)).collect();
    let has_fix = now.iter().any(|it| it.kind == "GGA" && it.quality > 0);
    let mut kinds: Vec<_> = now.iter().map(|it| it.kind.as_str()).collect();
    kinds.sort_unstable();
    kinds.dedup();
    match (has_fix, kinds.is_empty()) {
        (false, false) => format!("no GGA has this time: only {}", kinds.join(" and ")),
        _ => "unexplained".into(),
    }
}

fn differences(name: &str, log: &[u8], check: &[u8]) -> String {
    let (gpsd, said) = (positions_of_gpsd(check), said(log));
    let ours: Vec<_> = fixes(log)
        .into_iter()
        .map(|fix| (fix.utc_ns.map(iso).unwrap_or_default(), fix))
        .collect();
    let gga: Vec<_> = said
        .iter()
        .filter(|it| it.kind == "GGA" && it.quality > 0)
        .collect();
    // Before any sentence says the date, neither of us knows it.
    assert_eq!(
        ours.len(),
        gga.len(),
        "{name}: our fixes are the GGA that have one"
    );
    for ((time, fix), said) in ours.iter().zip(gga) {
        assert!(
            (time.is_empty() || is_of(said, time)) && same(fix.place, said.place.unwrap()),
            "{name} {time}"
        );
    }
    let mut table = String::new();
    for (time, fix) in &ours {
        let places = gpsd.get(time);
        if !places.is_some_and(|places| places.iter().any(|place| same(*place, fix.place))) {
            let reason = reason(fix, time, &gpsd, &said);
            writeln!(table, "{name}\t{time}\t{reason}").unwrap();
        }
    }
    let is_more = |time: &&String| ours.iter().all(|(our, _)| our != *time);
    for time in gpsd.keys().filter(is_more) {
        let reason = reason_of_more(time, &gpsd[time], &said, &ours);
        let time = if time.is_empty() { "–" } else { time };
        writeln!(table, "{name}\t{time}\t{reason}").unwrap();
    }
    table
}

#[test]
fn fixes_are_gpsds_but_for_the_differences_that_are_known() {
    let Some(folder) = folder() else { return };
    let mut table = "log\ttime\treason\n".to_owned();
    for name in LOGS {
        let file = |end: &str| unzipped(&folder.join(format!("{name}.log{end}.gz")));
        table += &differences(name, &file(""), &file(".chk"));
    }
    assert!(!table.contains("unexplained"), "{table}");
    if std::env::var_os("COLOC_WRITE").is_some() {
        std::fs::write(TABLE, &table).unwrap();
    }
    let known = std::fs::read_to_string(TABLE).unwrap_or_default();
    assert!(
        table == known,
        "gpsd_differences.tsv says something else:\n{table}"
    );
}

/// The same bytes, torn in every way: no fix that was not there, and nothing that ends the program.
#[test]
fn broken_lines_make_no_other_fixes() {
    let Some(folder) = folder() else { return };
    let log = unzipped(&folder.join("skytraq-dgps.log.gz"));
    let whole = fixes(&log);
    let lines: Vec<&[u8]> = log.split_inclusive(|byte| *byte == b'\n').collect();
    // Each third line cut, and each fifth inside of its neighbour.
    let mut torn = Vec::new();
    for (number, line) in lines.iter().enumerate() {
        match number % 15 {
            0 | 3 | 6 | 9 | 12 => torn.extend_from_slice(&line[..line.len() / 2]),
            5 | 10 => {
                let half = line.len() / 2;
                torn.extend_from_slice(&line[..half]);
                torn.extend_from_slice(lines[number.saturating_sub(1)]);
                torn.extend_from_slice(&line[half..]);
            }
            _ => torn.extend_from_slice(line),
        }
    }
    let left = fixes(&torn);
    assert!(
        left.len() > whole.len() / 3,
        "{} of {}",
        left.len(),
        whole.len()
    );
    for fix in left.iter().filter(|fix| fix.utc_ns.is_some()) {
        let original = whole.iter().find(|it| it.utc_ns == fix.utc_ns).unwrap();
        assert!(same(original.place, fix.place), "{fix:?}");
    }
}
