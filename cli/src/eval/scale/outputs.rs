//! What was asked to be written, tried before anything is computed.

use std::path::PathBuf;

use coloc_sim::scale::ScaleReport;
use serde::Serialize;

use super::super::EvalCommandError;
use super::super::args::EvalArgs;
use super::super::splice::Splice;
use super::super::table::Table;
use super::{Found, tables};
use crate::output::print_line;
use crate::pictures::{LawPanel, check_fonts, draw_law, to_png};
use crate::result_file::{ResultFile, WriteError, prepare_folder};

/// Where everything goes.
pub(super) struct Outputs {
    json: Option<(PathBuf, ResultFile)>,
    markdown: Option<Splice>,
    plots: Option<PathBuf>,
    png: bool,
}

/// What is the same for the same seed: no times, and no memory of this machine.
#[derive(Serialize)]
struct Document<'a> {
    version: &'static str,
    scale: Vec<&'a ScaleReport>,
}

impl Outputs {
    /// Refuses what cannot be written.
    pub(super) fn prepare(args: &EvalArgs) -> Result<Self, EvalCommandError> {
        let json = |path: &PathBuf| ResultFile::prepare(path).map(|file| (path.clone(), file));
        let splice = |path: &PathBuf| Splice::prepare(path, "scale".into());
        let outputs = Self {
            json: args.json.as_ref().map(json).transpose()?,
            markdown: args.markdown.as_ref().map(splice).transpose()?,
            plots: args.plots.clone(),
            png: args.png,
        };
        if let (Some((_, json)), Some(markdown)) = (&outputs.json, &outputs.markdown) {
            markdown.file().check_apart(json)?;
        }
        if let Some(folder) = &outputs.plots {
            prepare_folder(folder)?;
        }
        if outputs.png {
            check_fonts().map_err(EvalCommandError::Fonts)?;
        }
        Ok(outputs)
    }

    /// Whether anything but standard output was asked for.
    pub(super) fn any(&self) -> bool {
        self.json.is_some() || self.markdown.is_some() || self.plots.is_some()
    }

    /// Writes everything, whatever became of the others; the first that failed is told.
    pub(super) fn write(&self, found: &[Found]) -> Result<(), EvalCommandError> {
        let document = self.write_json(found);
        let tables = self.write_tables(found);
        let picture = self.draw(found);
        document.and(tables).and(picture).map_err(Into::into)
    }

    fn write_json(&self, found: &[Found]) -> Result<(), WriteError> {
        let Some((path, file)) = &self.json else {
            return Ok(());
        };
        let document = Document {
            version: env!("CARGO_PKG_VERSION"),
            scale: found.iter().map(|it| &it.report).collect(),
        };
        let text = serde_json::to_string(&document).map_err(|error| WriteError::new(path, &error));
        file.write((text? + "\n").as_bytes())
    }

    fn write_tables(&self, found: &[Found]) -> Result<(), WriteError> {
        let Some(splice) = &self.markdown else {
            return Ok(());
        };
        let tables: Vec<String> = tables(found).iter().map(Table::markdown).collect();
        splice.write(&tables.join("\n"))
    }

    fn draw(&self, found: &[Found]) -> Result<(), WriteError> {
        let Some(folder) = &self.plots else {
            return Ok(());
        };
        let file = folder.join("scale.svg");
        draw_law(&file, "What a robot costs", "robots", &panels(found))?;
        if self.png {
            to_png(&file)?;
        }
        print_line(&format!("the picture is {}", file.display()));
        Ok(())
    }
}

#[allow(clippy::cast_precision_loss)] // Some thousand robots.
fn panels(found: &[Found]) -> Vec<LawPanel> {
    let panel = |y_axis, value: &dyn Fn(&Found) -> f64| LawPanel {
        y_axis,
        points: found
            .iter()
            .map(|it| (it.report.robots as f64, value(it)))
            .collect(),
    };
    vec![
        panel("ns per robot and tick", &|it| {
            it.cost.ns_per(it.report.robot_ticks())
        }),
        panel("CPU for a second of all [s]", &|it| {
            let seconds = it.report.ticks as f64 / 50.0;
            it.cost.cpu_s / seconds
        }),
    ]
}
