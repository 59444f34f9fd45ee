//! What sees other robots and landmarks in part, and the landmarks.

use coloc_drivers::encoder::{Rounded, Time};

use super::super::{Config, Landmark};
use super::page::Page;

/// How far away something is of which it is said what an angle makes of it \[m\].
const AWAY_M: f64 = 5.0;

/// Half a degree, as a camera is off by.
const ANGLE_RAD: f64 = 0.01;

pub(super) fn write(config: &Config, page: &mut Page) {
    if !config.sighting.heard {
        return;
    }
    page.line(
        "sightings",
        "range and bearing, or one of them, on the channel sighting; what robots make of them on seen and answer",
    );
    if config.sighting.through_track {
        page.line(
            "",
            "of other robots by way of coloc-track, which has to run: poses of tracks where their headings are known, sightings elsewhere",
        );
    }
    page.line("", mounts(config));
    page.line(
        "",
        "each message says its own noise: white, new in every sighting, and slow, the same for seconds and for all in one image",
    );
    page.line(
        "",
        format!(
            "a bearing of σ {ANGLE_RAD} rad ({}°) is ± {} at {AWAY_M} m, a range of σ 1 % ± {}",
            Rounded(ANGLE_RAD.to_degrees()),
            length(AWAY_M * ANGLE_RAD),
            length(0.01 * AWAY_M)
        ),
    );
    page.lines("", floor(config));
    page.line("", memory(config));
    landmarks(&config.landmark, page);
}

fn mounts(config: &Config) -> String {
    let own = |source: &str, [x, y, turned]: [f64; 3]| {
        format!(
            "{source} sits {} ahead, {} to the left, turned {}° to the left",
            length(x),
            length(y),
            Rounded(turned.to_degrees())
        )
    };
    let sighting = &config.sighting;
    let sensors = sighting
        .sensor
        .iter()
        .map(|it| own(&format!("sensor {}", it.source), it.mount));
    let all = std::iter::once(own("a sensor that does not say so", sighting.mount)).chain(sensors);
    all.collect::<Vec<_>>().join("; ")
}

fn floor(config: &Config) -> Option<String> {
    let [x, y, _] = config.fusion.relative_pose_floor;
    (x > 0.0 || y > 0.0).then(|| {
        format!(
            "and none is taken to be more certain than ± {} ahead, ± {} across",
            length(x),
            length(y)
        )
    })
}

fn memory(config: &Config) -> String {
    let position = &config.fusion.position;
    format!(
        "what others say counts with a memory of {}, a heading as if {} away",
        Time(position.memory_s),
        length(position.heading_lever_m)
    )
}

fn landmarks(listed: &[Landmark], page: &mut Page) {
    let sigmas = || listed.iter().map(|it| it.sigma_m);
    let (least, most) = (
        sigmas().fold(f64::INFINITY, f64::min),
        sigmas().fold(0.0, f64::max),
    );
    let text = match listed {
        [] => return page.line("landmarks", "none: only robots are seen"),
        [one] => format!(
            "number {}, known to ± {} (σ)",
            one.number,
            length(one.sigma_m)
        ),
        _ if least < most => format!(
            "{}, known to ± {} to ± {} (σ)",
            listed.len(),
            length(least),
            length(most)
        ),
        _ => format!("{}, known to ± {} (σ) each", listed.len(), length(most)),
    };
    page.line("landmarks", text);
    page.line(
        "",
        "that error never changes: who sees one again and again knows itself no better than that",
    );
}

/// Metres, or centimetres of what is less.
fn length(metres: f64) -> String {
    if metres.abs() < 1.0 && metres.abs() > 0.0 {
        format!("{} cm", Rounded(100.0 * metres))
    } else {
        format!("{} m", Rounded(metres))
    }
}
