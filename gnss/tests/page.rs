//! `docs/sensors.md` says what is so.
//!
//! `COLOC_WRITE=1 cargo test -p coloc-gnss --test page` writes its table of settings anew.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::path::Path;

use coloc_daemon::config::Config;
use coloc_daemon::config::reference::section_md;
use coloc_gnss::refusal::Refusal;
use coloc_gnss::section::Gnss;
use coloc_rig::page::Page;

const PAGE: Page = Page {
    path: concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/sensors.md"),
    chapter: "",
    settings: "settings",
    written_by: "cargo test -p coloc-gnss --test page",
};

#[test]
fn the_settings_are_those_of_the_code() {
    let settings = section_md::<Gnss>();
    PAGE.assert_settings(&settings.replace("\n## ", "\n#### "));
}

#[test]
fn the_example_is_understood() {
    let text = PAGE.example();
    let text = format!("[robot]\nname = \"a\"\nid = 1\n{text}");
    let (config, section) = Config::parse_with::<Gnss>(&text, Path::new("robot.toml")).unwrap();
    assert_eq!(
        coloc_gnss::driver::unlikely(&config, &section),
        Vec::<String>::new()
    );
}

#[test]
fn floors_and_reasons_are_those_of_the_code() {
    let page = PAGE.chapter();
    let section = Gnss::of("stdin");
    for quality in 1..=5 {
        let floor = section.floor(quality).unwrap();
        let row = format!(
            "| {} m | {} m | {} s |",
            floor.sigma_m, floor.slow_sigma_m, floor.slow_time_s
        );
        let begin = format!("| {quality}, ");
        assert!(
            page.lines()
                .any(|line| line.starts_with(&begin) && line.ends_with(&row)),
            "{row}"
        );
    }
    let reasons = Refusal::ALL
        .into_iter()
        .filter(|it| *it != Refusal::Channel);
    PAGE.assert_names(reasons.map(Refusal::name));
}
