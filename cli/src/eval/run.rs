//! The course of the command.

use coloc_sim::evaluate::{EvalConfig, EvalReport, evaluate};
use coloc_sim::promises::promises;

use super::args::{EvalArgs, Sightings};
use super::outputs::Outputs;
use super::progress::Bar;
use super::setup::Setup;
use super::table::Table;
use super::{EvalCommandError, scale, sightings, tables};
use crate::output::{print_line, takes_no_more};

pub(crate) fn run(args: &EvalArgs) -> Result<(), EvalCommandError> {
    if !args.robots.is_empty() {
        return scale::run(args);
    }
    if let (Sightings::Recorded, Some(folder)) = (args.sightings, &args.data) {
        return sightings::run(args, folder);
    }
    let setup = Setup::new(args)?;
    let outputs = Outputs::prepare(args, &setup)?;
    start_threads(args)?;
    if args.promises {
        return hold_promises(args, &setup, &outputs);
    }
    let mut reports = Vec::new();
    for config in &setup.configs {
        if takes_no_more() && !outputs.any() {
            return Ok(());
        }
        reports.push(evaluated(&setup, config)?);
    }
    outputs.write(&setup, &reports)
}

/// Else the first computation would start them, and panic where it cannot.
pub(super) fn start_threads(args: &EvalArgs) -> Result<(), EvalCommandError> {
    // None are as many as RAYON_NUM_THREADS or the cores.
    let threads = args.threads.map_or(0, usize::from);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
    Ok(pool.build_global()?)
}

/// Evaluates, and prints what was found as soon as it is.
fn evaluated(setup: &Setup, config: &EvalConfig) -> Result<EvalReport, EvalCommandError> {
    let bar = Bar::new(config.scenario.name);
    let report = evaluate(config, &|progress| bar.show(progress))?;
    drop(bar);
    let tables = tables::all(&report, &|robot| setup.robot(robot));
    print_line(&format!("{}\n", tables::heading(&setup.world, &report)));
    print_line(
        &tables
            .iter()
            .map(Table::text)
            .collect::<Vec<_>>()
            .join("\n"),
    );
    Ok(report)
}

fn hold_promises(
    args: &EvalArgs,
    setup: &Setup,
    outputs: &Outputs,
) -> Result<(), EvalCommandError> {
    let Some(config) = setup.configs.first() else {
        return Ok(());
    };
    let bar = Bar::new("promises");
    let promises = promises(&config.world, args.runs(), args.seed, &|progress| {
        bar.show(progress);
    })?;
    drop(bar);
    let table = tables::promises(&promises);
    print_line(&table.text());
    outputs.write_tables(&|| vec![table.clone()])?;
    match promises.iter().filter(|promise| !promise.kept).count() {
        0 => Ok(()),
        broken => Err(EvalCommandError::Broken(broken, promises.len())),
    }
}
