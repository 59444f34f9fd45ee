//! Cases from the field (`COLOC_CASES`): DBC files and logs that were misread once.

use std::error::Error;
use std::path::{Path, PathBuf};

use coloc_drivers::Database;
use coloc_drivers::can::{Filter, Log, LogReport, Received};
use coloc_drivers::encoder::{OdometryConfig, OdometryDecoder};

type Fallible = Result<(), Box<dyn Error>>;

/// `COLOC_CASES`, or `../shared/cases` from here or any directory above.
fn cases() -> Option<PathBuf> {
    let given = std::env::var_os("COLOC_CASES").map(PathBuf::from);
    let above = Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .map(|directory| directory.join("shared/cases"));
    let found = given.into_iter().chain(above).find(|cases| cases.is_dir());
    if found.is_none() {
        eprintln!(
            "SKIPPED: no cases from the field; set COLOC_CASES to the directory that holds them"
        );
    }
    found
}

/// The odometry of a case, with its paths made absolute.
fn config(case: &Path) -> Result<OdometryConfig, Box<dyn Error>> {
    let robot: toml::Table = toml::from_str(&std::fs::read_to_string(case.join("robot.toml"))?)?;
    let odometry = robot.get("odometry").ok_or("no odometry")?.clone();
    let mut config: OdometryConfig = odometry.try_into()?;
    config.dbc = config.dbc.map(|dbc| case.join(dbc));
    Ok(config)
}

#[test]
fn dbc_files_are_read_right_or_refused() -> Fallible {
    let Some(cases) = cases() else {
        return Ok(());
    };
    for (case, expected) in [
        ("dbc-bom", None),
        ("dbc-minmax-dot", None),
        ("dbc-scale-int-dot", None),
        ("dbc-ev-float-initial", None),
        ("dbc-dup-name", Some("rename or remove one")),
        ("dbc-ext-silent", Some("wider than 11 bits")),
        ("dbc-ext-silent-foreign", Some("wider than 11 bits")),
        ("dbc-mulval-on-plain", Some("multiplexed")),
        ("enc-wrap-251", Some("251 if they wrap after 250")),
        ("enc-sna", None),
        ("dbc-j1939-sa", None),
    ] {
        let refusal = OdometryDecoder::new(&config(&cases.join(case))?).err();
        let refusal = refusal.map(|error| error.to_string());
        let is_right = match (&refusal, expected) {
            (None, None) => true,
            (Some(refusal), Some(expected)) => refusal.contains(expected),
            _ => false,
        };
        assert!(is_right, "{case}: {refusal:?}, expected {expected:?}");
    }
    Ok(())
}

#[test]
fn a_value_type_for_another_identifier_is_refused() -> Fallible {
    let Some(cases) = cases() else {
        return Ok(());
    };
    let database = Database::load(Some(&cases.join("dbc-valtype-wrong-id/wheels.dbc")))?;
    let message = database.message("WheelSpeeds")?;
    let refusal = database.signal(message, "Left").err().ok_or("accepted")?;
    assert!(
        refusal.to_string().contains("SIG_VALTYPE_ in line 13"),
        "{refusal}"
    );
    Ok(())
}

/// Plays a log without waiting: the way \[m\], the fastest sample \[m/s\] and what was found in it.
fn play(cases: &Path, log: &str) -> Result<(f64, f64, LogReport), Box<dyn Error>> {
    let mut decoder = OdometryDecoder::new(&config(&cases.join("log-ns9"))?)?;
    let log = Log::read(&cases.join(log), None, &Filter::ids(decoder.wanted_ids(0)))?;
    let (mut way_m, mut fastest_mps) = (0.0, 0.0_f64);
    for frame in log.frames() {
        let received = Received {
            frame: frame.frame,
            stamp_ns: frame.stamp_ns,
            bus: 0,
        };
        // A frame that was cut is refused by its checksum.
        if let Ok(Some(sample)) = decoder.push(&received) {
            #[expect(clippy::cast_precision_loss, reason = "seconds")]
            let dt_s = (sample.stamp_ns - sample.start_ns) as f64 * 1e-9;
            way_m += sample.velocity[0] * dt_s;
            fastest_mps = fastest_mps.max(sample.velocity[0].abs());
        }
    }
    Ok((way_m, fastest_mps, log.report().clone()))
}

#[test]
fn logs_are_played_as_far_as_they_go() -> Fallible {
    let Some(cases) = cases() else {
        return Ok(());
    };
    // What is not in the log is not driven: a log of a hundred lines holds fifty pairs, 0.02 m apart at most.
    for (log, damaged, jumps, cut) in [
        ("log-ns9/can.log", 0, 0, false),
        ("log-dlc8-foreign/can.log", 0, 0, false),
        ("log-trunc-odd/can.log", 1, 0, false),
        ("log-ntp-back-1h/can.log", 0, 1, false),
        ("log-ntp-forward/can.log", 0, 1, false),
        ("log-more/back-0.5s.log", 0, 1, false),
        ("log-more/blank-line.log", 0, 0, false),
        ("log-more/gz-trunc.log.gz", 0, 0, true),
        ("log-more/nul-tail.log", 1, 0, false),
        ("log-more/trunc-id.log", 1, 0, false),
        ("log-more/trunc-stamp.log", 1, 0, false),
        ("log-more/xl-foreign.log", 0, 0, false),
    ] {
        let (way_m, fastest_mps, report) = play(&cases, log)?;
        println!("{log}: {way_m:.3} m, at most {fastest_mps:.3} m/s; {report}");
        let found = (report.damaged, report.jumps, report.cut);
        assert_eq!(found, (damaged, jumps, cut), "{log}: {report}");
        assert!(fastest_mps <= 1.1, "{log}: {fastest_mps} m/s");
        assert!(report.frames > 90, "{log}: {report}");
    }
    Ok(())
}
