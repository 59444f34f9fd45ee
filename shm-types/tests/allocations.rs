//! The hot path allocates nothing.
use std::hint::black_box;

use coloc_counting::{Calls, calls_during};
use coloc_shm_types::{
    Estimate, Header, Limits, Neighbour, Position, RelativePose, Replay, RobotName, Space,
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
        now_ns: 10,
        history_ns: 5,
        future_tolerance_ns: 1,
        set_back_ns: 0,
        own: 1,
        robots: &[1, 2, 3],
    };
    let mut replay = Replay::new();
    let ((), calls) = calls_during(|| {
        for sequence in 0..1000 {
            let header = Header {
                stamp_ns: 8,
                session_ns: 1,
                sequence,
            };
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
                    sender: 2,
                    ..Neighbour::default()
                }
                .validate(&limits),
            )
            .unwrap();
            replay.accept(&header).unwrap();
        }
    });
    assert_eq!(calls, Calls::NONE);
}
