//! `docs/integrity.md` says what is so.
//!
//! `COLOC_WRITE=1 cargo test -p coloc-monitor --test page` writes its tables of settings anew.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::path::Path;

use coloc_daemon::config::Config;
use coloc_daemon::config::reference::section_md;
use coloc_monitor::refusal::Refusal;
use coloc_monitor::section::{Bounds, Integrity};
use coloc_rig::page::Page;

const PAGE: Page = Page {
    path: concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/integrity.md"),
    chapter: "",
    settings: "settings",
    written_by: "cargo test -p coloc-monitor --test page",
};

#[test]
fn the_settings_are_those_of_the_code() {
    let settings = section_md::<Bounds>() + &section_md::<Integrity>();
    PAGE.assert_settings(&settings.replace("\n## ", "\n### "));
}

#[test]
fn the_example_is_understood() {
    let text = PAGE.example();
    let text = format!(
        "[robot]\nname = \"a\"\nid = 1\n[odometry]\nmax_speed_mps = 2.0\nmax_turn_rate_radps = 3.0\n[odometry.base]\n{text}"
    );
    let (config, bounds) = Config::parse_with::<Bounds>(&text, Path::new("robot.toml")).unwrap();
    let integrity = Config::parse_with::<Integrity>(&text, Path::new("robot.toml"));
    assert_eq!(integrity.unwrap().1, Integrity::default());
    let warnings = coloc_monitor::program::unlikely(&config, &bounds);
    assert_eq!(warnings, Vec::<String>::new());
}

#[test]
fn reasons_are_those_of_the_code() {
    let reasons = Refusal::ALL
        .into_iter()
        .filter(|it| *it != Refusal::Channel);
    PAGE.assert_names(reasons.map(Refusal::name));
}
