//! What nobody of the team would send: it is refused under its reason, and nothing changes.

use coloc_estimator::assist::datum::{Reading, carried, extend};
use coloc_estimator::assist::events::{Data, Events, Now, OPEN_EVENTS, Terms, Word};
use coloc_estimator::assist::path::Path;
use coloc_estimator::assist::refusal::Refusal;
use coloc_estimator::assist::search::{Answer, Patience, Settled, Use};
use coloc_estimator::assist::slot::{Slot, Slots};
use coloc_estimator::assist::team::{Place, Team};
use coloc_estimator::{Covariance3, GlobalPose, Parts, Pose, Propagation, RobotId, Span, Stamp};

const LEADERS: [u16; 2] = [100, 101];

/// Eighteen children: two more than a path holds.
fn team() -> Team {
    let children: Vec<u16> = (1..=18).collect();
    crate::trees::team_of(&LEADERS, &children)
}

fn terms() -> Terms {
    Terms {
        team: team(),
        slots: Slots::new(Span::from_millis(200), Span::ZERO).unwrap(),
        patience: Patience {
            ack_timeout: 8,
            close_after: 40,
        },
        is_full: false,
        propagation: Propagation::Paper,
    }
}

const NOW: Now = Now {
    tick: 1003,
    slot: Slot(100),
};

/// In the tick 1000 the event began that it is about.
const BEGAN: u32 = 1000;

fn place(id: u16) -> Place {
    team().place(RobotId(id)).unwrap()
}

fn path(ids: &[u16]) -> Result<Path, Refusal> {
    let ids: Vec<_> = ids.iter().copied().map(RobotId).collect();
    Path::new(&team(), &ids)
}

fn data(ids: &[u16]) -> Data {
    let covariance = Covariance3::diagonal([0.01, 0.01, 0.001]).unwrap();
    Data {
        slot: Slot(100),
        stamp: Stamp::from_nanos(20_000_000_000),
        path: path(ids).unwrap(),
        is_final: false,
        digest: 0,
        said: GlobalPose {
            pose: Pose::new(1.0, 2.0, 0.3),
            parts: Parts {
                independent: covariance,
                dependent: covariance,
            },
        },
        word: Word::default(),
    }
}

fn reading() -> Reading {
    Reading {
        relative: Pose::new(1.0, 0.0, 0.0),
        covariance: Covariance3::diagonal([0.01, 0.01, 0.001]).unwrap(),
    }
}

/// Child 3 sees the children 4 and 5, and has a datum of leader 100.
fn in_the_middle() -> Events {
    let mut events = Events::new(place(3), Slot(90));
    let stamp = Stamp::from_nanos(20_000_000_000);
    for seen in [4, 5] {
        assert!(events.see(&terms(), NOW, (place(seen), stamp, reading()), BEGAN));
    }
    let first = data(&[100, 2, 3]);
    let answer = events.hear(&terms(), NOW, place(2), &first, BEGAN);
    assert_eq!(answer, Ok(Answer::Accepted));
    let mut sent = Vec::new();
    events.work(&terms(), NOW, |_, _| None, |it| sent.push(it.path.end()));
    assert_eq!(sent, [place(4), place(5)]);
    events
}

fn state(events: &Events) -> String {
    format!("{events:?}")
}

#[test]
fn what_is_no_path() {
    let long: Vec<u16> = [100].into_iter().chain(1..=16).collect();
    assert!(path(&long[..16]).is_ok());
    let cases: [(&[u16], Refusal); 8] = [
        (&[], Refusal::PathTooShort),
        (&[100], Refusal::PathTooShort),
        (&long, Refusal::PathTooLong),
        (&[1, 2, 3], Refusal::NotALeader),
        (&[102, 3], Refusal::NotALeader),
        (&[100, 40, 3], Refusal::UnknownRobot),
        (&[100, 2, 101, 3], Refusal::LeaderRelays),
        (&[100, 3, 2, 3], Refusal::Looped),
    ];
    for (ids, refusal) in cases {
        assert_eq!(path(ids).err(), Some(refusal), "{ids:?}");
    }
    assert_eq!(path(&[100, 2, 2, 3]).err(), Some(Refusal::Looped));
    assert_eq!(path(&[100, 100]).err(), Some(Refusal::LeaderRelays));
}

#[test]
fn what_is_no_datum_for_this_child() {
    let mut events = in_the_middle();
    let before = state(&events);
    let good = data(&[101, 2, 3]);
    let mut of_leader = in_the_middle();
    let spoilt = |change: fn(&mut Data)| {
        let mut data = good;
        change(&mut data);
        data
    };
    let cases = [
        (data(&[101, 2, 4]), 2, Refusal::NotForMe),
        (data(&[101, 2, 3]), 5, Refusal::NotOfSender),
        (spoilt(|it| it.is_final = true), 2, Refusal::NotFinal),
        (spoilt(|it| it.slot = Slot(99)), 2, Refusal::WrongEvent),
        (
            spoilt(|it| it.stamp = Stamp::from_nanos(i64::MAX)),
            2,
            Refusal::WrongEvent,
        ),
        (
            spoilt(|it| {
                it.slot = Slot(102);
                it.stamp = Stamp::from_nanos(20_400_000_000);
            }),
            2,
            Refusal::WrongEvent,
        ),
        (
            spoilt(|it| it.said.pose.x = f64::NAN),
            2,
            Refusal::NotFinite,
        ),
        (
            spoilt(|it| it.word.past.transitions[3][2][1] = f32::INFINITY),
            2,
            Refusal::NotFinite,
        ),
    ];
    for (data, sender, refusal) in cases {
        let answer = events.hear(&terms(), NOW, place(sender), &data, BEGAN);
        assert_eq!(answer, Err(refusal));
    }
    assert_eq!(state(&events), before);
    let answer = of_leader.hear(&terms(), NOW, place(2), &good, BEGAN);
    assert_eq!(
        answer,
        Ok(Answer::Accepted),
        "it was good before it was spoilt"
    );
}

/// Where leaders know all readings nothing is handed on, and only they speak.
#[test]
fn what_is_final() {
    let full = Terms {
        is_full: true,
        ..terms()
    };
    let mut events = Events::new(place(3), Slot(90));
    let handed_on = data(&[100, 2, 3]);
    let is_final = Data {
        is_final: true,
        ..handed_on
    };
    let answer = events.hear(&full, NOW, place(2), &handed_on, BEGAN);
    assert_eq!(answer, Err(Refusal::NotHandedOn));
    let answer = events.hear(&full, NOW, place(2), &is_final, BEGAN);
    assert_eq!(
        answer,
        Err(Refusal::NotOfSender),
        "a child says that it is final"
    );
    let answer = events.hear(&full, NOW, place(100), &is_final, BEGAN);
    assert_eq!(answer, Ok(Answer::Accepted));
    // Another leader knew something else. What shares a sighting with what was taken is not, the rest is.
    let other = |ids: &[u16]| Data {
        is_final: true,
        digest: 7,
        ..data(ids)
    };
    let answer = events.hear(&full, NOW, place(101), &other(&[101, 2, 3]), BEGAN);
    assert_eq!(answer, Ok(Answer::Declined));
    let answer = events.hear(&full, NOW, place(101), &other(&[101, 4, 3]), BEGAN);
    assert_eq!(answer, Ok(Answer::Accepted));
    assert_eq!(events.disagreed(), 2);
    let send = |_: &Data| panic!("a final datum is not handed on");
    assert_eq!(events.work(&full, NOW, |_, _| None, send), 0);
}

#[test]
fn what_answers_nothing() {
    let mut events = in_the_middle();
    let before = state(&events);
    let mut answered = |child, leader, slot| {
        let said = (place(child), place(leader), false);
        events.answered(&terms(), NOW, said, Slot(slot))
    };
    assert_eq!(answered(100, 100, 100), Err(Refusal::NotAChild));
    assert_eq!(answered(4, 5, 100), Err(Refusal::NotALeader));
    assert_eq!(answered(4, 101, 100), Ok(Settled::Ignored));
    assert_eq!(answered(6, 100, 100), Ok(Settled::Ignored));
    assert_eq!(answered(4, 100, 92), Ok(Settled::Ignored));
    assert_eq!(answered(4, 100, i64::MIN), Ok(Settled::Ignored));
    assert_eq!(state(&events), before);
}

/// However often it is said.
#[test]
fn a_flood_moves_nothing() {
    let mut events = in_the_middle();
    let before = state(&events);
    let stamp = Stamp::from_nanos(20_000_000_000);
    for number in 0_u16..10_000 {
        let relay = [1, 2, 4, 5, 6][usize::from(number % 5)];
        let again = data(&[100, relay, 3]);
        let answer = events.hear(&terms(), NOW, place(relay), &again, BEGAN + 50);
        let expected = if relay == 2 {
            Answer::Repeated
        } else {
            Answer::Declined
        };
        assert_eq!(answer, Ok(expected));
        let mut other = again;
        other.slot = Slot(i64::from(number) * 7 - 40_000);
        if other.slot != Slot(100) {
            let answer = events.hear(&terms(), NOW, place(relay), &other, BEGAN);
            assert_eq!(answer, Err(Refusal::WrongEvent));
        }
        let seen = (place(4), stamp, reading());
        assert!(events.see(&terms(), NOW, seen, BEGAN));
    }
    assert_eq!(state(&events), before);
}

/// The same of a child that sees more than it has room for.
#[test]
fn too_many_are_seen() {
    let mut events = Events::new(place(3), Slot(90));
    let stamp = Stamp::from_nanos(20_000_000_000);
    let others = (1..=18).filter(|it| *it != 3);
    let seen = others.map(|it| events.see(&terms(), NOW, (place(it), stamp, reading()), BEGAN));
    let seen: Vec<bool> = seen.collect();
    assert_eq!(seen.iter().filter(|it| **it).count(), 16);
    assert!(!seen[16]);
    assert!(!events.see(&terms(), NOW, (place(100), stamp, reading()), BEGAN));
    assert!(!events.see(&terms(), NOW, (place(3), stamp, reading()), BEGAN));
}

/// One more than there is room for closes the oldest.
#[test]
fn a_ninth_event() {
    let mut events = Events::new(place(3), Slot(90));
    let of = |slot: u32| {
        let mut data = data(&[100, 2, 3]);
        data.slot = Slot(i64::from(slot));
        data.stamp = Stamp::from_nanos(i64::from(slot) * 200_000_000);
        let now = Now {
            tick: slot * 3,
            slot: data.slot,
        };
        (data, now)
    };
    let mut hear = |slot: u32, at: u32| {
        let (data, _) = of(slot);
        let (_, now) = of(at);
        let answer = events
            .hear(&terms(), now, place(2), &data, slot * 3)
            .unwrap();
        (answer, events.closed_early())
    };
    for slot in 100..108 {
        assert_eq!(hear(slot, slot), (Answer::Accepted, 0));
    }
    assert_eq!(OPEN_EVENTS, 8);
    assert_eq!(hear(108, 107), (Answer::Accepted, 1));
    assert_eq!(hear(100, 107), (Answer::Closed, 1));
    assert_eq!(hear(101, 107), (Answer::Repeated, 1));
    assert_eq!(hear(89, 107), (Answer::Closed, 1));
    // After their time they are closed by themselves.
    assert_eq!(hear(106, 120), (Answer::Closed, 1));
    assert_eq!(hear(114, 120), (Answer::Accepted, 1));
}

/// Nothing of the time before it started.
#[test]
fn before_it_started() {
    let mut events = Events::new(place(3), Slot(101));
    let before = state(&events);
    let answer = events.hear(&terms(), NOW, place(2), &data(&[100, 2, 3]), BEGAN);
    assert_eq!(answer, Ok(Answer::Closed));
    assert!(!Answer::Closed.acknowledges());
    assert_eq!(state(&events), before);
}

/// A sighting with another stamp: the datum is carried there first, if the way is known; else the sighting stays free.
#[test]
fn a_sighting_with_another_stamp() {
    let mut events = Events::new(place(3), Slot(90));
    let first = data(&[100, 2, 3]);
    let later = first.stamp + Span::from_millis(40);
    assert!(events.see(&terms(), NOW, (place(4), later, reading()), BEGAN));
    let answer = events.hear(&terms(), NOW, place(2), &first, BEGAN);
    assert_eq!(answer, Ok(Answer::Accepted));
    let mut unknown = events.clone();
    unknown.work(
        &terms(),
        NOW,
        |_, _| None,
        |_| panic!("the way is not known"),
    );
    assert_eq!(
        unknown.search(Slot(100)).unwrap().sights()[0].used,
        Use::Free
    );
    let way = |from, to| {
        assert_eq!((from, to), (first.stamp, later));
        Some(Reading {
            relative: Pose::new(0.5, 0.0, 0.0),
            covariance: Covariance3::ZERO,
        })
    };
    let mut sent = Vec::new();
    events.work(&terms(), NOW, way, |it| sent.push(*it));
    let moved = carried(
        &first.said,
        &way(first.stamp, later).unwrap(),
        Propagation::Paper,
    );
    let expected = extend(&moved, &reading(), Propagation::Paper);
    assert_eq!((sent.len(), sent[0].stamp), (1, later));
    assert_eq!((sent[0].said, sent[0].word), (expected, first.word));
}
