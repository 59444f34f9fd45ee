//! The JSON: the same bytes for the same seed.

use coloc_sim::evaluate::EvalReport;
use serde::Serialize;

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

    pub(crate) fn text(&self) -> serde_json::Result<String> {
        Ok(serde_json::to_string(self)? + "\n")
    }
}
