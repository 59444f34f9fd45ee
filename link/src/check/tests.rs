//! What is said of a robot whose papers are in order, and of one whose are not.
use coloc_daemon::config::{Config, Member, Robot};

use super::papers::look_at_roster;
use super::*;
use crate::keys::Identity;
use crate::roster::Roster;
use crate::roster::tests::{robot_key, team};

const WITHIN: Moment = Moment::of(1_100_000);

fn config(id: u16, others: &[u16]) -> Config {
    let name = |id| format!("robot{id}").parse().unwrap();
    let mut config = Config::of(Robot { name: name(id), id });
    config.team = others
        .iter()
        .map(|id| Member {
            name: name(*id),
            id: *id,
        })
        .collect();
    config
}

fn found(config: &Config, roster: &Roster, key: &Identity, now: Moment) -> Findings {
    let mut findings = Findings::default();
    look_at_roster(config, roster, key, now, &mut findings);
    findings
}

#[test]
fn who_is_in_order_is_told_until_when() {
    let mut roster = team();
    roster.member[0].expires = Moment::of(100 * 86_400);
    let found = found(&config(1, &[2]), &roster, &robot_key(1), WITHIN);
    assert_eq!(found.warnings, [""; 0]);
    assert!(
        found
            .text
            .contains("member       robot1, number 1, until 1970-04-11"),
        "{}",
        found.text
    );
}

#[test]
fn what_is_wrong_is_named() {
    let said = |config: &Config, key: u16, now: i64, expected: &str| {
        let found = found(config, &team(), &robot_key(key), Moment::of(now));
        let named = found
            .warnings
            .iter()
            .any(|warning| warning.contains(expected));
        assert!(named, "{:?}", found.warnings);
    };
    said(&config(1, &[2]), 2, 1_100_000, "another key of robot1");
    said(&config(7, &[2]), 7, 1_100_000, "is not in the roster");
    said(
        &config(1, &[2]),
        1,
        2_000_001,
        "time in the roster was over at 1970-01-24",
    );
    said(
        &config(1, &[2]),
        1,
        1_999_000,
        "time in the roster is over at",
    );
    said(&config(1, &[2]), 1, 0, "it is my clock that is wrong");
    said(&config(1, &[]), 1, 1_100_000, "colocd will not hear it");
    said(&config(1, &[2, 5]), 1, 1_100_000, "[[team]] has robot5");
}

#[test]
fn what_the_link_that_runs_knows_is_told_and_what_is_wrong_is_a_warning() {
    let mut findings = Findings::default();
    super::peers::tell(
        "robot2: runs coloc-link 0.1.0\n!robot3: its clock\n",
        &mut findings,
    );
    assert_eq!(findings.text, "robot2       runs coloc-link 0.1.0\n");
    assert_eq!(findings.warnings, ["robot3: its clock"]);
}
