//! How inputs are fused, and for how long they are remembered.

use coloc_drivers::encoder::{Length, Rounded, Time};

use super::super::{self as config, Config, Fusion};
use super::page::{Page, chosen};

pub(super) fn write(config: &Config, page: &mut Page) {
    fusion(&config.fusion, page);
    gates(&config.fusion, page);
    floors(&config.fusion, page);
    history(config, page);
    health(config, page);
}

fn fusion(fusion: &Fusion, page: &mut Page) {
    page.line(
        "fusion",
        format!(
            "the weight minimises {}",
            chosen("fusion.criterion", fusion.criterion)
        ),
    );
    if fusion.paper {
        return page.line("", "the paper's algorithm to the letter");
    }
    page.line(
        "",
        format!(
            "a belief is carried on {}",
            chosen("fusion.propagation", fusion.propagation)
        ),
    );
    page.line(
        "",
        format!(
            "a radian counts as {}; damping {}, memory {}; what was sent {} independent",
            Length(fusion.heading_lever_m),
            fusion.damping,
            Time(fusion.memory_s),
            if fusion.reset_on_transmit {
                "is no longer"
            } else {
                "stays"
            }
        ),
    );
}

fn gates(fusion: &Fusion, page: &mut Page) {
    let gate = |gate: f64| {
        if gate.is_infinite() {
            "however far off".into()
        } else {
            format!("up to d² = {}, {} σ", Rounded(gate), Rounded(gate.sqrt()))
        }
    };
    page.line(
        "gates",
        format!(
            "a neighbour's pose is accepted {}; d² is taken with the weight {}",
            gate(fusion.neighbour_gate),
            chosen("fusion.gate_weight", fusion.gate_weight)
        ),
    );
    page.line(
        "",
        format!("a fix is accepted {}", gate(fusion.position_gate)),
    );
    page.line(
        "",
        format!("a heading is accepted {}", gate(fusion.heading_gate)),
    );
}

fn floors(fusion: &Fusion, page: &mut Page) {
    let floors = [
        floor("sightings are", &fusion.relative_pose_floor),
        floor("neighbours' poses are", &fusion.neighbour_floor),
        floor("fixes are", &fusion.position_floor),
    ];
    let heading = fusion.heading_floor;
    let heading = (heading > 0.0)
        .then(|| format!("headings are never believed to be better than σ = {heading} rad"));
    let mut set: Vec<_> = floors.into_iter().chain([heading]).flatten().collect();
    if set.is_empty() {
        set.push("none: every source is believed to be as good as it says".into());
    }
    page.lines("floors", set);
}

/// Least σ of x, y and, of poses, the heading.
fn floor(what: &str, least: &[f64]) -> Option<String> {
    let unit = |(axis, sigma): (usize, &f64)| {
        if axis < 2 {
            Length(*sigma).to_string()
        } else {
            format!("{sigma} rad")
        }
    };
    let sigmas: Vec<_> = least.iter().enumerate().map(unit).collect();
    let is_set = least.iter().any(|&sigma| sigma > 0.0);
    is_set.then(|| {
        format!(
            "{what} never believed to be better than σ = {}",
            sigmas.join(", ")
        )
    })
}

fn history(config: &Config, page: &mut Page) {
    let history = &config.history;
    page.line(
        "history",
        format!(
            "{} measurements; older than {} is too old, more than {} ahead of the clock is from the future",
            history.capacity,
            Time(history.length_s),
            Time(history.future_tolerance_s)
        ),
    );
}

fn health(config: &Config, page: &mut Page) {
    let health = &config.health;
    let [odometry, sightings, fixes, neighbours] = [
        health.odometry_stale_s,
        health.relative_pose_stale_s,
        health.position_stale_s,
        health.neighbours_stale_s,
    ]
    .map(Time);
    page.line(
        "health",
        format!(
            "stale are odometry after {odometry}, sightings after {sightings}, fixes after {fixes}, neighbours after {neighbours}; slower ones, but for wheels, after 2.5 of their own intervals"
        ),
    );
    page.line("fit to drive on", fit(health));
}

fn fit(health: &config::Health) -> String {
    let limits = [
        (health.fit_position_m, "m", "position"),
        (health.fit_heading_rad, "rad", "heading"),
    ];
    let asked = limits.iter().filter(|(limit, ..)| *limit > 0.0);
    let asked: Vec<_> = asked
        .map(|(limit, unit, what)| format!("σ of the {what} at most {limit} {unit}"))
        .collect();
    match &*asked.join(", ") {
        "" => "whenever the robot knows where it is, however well".into(),
        asked => format!("when the robot knows where it is, {asked}"),
    }
}
