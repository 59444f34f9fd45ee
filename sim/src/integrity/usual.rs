//! What a user has who configures nothing: errors that are Gaussian, bounds at five standard deviations, no compass.

use super::Form;
use super::bar::found;
use super::contain::{HEAD, row, runs};
use super::setting::Setting;
use crate::campaign::Finding;
use crate::honest::table::Table;
use crate::method::Kind;

/// What is found.
#[must_use]
pub fn find(form: &Form) -> Finding {
    found(
        "Gaussian errors, bounds at 5σ, no compass: no promise",
        form,
        |worlds, bars| {
            let mut table = Table::new(HEAD);
            for (number, world) in worlds {
                let mut tally = runs(form, world, (Setting::USUAL, Kind::Coloc), form.runs.min(1));
                table.row(row(*number, &mut tally));
            }
            bars.table(&table.text());
        },
    )
}
