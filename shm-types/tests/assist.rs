//! What leaders say of children, and what is answered: every reason for which one is refused.
use coloc_shm_types::{Assist, AssistAck, Clock, Header, Limits, Present, Reject};

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

const SOUND: [f64; 9] = [0.5, 0.1, 0.0, 0.1, 0.5, 0.0, 0.0, 0.0, 0.01];

/// What makes a message one that is refused, and why.
type Case<M> = (fn(&mut M), Reject);

fn header(stamp_ns: i64) -> Header {
    Header {
        stamp_ns,
        boot: BOOT,
        source: 2,
        ..Header::default()
    }
}

fn assist() -> Assist {
    let mut path = [0; 16];
    (path[0], path[1], path[2]) = (3, 2, 1);
    Assist {
        header: header(NOW_NS),
        pose: [1.0, -2.0, 7.0],
        independent: SOUND,
        dependent: SOUND,
        leader_covariance: SOUND,
        transitions: core::array::from_fn(|place| [if place == 0 { 0.5 } else { 0.0 }; 9]),
        path,
        robots: 3,
        known: 200,
        said: 1,
        ..Assist::default()
    }
}

#[test]
fn every_field_of_what_a_leader_says_is_checked() {
    assert_eq!(assist().validate(&LIMITS), Ok(()));
    let cases: [Case<Assist>; 17] = [
        (|it| it.pose[2] = f64::NAN, Reject::NotFinite),
        (|it| it.leader_pose[0] = f64::INFINITY, Reject::NotFinite),
        (|it| it.transitions[0][4] = f32::NAN, Reject::NotFinite),
        (|it| it.independent[1] = 0.2, Reject::Asymmetric),
        (|it| it.leader_covariance[1] = 0.2, Reject::Asymmetric),
        (
            |it| it.leader_covariance[0] = -0.1,
            Reject::NotPositiveSemidefinite,
        ),
        (
            |it| it.dependent[0] = -0.1,
            Reject::DependentNotPositiveSemidefinite,
        ),
        (
            |it| (it.independent, it.dependent) = ([0.0; 9], [0.0; 9]),
            Reject::NoCovariance,
        ),
        (|it| it.known = 0, Reject::Unsupported),
        (|it| it.said = 9, Reject::Unsupported),
        (|it| it.path[3] = 2, Reject::Unsupported),
        (|it| it.robots = 17, Reject::Unsupported),
        (|it| it.flags = 2, Reject::Unsupported),
        (|it| it.digest = 1, Reject::Unsupported),
        (|it| it.header.source = 1, Reject::UnknownRobot),
        (|it| it.path[1] = 9, Reject::UnknownRobot),
        (|it| it.header.stamp_ns -= 20_000, Reject::TooOld),
    ];
    for (number, (change, expected)) in cases.into_iter().enumerate() {
        let mut message = assist();
        change(&mut message);
        assert_eq!(message.validate(&LIMITS), Err(expected), "case {number}");
    }
}

#[test]
fn every_field_of_an_answer_is_checked() {
    let sound = AssistAck {
        header: header(NOW_NS),
        leader: 3,
        taken: 1,
        ..AssistAck::default()
    };
    assert_eq!(sound.validate(&LIMITS), Ok(()));
    let cases: [Case<AssistAck>; 5] = [
        (|it| it.taken = 2, Reject::Unsupported),
        (|it| it.reserved[0] = 1, Reject::Unsupported),
        (|it| it.header.source = 1, Reject::UnknownRobot),
        (|it| it.leader = 9, Reject::UnknownRobot),
        (|it| it.header.stamp_ns += 20_000, Reject::FromFuture),
    ];
    for (number, (change, expected)) in cases.into_iter().enumerate() {
        let mut message = sound;
        change(&mut message);
        assert_eq!(message.validate(&LIMITS), Err(expected), "case {number}");
    }
}
