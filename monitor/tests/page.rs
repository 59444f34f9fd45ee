//! `docs/integrity.md` says what is so.
//!
//! `COLOC_WRITE=1 cargo test -p coloc-monitor --test page` writes its tables of settings anew.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::path::Path;

use coloc_daemon::config::Config;
use coloc_daemon::config::reference::section_md;
use coloc_monitor::refusal::Refusal;
use coloc_monitor::section::{Bounds, Integrity};

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/integrity.md");
const BEGIN: &str = "<!-- settings -->\n";
const END: &str = "<!-- end of settings -->";

fn page() -> String {
    std::fs::read_to_string(PAGE).unwrap()
}

#[test]
fn the_settings_are_those_of_the_sections() {
    let page = page();
    let (before, rest) = page.split_once(BEGIN).unwrap();
    let (_, after) = rest.split_once(END).unwrap();
    let settings = section_md::<Bounds>() + &section_md::<Integrity>();
    let settings = settings.replace("\n## ", "\n### ");
    let current = format!("{before}{BEGIN}{settings}{END}{after}");
    if std::env::var_os("COLOC_WRITE").is_some() {
        std::fs::write(PAGE, &current).unwrap();
    }
    assert!(
        self::page() == current,
        "COLOC_WRITE=1 cargo test -p coloc-monitor --test page writes docs/integrity.md anew"
    );
}

#[test]
fn the_example_is_understood() {
    let page = page();
    let (_, rest) = page.split_once("```toml\n").unwrap();
    let (text, _) = rest.split_once("```").unwrap();
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
    let page = page();
    for refusal in Refusal::ALL.iter().filter(|it| **it != Refusal::Channel) {
        assert!(
            page.contains(&format!("`{}`", refusal.name())),
            "{refusal:?}"
        );
    }
}
