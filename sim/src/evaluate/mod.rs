//! Monte-Carlo evaluation: the same runs with every method, over all cores, to the same bits on any number of them.

mod config;
mod gather;
mod report;
mod run;

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use rayon::iter::{ParallelBridge, ParallelIterator};

pub use config::{EvalConfig, EvalError, EvalWorld};
pub use report::{Comparison, EvalReport, MethodReport, NisReport, RobotReport, Series, TruthPath};

use gather::Gather;

/// How far an evaluation has come; both in robot-steps.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Finished.
    pub done: u64,
    /// Altogether.
    pub total: u64,
}

/// Runs the evaluation on rayon's current thread pool; `progress` is called from its threads, many times a second.
///
/// # Errors
/// What in `config` makes no sense.
pub fn evaluate(
    config: &EvalConfig,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<EvalReport, EvalError> {
    config.check()?;
    let jobs = config
        .methods
        .iter()
        .flat_map(|&kind| (0..config.runs).map(move |run| (kind, run)));
    let total = config.robot_steps() * config.methods.len() as u64 * u64::from(config.runs);
    let done = AtomicU64::new(0);
    let advance = |steps: u64| {
        let done = done.fetch_add(steps, Ordering::Relaxed) + steps;
        progress(Progress { done, total });
    };
    let gathers: Vec<Mutex<Gather>> = config
        .methods
        .iter()
        .map(|_| Mutex::new(Gather::new(config)))
        .collect();
    // Handed out in order, so that few finished runs wait for an earlier one to be added before them.
    jobs.enumerate()
        .par_bridge()
        .for_each(|(index, (kind, run))| {
            let outcome = run::run(config, kind, run, &advance);
            if let Some(gather) = gathers.get(index / usize::from(config.runs)) {
                gather
                    .lock()
                    .unwrap_or_else(PoisonError::into_inner)
                    .add(run, outcome);
            }
        });
    let gathers: Vec<Gather> = gathers
        .into_iter()
        .map(|gather| gather.into_inner().unwrap_or_else(PoisonError::into_inner))
        .collect();
    Ok(report::report(config, &gathers))
}
