//! From arguments to evaluations.

use std::path::Path;
use std::sync::Arc;

use coloc_sim::evaluate::{EvalConfig, EvalWorld};
use coloc_sim::mrclam::Recording;
use coloc_sim::{Scenario, SyntheticConfig, World};

use super::EvalCommandError;
use super::args::{Choice, EvalArgs};

/// The 1500 s of a run shown as so many points.
const PLOT_POINTS: usize = 500;

/// What is to be evaluated.
pub(crate) struct Setup {
    /// What the world is called in tables and files.
    pub(crate) world: String,
    /// One for each scenario.
    pub(crate) configs: Vec<EvalConfig>,
    /// What each robot is called, by scenario.
    recorded: Option<Vec<String>>,
}

impl Setup {
    pub(crate) fn new(args: &EvalArgs) -> Result<Self, EvalCommandError> {
        let (world, name, recorded) = world(args)?;
        let scenarios = match &args.scenario {
            Choice::One(scenario) => vec![scenario.as_ref().clone()],
            Choice::All => Scenario::all()
                .into_iter()
                .filter(|scenario| recorded.is_none() || fits_a_recording(scenario))
                .collect(),
        };
        if let Some(scenario) = scenarios
            .iter()
            .find(|scenario| recorded.is_some() && !fits_a_recording(scenario))
        {
            return Err(EvalCommandError::NeedsSynthetic(scenario.name));
        }
        let config = |scenario| EvalConfig {
            scenario,
            methods: unique(&args.methods),
            runs: args.runs(),
            seed: args.seed,
            seconds: args.seconds,
            plot_points: PLOT_POINTS,
            ..EvalConfig::new(world.clone())
        };
        Ok(Self {
            world: name,
            configs: scenarios.into_iter().map(config).collect(),
            recorded,
        })
    }

    /// What the robot with that index is called.
    pub(crate) fn robot(&self, index: usize) -> String {
        let recorded = self.recorded.as_ref().and_then(|names| names.get(index));
        recorded
            .cloned()
            .unwrap_or_else(|| format!("R{}", index + 1))
    }
}

/// As many robots as were recorded are there, whatever the scenario would like.
fn fits_a_recording(scenario: &Scenario) -> bool {
    scenario.synthetic_robots == Scenario::paper().synthetic_robots
}

fn unique<T: PartialEq + Copy>(items: &[T]) -> Vec<T> {
    let mut unique = Vec::new();
    for &item in items {
        if !unique.contains(&item) {
            unique.push(item);
        }
    }
    unique
}

type Named = (EvalWorld, String, Option<Vec<String>>);

fn world(args: &EvalArgs) -> Result<Named, EvalCommandError> {
    let Some(folder) = &args.data else {
        let config = SyntheticConfig {
            seconds: args.seconds.unwrap_or(SyntheticConfig::default().seconds),
            ..SyntheticConfig::default()
        };
        return Ok((EvalWorld::Synthetic(config), "synthetic".into(), None));
    };
    let grid = Recording::load(folder)?.resample();
    let number = |robot| grid.number(robot).map(|number| format!("R{number}"));
    let robots = (0..grid.robots()).filter_map(number).collect();
    Ok((
        EvalWorld::Recorded(Arc::new(grid)),
        name_of(folder),
        Some(robots),
    ))
}

/// The folder's own name, however it was reached: results must not depend on where it lies.
pub(super) fn name_of(folder: &Path) -> String {
    let full = folder.canonicalize().unwrap_or_else(|_| folder.into());
    full.file_name()
        .map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeated_methods_are_run_once_in_the_order_asked_for() {
        assert_eq!(unique(&[3, 1, 3, 2, 1]), [3, 1, 2]);
    }

    #[test]
    fn only_the_scenario_with_other_robots_does_not_fit_a_recording() {
        let misfits: Vec<_> = Scenario::all()
            .into_iter()
            .filter(|scenario| !fits_a_recording(scenario))
            .map(|scenario| scenario.name)
            .collect();
        assert_eq!(misfits, ["ten-robots"]);
    }
}
