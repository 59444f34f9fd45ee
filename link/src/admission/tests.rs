//! What is admitted, and under which reason the rest is counted.
use coloc_shm_types::{Answer, Channel, Neighbour, Odometry, Plain};
use proptest::prelude::*;

use super::*;
use crate::keys::Identity;
use crate::roster::tests::{robot_key, team};
use crate::wire::{self, seal};

/// Within the time of the roster of tests (ns).
const START: i64 = 1_500_000_000_000_000;
const SECOND: i64 = 1_000_000_000;

const NOW: Now = Now {
    wall_ns: START,
    boot_ns: 50 * SECOND,
};

fn rules() -> Rules {
    Rules {
        own: 1,
        datum: team().datum_fingerprint(),
        periods: team().periods_fingerprint(),
        origin: 5,
        versions: wire::Versions::OWN,
        history_ns: 2 * SECOND,
        future_ns: SECOND / 10,
        max_offset_s: 0.05,
        correct_offset: false,
    }
}

/// Robot 2, or somebody who says so, and the door of robot 1.
struct Scene {
    door: Admission,
    roster: Roster,
    now: Now,
    key: Identity,
    envelope: Envelope,
    /// Added to the speaker's clock (ns).
    off_ns: i64,
}

impl Scene {
    fn new() -> Self {
        Self {
            door: Admission::new(rules()),
            roster: team(),
            now: NOW,
            key: robot_key(2),
            envelope: Envelope {
                version: wire::NEWEST,
                team: team().team.team(),
                session: 77,
                sequence: 0,
                stamp_ns: 0,
                kind: 0,
                roster: 3,
                speaker: 2,
                receiver: 1,
            },
            off_ns: 0,
        }
    }

    /// One that was greeted, and whose clock is known.
    fn met() -> Self {
        let mut scene = Self::new();
        scene.greet();
        scene.tell_time();
        scene
    }

    fn sealed(&mut self, kind: u32, body: &[u8]) -> Vec<u8> {
        self.envelope.sequence += 1;
        self.envelope.kind = kind;
        self.envelope.stamp_ns = self.now.wall_ns + self.off_ns;
        let mut bytes = Vec::new();
        assert!(seal(&self.envelope, body, self.key.signing(), &mut bytes));
        bytes
    }

    fn admit(&mut self, bytes: &[u8]) -> Result<(), Refusal> {
        let proven = self.key.public();
        self.door
            .admit(bytes, &proven, &self.roster, self.now)
            .map(drop)
    }

    fn say(&mut self, kind: u32, body: &[u8]) -> Result<(), Refusal> {
        let bytes = self.sealed(kind, body);
        self.admit(&bytes)
    }

    fn greet(&mut self) {
        let hello = own_hello(&rules(), &self.roster, self.now).body();
        assert_eq!(self.say(word::HELLO, &hello), Ok(()));
    }

    /// Two words about the clocks over a network that takes 1 ms each way.
    fn tell_time(&mut self) {
        self.pass(SECOND);
        let word = ClockWord {
            echo_ns: self.now.wall_ns - 2_000_000,
            heard_ns: self.now.wall_ns - 1_000_000 + self.off_ns,
        };
        let sent = self.now.wall_ns;
        self.now.wall_ns -= 1_000_000;
        let bytes = self.sealed(word::CLOCK, &word.body());
        self.now.wall_ns = sent;
        assert_eq!(self.admit(&bytes), Ok(()));
    }

    fn pass(&mut self, ns: i64) {
        self.now.wall_ns += ns;
        self.now.boot_ns += ns;
    }

    fn neighbour(&self) -> Neighbour {
        let mut told = Neighbour::default();
        told.header.stamp_ns = self.now.wall_ns + self.off_ns - SECOND / 10;
        told.header.source = self.envelope.speaker;
        told.header.clock = Clock::Realtime as u8;
        told
    }

    fn tell(&mut self, told: &Neighbour) -> Result<(), Refusal> {
        self.say(code(Channel::Neighbour), &plain(told))
    }
}

fn code(channel: Channel) -> u32 {
    Kind::of(channel).code
}

fn plain<P: Plain>(payload: &P) -> Vec<u8> {
    let mut bytes = vec![0; P::BYTES];
    assert!(payload.put(&mut bytes).is_some());
    bytes
}

/// Of somebody whom robot 1 has met, after `change`.
fn refused(change: impl FnOnce(&mut Scene)) -> Result<(), Refusal> {
    let mut scene = Scene::met();
    change(&mut scene);
    let told = scene.neighbour();
    let before = scene.door.counts().clone();
    let answer = scene.tell(&told);
    let counted = answer.err().map_or(0, |reason| {
        scene.door.counts().of(reason) - before.of(reason)
    });
    assert_eq!(counted, u64::from(answer.is_err()));
    assert_eq!(scene.door.counts().sum() - before.sum(), counted);
    answer
}

#[test]
fn a_member_that_was_met_is_heard() {
    assert_eq!(refused(|_| {}), Ok(()));
    assert_eq!(refused(|scene| scene.envelope.receiver = EVERYBODY), Ok(()));
    assert_eq!(refused(|scene| scene.envelope.roster = 2), Ok(()));
}

#[test]
fn each_lie_has_its_name() {
    type Lie = fn(&mut Scene);
    let expected: [(Lie, Refusal); 10] = [
        (|it| it.envelope.team ^= 1, Refusal::OtherTeam),
        (|it| it.envelope.speaker = 7, Refusal::NotInRoster),
        (|it| it.key = robot_key(9), Refusal::NotSpeaker),
        (|it| it.envelope.speaker = 1, Refusal::NotSpeaker),
        (|it| it.envelope.receiver = 9, Refusal::NotForMe),
        (|it| it.envelope.roster = 1, Refusal::OldRoster),
        (|it| it.envelope.session = 76, Refusal::OldSession),
        (|it| it.envelope.version = 9, Refusal::UnknownVersion),
        (|it| it.pass(600_000 * SECOND), Refusal::Expired),
        (|it| drop(it.roster.member.remove(1)), Refusal::NotInRoster),
    ];
    for (change, reason) in expected {
        assert_eq!(refused(change), Err(reason));
    }
}

#[test]
fn who_was_not_met_is_not_heard() {
    let mut scene = Scene::new();
    let told = scene.neighbour();
    assert_eq!(scene.tell(&told), Err(Refusal::OldSession));
    scene.greet();
    assert_eq!(scene.tell(&told), Err(Refusal::ClockUnknown));
    scene.tell_time();
    assert_eq!(scene.tell(&told), Ok(()));
}

#[test]
fn who_has_started_again_is_known_to_know_nothing_of_our_clock() {
    let mut scene = Scene::met();
    let is_first = |scene: &mut Scene, echo_ns| {
        let heard_ns = scene.now.wall_ns;
        let body = ClockWord { echo_ns, heard_ns }.body();
        let bytes = scene.sealed(word::CLOCK, &body);
        let proven = scene.key.public();
        let admitted = scene.door.admit(&bytes, &proven, &scene.roster, scene.now);
        matches!(admitted, Ok(Word::Clock { is_first: true }))
    };
    let sent_ns = scene.now.wall_ns - 1;
    assert!(!is_first(&mut scene, sent_ns) && is_first(&mut scene, 0));
}

#[test]
fn a_robot_cannot_speak_for_another_neither_outside_nor_inside() {
    let mut scene = Scene::met();
    let mut told = scene.neighbour();
    told.header.source = 9;
    assert_eq!(scene.tell(&told), Err(Refusal::NotSpeaker));
    // Robot 2's message, over the connection of the station.
    let told = scene.neighbour();
    let bytes = scene.sealed(code(Channel::Neighbour), &plain(&told));
    let station = robot_key(9).public();
    let answer = scene.door.admit(&bytes, &station, &scene.roster, scene.now);
    assert_eq!(answer.map(drop), Err(Refusal::NotSpeaker));
    let counted = scene.door.peer(9).unwrap().counts.of(Refusal::NotSpeaker);
    assert_eq!(counted, 1);
}

#[test]
fn what_its_role_may_not_say_is_refused() {
    let mut scene = Scene::met();
    let answer = scene.say(code(Channel::Odometry), &plain(&Odometry::default()));
    assert_eq!(answer, Err(Refusal::NotForRole));
    scene.roster.member[1].says = Some(vec!["answer".into()]);
    let told = scene.neighbour();
    assert_eq!(scene.tell(&told), Err(Refusal::NotForRole));
    let answer = Answer {
        header: told.header,
        ..Answer::default()
    };
    assert_eq!(scene.say(code(Channel::Answer), &plain(&answer)), Ok(()));
    scene.roster.member[1] = Roster::member(&team(), 9).unwrap().clone();
    scene.roster.member[1].id = 2;
    scene.roster.member[1].key = robot_key(2).public();
    assert_eq!(scene.tell(&told), Err(Refusal::NotForRole));
}

#[test]
fn a_kind_of_tomorrow_is_counted_and_harmless() {
    let mut scene = Scene::met();
    assert_eq!(scene.say(0xdead_beef, b"?"), Err(Refusal::UnknownKind));
    assert_eq!(scene.say(200, b"?"), Err(Refusal::UnknownKind));
    let told = scene.neighbour();
    assert_eq!(scene.tell(&told), Ok(()));
    let short = scene.say(code(Channel::Neighbour), &plain(&told)[1..]);
    assert_eq!(short, Err(Refusal::WrongSize));
    assert_eq!(scene.say(word::CLOCK, b"short"), Err(Refusal::BadWord));
    assert_eq!(scene.say(word::HELLO, b"short"), Err(Refusal::BadWord));
    assert_eq!(scene.say(word::ROSTER, b"\xff"), Err(Refusal::BadWord));
}

#[test]
fn what_was_here_passes_no_second_time_nor_in_another_session() {
    let mut scene = Scene::met();
    let told = scene.neighbour();
    let first = scene.sealed(code(Channel::Neighbour), &plain(&told));
    let second = scene.sealed(code(Channel::Neighbour), &plain(&told));
    assert_eq!(scene.admit(&second), Ok(()));
    assert_eq!(scene.admit(&first), Ok(()));
    for bytes in [&first, &second] {
        assert_eq!(scene.admit(bytes), Err(Refusal::Replayed));
    }
    scene.envelope.session = 78;
    scene.greet();
    assert_eq!(scene.admit(&first), Err(Refusal::OldSession));
}

#[test]
fn a_message_that_fails_uses_up_no_number() {
    let mut scene = Scene::met();
    let told = scene.neighbour();
    let good = scene.sealed(code(Channel::Neighbour), &plain(&told));
    let mut bad = good.clone();
    let last = bad.len() - 1;
    bad[last] ^= 1;
    assert_eq!(scene.admit(&bad), Err(Refusal::BadSignature));
    assert_eq!(scene.admit(&good), Ok(()));
}

#[test]
fn another_frame_or_period_is_refused_until_it_is_the_same() {
    for (change, reason) in [
        ((|it| it.datum ^= 1) as fn(&mut Hello), Refusal::WrongDatum),
        (|it| it.origin ^= 1, Refusal::WrongDatum),
        (|it| it.periods ^= 1, Refusal::WrongPeriod),
    ] {
        let mut scene = Scene::met();
        let mut hello = own_hello(&rules(), &scene.roster, scene.now);
        change(&mut hello);
        assert_eq!(scene.say(word::HELLO, &hello.body()), Ok(()));
        let told = scene.neighbour();
        assert_eq!(scene.tell(&told), Err(reason));
        scene.greet();
        assert_eq!(scene.tell(&told), Ok(()));
    }
}

#[test]
fn what_is_too_old_or_not_yet_is_refused_by_its_stamp() {
    let mut scene = Scene::met();
    let mut told = scene.neighbour();
    told.header.stamp_ns = scene.now.wall_ns - 2 * SECOND - 1;
    assert_eq!(scene.tell(&told), Err(Refusal::TooOld));
    told.header.stamp_ns = scene.now.wall_ns + SECOND / 10 + 1;
    assert_eq!(scene.tell(&told), Err(Refusal::FromFuture));
    told.header.stamp_ns = scene.now.wall_ns;
    assert_eq!(scene.tell(&told), Ok(()));
    told.header.clock = Clock::Boottime as u8;
    assert_eq!(scene.tell(&told), Err(Refusal::ForeignClock));
}

#[test]
fn a_clock_that_is_off_is_refused_or_corrected_as_configured() {
    for off_ns in [SECOND, -SECOND] {
        let mut scene = Scene::new();
        scene.off_ns = off_ns;
        scene.greet();
        scene.tell_time();
        let told = scene.neighbour();
        assert_eq!(scene.tell(&told), Err(Refusal::ClockOffset));
        let correcting = Rules {
            correct_offset: true,
            ..rules()
        };
        scene.door.set_rules(correcting);
        let bytes = scene.sealed(code(Channel::Neighbour), &plain(&told));
        let proven = scene.key.public();
        let word = scene.door.admit(&bytes, &proven, &scene.roster, scene.now);
        let Ok(Word::Payload(payload)) = word else {
            panic!("{word:?}");
        };
        assert!((payload.correction.by_ns + off_ns).abs() < 2_000_000);
        assert!(payload.correction.variance_s2 > 0.0);
    }
}

#[test]
fn a_robot_whose_clock_was_never_set_calls_nobody_a_stranger() {
    let mut scene = Scene::new();
    // It has been up for 50 s since 1970; robot 2 knows the time.
    scene.now.wall_ns = 50 * SECOND;
    scene.off_ns = START;
    scene.greet();
    scene.tell_time();
    let told = scene.neighbour();
    assert_eq!(scene.tell(&told), Err(Refusal::OwnClock));
    scene.door.set_rules(Rules {
        correct_offset: true,
        ..rules()
    });
    assert_eq!(scene.tell(&told), Ok(()));
    assert!(own_hello(&rules(), &scene.roster, scene.now).flags & Hello::CLOCK_UNSET != 0);
    assert!(own_hello(&rules(), &scene.roster, NOW).flags & Hello::CLOCK_UNSET == 0);
}

#[test]
fn a_new_key_stands_beside_the_old_one() {
    let mut scene = Scene::met();
    let next = robot_key(22);
    scene.roster.member[1].next_key = Some(next.public());
    let told = scene.neighbour();
    assert_eq!(scene.tell(&told), Ok(()));
    scene.key = next;
    assert_eq!(scene.tell(&told), Ok(()));
    scene.roster.member[1].key = robot_key(22).public();
    scene.roster.member[1].next_key = None;
    assert_eq!(scene.tell(&told), Ok(()));
    scene.key = robot_key(2);
    assert_eq!(scene.tell(&told), Err(Refusal::NotSpeaker));
}

#[test]
fn who_is_revoked_is_forgotten() {
    let mut scene = Scene::met();
    assert_eq!(scene.door.offsets().len(), 1);
    drop(scene.roster.member.remove(1));
    scene.door.forget_strangers(&scene.roster);
    assert!(scene.door.peers().next().is_none());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn no_bit_of_a_message_can_be_turned(at in any::<prop::sample::Index>(), bit in 0..8) {
        let mut scene = Scene::met();
        let told = scene.neighbour();
        let mut bytes = scene.sealed(code(Channel::Neighbour), &plain(&told));
        let at = at.index(bytes.len());
        bytes[at] ^= 1_u8 << bit;
        prop_assert!(scene.admit(&bytes).is_err());
        bytes[at] ^= 1_u8 << bit;
        prop_assert_eq!(scene.admit(&bytes), Ok(()));
    }

    #[test]
    fn bytes_of_a_member_are_harmless(kind in any::<u32>(), which in 0..25_usize, body in prop::collection::vec(any::<u8>(), 0..300)) {
        let mut scene = Scene::met();
        let known = Kind::all().get(which).map_or(kind % 5, |it| it.code);
        let _ = scene.say(known, &body);
        let _ = scene.admit(&body);
        let told = scene.neighbour();
        prop_assert_ne!(scene.tell(&told), Err(Refusal::BadSignature));
    }
}
