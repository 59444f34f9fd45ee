//! Sightings that say a part only, from a sensor to the robot seen and back.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

mod by_hand;

use by_hand::{Subject, World};
use coloc_shm_types::{Answer, Header, Input, Neighbour, Reject, RelativePose, Seen, Sighting};

const TAKES_PART: &str = "[sighting]\nheard = true\n";

/// Two metres ahead, by a camera.
fn sighting(header: Header) -> Sighting {
    Sighting {
        header,
        observed: 2,
        has: Sighting::RANGE | Sighting::BEARING,
        who: Sighting::ROBOT,
        range: 2.0,
        white: [1e-4, 1e-5],
        slow: [0.01, 6.0, 0.005, 10.0],
        ..Sighting::default()
    }
}

fn rejected(robot: &Subject, input: Input, reason: Reject) -> u64 {
    robot.robot.account().status().rejected_of(input, reason)
}

fn accepted(robot: &Subject, input: Input) -> u64 {
    robot.robot.account().status().accepted_of(input)
}

/// It knows where it is and not which way it looks.
fn seer(world: &World) -> Subject {
    let lines = "[initial]\npose = [0.0, 0.0, 0.1]\nsigma = [0.02, 0.02, 0.3]\n";
    world.robot("a", 1, &format!("{TAKES_PART}{lines}"))
}

/// The other way round.
fn seen(world: &World) -> Subject {
    let lines = "[initial]\npose = [2.0, 0.0, 0.0]\nsigma = [0.5, 0.02, 0.1]\n";
    world.robot("b", 2, &format!("{TAKES_PART}{lines}"))
}

#[test]
fn both_learn_of_a_sighting_that_says_range_and_bearing() {
    let world = World::new();
    let mut seer = seer(&world);
    let mut seen = seen(&world);
    let camera = world.publisher::<Sighting>("a");
    let before = [seer.tick(), seen.tick()];
    camera.send(sighting(world.header(0))).unwrap();
    seer.tick();
    let told = seen.tick();
    let answered = seer.tick();

    assert!(
        told.total()[0] < before[1].total()[0] / 10.0,
        "along the line"
    );
    assert!(told.dependent[0] > 0.0, "it owes it to the other one");
    assert!(
        answered.total()[8] < before[0].total()[8] / 10.0,
        "the heading"
    );
    assert!(answered.pose[2].abs() < 0.03, "{:?}", answered.pose);
    assert_eq!(accepted(&seer, Input::Sighting), 1);
    assert_eq!(accepted(&seen, Input::Seen), 1);
    assert_eq!(accepted(&seer, Input::Answer), 1);
}

#[test]
fn a_bearing_alone_asks_and_teaches_who_sees() {
    let world = World::new();
    let mut seer = seer(&world);
    let mut seen = seen(&world);
    let camera = world.publisher::<Sighting>("a");
    let before = [seer.tick(), seen.tick()];
    let bearing = Sighting {
        has: Sighting::BEARING,
        range: 0.0,
        white: [0.0, 1e-5],
        slow: [0.0, 0.0, 0.005, 10.0],
        ..sighting(world.header(0))
    };
    camera.send(bearing).unwrap();
    seer.tick();
    let asked = seen.tick();
    let answered = seer.tick();
    assert!(
        asked.total()[0] >= before[1].total()[0],
        "it was told nothing"
    );
    assert!(
        answered.total()[8] < before[0].total()[8] / 10.0,
        "the heading"
    );
    assert_eq!(accepted(&seer, Input::Answer), 1);
}

#[test]
fn a_landmark_answers_at_once_and_only_if_it_is_listed() {
    let world = World::new();
    let lines = format!(
        "{TAKES_PART}[initial]\npose = [0.0, 0.0, 0.1]\nsigma = [0.5, 0.02, 0.3]\n\
         [[landmark]]\nnumber = 6\nposition = [2.0, 0.0]\nsigma_m = 0.01\n"
    );
    let mut robot = world.robot("a", 1, &lines);
    let camera = world.publisher::<Sighting>("a");
    let before = robot.tick();
    let of = |number, sequence| Sighting {
        who: Sighting::LANDMARK,
        observed: number,
        ..sighting(world.header(sequence))
    };
    camera.send(of(7, 0)).unwrap();
    camera.send(of(6, 1)).unwrap();
    let after = robot.tick();
    assert!(after.total()[0] < before.total()[0] / 10.0);
    assert!(after.total()[8] < before.total()[8] / 10.0);
    assert_eq!(accepted(&robot, Input::Sighting), 1);
    assert_eq!(
        rejected(&robot, Input::Sighting, Reject::UnknownLandmark),
        1
    );
}

#[test]
fn what_was_not_asked_or_was_here_is_refused_under_its_reason() {
    let world = World::new();
    let mut seer = seer(&world);
    let mut seen = seen(&world);
    let (camera, answers) = (
        world.publisher::<Sighting>("a"),
        world.publisher::<Answer>("a"),
    );
    let told = world.publisher::<Seen>("a");
    seer.tick();
    seen.tick();
    let answer = |sequence, sighting| Answer {
        header: Header {
            source: 2,
            session: 77,
            ..world.header(sequence)
        },
        session: 1,
        sighting,
        position: [2.0, 0.0],
        dependent: [1.0, 0.0, 0.0, 1.0],
        ..Answer::default()
    };
    camera.send(sighting(world.header(0))).unwrap();
    answers.send(answer(0, 9)).unwrap();
    answers.send(answer(1, 0)).unwrap();
    answers.send(answer(2, 0)).unwrap();
    answers.send(answer(2, 0)).unwrap();
    let liar = Seen {
        header: Header {
            source: 3,
            ..world.header(0)
        },
        flags: Seen::NOTHING_TOLD,
        ..Seen::default()
    };
    told.send(liar).unwrap();
    seer.tick();
    assert_eq!(accepted(&seer, Input::Answer), 1);
    assert_eq!(rejected(&seer, Input::Answer, Reject::NotAsked), 1);
    assert_eq!(rejected(&seer, Input::Answer, Reject::Replayed), 2);
    assert_eq!(rejected(&seer, Input::Seen, Reject::UnknownRobot), 1);
}

/// It knows where it is, and hears of others by way of `coloc-track`.
const BY_TRACK: &str = "[sighting]\nheard = true\nthrough_track = true\n\
                        [initial]\npose = [0.0, 0.0, 0.1]\nsigma = [0.02, 0.02, 0.05]\n";

/// The robot ahead, as a track has it.
fn tracked(header: Header) -> RelativePose {
    RelativePose {
        header: Header {
            source: RelativePose::TRACK,
            ..header
        },
        observed: 2,
        components: RelativePose::OF_TRACK,
        pose: [2.0, 0.0, 0.0],
        covariance: [0.01, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.0, 0.01],
        ..RelativePose::default()
    }
}

#[test]
fn by_way_of_tracks_a_sighting_is_heard_that_they_pass_on_and_a_landmark() {
    let world = World::new();
    let lines =
        format!("{BY_TRACK}[[landmark]]\nnumber = 6\nposition = [2.0, 0.0]\nsigma_m = 0.01\n");
    let mut robot = world.robot("a", 1, &lines);
    let camera = world.publisher::<Sighting>("a");
    robot.tick();
    let raw = sighting(world.header(0));
    camera.send(raw).unwrap();
    robot.tick();
    let status = |robot: &Subject| {
        let unsupported = rejected(robot, Input::Sighting, Reject::Unsupported);
        (accepted(robot, Input::Sighting), unsupported)
    };
    assert_eq!(status(&robot), (0, 0), "as if it had not come");
    let passed_on = Sighting {
        who: Sighting::PASSED_ON,
        ..raw
    };
    camera.send(passed_on).unwrap();
    robot.tick();
    assert_eq!(status(&robot), (1, 0), "under the header that it had");
    let landmark = Sighting {
        who: Sighting::LANDMARK,
        observed: 6,
        ..sighting(world.header(1))
    };
    camera.send(landmark).unwrap();
    robot.tick();
    assert_eq!(status(&robot), (2, 0));
}

#[test]
fn of_what_a_track_says_nothing_is_independent() {
    let world = World::new();
    let mut seer = world.robot("a", 1, BY_TRACK);
    let mut seen = seen(&world);
    let tracks = world.publisher::<RelativePose>("a");
    let letters = world
        .space
        .subscriber::<Neighbour>(&by_hand::name("b"))
        .unwrap();
    let before = [seer.tick(), seen.tick()];
    assert!(before[0].independent[0] > 0.0);
    tracks.send(tracked(world.header(0))).unwrap();
    seer.tick();
    let letter = letters.receive().unwrap().unwrap();
    let heard = seen.tick();
    assert!(letter.independent.iter().all(|it| *it == 0.0));
    assert!(letter.dependent[0] > 0.01 && letter.dependent[8] > 0.01);
    assert!(heard.total()[0] < before[1].total()[0] / 4.0);
    assert_eq!(accepted(&seer, Input::RelativePose), 1);
    assert_eq!(accepted(&seen, Input::Neighbour), 1);
}

#[test]
fn who_does_not_hear_tracks_refuses_what_they_say() {
    let world = World::new();
    let mut robot = world.robot("a", 1, TAKES_PART);
    let (camera, tracks) = (
        world.publisher::<Sighting>("a"),
        world.publisher::<RelativePose>("a"),
    );
    robot.tick();
    let passed_on = Sighting {
        who: Sighting::PASSED_ON,
        ..sighting(world.header(0))
    };
    camera.send(passed_on).unwrap();
    tracks.send(tracked(world.header(0))).unwrap();
    robot.tick();
    for input in [Input::Sighting, Input::RelativePose] {
        assert_eq!(accepted(&robot, input), 0);
        assert_eq!(rejected(&robot, input, Reject::Unsupported), 1);
    }
}

#[test]
fn who_does_not_take_part_hears_nothing() {
    let world = World::new();
    let mut robot = world.robot("a", 1, "");
    let camera = world.publisher::<Sighting>("a");
    robot.tick();
    camera.send(sighting(world.header(0))).unwrap();
    robot.tick();
    assert_eq!(accepted(&robot, Input::Sighting), 0);
}
