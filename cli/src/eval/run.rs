//! The course of the command.

use std::path::Path;

use coloc_sim::evaluate::{EvalConfig, EvalReport, evaluate};
use coloc_sim::promises::promises;

use super::args::EvalArgs;
use super::document::Document;
use super::progress::Bar;
use super::setup::Setup;
use super::table::Table;
use super::{EvalCommandError, figures, splice, tables};
use crate::output::print_line;

pub(crate) fn run(args: &EvalArgs) -> Result<(), EvalCommandError> {
    let setup = Setup::new(args)?;
    if args.promises {
        return hold_promises(args, &setup);
    }
    let reports: Vec<EvalReport> = setup
        .configs
        .iter()
        .map(|config| evaluated(&setup, config))
        .collect::<Result<_, _>>()?;
    if let Some(path) = &args.json {
        Document::new(&setup.world, &reports).write(path)?;
    }
    if let Some(path) = &args.markdown {
        write_markdown(path, &setup, &reports)?;
    }
    if let Some(folder) = &args.plots {
        draw(folder, args.png, &setup, &reports)?;
    }
    Ok(())
}

/// Evaluates, and prints what was found as soon as it is.
fn evaluated(setup: &Setup, config: &EvalConfig) -> Result<EvalReport, EvalCommandError> {
    let bar = Bar::new(config.scenario.name);
    let report = evaluate(config, &|progress| bar.show(progress))?;
    drop(bar);
    let tables = tables::all(&report, &|robot| setup.robot(robot));
    print_line(&format!("{}\n", tables::heading(&setup.world, &report)));
    println!(
        "{}",
        tables
            .iter()
            .map(Table::text)
            .collect::<Vec<_>>()
            .join("\n")
    );
    Ok(report)
}

fn hold_promises(args: &EvalArgs, setup: &Setup) -> Result<(), EvalCommandError> {
    let Some(config) = setup.configs.first() else {
        return Ok(());
    };
    let bar = Bar::new("promises");
    let promises = promises(&config.world, args.runs, args.seed, &|progress| {
        bar.show(progress);
    })?;
    drop(bar);
    let table = tables::promises(&promises);
    print_line(&table.text());
    if let Some(path) = &args.markdown {
        splice::write(
            path,
            &format!("{} promises", setup.world),
            &table.markdown(),
        )?;
    }
    match promises.iter().filter(|promise| !promise.kept).count() {
        0 => Ok(()),
        broken => Err(EvalCommandError::Broken(broken, promises.len())),
    }
}

fn write_markdown(
    path: &Path,
    setup: &Setup,
    reports: &[EvalReport],
) -> Result<(), EvalCommandError> {
    let markdown = |tables: Vec<Table>| {
        tables
            .iter()
            .map(Table::markdown)
            .collect::<Vec<_>>()
            .join("\n")
    };
    if let [report] = reports {
        let name = format!("{} {}", setup.world, report.scenario.name);
        let body = markdown(tables::all(report, &|robot| setup.robot(robot)));
        return splice::write(path, &name, &body);
    }
    let summary = tables::summary(reports, &|robot| setup.robot(robot));
    splice::write(path, &format!("{} all", setup.world), &markdown(summary))
}

/// Into the folder itself, or with several scenarios into one for each.
fn draw(
    folder: &Path,
    png: bool,
    setup: &Setup,
    reports: &[EvalReport],
) -> Result<(), EvalCommandError> {
    for report in reports {
        let folder = match reports {
            [_] => folder.to_owned(),
            _ => folder.join(report.scenario.name),
        };
        std::fs::create_dir_all(&folder)
            .map_err(|error| EvalCommandError::files(&folder, &error))?;
        figures::draw(&folder, png, &setup.world, report, &|robot| {
            setup.robot(robot)
        })?;
        print_line(&format!("pictures are in {}", folder.display()));
    }
    Ok(())
}
