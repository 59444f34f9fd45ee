//! That one command installs what the README says.
#![allow(clippy::unwrap_used)] // The lint's exception for tests does not reach their helpers.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

const COMMAND: &str = "cargo install --locked --path cli";

fn packages() -> Vec<Value> {
    let output = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .args([
            "metadata",
            "--no-deps",
            "--offline",
            "--format-version",
            "1",
        ])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    let metadata: Value = serde_json::from_slice(&output.stdout).unwrap();
    metadata["packages"].as_array().unwrap().clone()
}

/// Names of the package's programs.
fn programs(package: &Value) -> Vec<String> {
    let targets = package["targets"].as_array().unwrap().iter();
    targets
        .filter(|target| target["kind"] == serde_json::json!(["bin"]))
        .map(|target| target["name"].as_str().unwrap().to_owned())
        .collect()
}

#[test]
fn the_command_of_the_readme_installs_coloc_and_colocd() {
    let readme = Path::new(env!("CARGO_MANIFEST_DIR")).join("../README.md");
    let readme = std::fs::read_to_string(readme).unwrap();
    assert!(
        readme.contains(COMMAND),
        "README.md does not say `{COMMAND}`"
    );
    let packages = packages();
    let cli = packages
        .iter()
        .find(|package| package["name"] == "coloc-cli")
        .unwrap();
    let mut installed = programs(cli);
    installed.sort();
    assert_eq!(installed, ["coloc", "colocd"]);
}

#[test]
fn no_two_programs_of_the_workspace_want_the_same_file() {
    let mut all: Vec<String> = packages().iter().flat_map(programs).collect();
    let count = all.len();
    all.sort();
    all.dedup();
    assert_eq!(all.len(), count, "{all:?}");
}

/// What is linked leaves the names of its source files in the program.
#[test]
fn what_flies_has_nothing_of_the_tools_in_it() {
    let holds = |program: &str, library: &str| {
        let program = std::fs::read(program).unwrap();
        let needle = library.as_bytes();
        program.windows(needle.len()).any(|window| window == needle)
    };
    let (coloc, colocd) = (env!("CARGO_BIN_EXE_coloc"), env!("CARGO_BIN_EXE_colocd"));
    for library in ["plotters-0", "rayon-core-1", "rand_chacha-0", "indicatif-0"] {
        assert!(
            holds(coloc, library),
            "{library}: the way to look for it works"
        );
        assert!(!holds(colocd, library), "{library} is in colocd");
    }
}
