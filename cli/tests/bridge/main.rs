//! The bridge from `coloc eval` to the product: five real daemons, fed with a run's sensors over CAN and shared memory,
//! believe at every tick, to the last bit, what the same measurements give in one process.
//!
//! Daemons stamp frames when the kernel receives them and tick when they wake, so no two drives are alike. Each therefore
//! records what its estimator was given. What is played again in one process are the robots' own measurements and the
//! ticks' stamps only: what robots tell one another is worked out anew, and must come out as it went through shared memory.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

mod feed;
mod replay;
mod team;

use std::collections::BTreeMap;

use coloc_daemon::record::Recording;
use coloc_estimator::Kind;
use coloc_sim::{Scenario, Sensors, Synthetic, SyntheticConfig, World};

use feed::Feed;
use replay::{Published, replay};
use team::{ROBOTS, Team};

const SECONDS: f64 = 6.0;

#[test]
fn five_daemons_over_shared_memory_believe_what_one_process_does_to_the_last_bit() {
    let world = Synthetic::new(&SyntheticConfig {
        robots: ROBOTS,
        seconds: SECONDS,
        ..SyntheticConfig::default()
    });
    let scenario = Scenario::paper();
    let mut team = Team::start(&world);
    let listeners = team.listen();
    let heard = Feed::open(&team).drive(
        &Sensors::new(&world, &scenario, 1, 0),
        world.steps(),
        &listeners,
    );
    drop(listeners);
    team.stop();
    let recordings = team.recordings();
    let played = replay(&team, &recordings);

    for (robot, recording) in recordings.iter().enumerate() {
        assert_fed(recording, robot);
        for (tick, published) in recording.ticks.iter().zip(&played.beliefs[robot]) {
            let recorded = Published::new(tick.stamp, &tick.belief);
            assert_eq!(recorded, *published, "robot {robot}");
        }
        assert_eq!(recording.ticks.len(), played.beliefs[robot].len());
        assert_heard(&heard[robot], &played.beliefs[robot], robot);
    }
    // The messages that were fused came over shared memory: `replay` has held each against the one worked out anew.
    assert!(played.messages > 500, "{} messages", played.messages);
}

/// A test in which the daemons heard nothing would prove nothing.
fn assert_fed(recording: &Recording, robot: usize) {
    let count = |wanted: Kind| {
        let ticks = recording.ticks.iter();
        let measurements = ticks.flat_map(|tick| &tick.measurements);
        measurements.filter(|it| it.kind() == wanted).count()
    };
    let [odometry, sightings, neighbours, fixes] =
        [Kind::Odometry, Kind::Sighting, Kind::Neighbour, Kind::Fix].map(count);
    assert!(odometry > 100, "robot {robot}: {odometry} of odometry");
    assert!(
        sightings > 100 && neighbours > 100,
        "robot {robot}: {sightings}, {neighbours}"
    );
    assert_eq!(fixes > 0, robot < 2, "robot {robot}: {fixes} fixes");
}

/// What came out of shared memory, by tick, is what was worked out.
fn assert_heard(heard: &BTreeMap<u64, Published>, played: &[Published], robot: usize) {
    assert!(
        heard.len() > 50,
        "robot {robot}: {} estimates heard",
        heard.len()
    );
    for (&tick, published) in heard {
        assert_eq!(
            played.get(usize::try_from(tick).unwrap()),
            Some(published),
            "robot {robot}, tick {tick}"
        );
    }
}
