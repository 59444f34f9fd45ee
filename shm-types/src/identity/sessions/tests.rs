use std::collections::BTreeSet;

use proptest::prelude::*;

use super::*;

const SECOND: i64 = 1_000_000_000;

fn message(source: u16, session: u64, sequence: u64) -> Header {
    Header {
        session,
        sequence,
        source,
        ..Header::default()
    }
}

fn sensors() -> Sessions {
    Sessions::new(Sessions::SENSORS)
}

/// Of the sources up to 40.
fn states(sessions: &Sessions, now_ns: i64) -> Vec<SourceState> {
    (0..=40)
        .filter_map(|number| sessions.state(number, now_ns))
        .collect()
}

#[test]
fn a_message_passes_once() {
    let mut sessions = sensors();
    assert_eq!(sessions.accept(&message(0, 1, 0), 0), Ok(()));
    assert_eq!(sessions.accept(&message(0, 1, 0), 0), Err(Reject::Replayed));
}

/// A driver that was restarted after its clock had been set back used to be muted until the clock had caught up.
#[test]
fn a_restarted_sender_is_heard_at_once_whatever_its_number() {
    for restarted in [0, u64::MAX] {
        let mut sessions = sensors();
        assert_eq!(sessions.accept(&message(0, 1000, 70), 0), Ok(()));
        assert_eq!(sessions.accept(&message(0, restarted, 0), 1), Ok(()));
        assert_eq!(sessions.accept(&message(0, restarted, 1), 2), Ok(()));
        assert_eq!(sessions.accept(&message(0, 1000, 71), 3), Ok(()));
    }
}

/// One message of a session slightly ahead used to silence the real neighbour.
#[test]
fn a_spoofed_message_mutes_nobody_also_under_the_senders_own_session() {
    for spoofed in [
        message(2, 7, 1_000_000),
        message(2, 7, u64::MAX),
        message(2, 8, 0),
        message(2, 6, 5),
        message(2, 7, 0),
    ] {
        let mut sessions = sensors();
        for sequence in 500..600 {
            assert_eq!(sessions.accept(&message(2, 7, sequence), 0), Ok(()));
        }
        let _ = sessions.accept(&spoofed, 1);
        for sequence in 600..1000 {
            let heard = sessions.accept(&message(2, 7, sequence), 2);
            assert_eq!(heard, Ok(()), "{sequence} after {spoofed:?}");
            assert!(sessions.accept(&message(2, 7, sequence), 2).is_err());
        }
    }
}

#[test]
fn a_flood_of_sessions_mutes_nobody() {
    let mut sessions = sensors();
    for turn in 0..1000 {
        let now_ns = i64::try_from(turn).unwrap() * SECOND / 50;
        assert_eq!(sessions.accept(&message(0, 1, turn), now_ns), Ok(()));
        for spoofed in 0..5 {
            let session = 2 + 5 * turn + spoofed;
            assert_eq!(sessions.accept(&message(0, session, 0), now_ns), Ok(()));
        }
    }
}

#[test]
fn two_receivers_are_two_sources_and_both_are_heard() {
    let mut sessions = sensors();
    for sequence in 0..100 {
        for source in [0, 1] {
            assert_eq!(sessions.accept(&message(source, 5, sequence), 0), Ok(()));
        }
    }
    let states = states(&sessions, 0);
    assert_eq!(states.len(), 2);
    assert!(states.iter().all(|it| it.live == 1 && it.lost == 0));
}

#[test]
fn a_session_ends_after_five_of_its_intervals_and_not_within_a_second() {
    for (interval_ns, patience_ns) in [(SECOND / 50, SECOND), (SECOND, 5 * SECOND)] {
        let mut sessions = sensors();
        for k in 0..10 {
            sessions
                .accept(&message(0, 1, k), k.cast_signed() * interval_ns)
                .unwrap();
        }
        let last_ns = 9 * interval_ns;
        let live = |now_ns| sessions.state(0, now_ns).unwrap().live;
        assert_eq!(live(last_ns + patience_ns), 1);
        assert_eq!(live(last_ns + patience_ns + 1), 0);
    }
}

#[test]
fn a_session_that_was_silent_goes_on_where_it_was() {
    let mut sessions = sensors();
    sessions.accept(&message(0, 1, 5), 0).unwrap();
    assert_eq!(sessions.state(0, 60 * SECOND).unwrap().live, 0);
    assert!(sessions.accept(&message(0, 1, 5), 60 * SECOND).is_err());
    sessions.accept(&message(0, 1, 6), 60 * SECOND).unwrap();
    assert_eq!(sessions.state(0, 60 * SECOND).unwrap().live, 1);
}

#[test]
fn what_is_missing_is_counted_for_its_source() {
    let mut sessions = sensors();
    for sequence in [0, 1, 5, 6, 3] {
        sessions.accept(&message(0, 1, sequence), 0).unwrap();
    }
    sessions.accept(&message(1, 1, 900), 0).unwrap();
    assert_eq!(sessions.state(0, 0).unwrap().lost, 2);
    assert_eq!(sessions.state(1, 0).unwrap().lost, 0);
}

#[test]
fn a_restart_is_no_contest() {
    let mut sessions = sensors();
    for sequence in 0_u64..100 {
        let now_ns = SECOND / 10 * sequence.cast_signed();
        let (session, sequence) = (sequence / 50, sequence % 50);
        sessions
            .accept(&message(0, session, sequence), now_ns)
            .unwrap();
        assert!(!sessions.state(0, now_ns).unwrap().contested);
    }
    assert_eq!(sessions.state(0, 10 * SECOND).unwrap().live, 1);
}

/// At 10 Hz, at 1 Hz and every ten seconds.
#[test]
fn two_senders_that_claim_one_source_are_contested_until_one_of_them_ends() {
    for interval_ns in [SECOND / 10, SECOND, 10 * SECOND] {
        let mut sessions = sensors();
        let mut now_ns = 0;
        for sequence in 0..100 {
            now_ns += interval_ns / 2;
            let number = 1 + sequence % 2;
            sessions
                .accept(&message(0, number, sequence / 2), now_ns)
                .unwrap();
        }
        let state = sessions.state(0, now_ns).unwrap();
        assert_eq!((state.contested, state.live, state.lost), (true, 2, 0));
        for sequence in 50..150 {
            now_ns += interval_ns;
            sessions.accept(&message(0, 1, sequence), now_ns).unwrap();
        }
        let state = sessions.state(0, now_ns).unwrap();
        assert_eq!((state.contested, state.live), (false, 1));
    }
}

/// A contest used to last for as long as the slower of the two is waited for.
#[test]
fn a_contest_is_over_when_one_of_two_has_ended_however_slow_the_other_is() {
    let mut sessions = sensors();
    for tenth in 0..1000_u64 {
        let now_ns = SECOND / 10 * tenth.cast_signed();
        sessions.accept(&message(0, 1, tenth), now_ns).unwrap();
        if tenth % 100 == 0 {
            let slow = message(0, 2, tenth / 100);
            sessions.accept(&slow, now_ns).unwrap();
        }
    }
    let state = |seconds| sessions.state(0, seconds * SECOND).unwrap();
    assert_eq!((state(100).contested, state(100).live), (true, 2));
    assert_eq!((state(102).contested, state(102).live), (false, 1));
}

/// One that comes back after an hour used to be waited for as if it spoke once in an hour.
#[test]
fn a_contest_is_over_soon_also_with_one_that_was_away_for_long() {
    let (mut sessions, hour) = (sensors(), 3600);
    for sequence in 0..50 {
        let now_ns = SECOND / 10 * sequence;
        let old = message(0, 1, sequence.cast_unsigned());
        sessions.accept(&old, now_ns).unwrap();
    }
    for second in 0..15 {
        let now_ns = (hour + second) * SECOND;
        let sequence = second.cast_unsigned();
        sessions.accept(&message(0, 2, sequence), now_ns).unwrap();
        if second < 5 {
            let old = message(0, 1, 50 + sequence);
            sessions.accept(&old, now_ns + 1).unwrap();
        }
    }
    let state = |seconds| sessions.state(0, seconds * SECOND).unwrap();
    assert!(state(hour + 4).contested);
    let later = state(hour + 14);
    assert_eq!((later.contested, later.live), (false, 1));
}

/// Two restarts, an hour apart, are no hour of contest.
#[test]
fn a_contest_of_long_ago_does_not_go_on() {
    let mut sessions = sensors();
    for (hour, [old, new]) in [(0, [1, 2]), (1, [3, 4])] {
        let now_ns = 3600 * SECOND * hour;
        for (session, sequence) in [(old, 0), (new, 0), (old, 1)] {
            let header = message(0, session, sequence);
            sessions.accept(&header, now_ns).unwrap();
        }
        let state = sessions.state(0, now_ns).unwrap();
        assert_eq!((state.contested, state.live), (false, 2));
    }
}

#[test]
fn a_source_too_many_is_refused_until_one_has_ended() {
    let mut sessions = sensors();
    for source in 0..16 {
        sessions.accept(&message(source, 1, 0), 0).unwrap();
    }
    let seventeenth = message(16, 1, 0);
    assert_eq!(
        sessions.accept(&seventeenth, SECOND),
        Err(Reject::TooManySources)
    );
    sessions.accept(&message(0, 1, 1), SECOND + 1).unwrap();
    assert_eq!(sessions.accept(&seventeenth, SECOND + 1), Ok(()));
    assert!(sessions.state(0, SECOND + 1).is_some());
    assert_eq!(states(&sessions, 0).len(), 16);
}

#[test]
fn of_the_sources_that_have_ended_the_one_that_was_silent_for_longest_gives_way() {
    let mut sessions = Sessions::new(3);
    let begun = [2, 1, 3].map(|at| at * SECOND);
    for (source, now_ns) in (0..).zip(begun) {
        sessions.accept(&message(source, 1, 0), now_ns).unwrap();
    }
    let now_ns = 100 * SECOND;
    for (source, gone) in [(7, 1), (8, 0)] {
        assert_eq!(sessions.accept(&message(source, 1, 0), now_ns), Ok(()));
        assert_eq!(sessions.state(gone, now_ns), None);
    }
    assert!(sessions.state(2, now_ns).is_some());
}

/// After a stall many messages come at one moment: of sessions that came at once the one that came first gives way.
#[test]
fn a_fifth_session_takes_the_place_of_the_first_of_those_that_came_at_once() {
    let mut sessions = sensors();
    for session in 1..=5 {
        assert_eq!(sessions.accept(&message(0, session, 0), SECOND), Ok(()));
    }
    for session in 2..=5 {
        let again = sessions.accept(&message(0, session, 0), SECOND);
        assert_eq!(again, Err(Reject::Replayed), "{session}");
    }
    assert_eq!(sessions.accept(&message(0, 2, 1), SECOND), Ok(()));
    assert_eq!(sessions.accept(&message(0, 6, 0), SECOND), Ok(()));
    let again = sessions.accept(&message(0, 2, 0), SECOND);
    assert_eq!(again, Err(Reject::Replayed), "the second has come since");
}

/// The simplest thing that does the same, for one source and few sessions: everything that ever passed.
#[derive(Default)]
struct Model {
    passed: BTreeSet<(u64, u64)>,
    /// Of each session, the first and the newest.
    reach: std::collections::BTreeMap<u64, (u64, u64)>,
}

impl Model {
    fn accept(&mut self, session: u64, sequence: u64) -> bool {
        let (first, newest) = self.reach.entry(session).or_insert((sequence, sequence));
        *first = (*first).min(sequence);
        *newest = (*newest).max(sequence);
        self.passed.insert((session, sequence))
    }

    /// Between the first that was received, which a late one may come before, and the newest.
    fn missing(&self, begun: &std::collections::BTreeMap<u64, u64>) -> u64 {
        let of = |(session, (_, newest)): (&u64, &(u64, u64))| {
            let begun = begun[session];
            let there = self.passed.range((*session, begun)..=(*session, *newest));
            newest - begun + 1 - there.count() as u64
        };
        self.reach.iter().map(of).sum()
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        rng_seed: proptest::test_runner::RngSeed::Fixed(1), failure_persistence: None, ..ProptestConfig::default()
    })]

    /// Up to four sessions within their windows: exactly the new ones pass, and what is missing is counted.
    #[test]
    fn agrees_with_a_set(messages in prop::collection::vec((0_u64..4, 0_u64..128), 0..400)) {
        let (mut sessions, mut model) = (sensors(), Model::default());
        let mut begun = std::collections::BTreeMap::new();
        for (session, sequence) in messages {
            begun.entry(session).or_insert(sequence);
            let passed = sessions.accept(&message(0, session, sequence), 0).is_ok();
            prop_assert_eq!(passed, model.accept(session, sequence));
        }
        if let Some(state) = sessions.state(0, 0) {
            prop_assert_eq!(state.lost, model.missing(&begun));
        }
    }

    /// Whatever else is said under its source and its number: a sender that counts on is heard, each time.
    #[test]
    fn whatever_others_say_a_sender_is_heard(
        others in prop::collection::vec((0_u64..6, any::<u64>(), 0_i64..SECOND), 0..300),
    ) {
        let mut sessions = sensors();
        let (mut now_ns, mut sequence) = (0, 1000);
        for (session, spoofed, later_ns) in others {
            now_ns += later_ns;
            // It may happen to say what the sender is about to say; who was first is not to be told then.
            let _ = sessions.accept(&message(0, session, spoofed), now_ns);
            let same = (session, spoofed) == (3, sequence);
            prop_assert!(sessions.accept(&message(0, 3, sequence), now_ns).is_ok() || same);
            sequence += 1;
        }
    }

    /// Whatever comes and however the time goes, there is an answer, and no more sources than there is room.
    #[test]
    fn no_header_can_do_harm(
        headers in prop::collection::vec((0_u16..40, 0_u64..6, any::<u64>(), any::<i64>()), 0..300),
    ) {
        let mut sessions = sensors();
        for (source, session, sequence, now_ns) in headers {
            let _ = sessions.accept(&message(source, session, sequence), now_ns);
            let states = states(&sessions, now_ns);
            prop_assert!(states.len() <= Sessions::SENSORS);
            prop_assert!(states.iter().all(|it| it.live <= 4));
        }
    }
}
