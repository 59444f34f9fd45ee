//! Sensor synthesis: what the robots' sensors and radios deliver at every step, made from the truth.

use std::f64::consts::TAU;

use coloc_estimator::Pose;
use coloc_estimator::angle::wrap;

use crate::random::{Noise, Purpose};
use crate::scenario::{Outliers, Scenario};
use crate::world::World;

/// One robot sees another.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Sighting {
    /// Who sees.
    pub observer: usize,
    /// Who is seen.
    pub observed: usize,
    /// Pose of `observed` in the body frame of `observer`, with noise.
    pub relative: Pose,
    /// The step at which what the observer has to tell reaches the observed; `None` if it is lost.
    pub arrives: Option<usize>,
}

/// A satellite fix.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Fix {
    /// Whose receiver.
    pub robot: usize,
    /// `[x, y]` \[m\], with noise.
    pub position: [f64; 2],
}

/// Everything that is measured at one step, the same for every method.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StepInputs {
    /// The moment.
    pub step: usize,
    /// For each robot `[v, ω]` over the step that ends here; `None` while its odometry is silent.
    pub odometry: Vec<Option<[f64; 2]>>,
    /// Ascending in (observer, observed).
    pub sightings: Vec<Sighting>,
    /// Ascending in robot.
    pub fixes: Vec<Fix>,
}

/// The sensors of a team in one run.
#[derive(Clone, Debug)]
pub struct Sensors<'a, W: ?Sized> {
    world: &'a W,
    scenario: &'a Scenario,
    noise: Noise,
}

impl<'a, W: World + ?Sized> Sensors<'a, W> {
    /// The sensors in run number `run`.
    #[must_use]
    pub fn new(world: &'a W, scenario: &'a Scenario, seed: u64, run: u16) -> Self {
        Self {
            world,
            scenario,
            noise: Noise::new(seed, run),
        }
    }

    /// What is measured at `step`, from 1 on (odometry is that of the step that ends there).
    #[must_use]
    pub fn at(&self, step: usize) -> StepInputs {
        let mut inputs = StepInputs::default();
        self.fill(step, &mut inputs);
        inputs
    }

    /// [`Self::at`] into storage that is used again.
    pub fn fill(&self, step: usize, inputs: &mut StepInputs) {
        let robots = 0..self.world.robots();
        inputs.step = step;
        inputs.odometry.clear();
        inputs
            .odometry
            .extend(robots.map(|robot| self.odometry(step, robot)));
        inputs.sightings.clear();
        if self.is_due(step, self.scenario.sightings.rate_hz) {
            self.sightings(step, &mut inputs.sightings);
        }
        inputs.fixes.clear();
        if self.is_due(step, self.scenario.fixes.rate_hz) && !self.is_outage(step) {
            inputs.fixes.extend(
                self.scenario
                    .fixes
                    .robots
                    .iter()
                    .filter_map(|&robot| self.fix(step, robot)),
            );
        }
    }

    fn is_due(&self, step: usize, rate_hz: f64) -> bool {
        step > 0 && step.is_multiple_of(self.steps_in(1.0 / rate_hz).max(1))
    }

    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // Saturates, which is what is wanted.
    fn steps_in(&self, seconds: f64) -> usize {
        (seconds / self.world.dt_s()).round() as usize
    }

    fn is_outage(&self, step: usize) -> bool {
        let length = self.steps_in(self.scenario.fixes.outage_s);
        let first = (self.world.steps() / 2).saturating_sub(length / 2);
        (first..first + length).contains(&step)
    }

    fn odometry(&self, step: usize, robot: usize) -> Option<[f64; 2]> {
        let begin = step.checked_sub(1)?;
        (!self.is_silent(step, robot)).then(|| self.world.odometry(begin, robot))
    }

    fn is_silent(&self, step: usize, robot: usize) -> bool {
        let Some(drop_outs) = self.scenario.drop_outs else {
            return false;
        };
        let period = self.steps_in(drop_outs.every_s).max(1);
        let mut draws = self.noise.draws(Purpose::DropOut, step / period, robot, 0);
        let length_s = draws.uniform(drop_outs.length_s[0], drop_outs.length_s[1]);
        let first = self.steps_in(draws.uniform(0.0, (drop_outs.every_s - length_s).max(0.0)));
        (first..first + self.steps_in(length_s)).contains(&(step % period))
    }

    fn sightings(&self, step: usize, sightings: &mut Vec<Sighting>) {
        for observer in 0..self.world.robots() {
            let seen = (0..self.world.robots())
                .filter_map(|observed| self.sighting(step, observer, observed));
            sightings.extend(seen);
        }
    }

    fn sighting(&self, step: usize, observer: usize, observed: usize) -> Option<Sighting> {
        let sensor = &self.scenario.sightings;
        if observer == observed || (sensor.one_way && observer > observed) {
            return None;
        }
        let exact = relative(
            &self.world.truth(step, observer)?,
            &self.world.truth(step, observed)?,
        );
        if libm::hypot(exact.x, exact.y) > sensor.range_m {
            return None;
        }
        let noise = self
            .noise
            .draws(Purpose::RelativePose, step, observer, observed)
            .normals::<3>();
        let error: [f64; 3] = std::array::from_fn(|i| sensor.sigma[i] * noise[i]);
        let gross = self.outlier(Purpose::RelativeOutlier, step, observer, observed);
        let relative = Pose::new(
            exact.x + error[0] + gross[0],
            exact.y + error[1] + gross[1],
            exact.phi + error[2],
        );
        Some(Sighting {
            observer,
            observed,
            relative,
            arrives: self.arrival(step, observer, observed),
        })
    }

    fn arrival(&self, step: usize, observer: usize, observed: usize) -> Option<usize> {
        let radio = self.scenario.radio;
        if radio.loss > 0.0
            && self
                .noise
                .draws(Purpose::Loss, step, observer, observed)
                .happens(radio.loss)
        {
            return None;
        }
        if radio.delay_s[1] <= 0.0 {
            return Some(step);
        }
        let mut draws = self.noise.draws(Purpose::Delay, step, observer, observed);
        Some(step + self.steps_in(draws.uniform(radio.delay_s[0], radio.delay_s[1])))
    }

    fn fix(&self, step: usize, robot: usize) -> Option<Fix> {
        let truth = self.world.truth(step, robot)?;
        let noise = self
            .noise
            .draws(Purpose::Fix, step, robot, 0)
            .normals::<2>();
        let gross = self.outlier(Purpose::FixOutlier, step, robot, 0);
        let sigma_m = self.scenario.fixes.sigma_m;
        let position = [
            truth.x + sigma_m * noise[0] + gross[0],
            truth.y + sigma_m * noise[1] + gross[1],
        ];
        Some(Fix { robot, position })
    }

    fn outlier(&self, purpose: Purpose, step: usize, robot: usize, other: usize) -> [f64; 2] {
        let Some(Outliers {
            probability,
            size_m,
        }) = self.scenario.outliers
        else {
            return [0.0; 2];
        };
        let mut draws = self.noise.draws(purpose, step, robot, other);
        if !draws.happens(probability) {
            return [0.0; 2];
        }
        let (size, direction) = (draws.uniform(size_m[0], size_m[1]), draws.uniform(0.0, TAU));
        [size * libm::cos(direction), size * libm::sin(direction)]
    }
}

/// Pose of `seen` in the body frame of `observer`: `Γ(φ)ᵀ (x_seen − x_observer)` \[2\].
#[must_use]
pub fn relative(observer: &Pose, seen: &Pose) -> Pose {
    let (sin, cos) = libm::sincos(observer.phi);
    let [dx, dy] = [seen.x - observer.x, seen.y - observer.y];
    Pose::new(
        cos * dx + sin * dy,
        cos * dy - sin * dx,
        wrap(seen.phi - observer.phi),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Robots that stand on the x axis, 3 m apart, looking left.
    struct Row(usize);

    impl World for Row {
        fn dt_s(&self) -> f64 {
            0.02
        }
        fn steps(&self) -> usize {
            100_000
        }
        fn robots(&self) -> usize {
            self.0
        }
        #[allow(clippy::cast_precision_loss)]
        fn truth(&self, _: usize, robot: usize) -> Option<Pose> {
            Some(Pose::new(3.0 * robot as f64, 0.0, 0.5))
        }
        fn odometry(&self, _: usize, _: usize) -> [f64; 2] {
            [0.1, 0.2]
        }
    }

    fn inputs(scenario: &Scenario, steps: std::ops::Range<usize>) -> Vec<StepInputs> {
        let world = Row(5);
        let sensors = Sensors::new(&world, scenario, 11, 0);
        steps.map(|step| sensors.at(step)).collect()
    }

    #[test]
    fn measurements_come_at_their_rate_within_their_range() {
        let inputs = inputs(&Scenario::paper(), 1..11);
        for at in &inputs {
            let due = at.step % 5 == 0;
            // Of 20 ordered pairs two are 12 m apart.
            assert_eq!(at.sightings.len(), if due { 18 } else { 0 });
            assert_eq!(
                at.fixes.iter().map(|fix| fix.robot).collect::<Vec<_>>(),
                if due { vec![0, 1] } else { vec![] }
            );
        }
    }

    #[test]
    fn noise_has_the_standard_deviations_of_the_scenario() {
        let sightings = inputs(&Scenario::paper(), 1..5001)
            .into_iter()
            .flat_map(|at| at.sightings);
        let errors = sightings.map(|seen| {
            let exact = relative(
                &Row(5).truth(0, seen.observer).unwrap(),
                &Row(5).truth(0, seen.observed).unwrap(),
            );
            [
                seen.relative.x - exact.x,
                seen.relative.y - exact.y,
                wrap(seen.relative.phi - exact.phi),
            ]
        });
        let errors: Vec<[f64; 3]> = errors.collect();
        for (i, sigma) in Scenario::paper().sightings.sigma.into_iter().enumerate() {
            #[allow(clippy::cast_precision_loss)]
            let rms =
                (errors.iter().map(|e| e[i] * e[i]).sum::<f64>() / errors.len() as f64).sqrt();
            assert!((rms / sigma - 1.0).abs() < 0.03, "{rms} for {sigma}");
        }
    }

    #[test]
    fn an_option_changes_only_what_it_is_about() {
        let paper = inputs(&Scenario::paper(), 1..201);
        let lossy = inputs(&Scenario::named("lossy").unwrap(), 1..201);
        let near = inputs(&Scenario::named("near").unwrap(), 1..201);
        for ((paper, mut lossy), near) in paper.into_iter().zip(lossy).zip(near) {
            assert!(
                near.sightings
                    .iter()
                    .all(|seen| paper.sightings.contains(seen))
            );
            assert_eq!(near.fixes, paper.fixes);
            lossy
                .sightings
                .iter_mut()
                .for_each(|seen| seen.arrives = Some(paper.step));
            assert_eq!(lossy, paper);
        }
    }

    #[test]
    #[allow(clippy::cast_precision_loss)]
    fn every_option_does_what_it_says() {
        let of = |name: &str| inputs(&Scenario::named(name).unwrap(), 1..5001);
        let all = |name: &str| {
            of(name)
                .into_iter()
                .flat_map(|at| at.sightings)
                .collect::<Vec<_>>()
        };
        let lost = all("lossy")
            .iter()
            .filter(|seen| seen.arrives.is_none())
            .count();
        assert!((lost as f64 / 18_000.0 - 0.5).abs() < 0.02, "{lost} lost");
        assert!(
            all("one-way")
                .iter()
                .all(|seen| seen.observer < seen.observed)
        );
        let delays = of("delayed").into_iter().flat_map(|at| {
            at.sightings
                .into_iter()
                .map(move |s| s.arrives.unwrap() - at.step)
        });
        assert_eq!(delays.max(), Some(20));
        let silent = of("drop-outs")
            .iter()
            .filter(|at| at.odometry[0].is_none())
            .count();
        assert!(
            (silent as f64 / 5000.0 - 0.08).abs() < 0.03,
            "{silent} silent"
        );
        let gross = all("outliers")
            .iter()
            .zip(all("paper"))
            .filter(|(a, b)| {
                libm::hypot(a.relative.x - b.relative.x, a.relative.y - b.relative.y) > 2.99
            })
            .count();
        assert!(
            (gross as f64 / 18_000.0 - 0.02).abs() < 0.005,
            "{gross} outliers"
        );
        assert_eq!(of("one-dgps")[4].fixes.len(), 1);
    }

    #[test]
    fn the_outage_is_in_the_middle() {
        let scenario = Scenario::named("dgps-outage").unwrap();
        let fixes: Vec<usize> = inputs(&scenario, 48_000..52_001)
            .iter()
            .map(|at| at.fixes.len())
            .collect();
        assert_eq!(fixes[0], 2);
        assert_eq!(fixes[500..3500].iter().sum::<usize>(), 0);
        assert_eq!(fixes[3500], 2);
    }
}
