//! What the command was asked to write, tried before anything is computed.

use std::path::{Path, PathBuf};

use coloc_sim::evaluate::EvalReport;

use super::args::EvalArgs;
use super::document::Document;
use super::setup::Setup;
use super::splice::Splice;
use super::table::Table;
use super::{EvalCommandError, figures, tables};
use crate::output::print_line;
use crate::pictures::check_fonts;
use crate::result_file::{ResultFile, WriteError, prepare_folder};

/// Where everything goes.
pub(super) struct Outputs {
    json: Option<(PathBuf, ResultFile)>,
    markdown: Option<Splice>,
    plots: Option<PathBuf>,
    png: bool,
}

impl Outputs {
    /// Refuses what cannot be written.
    pub(super) fn prepare(args: &EvalArgs, setup: &Setup) -> Result<Self, EvalCommandError> {
        let name = match (args.promises, setup.configs.as_slice()) {
            (true, _) => "promises",
            (false, [config]) => config.scenario.name,
            _ => "all",
        };
        let json = |path: &PathBuf| ResultFile::prepare(path).map(|file| (path.clone(), file));
        let splice = |path: &PathBuf| Splice::prepare(path, format!("{} {name}", setup.world));
        let outputs = Self {
            json: args.json.as_ref().map(json).transpose()?,
            markdown: args.markdown.as_ref().map(splice).transpose()?,
            plots: args.plots.clone(),
            png: args.png,
        };
        if let (Some((_, json)), Some(markdown)) = (&outputs.json, &outputs.markdown) {
            markdown.file().check_apart(json)?;
        }
        outputs.prepare_pictures(setup)?;
        Ok(outputs)
    }

    fn prepare_pictures(&self, setup: &Setup) -> Result<(), EvalCommandError> {
        if let Some(folder) = &self.plots {
            let several = setup.configs.len() > 1;
            for config in &setup.configs {
                prepare_folder(&folder_of(folder, several, config.scenario.name))?;
            }
        }
        if self.png {
            check_fonts().map_err(EvalCommandError::Fonts)?;
        }
        Ok(())
    }

    /// Whether anything but standard output was asked for.
    pub(super) fn any(&self) -> bool {
        self.json.is_some() || self.markdown.is_some() || self.plots.is_some()
    }

    /// Writes everything, whatever became of the others; the first that failed is told.
    pub(super) fn write(
        &self,
        setup: &Setup,
        reports: &[EvalReport],
    ) -> Result<(), EvalCommandError> {
        let document = self.write_json(setup, reports);
        let tables = self.write_tables(&|| tables_of(setup, reports));
        let pictures = self.draw(setup, reports);
        document.and(tables).and(pictures).map_err(Into::into)
    }

    fn write_json(&self, setup: &Setup, reports: &[EvalReport]) -> Result<(), WriteError> {
        let Some((path, file)) = &self.json else {
            return Ok(());
        };
        let text = Document::new(&setup.world, reports).text();
        file.write(
            text.map_err(|error| WriteError::new(path, &error))?
                .as_bytes(),
        )
    }

    /// Writes tables as Markdown, if that was asked for.
    pub(super) fn write_tables(&self, tables: &dyn Fn() -> Vec<Table>) -> Result<(), WriteError> {
        let body = || {
            tables()
                .iter()
                .map(Table::markdown)
                .collect::<Vec<_>>()
                .join("\n")
        };
        self.markdown
            .as_ref()
            .map_or(Ok(()), |splice| splice.write(&body()))
    }

    fn draw(&self, setup: &Setup, reports: &[EvalReport]) -> Result<(), WriteError> {
        let Some(folder) = &self.plots else {
            return Ok(());
        };
        for report in reports {
            let folder = folder_of(folder, setup.configs.len() > 1, report.scenario.name);
            figures::draw(&folder, self.png, &setup.world, report, &|robot| {
                setup.robot(robot)
            })?;
            print_line(&format!("pictures are in {}", folder.display()));
        }
        Ok(())
    }
}

/// The folder itself, or with several scenarios one for each.
fn folder_of(folder: &Path, several: bool, scenario: &str) -> PathBuf {
    if several {
        folder.join(scenario)
    } else {
        folder.to_owned()
    }
}

fn tables_of(setup: &Setup, reports: &[EvalReport]) -> Vec<Table> {
    match reports {
        [report] => tables::all(report, &|robot| setup.robot(robot)),
        _ => tables::summary(reports, &|robot| setup.robot(robot)),
    }
}
