//! The short form of `crew`: a few kills. The long one has 300.

use std::process::Command;

#[test]
fn whoever_is_killed_a_belief_changes_by_a_whole_round_or_not_at_all() {
    let crew = Command::new(env!("CARGO_BIN_EXE_crew"))
        .args(["12", "7"])
        .output()
        .expect("it starts");
    let said = String::from_utf8_lossy(&crew.stderr);
    assert!(crew.status.success(), "{said}");
}
