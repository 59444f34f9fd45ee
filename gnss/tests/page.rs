//! `docs/sensors.md` says what is so.
//!
//! `COLOC_WRITE=1 cargo test -p coloc-gnss --test page` writes its table of settings anew.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::path::Path;

use coloc_daemon::config::Config;
use coloc_daemon::config::reference::section_md;
use coloc_gnss::refusal::Refusal;
use coloc_gnss::section::Gnss;

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/sensors.md");
const BEGIN: &str = "<!-- settings -->\n";
const END: &str = "<!-- end of settings -->";

fn page() -> String {
    std::fs::read_to_string(PAGE).unwrap()
}

#[test]
fn the_settings_are_those_of_the_section() {
    let page = page();
    let (before, rest) = page.split_once(BEGIN).unwrap();
    let (_, after) = rest.split_once(END).unwrap();
    let settings = section_md::<Gnss>().replace("\n## ", "\n#### ");
    let current = format!("{before}{BEGIN}{settings}{END}{after}");
    if std::env::var_os("COLOC_WRITE").is_some() {
        std::fs::write(PAGE, &current).unwrap();
    }
    let written = self::page();
    assert!(
        written == current,
        "COLOC_WRITE=1 cargo test -p coloc-gnss --test page writes docs/sensors.md anew"
    );
}

#[test]
fn the_example_is_understood() {
    let page = page();
    let (_, rest) = page.split_once("```toml\n").unwrap();
    let (text, _) = rest.split_once("```").unwrap();
    let text = format!("[robot]\nname = \"a\"\nid = 1\n{text}");
    let (config, section) = Config::parse_with::<Gnss>(&text, Path::new("robot.toml")).unwrap();
    assert_eq!(
        coloc_gnss::driver::unlikely(&config, &section),
        Vec::<String>::new()
    );
}

#[test]
fn floors_and_reasons_are_those_of_the_code() {
    let page = page();
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
    for refusal in Refusal::ALL.iter().filter(|it| **it != Refusal::Channel) {
        assert!(
            page.contains(&format!("`{}`", refusal.name())),
            "{refusal:?}"
        );
    }
}
