//! `docs/sensors.md` says what is so.
//!
//! `COLOC_WRITE=1 cargo test -p coloc-tracker --test page` writes its table of settings anew.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::path::Path;

use coloc_daemon::config::Config;
use coloc_daemon::config::reference::section_md;
use coloc_rig::page::Page;
use coloc_tracker::refusal::Refusal;
use coloc_tracker::section::Track;

const PAGE: Page = Page {
    path: concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/sensors.md"),
    chapter: "## Where the neighbours are",
    settings: "track settings",
    written_by: "cargo test -p coloc-tracker --test page",
};

#[test]
fn the_settings_are_those_of_the_code() {
    let settings = section_md::<Track>();
    PAGE.assert_settings(&settings.replace("\n## ", "\n#### "));
}

#[test]
fn the_example_is_understood() {
    let text = PAGE.example();
    let text = format!("[robot]\nname = \"a\"\nid = 1\n[[team]]\nname = \"b\"\nid = 2\n{text}");
    let (config, _) = Config::parse_with::<Track>(&text, Path::new("robot.toml")).unwrap();
    assert_eq!(
        coloc_tracker::program::unlikely(&config),
        Vec::<String>::new()
    );
}

#[test]
fn reasons_are_those_of_the_code() {
    let reasons = Refusal::ALL
        .into_iter()
        .filter(|it| *it != Refusal::Channel);
    PAGE.assert_names(reasons.map(Refusal::name));
}
