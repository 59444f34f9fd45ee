//! The noise of what wheels say, and what it makes of a robot.

use coloc_drivers::encoder::{OdometryConfig, Rounded, Time};
use coloc_estimator::noise::Variance;

use super::super::{Config, Motion, StandsBy};
use super::forecast::{Doubt, counts, standing, straight};
use super::page::{Page, chosen};

pub(super) fn write(config: &Config, odometry: &OdometryConfig, page: &mut Page) {
    let motion = &config.motion;
    page.line("noise", preset(motion));
    let speed = odometry.max_speed_mps;
    let directions = directions(config, odometry);
    page.lines("", directions.map(|direction| direction.text(speed)));
    page.line(
        "",
        format!(
            "each in a sample of {}; other intervals are scaled as white noise",
            Time(motion.reference_period_s)
        ),
    );
    after_100_m(config, speed, page);
    after_an_hour(config, odometry, page);
}

/// Its source is in the reference.
fn preset(motion: &Motion) -> String {
    let text = chosen("motion.preset", motion.preset);
    let (is, _) = text.split_once(". ").unwrap_or((&text, ""));
    let as_it_is = *motion == motion.preset.motion();
    let changed = if as_it_is {
        ""
    } else {
        "; changed in [motion], to"
    };
    format!("{is}{changed}")
}

struct Direction {
    name: &'static str,
    variance: Variance,
    unit: &'static str,
    /// A velocity in this direction is measured.
    moves: bool,
}

impl Direction {
    /// As σ, at rest and at the highest speed.
    fn text(&self, speed: f64) -> String {
        let Self { variance, unit, .. } = self;
        let sigma = |speed: f64| {
            let v = if self.moves { speed } else { 0.0 };
            Rounded(variance.at(v, speed, 0.0).sqrt())
        };
        let squares = growth(variance.c, "(rad/s)²");
        let linear = growth(variance.per_turn_rate, "rad/s");
        format!(
            "{} σ = {} {unit} at 0 m/s, {} {unit} at {speed} m/s{linear}{squares}",
            self.name,
            sigma(0.0),
            sigma(speed)
        )
    }
}

fn growth(by: f64, each: &str) -> String {
    if by > 0.0 {
        format!(", σ² growing by {} for each {each}", Rounded(by))
    } else {
        String::new()
    }
}

/// Those that have a part in what happens.
fn directions(
    config: &Config,
    odometry: &OdometryConfig,
) -> impl Iterator<Item = Direction> + use<> {
    let noise = config.motion.noise();
    let is_holonomic = odometry.moves_sideways();
    let direction = |name, variance, unit, moves| Direction {
        name,
        variance,
        unit,
        moves,
    };
    let all = [
        direction("forward", noise.forward, "m/s", true),
        direction("sideways", noise.sideways, "m/s", is_holonomic),
        direction("turning", noise.turning, "rad/s", true),
    ];
    let slips = noise.sideways.at(0.0, 1.0, 1.0) > 0.0;
    let is_used = move |it: &Direction| is_holonomic || slips || it.name != "sideways";
    all.into_iter().filter(is_used)
}

fn after_100_m(config: &Config, max_speed_mps: f64, page: &mut Page) {
    let speed_mps = max_speed_mps.min(1.0);
    let Doubt {
        along_m,
        across_m,
        heading_rad,
    } = straight(config, speed_mps);
    page.line(
        "",
        format!(
            "after 100 m straight at {speed_mps} m/s, the heading known at the start: ± {} m along, ± {} m across, heading ± {}°",
            brief(along_m),
            brief(across_m),
            brief(heading_rad.to_degrees())
        ),
    );
}

fn after_an_hour(config: &Config, odometry: &OdometryConfig, page: &mut Page) {
    let Doubt {
        along_m,
        across_m,
        heading_rad,
    } = standing(config);
    page.line(
        "",
        format!(
            "after an hour of standing: heading ± {}°, ± {} m along, ± {} m across",
            brief(heading_rad.to_degrees()),
            brief(along_m),
            brief(across_m)
        ),
    );
    page.line("stands by", said_by(config, odometry));
}

/// What the hour's standing was told by.
fn said_by(config: &Config, odometry: &OdometryConfig) -> String {
    let [forward, sideways, turning] = config.motion.creep_per_hour;
    let creep = format!(
        "meanwhile it may creep by {forward} m, {sideways} m sideways, {}° in an hour and be within 3 σ",
        brief(turning.to_degrees())
    );
    let by = chosen("motion.stands_by", config.motion.stands_by);
    match config.motion.stands_by {
        StandsBy::Nothing => by,
        StandsBy::Counts if !counts(odometry) => format!(
            "{by}; its speeds do not say that, and while they are 0 it has the noise of 0 m/s"
        ),
        _ => format!("{by}; {creep}"),
    }
}

/// Two digits are what noise is known to.
fn brief(sigma: f64) -> f64 {
    format!("{sigma:.1e}").parse().unwrap_or(sigma)
}

#[cfg(test)]
mod tests {
    use super::brief;

    #[test]
    fn two_digits_are_said() {
        let said = [0.0, 0.2049, 3.913, 12.49, 4567.0, 0.000_123].map(|it| brief(it).to_string());
        assert_eq!(said, ["0", "0.2", "3.9", "12", "4600", "0.00012"]);
    }
}
