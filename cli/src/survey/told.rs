//! What was found, for people, and as sections of robot.toml.

use coloc_calibrate::survey::{Found, Survey};
use coloc_daemon::config::Landmark;
use serde::Serialize;

use super::read::Read;
use crate::eval::table::Table;

/// Places and σ are written to a tenth of a millimetre, and no σ below it.
const FINEST_M: f64 = 1e-4;

#[derive(Serialize)]
struct Sections {
    landmark: Vec<Landmark>,
}

pub(super) fn table(survey: &Survey, read: &Read) -> String {
    let mut table = Table::new(
        title(survey, read),
        &[
            "landmark",
            "used",
            "x [m]",
            "y [m]",
            "σ [m]",
            "sightings",
            "far off",
        ],
    );
    table.rows.extend(survey.landmarks.iter().map(row));
    let refused = survey.landmarks.iter().filter_map(|it| {
        let unfit = it.unfit.as_ref()?;
        Some(format!("  {} is left out: {unfit}\n", it.landmark))
    });
    let alone = match read.alone {
        0 => String::new(),
        count => format!("  {count} sightings of a range or a bearing alone were not used\n"),
    };
    table.text() + &refused.collect::<String>() + &alone
}

fn title(survey: &Survey, read: &Read) -> String {
    let [sightings, fixes] = survey.larger;
    let number = |it: Option<u16>| it.map_or_else(|| "–".into(), |it| it.to_string());
    let [sensor, receiver] = read.used.map(number);
    let times = |it: f64| format!("{it:.1} times what it says");
    format!(
        "Landmarks, by sensor {sensor} (white noise {}) and receiver {receiver} (noise {}; {} of {} fixes far off)",
        times(sightings),
        times(fixes),
        survey.stray_fixes,
        read.journey.fixes.len()
    )
}

fn row(found: &Found) -> Vec<String> {
    let [x, y] = found.position.map(|it| format!("{it:.3}"));
    let [agree, stray] = found.sightings.map(|it| it.to_string());
    let used = if found.unfit.is_none() { "yes" } else { "NO" };
    let sigma = format!("{:.3}", found.sigma_m());
    vec![
        found.landmark.to_string(),
        used.into(),
        x,
        y,
        sigma,
        agree,
        stray,
    ]
}

/// As TOML.
pub(super) fn sections(survey: &Survey) -> Result<String, toml::ser::Error> {
    let fit = survey.landmarks.iter().filter(|it| it.unfit.is_none());
    let landmark = |found: &Found| Landmark {
        number: found.landmark,
        position: found.position.map(rounded),
        // Of the longer axis: in no direction is it believed to be better known.
        sigma_m: rounded(found.sigma_m() + 0.5 * FINEST_M).max(FINEST_M),
    };
    toml::to_string(&Sections {
        landmark: fit.map(landmark).collect(),
    })
}

fn rounded(metres: f64) -> f64 {
    (metres / FINEST_M).round() / (1.0 / FINEST_M)
}
