//! The hot path allocates nothing.
use std::hint::black_box;

use coloc_counting::{Calls, calls_during};
use coloc_shm_types::{
    Clock, Estimate, Limits, Neighbour, Position, Present, RelativePose, RobotName, Sender,
    Sessions, Space,
};

#[test]
fn sending_and_receiving_allocate_nothing() {
    let root = tempfile::tempdir().unwrap();
    let robot = RobotName::new("r1").unwrap();
    let space = Space::open(root.path(), "t", "test").unwrap();
    let publisher = space.publisher::<Estimate>(&robot).unwrap();
    let subscribers = [0; 3].map(|_| space.subscriber::<Estimate>(&robot).unwrap());
    publisher.refresh().unwrap();
    for subscriber in &subscribers {
        subscriber.refresh().unwrap();
    }
    let mut received = 0_u64;
    let ((), calls) = calls_during(|| {
        for tick in 0..10_000 {
            publisher
                .send(Estimate {
                    tick,
                    ..Estimate::default()
                })
                .unwrap();
            // The first reads everything, the second nothing (it overflows), the third every other.
            while subscribers[0].receive().unwrap().is_some() {
                received += 1;
            }
            if tick % 2 == 0 {
                black_box(subscribers[2].receive().unwrap());
            }
        }
    });
    assert_eq!(received, 10_000);
    assert_eq!(calls, Calls::NONE);
}

#[test]
fn checking_allocates_nothing() {
    let limits = Limits {
        now: Present::only(Clock::Realtime, 10),
        boot: 0,
        history_ns: 5,
        future_tolerance_ns: 1,
        own: 1,
        robots: &[1, 2, 3],
    };
    let mut sender = Sender::start(2, Clock::Realtime).unwrap();
    let mut sessions = Sessions::new(Sessions::SENSORS);
    let ((), calls) = calls_during(|| {
        for now_ns in 0..1000 {
            let header = sender.header(8);
            black_box(
                RelativePose {
                    header,
                    ..RelativePose::default()
                }
                .validate(&limits),
            )
            .ok();
            black_box(
                Position {
                    header,
                    ..Position::default()
                }
                .validate(&limits),
            )
            .ok();
            black_box(
                Neighbour {
                    header,
                    dependent: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
                    ..Neighbour::default()
                }
                .validate(&limits),
            )
            .unwrap();
            sessions.accept(&header, now_ns).unwrap();
        }
    });
    assert_eq!(calls, Calls::NONE);
}
