//! `docs/sensors.md` says what is so.
//!
//! `COLOC_WRITE=1 cargo test -p coloc-laser --test page` writes its table of settings anew.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::path::Path;

use coloc_daemon::config::Config;
use coloc_daemon::config::reference::section_md;
use coloc_laser::refusal::Refusal;
use coloc_laser::section::Laser;
use coloc_rig::page::Page;

const PAGE: Page = Page {
    path: concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/sensors.md"),
    chapter: "## A laser scanner",
    settings: "laser settings",
    written_by: "cargo test -p coloc-laser --test page",
};

#[test]
fn the_settings_are_those_of_the_code() {
    let settings = section_md::<Laser>();
    PAGE.assert_settings(&settings.replace("\n## ", "\n#### "));
}

#[test]
fn the_example_is_understood() {
    let text = PAGE.example();
    let text = format!("[robot]\nname = \"a\"\nid = 1\n[[team]]\nname = \"b\"\nid = 2\n{text}");
    let (config, section) = Config::parse_with::<Laser>(&text, Path::new("robot.toml")).unwrap();
    assert_eq!(
        coloc_laser::driver::unlikely(&config, &section),
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
