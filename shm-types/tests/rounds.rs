//! What robots that make rounds say: every reason for which it is refused.
use coloc_shm_types::{
    Call, Clock, Correction, Header, Limits, Present, Reject, Round, RoundEntry, SeenAtSlot, Share,
    Shared,
};

const NOW_NS: i64 = 1_000_000;
const BOOT: u64 = 7;

const LIMITS: Limits = Limits {
    now: Present::only(Clock::Boottime, NOW_NS),
    boot: BOOT,
    history_ns: 10_000,
    future_tolerance_ns: 100,
    own: 1,
    robots: &[1, 2, 3],
};

const IDENTITY: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
/// Correlation −2 between x and y.
const INDEFINITE: [f64; 9] = [1.0, -2.0, 0.0, -2.0, 1.0, 0.0, 0.0, 0.0, 1.0];
const ASYMMETRIC: [f64; 9] = [1.0, 0.1, 0.0, 0.2, 1.0, 0.0, 0.0, 0.0, 1.0];
const CERTAIN_OF_X: [f64; 9] = [0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

fn from(source: u16) -> Header {
    Header {
        stamp_ns: NOW_NS,
        boot: BOOT,
        source,
        ..Header::default()
    }
}

/// What makes a message one that is refused, and why.
type Case<M> = (fn(&mut M), Reject);

/// `sound` passes, and after each change it is refused for its reason.
fn refused<M: Copy>(
    sound: M,
    validate: fn(&M, &Limits<'_>) -> Result<(), Reject>,
    all: &[Case<M>],
) {
    assert_eq!(validate(&sound, &LIMITS), Ok(()));
    for (place, (change, reason)) in all.iter().enumerate() {
        let mut message = sound;
        change(&mut message);
        assert_eq!(validate(&message, &LIMITS), Err(*reason), "{place}");
    }
}

#[test]
fn what_is_shared_is_refused_for_its_reason() {
    let shared = Shared {
        header: from(1),
        slot: 9,
        since: 8,
        covariance: IDENTITY,
        psi: IDENTITY,
        standing: Shared::SINCE,
        ..Shared::default()
    };
    refused(
        shared,
        Shared::validate,
        &[
            (|it| it.pose[2] = f64::NAN, Reject::NotFinite),
            (|it| it.psi[8] = f64::INFINITY, Reject::NotFinite),
            (|it| it.covariance[4] = f64::NAN, Reject::NotFinite),
            (|it| it.covariance = ASYMMETRIC, Reject::Asymmetric),
            (
                |it| it.covariance = INDEFINITE,
                Reject::NotPositiveSemidefinite,
            ),
            (|it| it.covariance = CERTAIN_OF_X, Reject::NoCovariance),
            (|it| it.covariance = [0.0; 9], Reject::NoCovariance),
            (|it| it.standing = 4, Reject::Unsupported),
            (|it| it.reserved[6] = 1, Reject::Unsupported),
            (|it| it.header.source = 99, Reject::UnknownRobot),
            (|it| it.header.stamp_ns = NOW_NS + 101, Reject::FromFuture),
            (|it| it.header.stamp_ns = 0, Reject::TooOld),
        ],
    );
    let apart = Shared {
        header: from(1),
        ..Shared::default()
    };
    assert_eq!(apart.validate(&LIMITS), Ok(()), "there is no belief in it");
}

fn share() -> Share {
    let mut share = Share {
        header: from(2),
        slot: 9,
        known: 8,
        since: 8,
        covariance: IDENTITY,
        psi: IDENTITY,
        seen_count: 1,
        standing: Shared::SINCE,
        leader: 1,
        ..Share::default()
    };
    share.seen[0] = SeenAtSlot {
        observed: 3,
        age_s: -0.02,
        covariance: IDENTITY,
        ..SeenAtSlot::default()
    };
    share
}

#[test]
fn a_share_is_refused_for_its_reason() {
    refused(
        share(),
        Share::validate,
        &[
            (|it| it.pose[0] = f64::NAN, Reject::NotFinite),
            (|it| it.psi[3] = f64::NEG_INFINITY, Reject::NotFinite),
            (|it| it.velocity[1] = f64::NAN, Reject::NotFinite),
            (|it| it.seen[0].pose[1] = f64::NAN, Reject::NotFinite),
            (|it| it.seen[0].age_s = f64::NAN, Reject::NotFinite),
            (|it| it.covariance = ASYMMETRIC, Reject::Asymmetric),
            (
                |it| it.covariance = INDEFINITE,
                Reject::NotPositiveSemidefinite,
            ),
            (
                |it| it.velocity_noise = INDEFINITE,
                Reject::NotPositiveSemidefinite,
            ),
            (
                |it| it.seen[0].covariance = INDEFINITE,
                Reject::NotPositiveSemidefinite,
            ),
            (|it| it.covariance = [0.0; 9], Reject::NoCovariance),
            (
                |it| it.seen[0].covariance = CERTAIN_OF_X,
                Reject::NoCovariance,
            ),
            (|it| it.standing = Shared::NOWHERE, Reject::Unsupported),
            (|it| it.standing = 4, Reject::Unsupported),
            (
                |it| (it.seen, it.seen_count) = ([it.seen[0]; 16], 17),
                Reject::Unsupported,
            ),
            (|it| it.seen[9].reserved[0] = 1, Reject::Unsupported),
            (|it| it.reserved[0] = 1, Reject::Unsupported),
            (|it| it.header.source = 1, Reject::UnknownRobot),
            (|it| it.header.source = 99, Reject::UnknownRobot),
            (|it| it.leader = 99, Reject::UnknownRobot),
            (|it| it.seen[0].observed = 99, Reject::UnknownRobot),
            (|it| it.header.stamp_ns = NOW_NS + 101, Reject::FromFuture),
            (|it| it.header.stamp_ns = 0, Reject::TooOld),
        ],
    );
    assert_eq!(share().seen().len(), 1);
}

/// Of a team of three, of which the third has never taken part.
fn round() -> Round {
    let entry = RoundEntry {
        slot: 9,
        covariance: IDENTITY,
        factor: 1.0,
        owed: 1.0,
        is_there: 1,
        ..RoundEntry::default()
    };
    let mut round = Round {
        header: from(2),
        slot: 9,
        leader: 2,
        count: 3,
        ..Round::default()
    };
    round.robots[..3].copy_from_slice(&[1, 2, 3]);
    round.entries[..2].fill(entry);
    round
}

#[test]
fn a_round_is_refused_for_its_reason() {
    refused(
        round(),
        Round::validate,
        &[
            (|it| it.entries[1].pose[0] = f64::NAN, Reject::NotFinite),
            (|it| it.entries[0].factor = f64::INFINITY, Reject::NotFinite),
            (|it| it.entries[2].owed = f64::NAN, Reject::NotFinite),
            (|it| it.cross[2][8] = f64::NAN, Reject::NotFinite),
            (|it| it.cross[119][0] = f64::NAN, Reject::NotFinite),
            (
                |it| it.entries[1].covariance = ASYMMETRIC,
                Reject::Asymmetric,
            ),
            (
                |it| it.entries[1].covariance = INDEFINITE,
                Reject::NotPositiveSemidefinite,
            ),
            (
                |it| it.entries[0].covariance = [0.0; 9],
                Reject::NoCovariance,
            ),
            (|it| it.entries[2].is_there = 2, Reject::Unsupported),
            (|it| it.entries[15].reserved[0] = 1, Reject::Unsupported),
            (|it| it.reserved[4] = 1, Reject::Unsupported),
            (|it| it.count = 17, Reject::Unsupported),
            (|it| it.header.source = 1, Reject::UnknownRobot),
            (|it| it.header.source = 99, Reject::UnknownRobot),
            (|it| it.leader = 99, Reject::UnknownRobot),
            // A foreign robot, one that is missing, one twice, two in the wrong order.
            (|it| it.robots[2] = 99, Reject::UnknownRobot),
            (|it| it.count = 2, Reject::UnknownRobot),
            (|it| it.robots[2] = 2, Reject::UnknownRobot),
            (|it| it.robots[..3].reverse(), Reject::UnknownRobot),
            (|it| it.header.stamp_ns = NOW_NS + 101, Reject::FromFuture),
            (|it| it.header.stamp_ns = 0, Reject::TooOld),
        ],
    );
    assert_eq!(round().robots(), [1, 2, 3]);
}

#[test]
fn a_call_is_refused_for_its_reason() {
    let ask = Call {
        header: from(2),
        slot: 9,
        known: 8,
        to: 3,
        kind: Call::ASK,
        ..Call::default()
    };
    refused(
        ask,
        Call::validate,
        &[
            (|it| it.kind = 2, Reject::Unsupported),
            (|it| it.reserved[0] = 1, Reject::Unsupported),
            (|it| it.to = 99, Reject::UnknownRobot),
            (|it| it.header.source = 1, Reject::UnknownRobot),
            (|it| it.header.source = 99, Reject::UnknownRobot),
            (|it| it.header.clock = 77, Reject::UnknownClock),
            (|it| it.header.stamp_ns = NOW_NS + 101, Reject::FromFuture),
            (|it| it.header.stamp_ns = 0, Reject::TooOld),
        ],
    );
    let here = Call {
        to: 0,
        kind: Call::HERE,
        ..ask
    };
    assert_eq!(here.validate(&LIMITS), Ok(()), "nobody is asked");
}

#[test]
fn a_correction_is_refused_for_its_reason() {
    let correction = Correction {
        header: from(0),
        slot: 9,
        covariance: IDENTITY,
        factor: 1.0,
        kind: Correction::CORRECT,
        ..Correction::default()
    };
    refused(
        correction,
        Correction::validate,
        &[
            (|it| it.pose[1] = f64::NAN, Reject::NotFinite),
            (|it| it.factor = f64::INFINITY, Reject::NotFinite),
            (|it| it.covariance[0] = f64::NAN, Reject::NotFinite),
            (|it| it.covariance = ASYMMETRIC, Reject::Asymmetric),
            (
                |it| it.covariance = INDEFINITE,
                Reject::NotPositiveSemidefinite,
            ),
            (|it| it.covariance = CERTAIN_OF_X, Reject::NoCovariance),
            (|it| it.kind = 5, Reject::Unsupported),
            (|it| it.reserved[0] = 1, Reject::Unsupported),
            (|it| it.header.stamp_ns = NOW_NS + 101, Reject::FromFuture),
            (|it| it.header.stamp_ns = 0, Reject::TooOld),
        ],
    );
    let join = Correction {
        covariance: [0.0; 9],
        factor: 0.0,
        kind: Correction::JOIN,
        ..correction
    };
    assert_eq!(join.validate(&LIMITS), Ok(()), "there is no belief in it");
}
