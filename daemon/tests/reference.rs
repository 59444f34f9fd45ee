//! `robot.toml` and `docs/configuration.md` say what the description of the settings says, of every setting.
//!
//! `COLOC_WRITE=1 cargo test -p coloc-daemon --test reference` writes both anew.

use std::path::{Path, PathBuf};

use coloc_daemon::config::reference::{configuration_md, robot_toml};

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

fn is_up_to_date(name: &str, generated: &str) {
    if std::env::var_os("COLOC_WRITE").is_some() {
        std::fs::write(file(name), generated).expect("the repository can be written");
    }
    let committed = std::fs::read_to_string(file(name)).unwrap_or_default();
    assert!(
        committed == generated,
        "{name} is not what the settings' description says; \
         `COLOC_WRITE=1 cargo test -p coloc-daemon --test reference` writes it anew"
    );
}

#[test]
fn the_commented_configuration_is_up_to_date() {
    is_up_to_date("robot.toml", &robot_toml());
}

#[test]
fn the_reference_is_up_to_date() {
    is_up_to_date("../docs/configuration.md", &configuration_md());
}
