//! How sensors err, and within which bounds the monitor takes them to be.

use coloc_bounds::Arena;
use coloc_bounds::evidence::Wheels;
use coloc_bounds::mean::Promise;
use coloc_bounds::monitor::Settings;
use coloc_estimator::angle::wrap;

use crate::random::{Draws, Noise, Purpose};
use crate::scenario::Scenario;
use crate::sensors::{StepInputs, relative};
use crate::world::World;

/// Length of a slot, in steps of 20 ms.
pub(super) const SLOT_STEPS: usize = 25;
pub(super) const SLOT_S: f64 = 0.5;

/// A compass is off by no more, uniformly \[rad\].
const COMPASS_RAD: f64 = 5.0 * std::f64::consts::PI / 180.0;

/// What holds of MR.CLAM's wheels.
pub(super) const WHEELS: Wheels = Wheels {
    speed_mps: 0.07,
    sideways_mps: 0.03,
    turn_radps: 0.7,
    max_speed_mps: 2.0,
    max_turn_radps: 3.0,
};

/// A setting to monitor in.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct Setting {
    /// Bounds of sightings and fixes in standard deviations.
    pub(super) sigmas: f64,
    /// Whether errors end there.
    pub(super) truncated: bool,
    /// Half of a compass's interval \[rad\]; `None`: there is none.
    pub(super) compass_rad: Option<f64>,
    /// Of the means of errors.
    pub(super) means: Promise,
}

/// Nothing is promised.
const NOTHING: Promise = Promise {
    slots: 8,
    fixes: 1.0,
    sightings: 1.0,
};

impl Setting {
    /// The specification's: noise that ends at 3σ, which is the bound, and a compass.
    pub(super) const HARD: Self = Self {
        sigmas: 3.0,
        truncated: true,
        compass_rad: Some(COMPASS_RAD),
        means: Promise {
            slots: 8,
            fixes: 0.28,
            sightings: 0.28,
        },
    };

    /// The same without a promise of means.
    pub(super) const FORGETFUL: Self = Self {
        means: NOTHING,
        ..Self::HARD
    };

    /// What a user has who configures nothing: Gaussian noise, 5σ, no compass.
    pub(super) const USUAL: Self = Self {
        sigmas: 5.0,
        truncated: false,
        compass_rad: None,
        means: NOTHING,
    };

    /// Makes again what of `inputs` is off by more than the bounds, if errors end there.
    pub(super) fn cut(
        &self,
        world: &(impl World + ?Sized),
        scenario: &Scenario,
        noise: &Noise,
        inputs: &mut StepInputs,
    ) {
        if !self.truncated {
            return;
        }
        for seen in &mut inputs.sightings {
            let (Some(from), Some(to)) = (
                world.truth(inputs.step, seen.observer),
                world.truth(inputs.step, seen.observed),
            ) else {
                continue;
            };
            let exact = relative(&from, &to);
            let mut draws = noise.draws(
                Purpose::Integrity,
                inputs.step,
                1 + seen.observer,
                1 + seen.observed,
            );
            let [x, y, turn] = scenario.sightings.sigma;
            let it = &mut seen.relative;
            it.x = exact.x + self.within(it.x - exact.x, x, &mut draws);
            it.y = exact.y + self.within(it.y - exact.y, y, &mut draws);
            it.phi = wrap(exact.phi + self.within(wrap(it.phi - exact.phi), turn, &mut draws));
        }
        for fix in &mut inputs.fixes {
            let Some(truth) = world.truth(inputs.step, fix.robot) else {
                continue;
            };
            let mut draws = noise.draws(Purpose::Integrity, inputs.step, 1 + fix.robot, 0);
            for (value, exact) in fix.position.iter_mut().zip([truth.x, truth.y]) {
                let error = self.within(*value - exact, scenario.fixes.sigma_m, &mut draws);
                *value = exact + error;
            }
        }
    }

    /// `error`, or another one if it is too large.
    fn within(&self, mut error: f64, sigma: f64, draws: &mut Draws) -> f64 {
        while error.abs() > self.sigmas * sigma {
            error = sigma * draws.normal();
        }
        error
    }

    /// What the compass of `robot` says of `heading`.
    pub(super) fn compass(
        &self,
        noise: &Noise,
        step: usize,
        robot: usize,
        heading: f64,
    ) -> Option<coloc_bounds::AngleInterval> {
        let half = self.compass_rad?;
        let mut draws = noise.draws(Purpose::Integrity, step, 0, 1 + robot);
        let centre = heading + draws.uniform(-half, half);
        Some(coloc_bounds::AngleInterval::new(wrap(centre), half))
    }
}

/// The specification's defaults; all robots' pairs are kept in a team of five, so it is nobody's monitor in particular.
pub(super) fn monitor(means: Promise) -> Settings {
    Settings {
        own: 0,
        slot_s: SLOT_S,
        wheels: WHEELS,
        pair_slots: 10,
        arena: Arena {
            centre: [0.0; 2],
            half: 1e4,
        },
        means,
        initial: [0.0; 2],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_is_within_its_bound() {
        let mut draws = Noise::new(1, 0).draws(Purpose::Integrity, 0, 0, 0);
        for error in [0.0, 0.29, -0.31, 7.0] {
            let cut = Setting::HARD.within(error, 0.1, &mut draws);
            assert!(cut.abs() <= 0.3 && (error.abs() > 0.3 || (cut - error).abs() < 1e-15));
        }
    }
}
