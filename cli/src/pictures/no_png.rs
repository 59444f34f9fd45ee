//! Instead of PNG, where coloc was built without it.

use std::path::Path;

use crate::result_file::WriteError;

const WITHOUT: &str =
    "this coloc was built without PNG: build it with `--features png`, or leave --png away";

/// That it is missing.
pub(crate) fn check_fonts() -> Result<(), &'static str> {
    Err(WITHOUT)
}

/// Fails.
pub(crate) fn to_png(svg: &Path) -> Result<(), WriteError> {
    Err(WriteError::new(&svg.with_extension("png"), WITHOUT))
}
