//! `docs/sensors.md` says what is so.
//!
//! `COLOC_WRITE=1 cargo test -p coloc-tracker --test page` writes its table of settings anew.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::path::Path;

use coloc_daemon::config::Config;
use coloc_daemon::config::reference::section_md;
use coloc_tracker::refusal::Refusal;
use coloc_tracker::section::Track;

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/sensors.md");
const BEGIN: &str = "<!-- track settings -->\n";
const END: &str = "<!-- end of track settings -->";
const CHAPTER: &str = "## Where the neighbours are";

fn page() -> String {
    std::fs::read_to_string(PAGE).unwrap()
}

#[test]
fn the_settings_are_those_of_the_section() {
    let page = page();
    let (before, rest) = page.split_once(BEGIN).unwrap();
    let (_, after) = rest.split_once(END).unwrap();
    let settings = section_md::<Track>().replace("\n## ", "\n#### ");
    let current = format!("{before}{BEGIN}{settings}{END}{after}");
    if std::env::var_os("COLOC_WRITE").is_some() {
        std::fs::write(PAGE, &current).unwrap();
    }
    assert!(
        self::page() == current,
        "COLOC_WRITE=1 cargo test -p coloc-tracker --test page writes docs/sensors.md anew"
    );
}

#[test]
fn the_example_is_understood() {
    let page = page();
    let (_, chapter) = page.split_once(CHAPTER).unwrap();
    let (_, rest) = chapter.split_once("```toml\n").unwrap();
    let (text, _) = rest.split_once("```").unwrap();
    let text = format!("[robot]\nname = \"a\"\nid = 1\n[[team]]\nname = \"b\"\nid = 2\n{text}");
    let (config, _) = Config::parse_with::<Track>(&text, Path::new("robot.toml")).unwrap();
    assert_eq!(
        coloc_tracker::program::unlikely(&config),
        Vec::<String>::new()
    );
}

#[test]
fn reasons_are_those_of_the_code() {
    let page = page();
    let (_, chapter) = page.split_once(CHAPTER).unwrap();
    for refusal in Refusal::ALL.iter().filter(|it| **it != Refusal::Channel) {
        assert!(
            chapter.contains(&format!("`{}`", refusal.name())),
            "{refusal:?}"
        );
    }
}
