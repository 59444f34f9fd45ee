//! Sightings that say a part only, and what is told and answered of them: every reason for which one is refused.
use coloc_shm_types::{
    Answer, Clock, Evidence, Header, Increment, Integrity, Limits, Present, Reject, Seen,
    SeenWithin, Sighting, Suspect, Tracked,
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

fn from(source: u16, stamp_ns: i64) -> Header {
    Header {
        stamp_ns,
        boot: BOOT,
        source,
        ..Header::default()
    }
}

fn sighting() -> Sighting {
    Sighting {
        header: from(0, NOW_NS),
        observed: 2,
        has: Sighting::RANGE | Sighting::BEARING,
        who: Sighting::ROBOT,
        range: 2.0,
        bearing: -0.3,
        white: [1e-4, 1e-5],
        slow: [0.045, 6.0, 0.013, 10.0],
        ..Sighting::default()
    }
}

fn seen() -> Seen {
    Seen {
        header: from(2, NOW_NS),
        position: [1.0, -2.0],
        independent: [0.5, 0.0, 0.0, 0.5],
        dependent: [0.5, 0.1, 0.1, 0.5],
        ..Seen::default()
    }
}

fn answer() -> Answer {
    Answer {
        header: from(2, NOW_NS),
        position: [1.0, -2.0],
        dependent: [0.5, 0.1, 0.1, 0.5],
        ..Answer::default()
    }
}

/// What makes a message one that is refused, and why.
type Case<M> = (fn(&mut M), Reject);

/// What comes of `sound` after a change.
fn after<M: Copy>(
    sound: M,
    validate: fn(&M, &Limits<'_>) -> Result<(), Reject>,
) -> impl Fn(fn(&mut M)) -> Result<(), Reject> {
    assert_eq!(validate(&sound, &LIMITS), Ok(()));
    move |change| {
        let mut message = sound;
        change(&mut message);
        validate(&message, &LIMITS)
    }
}

#[test]
fn a_sighting_says_range_or_bearing_or_both() {
    let check = after(sighting(), Sighting::validate);
    assert_eq!(
        check(|it| (it.has, it.bearing, it.white[1], it.slow[2]) = (1, 0.0, 0.0, 0.0)),
        Ok(())
    );
    assert_eq!(
        check(|it| (it.has, it.range, it.white[0], it.slow[0]) = (2, 0.0, 0.0, 0.0)),
        Ok(())
    );
    assert_eq!(check(|it| (it.who, it.observed) = (2, 999)), Ok(()));
    assert_eq!(check(|it| it.slow = [0.0; 4]), Ok(()));
    let unsupported: [fn(&mut Sighting); 8] = [
        |it| it.has = 0,
        |it| it.has = 4,
        |it| it.has = Sighting::RANGE,
        |it| it.has = Sighting::BEARING,
        |it| it.who = Sighting::UNKNOWN,
        |it| it.who = 3,
        |it| it.reserved[3] = 1,
        |it| it.slow[1] = 0.0,
    ];
    for change in unsupported {
        assert_eq!(check(change), Err(Reject::Unsupported));
    }
}

#[test]
fn a_sighting_is_refused_for_its_reason() {
    let check = after(sighting(), Sighting::validate);
    let all: [Case<Sighting>; 14] = [
        (|it| it.range = f64::NAN, Reject::NotFinite),
        (|it| it.bearing = f64::INFINITY, Reject::NotFinite),
        (|it| it.white[1] = f64::NAN, Reject::NotFinite),
        (|it| it.slow[3] = 1e61, Reject::NotFinite),
        (|it| it.mount[2] = f64::NAN, Reject::NotFinite),
        (|it| it.slow[0] = -0.1, Reject::NotPositiveSemidefinite),
        (|it| it.slow[3] = -1.0, Reject::NotPositiveSemidefinite),
        (|it| it.white[0] = 0.0, Reject::NoCovariance),
        (|it| it.white[1] = -1e-9, Reject::NoCovariance),
        (|it| it.observed = 1, Reject::UnknownRobot),
        (|it| it.observed = 9, Reject::UnknownRobot),
        (|it| it.header.stamp_ns += 101, Reject::FromFuture),
        (|it| it.header.stamp_ns -= 10_001, Reject::TooOld),
        (|it| it.range = 0.0, Reject::NoRange),
    ];
    for (change, reason) in all {
        assert_eq!(check(change), Err(reason));
    }
}

#[test]
fn what_another_robot_tells_is_a_position_or_a_question() {
    let check = after(seen(), Seen::validate);
    assert_eq!(check(|it| it.flags = Seen::NO_ANSWER), Ok(()));
    let question = |it: &mut Seen| {
        (it.flags, it.position) = (Seen::NOTHING_TOLD, [0.0; 2]);
        (it.independent, it.dependent) = ([0.0; 4], [0.0; 4]);
    };
    assert_eq!(check(question), Ok(()));
    let all: [Case<Seen>; 9] = [
        (|it| it.position[1] = f64::NAN, Reject::NotFinite),
        (|it| it.independent[1] = 0.2, Reject::Asymmetric),
        (
            |it| it.independent = [1.0, 2.0, 2.0, 1.0],
            Reject::NotPositiveSemidefinite,
        ),
        (
            |it| it.dependent = [1.0, 2.0, 2.0, 1.0],
            Reject::DependentNotPositiveSemidefinite,
        ),
        (
            |it| (it.independent, it.dependent) = ([0.0; 4], [0.0; 4]),
            Reject::NoCovariance,
        ),
        (|it| it.flags = Seen::NOTHING_TOLD, Reject::Unsupported),
        (
            |it| {
                it.flags = Seen::NOTHING_TOLD | Seen::NO_ANSWER;
                (it.position, it.independent, it.dependent) = ([0.0; 2], [0.0; 4], [0.0; 4]);
            },
            Reject::Unsupported,
        ),
        (|it| it.reserved[0] = 1, Reject::Unsupported),
        (|it| it.header.source = 1, Reject::UnknownRobot),
    ];
    for (change, reason) in all {
        assert_eq!(check(change), Err(reason));
    }
}

#[test]
fn an_answer_is_a_position() {
    let check = after(answer(), Answer::validate);
    let all: [Case<Answer>; 6] = [
        (|it| it.position[0] = f64::INFINITY, Reject::NotFinite),
        (
            |it| it.dependent[0] = -1.0,
            Reject::DependentNotPositiveSemidefinite,
        ),
        (|it| it.dependent = [0.0; 4], Reject::NoCovariance),
        (|it| it.reserved[5] = 1, Reject::Unsupported),
        (|it| it.header.source = 4, Reject::UnknownRobot),
        (|it| it.header.stamp_ns += 200, Reject::FromFuture),
    ];
    for (change, reason) in all {
        assert_eq!(check(change), Err(reason));
    }
}

fn increment() -> Increment {
    Increment {
        header: from(2, NOW_NS),
        flags: Increment::BEARING,
        start_ns: NOW_NS - 50,
        displacement: [0.1, 0.0, 0.02],
        covariance: [1e-4, 0.0, 0.0, 0.0, 1e-6, 0.0, 0.0, 0.0, 1e-4],
        bearing: 0.5,
        bearing_variance: 1e-4,
        ..Increment::default()
    }
}

fn tracked() -> Tracked {
    Tracked {
        header: from(1, NOW_NS),
        observed: 2,
        has: Tracked::POSITION | Tracked::HEADING,
        status: Tracked::COASTED,
        seen_ns: NOW_NS - 500,
        pose: [2.0, -1.0, 0.4],
        covariance: [1e-2, 0.0, 0.0, 0.0, 1e-2, 0.0, 0.0, 0.0, 1e-2],
        ..Tracked::default()
    }
}

#[test]
fn an_increment_says_motion_or_a_bearing() {
    let check = after(increment(), Increment::validate);
    let still = |it: &mut Increment| {
        (it.start_ns, it.displacement, it.covariance) = (NOW_NS, [0.0; 3], [0.0; 9]);
    };
    let blind = |it: &mut Increment| {
        (it.flags, it.bearing, it.bearing_variance) = (0, 0.0, 0.0);
    };
    assert_eq!([check(still), check(blind)], [Ok(()); 2]);
    let all: [Case<Increment>; 8] = [
        (|it| it.displacement[0] = f64::NAN, Reject::NotFinite),
        (|it| it.bearing = f64::INFINITY, Reject::NotFinite),
        (
            |it| it.covariance[0] = -1.0,
            Reject::NotPositiveSemidefinite,
        ),
        (|it| it.bearing_variance = 0.0, Reject::NoCovariance),
        (|it| it.start_ns = NOW_NS + 1, Reject::Unsupported),
        (|it| it.start_ns = NOW_NS, Reject::Unsupported),
        (|it| it.flags = 0, Reject::Unsupported),
        (|it| it.reserved[3] = 1, Reject::Unsupported),
    ];
    for (place, (change, reason)) in all.into_iter().enumerate() {
        assert_eq!(check(change), Err(reason), "{place}");
    }
}

#[test]
fn a_track_says_a_heading_or_nothing_of_it() {
    let check = after(tracked(), Tracked::validate);
    let unturned = |it: &mut Tracked| {
        (it.has, it.pose[2], it.covariance[8]) = (Tracked::POSITION, 0.0, 0.0);
    };
    assert_eq!(check(unturned), Ok(()));
    let all: [Case<Tracked>; 7] = [
        (|it| it.pose[1] = f64::NAN, Reject::NotFinite),
        (|it| it.covariance[4] = 0.0, Reject::NoCovariance),
        (|it| it.covariance[8] = 0.0, Reject::NoCovariance),
        (|it| it.has = Tracked::POSITION, Reject::Unsupported),
        (|it| it.has = Tracked::HEADING, Reject::Unsupported),
        (|it| it.status = 0, Reject::Unsupported),
        (|it| it.reserved[0] = 1, Reject::Unsupported),
    ];
    for (place, (change, reason)) in all.into_iter().enumerate() {
        assert_eq!(check(change), Err(reason), "{place}");
    }
}

#[test]
fn a_robot_without_a_name_is_for_trackers_and_by_both_numbers() {
    let unnamed = |it: &mut Sighting| (it.who, it.observed) = (Sighting::UNKNOWN, 0);
    let check = after(sighting(), Sighting::validate);
    assert_eq!(check(unnamed), Err(Reject::Unsupported));
    let check = after(sighting(), Sighting::validate_of_robot);
    assert_eq!(check(unnamed), Ok(()));
    let alone = |it: &mut Sighting| {
        (it.who, it.has, it.range) = (Sighting::UNKNOWN, Sighting::BEARING, 0.0);
        (it.white[0], it.slow[0]) = (0.0, 0.0);
    };
    assert_eq!(check(alone), Err(Reject::Unsupported));
    let place = |it: &mut Sighting| it.who = Sighting::LANDMARK;
    assert_eq!(check(place), Err(Reject::Unsupported));
}

fn evidence() -> Evidence {
    let mut evidence = Evidence {
        header: from(2, NOW_NS),
        epoch: 7,
        moved: [0.1; 16],
        turn: [0.2, 0.05],
        compass: [1.0, 0.09],
        fix: [3.0, 4.0],
        fix_half: [0.3, 0.3],
        seen_count: 1,
        has: Evidence::FIX | Evidence::COMPASS,
        ..Evidence::default()
    };
    evidence.seen[0] = SeenWithin {
        observed: 1,
        centre: [2.0, 1.0],
        half: [0.3, 0.3],
        turn: 0.4,
        turn_half: 0.05,
        ..SeenWithin::default()
    };
    evidence
}

#[test]
fn evidence_is_refused_for_its_reason() {
    let check = after(evidence(), Evidence::validate);
    assert_eq!(check(|_| ()), Ok(()));
    let all: [Case<Evidence>; 16] = [
        (|it| it.fix_half = [0.3, 0.0], Reject::NoCovariance),
        (|it| it.compass[1] = 0.0, Reject::NoCovariance),
        (|it| it.seen[0].half[0] = 0.0, Reject::NoCovariance),
        (|it| it.seen[0].turn_half = 0.0, Reject::NoCovariance),
        (|it| it.fix_half[0] = f64::NAN, Reject::NotFinite),
        (|it| it.moved[3] = f64::NAN, Reject::NotFinite),
        (|it| it.seen[0].centre[1] = f64::INFINITY, Reject::NotFinite),
        (
            |it| it.seen[0].half[0] = -0.1,
            Reject::NotPositiveSemidefinite,
        ),
        (|it| it.fix_half[1] = -0.1, Reject::NotPositiveSemidefinite),
        (|it| it.turn[1] = -0.1, Reject::NotPositiveSemidefinite),
        // It cannot have gone nowhere.
        (|it| it.moved[4] = -0.2, Reject::Unsupported),
        (|it| it.seen_count = 17, Reject::Unsupported),
        (|it| it.has = 4, Reject::Unsupported),
        (|it| it.reserved[0] = 1, Reject::Unsupported),
        (|it| it.seen[0].observed = 99, Reject::UnknownRobot),
        (
            |it| it.header.stamp_ns = NOW_NS + 1_000_000_000,
            Reject::FromFuture,
        ),
    ];
    for (place, (change, reason)) in all.into_iter().enumerate() {
        assert_eq!(check(change), Err(reason), "{place}");
    }
}

#[test]
fn a_word_on_integrity_is_refused_for_its_reason() {
    let word = Integrity {
        header: from(1, NOW_NS),
        robot: 1,
        vertex_count: 3,
        conflict_count: 1,
        conflicts: {
            let mut all = [Suspect::default(); 8];
            all[0].kind = Suspect::COMPASS;
            all
        },
        ..Integrity::default()
    };
    let check = after(word, Integrity::validate);
    assert_eq!(check(|_| ()), Ok(()));
    assert_eq!((word.vertices().len(), word.conflicts().len()), (3, 1));
    let all: [Case<Integrity>; 9] = [
        (|it| it.area_m2 = f64::NAN, Reject::NotFinite),
        (|it| it.vertices[31][1] = f64::NAN, Reject::NotFinite),
        (|it| it.distance_m = -1.0, Reject::NotPositiveSemidefinite),
        (|it| it.state = 6, Reject::Unsupported),
        (|it| it.contained = 3, Reject::Unsupported),
        (|it| it.vertex_count = 33, Reject::Unsupported),
        (|it| it.conflict_count = 9, Reject::Unsupported),
        (|it| it.conflicts[0].kind = 0, Reject::Unsupported),
        (|it| it.robot = 2, Reject::Unsupported),
    ];
    for (place, (change, reason)) in all.into_iter().enumerate() {
        assert_eq!(check(change), Err(reason), "{place}");
    }
}
