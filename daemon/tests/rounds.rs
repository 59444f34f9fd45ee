//! A robot in rounds, over shared memory and by hand: what it shares, and what it takes of whoever says that it is its `coloc-rounds`.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

mod by_hand;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use by_hand::{PERIOD, Subject, World, name};
use coloc_counting::{Calls, calls_during};
use coloc_daemon::event::Event;
use coloc_daemon::wait::Wake;
use coloc_shm_types::{
    Call, Correction, Header, Health, Input, Neighbour, Publisher, Reject, RelativePose, Shared,
    Subscriber,
};

const LINES: &str = "[initial]\npose = [1.0, 2.0, 0.5]\nsigma = [0.1, 0.1, 0.05]\n[fusion]\nmode = \"rounds\"\n[rounds]\nrate_hz = 5.0\n";

struct Team {
    world: World,
    robot: Subject,
    shared: Subscriber<Shared>,
    corrections: Publisher<Correction>,
    sequence: u64,
    calls: Calls,
}

impl Team {
    fn new() -> Self {
        let world = World::new();
        let robot = world.robot("a", 1, LINES);
        Self {
            shared: world.space.subscriber(&name("a")).unwrap(),
            corrections: world.publisher("a"),
            world,
            robot,
            sequence: 0,
            calls: Calls::NONE,
        }
    }

    fn tick(&mut self) -> [f64; 3] {
        self.world.time.run(PERIOD);
        let wake = Wake::Deadline {
            deadline_ns: 0,
            missed: 0,
        };
        let (_, calls) = calls_during(|| self.robot.robot.wake(wake));
        // The first ticks connect the ports of this test.
        if self.robot.robot.account().tick() > 20 {
            self.calls += calls;
        }
        self.robot.estimates.receive().unwrap().unwrap().pose
    }

    /// What is shared at the next slot.
    fn slot(&mut self) -> Shared {
        for _ in 0..20 {
            self.tick();
            if let Some(shared) = self.shared.receive().unwrap() {
                return shared;
            }
        }
        panic!("nothing was shared in two slots");
    }

    fn say(&mut self, correction: Correction) -> [f64; 3] {
        self.sequence += 1;
        let header = self.world.header(self.sequence);
        self.corrections
            .send(Correction {
                header,
                ..correction
            })
            .unwrap();
        self.tick()
    }

    fn rejected(&self, reason: Reject) -> u64 {
        let status = self.robot.robot.account().status();
        status.rejected_of(Input::Correction, reason)
    }
}

fn kind(kind: u8) -> Correction {
    Correction {
        kind,
        ..Correction::default()
    }
}

/// Half of the variances are left.
fn honest(shared: &Shared) -> Correction {
    Correction {
        slot: shared.slot,
        pose: [
            shared.pose[0] + 0.3 * shared.covariance[0].sqrt(),
            shared.pose[1],
            shared.pose[2],
        ],
        covariance: shared.covariance.map(|it| 0.5 * it),
        factor: 1.0,
        ..Correction::default()
    }
}

#[test]
fn a_robot_joins_follows_and_leaves_and_no_tick_allocates() {
    let mut team = Team::new();
    let (link, done) = (
        Arc::clone(&team.robot.link),
        Arc::new(AtomicBool::new(false)),
    );
    let ended = Arc::clone(&done);
    let telemetry = std::thread::spawn(move || {
        while !ended.load(Ordering::Relaxed) {
            match link.next_event() {
                Some(Event::Account(ledger)) => link.give_back(ledger),
                Some(_) => {}
                None => std::thread::yield_now(),
            }
        }
    });
    assert_eq!(team.slot().standing, Shared::APART);
    team.say(kind(Correction::JOIN));
    let joining = team.slot();
    assert_eq!(
        (joining.standing, joining.since),
        (Shared::JOINING, joining.slot)
    );
    let mut last = joining;
    for _ in 0..200 {
        let told = honest(&last);
        team.say(told);
        let next = team.slot();
        assert_eq!((next.standing, next.since), (Shared::SINCE, last.slot));
        last = next;
    }
    team.say(kind(Correction::LEAVE));
    assert_eq!(team.slot().standing, Shared::APART);
    done.store(true, Ordering::Relaxed);
    telemetry.join().unwrap();
    assert_eq!(team.calls, Calls::NONE);
    let status = team.robot.robot.account().status();
    assert_eq!(status.accepted_of(Input::Correction), 202);
    assert_eq!(status.health_of(Input::Correction), Health::Ok);
}

type Lie = fn(&mut Correction);

/// Whatever it says, the belief moves by no more than an honest round could have moved it, and each lie has its name.
#[test]
fn who_lies_moves_nothing_and_is_named() {
    let mut team = Team::new();
    team.slot();
    team.say(kind(Correction::JOIN));
    let first = team.slot();
    team.say(honest(&first));
    let lies: [(Reject, Lie); 10] = [
        (Reject::TooFar, |it| it.pose[0] += 1.0),
        (Reject::TooFar, |it| it.pose[1] -= 100.0),
        (Reject::TooFar, |it| it.pose[2] += 2.0),
        (Reject::NoRound, |it| {
            it.covariance = it.covariance.map(|it| 1e-7 * it);
        }),
        (Reject::NoRound, |it| {
            it.covariance = it.covariance.map(|it| 3.0 * it);
        }),
        (Reject::NoRound, |it| it.factor = 3.0),
        (Reject::NotPositiveSemidefinite, |it| {
            it.covariance[0] *= -1.0;
        }),
        (Reject::NoCovariance, |it| it.covariance = [0.0; 9]),
        (Reject::NotFinite, |it| it.pose[0] = f64::NAN),
        (Reject::TookNoPart, |it| it.slot += 7),
    ];
    for (reason, lie) in lies {
        let shared = team.slot();
        let (before, count) = (team.tick(), team.rejected(reason));
        let mut told = honest(&shared);
        lie(&mut told);
        let after = team.say(told);
        assert_eq!(team.rejected(reason), count + 1, "{reason}");
        assert_eq!(
            after.map(f64::to_bits),
            before.map(f64::to_bits),
            "{reason}"
        );
        assert_eq!(team.slot().since, first.slot, "{reason}");
    }
    let shared = team.slot();
    team.say(honest(&shared));
    assert_eq!(team.slot().since, shared.slot);
}

#[test]
fn in_the_other_mode_nobody_is_heard() {
    let world = World::new();
    let mut robot = world.robot("a", 1, "");
    let shared = world.space.subscriber::<Shared>(&name("a")).unwrap();
    let corrections = world.publisher::<Correction>("a");
    let header = world.header(1);
    corrections
        .send(Correction {
            header,
            ..kind(Correction::JOIN)
        })
        .unwrap();
    (0..60).for_each(|_| {
        robot.tick();
    });
    assert!(shared.receive().unwrap().is_none());
    let status = robot.robot.account().status();
    assert_eq!(status.accepted_of(Input::Correction), 0);
}

/// Who says at each slot that it takes part fuses nothing of what it is told. Once it says nothing any more it is told again.
#[test]
fn who_makes_rounds_is_not_told_where_it_is_seen() {
    const SLOT_NS: i64 = 200_000_000;
    let mut team = Team::new();
    let told: Subscriber<Neighbour> = team.world.space.subscriber(&name("b")).unwrap();
    let sightings: Publisher<RelativePose> = team.world.publisher("a");
    let calls: Publisher<Call> = team.world.publisher("b");
    let mut sequence = 1000;
    let mut see = |team: &mut Team| {
        sequence += 1;
        let sighting = RelativePose {
            header: team.world.header(sequence),
            observed: 2,
            pose: [2.0, 0.5, 0.1],
            covariance: [0.01, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.0, 0.01],
            ..RelativePose::default()
        };
        sightings.send(sighting).unwrap();
        team.tick();
        let mut count = 0;
        while told.receive().unwrap().is_some() {
            count += 1;
        }
        count
    };
    assert!((0..40).any(|_| see(&mut team) == 1), "ports connect");
    let header = team.world.header(1);
    let slot = u64::try_from(header.stamp_ns / SLOT_NS).unwrap();
    let call = |kind, source| Call {
        header: Header { source, ..header },
        slot,
        kind,
        ..Call::default()
    };
    for (kind, source) in [(Call::ASK, 2), (Call::HERE, 3)] {
        calls.send(call(kind, source)).unwrap();
        assert_eq!(see(&mut team), 1, "that does not say that it is there");
    }
    calls.send(call(Call::HERE, 2)).unwrap();
    let silent = (0..100).take_while(|_| see(&mut team) == 0).count();
    assert!(
        (21..=40).contains(&silent),
        "three slots and a part of one: {silent}"
    );
    assert_eq!(see(&mut team), 1);
}
