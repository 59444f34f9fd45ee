//! What an operator does, in a directory.
use std::path::Path;

use clap::Parser;

use super::*;
use crate::keys::{Identity, ROBOT_KEY, TEAM, load_team};
use crate::roster::{Book, FLEET};

#[derive(Debug, Parser)]
struct Typed {
    #[command(subcommand)]
    command: Fleet,
}

const NOW: Moment = Moment::of(1_000_000);

/// As it is typed behind `coloc-link fleet`, `DIR` being `directory`.
fn typed_at(now: Moment, directory: &Path, line: &str) -> Result<String, FleetError> {
    let line = line.replace("DIR", directory.to_str().unwrap());
    let words = ["fleet"].into_iter().chain(line.split_whitespace());
    told(Typed::try_parse_from(words).unwrap().command, now)
}

fn typed(directory: &Path, line: &str) -> Result<String, FleetError> {
    typed_at(NOW, directory, line)
}

fn begun() -> (tempfile::TempDir, std::path::PathBuf) {
    let home = tempfile::tempdir().unwrap();
    let directory = home.path().join("yard");
    typed(
        &directory,
        "init DIR --name yard --datum hall --period assist=0.5",
    )
    .unwrap();
    typed(
        &directory,
        "add DIR robot1 --id 1 --address 10.0.0.1:7373 --leads",
    )
    .unwrap();
    typed(&directory, "add DIR robot2 --id 2 --address 10.0.0.2:7373").unwrap();
    (home, directory)
}

/// What a robot that has this directory believes.
fn book_of(directory: &Path) -> Book {
    let text = std::fs::read_to_string(directory.join(FLEET)).unwrap();
    Book::open(text, load_team(directory).unwrap()).unwrap()
}

#[test]
fn two_robots_are_a_team_and_have_what_they_need() {
    let (_home, directory) = begun();
    for name in ["robot1", "robot2"] {
        let own = directory.join(name);
        let book = book_of(&own);
        let key = Identity::load(&own, ROBOT_KEY).unwrap().public();
        assert_eq!(book.roster().owner(&key).unwrap().name.as_str(), name);
        assert_eq!(book.roster().version, 3);
    }
    assert!(
        book_of(&directory)
            .roster()
            .leads(&"robot1".parse().unwrap())
    );
    let text = typed(&directory, "show DIR").unwrap();
    for part in [
        "team         yard",
        "period       assist 0.5 s",
        "robot, leads",
        "at 10.0.0.2:7373",
    ] {
        assert!(text.contains(part), "{text}");
    }
    // A robot's own directory shows the same, and has no key of the team.
    assert!(
        typed(&directory.join("robot1"), "show DIR")
            .unwrap()
            .contains("robot2")
    );
    assert!(typed(&directory.join("robot1"), "revoke DIR robot2").is_err());
}

#[test]
fn a_team_is_begun_once_and_nobody_is_in_it_twice() {
    let (_home, directory) = begun();
    assert!(matches!(
        typed(&directory, "init DIR"),
        Err(FleetError::Key(_))
    ));
    let twice = typed(&directory, "add DIR robot1 --id 7");
    assert!(matches!(twice, Err(FleetError::There(_))));
    let number = typed(&directory, "add DIR robot7 --id 2");
    assert!(matches!(number, Err(FleetError::Roster(_))));
    assert!(!directory.join("robot7").exists());
    assert_eq!(book_of(&directory).roster().version, 3);
    assert!(matches!(
        typed(&directory, "revoke DIR robot7"),
        Err(FleetError::Nobody(_))
    ));
}

#[test]
fn who_is_revoked_is_gone_from_the_newest_roster() {
    let (_home, directory) = begun();
    let mut old = book_of(&directory.join("robot1"));
    typed(&directory, "revoke DIR robot1").unwrap();
    let book = book_of(&directory.join("robot2"));
    assert!(book.roster().named("robot1").is_none());
    assert!(book.roster().leaders.is_empty());
    assert_eq!(old.offer(book.text()), Ok(crate::roster::Offer::Newer));
    // Under its name another one comes, with another key.
    let before = Identity::load(&directory.join("robot1"), ROBOT_KEY).unwrap();
    typed(&directory, "add DIR robot1 --id 1").unwrap();
    let after = Identity::load(&directory.join("robot1"), ROBOT_KEY).unwrap();
    assert_ne!(before.public(), after.public());
}

#[test]
fn time_is_renewed_for_one_or_for_all() {
    let (_home, directory) = begun();
    let until = |name: &str| book_of(&directory).roster().named(name).unwrap().expires;
    let later = NOW.later(86_400 * 360);
    assert!(
        typed_at(later, &directory, "show DIR")
            .unwrap()
            .contains("soon over:")
    );
    typed_at(later, &directory, "renew DIR robot2 --days 10").unwrap();
    assert_eq!(until("robot2"), later.later(86_400 * 10));
    assert_eq!(until("robot1"), NOW.later(86_400 * 365));
    typed_at(later, &directory, "renew DIR").unwrap();
    assert_eq!(until("robot1"), later.later(86_400 * 365));
    let over = typed_at(later.later(86_400 * 400), &directory, "show DIR").unwrap();
    assert!(over.contains("OVER since"));
}

#[test]
fn a_key_is_renewed_without_a_moment_in_which_nobody_knows_it() {
    let (_home, directory) = begun();
    let own = directory.join("robot2");
    let old = Identity::load(&own, ROBOT_KEY).unwrap().public();
    typed(&directory, "renew DIR robot2 --new-key").unwrap();
    let new = Identity::load(&own, ROBOT_KEY).unwrap().public();
    assert_ne!(old, new);
    let has = |key| {
        book_of(&directory)
            .roster()
            .named("robot2")
            .unwrap()
            .has(&key)
    };
    assert!(has(old) && has(new));
    // To give everybody more time is not to drop somebody's key.
    typed(&directory, "renew DIR").unwrap();
    assert!(has(old) && has(new));
    typed(&directory, "renew DIR robot2").unwrap();
    assert!(!has(old) && has(new));
}

#[test]
fn a_robot_may_have_made_its_key_itself() {
    let (_home, directory) = begun();
    let key = Identity::of_seed(&[9; 32]).public();
    let line = format!("add DIR base --id 9 --role station --key {key}");
    typed(&directory, &line).unwrap();
    assert!(!directory.join("base").join(ROBOT_KEY).exists());
    assert!(directory.join("base").join(TEAM).exists());
    let book = book_of(&directory);
    let member = book.roster().owner(&key).unwrap();
    assert_eq!((member.id, member.role), (9, Role::Station));
}
