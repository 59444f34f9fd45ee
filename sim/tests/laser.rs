//! Robots in recorded rooms are found, by a part of the campaign.

use std::path::PathBuf;

use coloc_sim::campaign::recordings;
use coloc_sim::laser::{Form, find};

#[test]
fn the_short_form_holds_its_bars() {
    let Some(data) = recordings(None::<PathBuf>) else {
        eprintln!("SKIPPED: no recordings; set COLOC_DATA to the folder that holds carmen_laser");
        return;
    };
    let finding = find(&Form::short(1, Some(data)));
    assert!(finding.text.lines().count() > 8, "{}", finding.text);
    assert!(
        finding.missed.is_empty(),
        "{:?}\n{}",
        finding.missed,
        finding.text
    );
}
