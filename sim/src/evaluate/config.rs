//! What to evaluate.

use std::sync::Arc;

use coloc_estimator::{Belief, Covariance3};

use crate::method::{FilterSettings, Kind};
use crate::mrclam::GridWorld;
use crate::scenario::Scenario;
use crate::synthetic::{Synthetic, SyntheticConfig};
use crate::world::World;

/// Where the robots drive.
#[derive(Clone, Debug)]
pub enum EvalWorld {
    /// In a recording: the same drive in every run.
    Recorded(Arc<GridWorld>),
    /// In a world made up: the same waypoints in every run, other wheel slip. Seed, run and number of robots are
    /// those of the evaluation and its scenario.
    Synthetic(SyntheticConfig),
}

/// An evaluation.
#[derive(Clone, Debug)]
pub struct EvalConfig {
    /// Where.
    pub world: EvalWorld,
    /// Which sensors.
    pub scenario: Scenario,
    /// Which estimators.
    pub methods: Vec<Kind>,
    /// How many runs, each with other noise.
    pub runs: u16,
    /// All randomness.
    pub seed: u64,
    /// Stop after this time \[s\]; `None` for the whole world.
    pub seconds: Option<f64>,
    /// P₀, around the true pose. The paper does not state its own; from 1 mm to 10 cm it changes no figure of the
    /// whole recording by more than 1 %, but for the NEES of `sl`.
    pub initial: Covariance3,
    /// About how many points a plotted series has.
    pub plot_points: usize,
    /// Instead of the filters that know the scenario, these.
    pub settings: Option<FilterSettings>,
}

/// Why an evaluation cannot be.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EvalError {
    /// No method, run, robot or step.
    #[error("nothing to evaluate: no {0}")]
    Nothing(&'static str),
    /// A robot whose true pose is never known.
    #[error("nobody ever knows where robot {0} is: its truth is missing")]
    NoTruth(usize),
    /// What is promised is promised of the first recording of MR.CLAM.
    #[error("the promises are about the five robots of MR.CLAM's first recording; here are {0}")]
    OtherTeam(usize),
    /// A robot that is to have a satellite receiver is not there.
    #[error("the scenario gives robot {robot} a satellite receiver, but there are {robots} robots")]
    NoSuchRobot {
        /// From 1.
        robot: usize,
        /// In the world.
        robots: usize,
    },
}

/// 5 cm, 5 cm, 2°.
fn initial_covariance() -> Covariance3 {
    let heading = 2.0_f64.to_radians();
    Covariance3::diagonal([0.0025, 0.0025, heading * heading]).unwrap_or_default()
}

impl EvalConfig {
    /// The paper's setting in `world`: all methods of its comparison, 20 runs, seed 1.
    #[must_use]
    pub fn new(world: EvalWorld) -> Self {
        Self {
            world,
            scenario: Scenario::paper(),
            methods: vec![
                Kind::Sl,
                Kind::Nb,
                Kind::Ei,
                Kind::Ci,
                Kind::SplitCi,
                Kind::Coloc,
                Kind::Ccl,
            ],
            runs: 20,
            seed: 1,
            seconds: None,
            initial: initial_covariance(),
            plot_points: 1500,
            settings: None,
        }
    }

    pub(super) fn world(&self, run: u16) -> Arc<dyn World + Send> {
        match &self.world {
            EvalWorld::Recorded(world) => world.clone(),
            EvalWorld::Synthetic(config) => {
                let robots = self.scenario.synthetic_robots;
                let seconds = self
                    .seconds
                    .map_or(config.seconds, |seconds| seconds.min(config.seconds));
                Arc::new(Synthetic::new(&SyntheticConfig {
                    run,
                    seed: self.seed,
                    robots,
                    seconds,
                    ..config.clone()
                }))
            }
        }
    }

    pub(crate) fn robots(&self) -> usize {
        match &self.world {
            EvalWorld::Recorded(world) => world.robots(),
            EvalWorld::Synthetic(_) => self.scenario.synthetic_robots,
        }
    }

    /// Steps to evaluate.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // Saturates, which is what is wanted.
    pub(super) fn steps(&self) -> usize {
        let (dt_s, whole) = match &self.world {
            EvalWorld::Recorded(world) => (world.dt_s(), world.steps()),
            EvalWorld::Synthetic(config) => (0.02, (config.seconds / 0.02).round() as usize + 1),
        };
        self.seconds.map_or(whole, |seconds| {
            whole.min((seconds / dt_s).round() as usize + 1)
        })
    }

    pub(super) fn robot_steps(&self) -> u64 {
        (self.steps() * self.robots()) as u64
    }

    pub(super) fn filters(&self, dt_s: f64) -> FilterSettings {
        self.settings
            .clone()
            .unwrap_or_else(|| FilterSettings::new(&self.scenario, dt_s))
    }

    pub(super) fn beginning(&self, world: &(impl World + ?Sized)) -> Vec<Belief> {
        let initial =
            |robot| Belief::independent(world.initial(robot).unwrap_or_default(), self.initial);
        (0..world.robots()).map(initial).collect()
    }

    pub(super) fn check(&self) -> Result<(), EvalError> {
        let counts = [
            ("method", self.methods.len()),
            ("run", usize::from(self.runs)),
            ("robot", self.robots()),
            ("step", self.steps().saturating_sub(1)),
        ];
        if let Some((what, _)) = counts.into_iter().find(|(_, count)| *count == 0) {
            return Err(EvalError::Nothing(what));
        }
        let robots = self.robots();
        if let Some(robot) = self
            .scenario
            .fixes
            .robots
            .iter()
            .find(|robot| **robot >= robots)
        {
            return Err(EvalError::NoSuchRobot {
                robot: robot + 1,
                robots,
            });
        }
        let EvalWorld::Recorded(world) = &self.world else {
            return Ok(());
        };
        let lost = (0..robots).find(|&robot| world.initial(robot).is_none());
        lost.map_or(Ok(()), |robot| Err(EvalError::NoTruth(robot + 1)))
    }
}
