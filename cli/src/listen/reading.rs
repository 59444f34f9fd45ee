//! An estimate in the units and words in which it is printed.

use coloc_shm_types::{BeliefState, Estimate, Input, Opinion};
use serde::Serialize;

/// In the order in which it is printed.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Reading {
    /// Hexadecimal: programs that read numbers as floating-point ones would confuse two of them.
    pub(super) session: String,
    pub(super) sequence: u64,
    pub(super) tick: u64,
    pub(super) clock: &'static str,
    pub(super) stamp_ns: i64,
    pub(super) boot_ns: i64,
    pub(super) x_m: f64,
    pub(super) y_m: f64,
    pub(super) heading_rad: f64,
    pub(super) sigma_x_m: f64,
    pub(super) sigma_y_m: f64,
    pub(super) sigma_heading_rad: f64,
    pub(super) vx_mps: f64,
    pub(super) vy_mps: f64,
    pub(super) omega_radps: f64,
    pub(super) state: &'static str,
    pub(super) fit: bool,
    pub(super) odometry_health: &'static str,
    pub(super) relative_pose_health: &'static str,
    pub(super) position_health: &'static str,
    pub(super) neighbour_health: &'static str,
    pub(super) pose_health: &'static str,
    pub(super) odometry_x_m: f64,
    pub(super) odometry_y_m: f64,
    pub(super) odometry_heading_rad: f64,
    /// Empty where it is fit.
    pub(super) unfit: String,
    pub(super) heading_health: &'static str,
    pub(super) gyro_health: &'static str,
    pub(super) gyro_bias_radps: f64,
    pub(super) sigma_gyro_bias_radps: f64,
    pub(super) opinion: &'static str,
}

impl Reading {
    pub(super) fn of(estimate: &Estimate) -> Self {
        let [x_m, y_m, heading_rad] = estimate.pose;
        let [odometry_x_m, odometry_y_m, odometry_heading_rad] = estimate.odometry;
        let [vx_mps, vy_mps, omega_radps] = estimate.velocity;
        let [sigma_x_m, sigma_y_m, sigma_heading_rad] = sigmas(estimate);
        let health = |input| estimate.health_of(input).name();
        Self {
            session: format!("{:016x}", estimate.header.session),
            sequence: estimate.header.sequence,
            tick: estimate.tick,
            clock: estimate.header.clock().map_or("unknown", |it| it.name()),
            stamp_ns: estimate.header.stamp_ns,
            boot_ns: estimate.boot_ns,
            x_m,
            y_m,
            heading_rad,
            sigma_x_m,
            sigma_y_m,
            sigma_heading_rad,
            vx_mps,
            vy_mps,
            omega_radps,
            state: estimate.state().name(),
            fit: estimate.is_fit(),
            odometry_health: health(Input::Odometry),
            relative_pose_health: health(Input::RelativePose),
            position_health: health(Input::Position),
            neighbour_health: health(Input::Neighbour),
            pose_health: health(Input::Pose),
            odometry_x_m,
            odometry_y_m,
            odometry_heading_rad,
            unfit: unfit(estimate),
            heading_health: health(Input::Heading),
            gyro_health: health(Input::Gyro),
            gyro_bias_radps: estimate.gyro_bias_radps,
            sigma_gyro_bias_radps: estimate.gyro_bias_sigma_radps,
            opinion: estimate.opinion().name(),
        }
    }
}

/// One standard deviation of x, y and the heading.
pub(super) fn sigmas(estimate: &Estimate) -> [f64; 3] {
    let total = estimate.total();
    [total[0], total[4], total[8]].map(f64::sqrt)
}

fn unfit(estimate: &Estimate) -> String {
    let why = estimate.why_unfit();
    why.map_or_else(String::new, |why| why.to_string())
}

/// What is to be said where the word for the belief is `unfit`.
pub(crate) fn why_unfit(estimate: &Estimate) -> Option<String> {
    let why = estimate.why_unfit()?;
    let is_known = estimate.state() == BeliefState::Ok;
    is_known.then(|| format!("is not fit to drive on: {why}"))
}

/// What is to be said where a second opinion is not that the estimate can be right.
pub(crate) fn doubted(estimate: &Estimate) -> Option<&'static str> {
    let opinion = estimate.opinion();
    let is_well = matches!(opinion, Opinion::None | Opinion::Possible);
    (!is_well).then(|| opinion.meaning())
}

/// The state of the belief, in a word that also says whether to drive on it.
pub(crate) fn belief(estimate: &Estimate) -> &'static str {
    match estimate.state() {
        BeliefState::Ok if !estimate.is_fit() => "unfit",
        state => state.name(),
    }
}

/// An estimate of which no two numbers are the same.
#[cfg(test)]
pub(super) fn example() -> Estimate {
    use coloc_shm_types::{Clock, Header, Health};

    let mut estimate = Estimate {
        header: Header {
            stamp_ns: 1_700_000_000_020_000_001,
            session: 0xfedc_ba98_7654_3210,
            sequence: 7,
            clock: Clock::Realtime as u8,
            ..Header::default()
        },
        boot_ns: 5_000_000_000,
        tick: 8,
        pose: [1.5, -2.25, 0.5],
        odometry: [3.5, 4.5, -1.25],
        velocity: [0.75, 0.125, -0.25],
        independent: [0.25, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0025],
        velocity_covariance: [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9],
        state: 1,
        unfit: 2,
        gyro_bias_radps: 0.0625,
        gyro_bias_sigma_radps: 0.03125,
        fit_limit: 0.875,
        opinion: Opinion::EstimateOutside as u8,
        ..Estimate::default()
    };
    estimate.health[Input::Odometry as usize] = Health::Ok as u8;
    estimate.health[Input::Position as usize] = Health::Stale as u8;
    estimate
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_known_pose_that_is_not_to_be_driven_on_has_its_own_word() {
        let estimate = |state, fit| Estimate {
            state,
            fit,
            ..Estimate::default()
        };
        let words = [(0, 0), (1, 1), (1, 0), (2, 0), (3, 0)];
        assert_eq!(
            words.map(|(state, fit)| belief(&estimate(state, fit))),
            ["finding", "ok", "unfit", "contradicted", "lost"]
        );
        let said = words.map(|(state, fit)| why_unfit(&estimate(state, fit)).is_some());
        assert_eq!(said, [false, false, true, false, false]);
    }
}
