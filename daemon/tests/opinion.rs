//! The word of `coloc-bounds`, over shared memory and by hand: it is said on where that is asked for, and changes nothing else.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

mod by_hand;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use by_hand::{Subject, World};
use coloc_counting::{Calls, calls_during};
use coloc_daemon::config::Config;
use coloc_daemon::estimate::Estimate as Estimating;
use coloc_daemon::event::{Event, Link};
use coloc_daemon::record::Record;
use coloc_estimator::{Stamp, TickInputs};
use coloc_shm_types::{
    Estimate, Header, Health, Input, Integrity, Opinion, Position, Publisher, Reject,
};

const START: &str = "[initial]\npose = [1.0, 2.0, 0.5]\nsigma = [0.1, 0.1, 0.05]\n[telemetry]\nrecord = \"a.jsonl\"\n";
const STATES: [(u8, Opinion); 6] = [
    (Integrity::OK, Opinion::Possible),
    (Integrity::ESTIMATE_OUTSIDE, Opinion::EstimateOutside),
    (Integrity::BOUNDS_VIOLATED, Opinion::BoundsViolated),
    (Integrity::NOT_OBSERVABLE, Opinion::NotObservable),
    (Integrity::STALE, Opinion::Stale),
    (Integrity::STARTING, Opinion::Starting),
];

struct Scene {
    world: World,
    robot: Subject,
    words: Publisher<Integrity>,
    fixes: Publisher<Position>,
    sequence: u64,
}

impl Scene {
    fn new(action: &str) -> Self {
        let world = World::new();
        let lines = format!("{START}[integrity]\naction = \"{action}\"\nalarm_slots = 2\n");
        Self {
            robot: world.robot("a", 1, &lines),
            words: world.publisher("a"),
            fixes: world.publisher("a"),
            world,
            sequence: 0,
        }
    }

    fn header(&mut self, source: u16) -> Header {
        self.sequence += 1;
        Header {
            source,
            ..self.world.header(self.sequence)
        }
    }

    fn word(&mut self, state: u8) -> Integrity {
        Integrity {
            header: self.header(1),
            robot: 1,
            state,
            ..Integrity::default()
        }
    }

    #[allow(clippy::large_types_passed_by_value)] // As a publisher takes it.
    fn say(&mut self, word: Integrity) -> Estimate {
        self.words.send(word).unwrap();
        self.robot.tick()
    }

    /// A fix that moves the belief, so that there is something to be the same.
    fn fix(&mut self) {
        let header = self.header(0);
        let step = f64::from(u32::try_from(self.sequence % 7).unwrap());
        let fix = Position {
            header,
            quality: 4,
            position: [1.0 + 0.01 * step, 2.0],
            covariance: [0.01, 0.0, 0.0, 0.01],
            ..Position::default()
        };
        self.fixes.send(fix).unwrap();
    }

    fn rejected(&self, reason: Reject) -> u64 {
        let status = self.robot.robot.account().status();
        status.rejected_of(Input::Integrity, reason)
    }

    fn recorded(&self) -> Vec<Record> {
        let events = std::iter::from_fn(|| self.robot.link.next_event());
        let lines = events.filter_map(|event| match event {
            Event::Recorded(record) => Some(record),
            _ => None,
        });
        lines.collect()
    }
}

#[test]
fn each_word_stands_in_the_estimate_until_nobody_speaks_any_more() {
    let mut scene = Scene::new("health");
    let first = scene.robot.tick();
    assert_eq!(first.opinion(), Opinion::None, "nobody has spoken");
    for (state, expected) in STATES {
        let word = scene.word(state);
        let estimate = scene.say(word);
        assert_eq!(estimate.opinion(), expected);
        assert_eq!(estimate.health_of(Input::Integrity), Health::Ok);
        assert_eq!(scene.robot.tick().opinion(), expected, "until the next");
    }
    let word = scene.word(Integrity::OK);
    scene.say(word);
    let silent = (0..500)
        .take_while(|_| scene.robot.tick().opinion() == Opinion::Possible)
        .count();
    assert!((10..499).contains(&silent), "{silent} ticks");
    let late = scene.robot.tick();
    assert_eq!(late.opinion(), Opinion::Stale);
    assert_eq!(late.health_of(Input::Integrity), Health::Stale);
}

type Lie = fn(&mut Integrity);

#[test]
fn a_word_that_is_none_is_refused_under_its_reason_and_says_nothing() {
    let mut scene = Scene::new("health");
    let word = scene.word(Integrity::ESTIMATE_OUTSIDE);
    scene.say(word);
    let lies: [(Reject, Lie); 9] = [
        (Reject::NotFinite, |it| it.distance_m = f64::NAN),
        (Reject::NotFinite, |it| it.vertices[3][1] = f64::INFINITY),
        (Reject::Unsupported, |it| it.state = 6),
        (Reject::Unsupported, |it| it.contained = 3),
        (Reject::Unsupported, |it| it.robot = 2),
        (Reject::UnknownRobot, |it| {
            (it.robot, it.header.source) = (2, 2);
        }),
        (Reject::UnknownRobot, |it| {
            (it.robot, it.header.source) = (9, 9);
        }),
        (Reject::FromFuture, |it| {
            it.header.stamp_ns += 10 * by_hand::SECOND;
        }),
        (Reject::TooOld, |it| {
            it.header.stamp_ns -= 60 * by_hand::SECOND;
        }),
    ];
    for (number, (reason, lie)) in lies.into_iter().enumerate() {
        let count = scene.rejected(reason);
        let mut word = scene.word(Integrity::OK);
        lie(&mut word);
        let estimate = scene.say(word);
        assert_eq!(scene.rejected(reason), count + 1, "{number}: {reason}");
        assert_eq!(estimate.opinion(), Opinion::EstimateOutside, "{number}");
    }
    let word = scene.word(Integrity::OK);
    assert_eq!(scene.say(word).opinion(), Opinion::Possible);
    let count = scene.rejected(Reject::Replayed);
    let estimate = scene.say(Integrity {
        state: Integrity::BOUNDS_VIOLATED,
        ..word
    });
    assert_eq!(estimate.opinion(), Opinion::Possible, "it was said before");
    assert_eq!(scene.rejected(Reject::Replayed), count + 1);
}

/// Beliefs, and all that is recorded but the word itself.
fn drive(action: &str) -> (Vec<Estimate>, Vec<Record>) {
    let mut scene = Scene::new(action);
    let mut recorded = scene.recorded();
    let mut estimates = Vec::new();
    for tick in 0..300_usize {
        if tick % 5 == 0 {
            scene.fix();
        }
        let (state, _) = STATES[tick / 25 % STATES.len()];
        let word = scene.word(state);
        let estimate = if tick % 25 == 0 {
            scene.say(word)
        } else {
            scene.robot.tick()
        };
        estimates.push(estimate);
        recorded.extend(scene.recorded());
    }
    (estimates, recorded)
}

/// What the lines of a recording make of it once more.
fn replayed(recorded: &[Record]) -> Vec<[u64; 3]> {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.jsonl");
    let lines = recorded.iter().map(|it| serde_json::to_string(it).unwrap());
    std::fs::write(&path, lines.collect::<Vec<_>>().join("\n") + "\n").unwrap();
    let recording = coloc_daemon::record::Recording::read(&path).unwrap();
    let text = format!("[robot]\nname = \"a\"\nid = 1\n{START}");
    let config = Config::parse(&text, &directory.path().join("a.toml")).unwrap();
    let mut estimating = Estimating::new(&config, recording.stamp, &recording.start);
    let mut step = |stamp: Stamp, inputs: &TickInputs<'_>| {
        let outputs = estimating.step(inputs);
        assert_eq!(outputs.estimate.stamp, stamp);
        let pose = outputs.estimate.belief.pose;
        [pose.x, pose.y, pose.phi].map(f64::to_bits)
    };
    let ticks = recording.ticks.iter();
    ticks.map(|it| step(it.stamp, &it.inputs())).collect()
}

#[test]
fn a_belief_is_bit_for_bit_the_same_with_and_without_and_replayed() {
    let (heard, recorded) = drive("health");
    let (deaf, without) = drive("report");
    let bits = |it: &Estimate| (it.pose.map(f64::to_bits), it.total().map(f64::to_bits));
    assert!(heard.iter().map(bits).eq(deaf.iter().map(bits)));
    assert!(heard.iter().any(|it| it.pose[0] > 1.0), "fixes are heard");
    for (_, opinion) in STATES {
        assert!(heard.iter().any(|it| it.opinion() == opinion), "{opinion}");
    }
    for it in &deaf {
        assert_eq!(it.opinion(), Opinion::None);
        assert_eq!(it.health_of(Input::Integrity), Health::NeverSeen);
    }
    let said = |lines: &[Record]| -> Vec<u8> {
        let lines = lines.iter().filter_map(|it| match it {
            Record::Estimate { opinion, .. } => Some(*opinion),
            _ => None,
        });
        lines.collect()
    };
    assert!(
        said(&recorded)
            .into_iter()
            .eq(heard.iter().map(|it| it.opinion))
    );
    assert!(said(&without).into_iter().all(|it| it == 0));
    let again = replayed(&recorded);
    assert!(
        again
            .into_iter()
            .eq(heard.iter().map(|it| it.pose.map(f64::to_bits)))
    );
}

fn drain(link: &Link, done: &AtomicBool) {
    while !done.load(Ordering::Relaxed) {
        match link.next_event() {
            Some(Event::Account(ledger)) => link.give_back(ledger),
            Some(_) => {}
            None => std::thread::yield_now(),
        }
    }
}

#[test]
fn no_tick_that_hears_a_word_allocates() {
    let mut scene = Scene::new("health");
    let done = Arc::new(AtomicBool::new(false));
    let (link, ended) = (Arc::clone(&scene.robot.link), Arc::clone(&done));
    let telemetry = std::thread::spawn(move || drain(&link, &ended));
    let mut counted = Calls::NONE;
    for tick in 0..1000_usize {
        let (state, _) = STATES[tick % STATES.len()];
        let word = scene.word(state);
        let bad = Integrity {
            header: scene.header(2),
            ..word
        };
        scene.words.send(word).unwrap();
        scene.words.send(bad).unwrap();
        let (_, calls) = calls_during(|| scene.robot.tick());
        // The first ticks connect the ports of this test.
        if tick > 20 {
            counted += calls;
        }
    }
    done.store(true, Ordering::Relaxed);
    telemetry.join().unwrap();
    assert_eq!(counted, Calls::NONE);
    assert!(scene.rejected(Reject::Unsupported) > 900);
}
