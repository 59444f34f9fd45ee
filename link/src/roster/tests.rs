//! Rosters.
use coloc_shm_types::{Channel, RobotName};

use super::*;
use crate::keys::Identity;
use crate::kinds::Kind;

/// The key of the team of tests.
pub(crate) fn team_key() -> Identity {
    Identity::of_seed(&[0xfe; 32])
}

/// The key of a robot of it.
pub(crate) fn robot_key(id: u16) -> Identity {
    Identity::of_seed(&[u8::try_from(id).unwrap(); 32])
}

/// Robots 1 and 2, and station 9, until second 2000 from a roster of second 1000.
pub(crate) fn team() -> Roster {
    let member = |id, role| Member {
        name: RobotName::new(&format!("robot{id}")).unwrap(),
        id,
        role,
        key: robot_key(id).public(),
        next_key: None,
        expires: Moment::of(2_000_000),
        addresses: vec![format!("127.0.0.1:{}", 4000 + id)],
        says: None,
    };
    Roster {
        format: FORMAT,
        version: 3,
        name: "yard".into(),
        team: team_key().public(),
        issued: Moment::of(1_000_000),
        datum: "yard".into(),
        periods: [("assist".to_owned(), 0.5)].into(),
        leaders: vec!["robot1".into()],
        member: vec![
            member(1, Role::Robot),
            member(2, Role::Robot),
            member(9, Role::Station),
        ],
    }
}

#[test]
fn what_is_signed_is_read_again() {
    let text = team().sign(&team_key()).unwrap();
    assert_eq!(Roster::verify(&text, &team_key().public()), Ok(team()));
}

#[test]
fn a_roster_that_was_changed_or_is_anothers_is_refused() {
    let text = team().sign(&team_key()).unwrap();
    let changed = text.replace("station", "robot");
    assert_ne!(changed, text);
    let refused = Roster::verify(&changed, &team_key().public());
    assert!(matches!(refused, Err(RosterError::BadSignature { .. })));
    let refused = Roster::verify(&text, &robot_key(1).public());
    assert!(matches!(refused, Err(RosterError::BadSignature { .. })));
    let (_, unsigned) = text.split_once('\n').unwrap();
    let refused = Roster::verify(unsigned, &team_key().public());
    assert_eq!(refused, Err(RosterError::NotSigned));
    assert!(team().sign(&robot_key(1)).is_err());
}

#[test]
fn what_contradicts_itself_is_neither_signed_nor_read() {
    let refused = |change: fn(&mut Roster)| {
        let mut roster = team();
        change(&mut roster);
        let refused = roster.sign(&team_key());
        assert!(
            matches!(refused, Err(RosterError::Contradiction(_))),
            "{refused:?}"
        );
    };
    refused(|roster| roster.member[1].id = 1);
    refused(|roster| roster.member[1].id = u16::MAX);
    refused(|roster| roster.member[1].name = roster.member[0].name.clone());
    refused(|roster| roster.member[1].key = roster.member[0].key);
    refused(|roster| roster.member[1].next_key = Some(roster.member[0].key));
    refused(|roster| roster.member[1].key = roster.team);
    refused(|roster| roster.member[1].says = Some(vec!["odometry".into()]));
    refused(|roster| roster.leaders = vec!["robot7".into()]);
    refused(|roster| roster.periods = [("assist".to_owned(), f64::NAN)].into());
}

#[test]
fn a_newer_format_is_named() {
    let roster = Roster {
        format: FORMAT + 1,
        ..team()
    };
    let text = roster.sign(&team_key()).unwrap();
    let refused = Roster::verify(&text, &team_key().public());
    assert_eq!(refused, Err(RosterError::Format(FORMAT + 1)));
}

#[test]
fn what_a_later_version_adds_is_passed_over() {
    use ed25519_dalek::Signer;
    let text = team().sign(&team_key()).unwrap();
    let (_, body) = text.split_once('\n').unwrap();
    let body = body.replace("version = 3", "version = 3\nlater = true");
    let signature = team_key()
        .signing()
        .sign(format!("coloc roster\n{body}").as_bytes());
    let text = format!(
        "signature = \"{}\"\n{body}",
        crate::keys::hex(&signature.to_bytes())
    );
    assert_eq!(Roster::verify(&text, &team_key().public()), Ok(team()));
}

#[test]
fn the_newest_roster_decides_and_an_old_one_never_comes_back() {
    let sign = |version| Roster { version, ..team() }.sign(&team_key()).unwrap();
    let mut book = Book::open(sign(3), team_key().public()).unwrap();
    assert_eq!(book.offer(&sign(3)), Ok(Offer::Same));
    assert_eq!(book.offer(&sign(2)), Ok(Offer::Old));
    let mut revoked = team();
    revoked.version = 4;
    revoked.member.retain(|member| member.id != 2);
    assert_eq!(
        book.offer(&revoked.sign(&team_key()).unwrap()),
        Ok(Offer::Newer)
    );
    assert_eq!(
        book.roster().standing(2, Moment::of(1_500_000)),
        Err(Standing::Unknown)
    );
    assert_eq!(book.offer(&sign(3)), Ok(Offer::Old));
    assert_eq!(book.offer(&sign(4)), Ok(Offer::Another));
    assert!(book.roster().member(2).is_none());
    assert!(book.offer("version = 5\n").is_err());
}

#[test]
fn time_is_over_only_for_whom_it_is() {
    let mut roster = team();
    roster.member[1].expires = Moment::of(1_200_000);
    let standing = |id, now| roster.standing(id, Moment::of(now)).map(|it| it.id);
    assert_eq!(standing(2, 1_200_000), Ok(2));
    assert_eq!(standing(2, 1_200_001), Err(Standing::Expired));
    assert_eq!(standing(1, 1_200_001), Ok(1));
    assert_eq!(standing(7, 1_100_000), Err(Standing::Unknown));
}

#[test]
fn a_clock_that_was_never_set_is_called_so_and_makes_nobody_a_stranger() {
    let roster = team();
    assert!(roster.clock_is_wrong(Moment::of(0)));
    assert!(!roster.clock_is_wrong(Moment::of(1_000_000 - 5)));
    assert!(roster.standing(1, Moment::of(0)).is_ok());
}

#[test]
fn stations_listen_and_nobody_says_what_drivers_say() {
    let roster = team();
    let [robot, station] = [1, 9].map(|id| roster.member(id).unwrap());
    for kind in Kind::all() {
        assert!(!station.may_say(kind));
        assert_eq!(robot.may_say(kind), !kind.is_a_drivers());
    }
    let some = Member {
        says: Some(vec!["answer".into()]),
        ..robot.clone()
    };
    assert!(some.may_say(&Kind::of(Channel::Answer)));
    assert!(!some.may_say(&Kind::of(Channel::Neighbour)));
}

#[test]
fn another_frame_or_period_has_another_fingerprint() {
    let other = Roster {
        datum: "garage".into(),
        periods: [("assist".to_owned(), 0.25)].into(),
        ..team()
    };
    assert_ne!(other.datum_fingerprint(), team().datum_fingerprint());
    assert_ne!(other.periods_fingerprint(), team().periods_fingerprint());
}
