//! What to make of odometry that may be silent, step by step: the product's rules on a regular grid.

use coloc_estimator::Motion;

use super::FilterSettings;

/// The velocity of one robot.
#[derive(Clone, Debug, Default)]
pub struct Wheels {
    last: Option<[f64; 2]>,
    silent_steps: u32,
}

impl Wheels {
    /// The motion of the next step, given what the wheels report of it.
    ///
    /// A silent robot keeps its last velocity with growing noise up to the hold time, from then on it stands
    /// still with outage noise. The held time of a step is that of its middle.
    pub fn motion(&mut self, reported: Option<[f64; 2]>, settings: &FilterSettings) -> Motion {
        let odometry = &settings.product.odometry;
        if let Some(velocity) = reported {
            *self = Self {
                last: reported,
                silent_steps: 0,
            };
            return settings.odometry.nonholonomic(velocity);
        }
        let held_s = f64::from(self.silent_steps) * settings.dt_s;
        self.silent_steps = self.silent_steps.saturating_add(1);
        match self.last {
            Some(velocity) if held_s + 0.5 * settings.dt_s < odometry.hold.as_seconds() => {
                let periods = f64::from(self.silent_steps) - 0.5;
                settings
                    .odometry
                    .nonholonomic(velocity)
                    .with_noise_scaled(1.0 + odometry.hold_growth * periods)
            }
            _ => Motion::standstill(odometry.outage_variance),
        }
    }
}
