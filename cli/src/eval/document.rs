//! The JSON: the same bytes for the same seed.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use coloc_sim::evaluate::EvalReport;
use serde::Serialize;

use super::EvalCommandError;

/// Everything that was found.
#[derive(Serialize)]
pub(crate) struct Document<'a> {
    /// Of coloc.
    version: &'static str,
    /// The recording's folder, or `synthetic`.
    world: &'a str,
    /// One for each scenario. Numbers that are not finite are null.
    reports: &'a [EvalReport],
}

impl<'a> Document<'a> {
    pub(crate) fn new(world: &'a str, reports: &'a [EvalReport]) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION"),
            world,
            reports,
        }
    }

    pub(crate) fn write(&self, path: &Path) -> Result<(), EvalCommandError> {
        let file = File::create(path).map_err(|error| EvalCommandError::files(path, &error))?;
        let mut file = BufWriter::new(file);
        serde_json::to_writer(&mut file, self)
            .map_err(|error| EvalCommandError::files(path, &error))?;
        let end = writeln!(file).and_then(|()| file.flush());
        end.map_err(|error| EvalCommandError::files(path, &error))
    }
}
