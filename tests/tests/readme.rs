//! What the README and ARCHITECTURE.md say is so: files they point to exist, the configuration they show is accepted.
#![allow(
    clippy::unwrap_used,
    reason = "a test fails by panicking, also in its helpers"
)]

use std::path::{Path, PathBuf};

use coloc_daemon::config::Config;

const DOCUMENTS: [&str; 2] = ["README.md", "ARCHITECTURE.md"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .unwrap()
        .to_owned()
}

fn read(document: &str) -> String {
    std::fs::read_to_string(root().join(document)).unwrap()
}

/// The targets of `[text](target)` that are files of this repository.
fn links(document: &str) -> impl Iterator<Item = &str> {
    document
        .split("](")
        .skip(1)
        .filter_map(|rest| rest.split_once(')'))
        .map(|(target, _)| target)
        .filter(|target| !target.starts_with("http"))
}

#[test]
fn every_file_that_is_linked_exists() {
    for name in DOCUMENTS {
        let document = read(name);
        let missing: Vec<&str> = links(&document)
            .filter(|target| !root().join(target).exists())
            .collect();
        assert!(
            links(&document).count() > 5 && missing.is_empty(),
            "{name}: {missing:?}"
        );
    }
}

#[test]
fn the_configuration_of_the_readme_is_accepted() {
    let readme = read("README.md");
    let (_, rest) = readme.split_once("```toml\n").unwrap();
    let (text, _) = rest.split_once("```").unwrap();
    let config = Config::parse(text, Path::new("README.md")).unwrap();
    assert_eq!(config.robot.name.as_str(), "robot1");
}
