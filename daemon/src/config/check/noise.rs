//! Noise that is none.

use super::super::finding::Finding;
use super::super::{Config, Motion, Variance};

/// Variances below this are lost in rounding \[m²/s², rad²/s²\]: they would be written as noise and act as none.
const LEAST_VARIANCE: f64 = 1e-18;

/// Of standard deviations \[m, rad\].
const LEAST_SIGMA: f64 = 1e-9;

/// Numbers above zero that nothing can be computed with.
pub(super) fn refusals(config: &Config) -> impl Iterator<Item = Finding> {
    let variances = variances(&config.motion)
        .into_iter()
        .filter_map(|(key, variance)| too_small(key, variance, LEAST_VARIANCE));
    let sigmas = sigmas(config)
        .into_iter()
        .filter_map(|(key, sigma)| too_small(key, sigma, LEAST_SIGMA));
    variances.chain(sigmas)
}

fn too_small(key: String, value: f64, least: f64) -> Option<Finding> {
    let problem =
        format!(" = {value:e}: must be 0, or {least:e} or more: less is lost in rounding");
    (value > 0.0 && value < least).then(|| Finding::new(key, problem))
}

fn variances(motion: &Motion) -> Vec<(String, f64)> {
    let directions = [
        ("forward", motion.forward),
        ("sideways", motion.sideways),
        ("turning", motion.turning),
    ];
    let coefficients = directions.into_iter().flat_map(|(name, variance)| {
        coefficients(variance).map(|(key, value)| (format!("motion.{name}.{key}"), value))
    });
    coefficients
        .chain(numbered("motion.outage_variance", &motion.outage_variance))
        .collect()
}

fn coefficients(variance: Variance) -> [(&'static str, f64); 6] {
    let Variance {
        a,
        b,
        c,
        per_s,
        per_m,
        per_rad,
    } = variance;
    [
        ("a", a),
        ("b", b),
        ("c", c),
        ("per_s", per_s),
        ("per_m", per_m),
        ("per_rad", per_rad),
    ]
}

fn sigmas(config: &Config) -> Vec<(String, f64)> {
    let fusion = &config.fusion;
    let lists: [(&'static str, &[f64]); 5] = [
        ("motion.creep_per_hour", &config.motion.creep_per_hour),
        ("initial.sigma", &config.initial.sigma),
        ("fusion.relative_pose_floor", &fusion.relative_pose_floor),
        ("fusion.neighbour_floor", &fusion.neighbour_floor),
        ("fusion.position_floor", &fusion.position_floor),
    ];
    lists
        .into_iter()
        .flat_map(|(key, list)| numbered(key, list))
        .collect()
}

fn numbered<'l>(
    key: &'static str,
    list: &'l [f64],
) -> impl Iterator<Item = (String, f64)> + use<'l> {
    (0..)
        .zip(list)
        .map(move |(index, &value): (usize, _)| (format!("{key}.{index}"), value))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use coloc_estimator::{OdometrySample, Span, Stamp, TickInputs};
    use proptest::prelude::*;

    use super::*;
    use crate::collect::wheels::ToMotion;
    use crate::estimate::{Estimate, start};

    /// Nothing, what is hardly anything, what is usual, the most, and what is no number.
    fn any_number() -> impl Strategy<Value = f64> {
        prop_oneof![
            20 => Just(0.0),
            20 => (-20.0..19.0).prop_map(f64::exp2),
            20 => Just(1e6),
            20 => Just(1e-9),
            1 => (-1070.0..-31.0).prop_map(f64::exp2),
            1 => (990.0..1023.0).prop_map(f64::exp2),
            1 => Just(f64::INFINITY),
            1 => Just(f64::NAN),
        ]
    }

    const WHEELS: &str = "[odometry]\nbuses = [\"socketcan:can0\"]\nmax_speed_mps = 2.0\n\
        [odometry.wheels]\ntrack_m = 0.3\n\
        left = { message = \"WheelLeft\", signal = \"Ticks\", metres_per_tick = 1e-4 }\n\
        right = { message = \"WheelRight\", signal = \"Ticks\", metres_per_tick = 1e-4 }\n";

    fn text(noise: &[f64], period_s: f64) -> String {
        let [a, b, c, d, e, f, g, h, i, x, y, phi, sx, sy, sphi, growth] = noise else {
            unreachable!("as many as are drawn")
        };
        format!(
            "[robot]\nname = \"a\"\nid = 1\n{WHEELS}[motion]\nforward = {{ a = {a}, b = {b}, c = {c} }}\n\
             sideways = {{ a = {d}, b = {e}, c = {f} }}\nturning = {{ a = {g}, b = {h}, c = {i} }}\n\
             outage_variance = [{x}, {y}, {phi}]\nhold_growth = {growth}\nreference_period_s = {period_s:?}\n\
             [initial]\nsigma = [{sx}, {sy}, {sphi}]\n"
        )
    }

    /// Variances of the forward and the turning velocity at full speed, straight on and in a turn.
    fn variances_at_speed(config: &Config) -> [f64; 2] {
        let motion = ToMotion::new(config).motion([2.0, 0.0, 10.0]);
        let [forward, _, turning] = motion.covariance().variances();
        [forward, turning]
    }

    fn is_written(variance: Variance) -> bool {
        variance != Variance::default()
    }

    /// A fast turn, then ten seconds without odometry: the variances before and after.
    fn lived(config: &Config) -> [[f64; 3]; 2] {
        let (known, start) = (start(config), Stamp::default());
        let after = |ms| start + Span::from_millis(ms);
        let mut estimate = Estimate::new(config, start, &known);
        let sample = OdometrySample {
            source: 0,
            start,
            stamp: after(20),
            motion: ToMotion::new(config).motion([2.0, 0.0, 0.5]),
        };
        let mut variances = [known.belief().total().variances(); 2];
        for (ms, samples) in [(20, vec![sample.into()]), (10_000, Vec::new())] {
            let outputs = estimate.step(&TickInputs {
                stamp: after(ms),
                measurements: &samples,
            });
            variances[1] = outputs.estimate.belief.total().variances();
        }
        variances
    }

    proptest! {
        #[test]
        fn an_accepted_configuration_is_never_more_certain_than_it_says(
            noise in proptest::collection::vec(any_number(), 16), period_s in 1e-4..10.0,
        ) {
            let text = text(&noise, period_s);
            let Ok(config) = Config::parse(&text, Path::new("a.toml")) else {
                let wrong = |&number: &f64| number.is_nan() || number > 1e6 || number > 0.0 && number < 1e-9;
                prop_assert!(noise.iter().any(wrong), "refused:\n{text}");
                return Ok(());
            };
            let written = [is_written(config.motion.forward), is_written(config.motion.turning)];
            for (variance, written) in variances_at_speed(&config).into_iter().zip(written) {
                prop_assert!(variance.is_finite() && (variance > 0.0) == written, "{variance}\n{text}");
            }
            let [before, after] = lived(&config);
            prop_assert_eq!(before.map(|variance| variance > 0.0), config.initial.sigma.map(|sigma| sigma > 0.0));
            // Whoever may look anywhere may also come back: positions within a turn then say something of one another.
            let knows_its_heading = config.initial.sigma[2] < 0.3;
            for (before, after) in before.into_iter().zip(after) {
                let grows = after >= before * (1.0 - 1e-9);
                prop_assert!(after.is_finite() && (grows || !knows_its_heading), "{before} {after}\n{text}");
            }
        }
    }
}
