//! The bridge from `coloc eval` to the product: five real daemons, fed with a run's sensors over CAN and shared memory,
//! believe at every tick, to the last bit, what the same measurements give in one process.
//!
//! Daemons stamp frames when the kernel receives them and tick when they wake, so no two drives are alike. Each therefore
//! records what its estimator was given. What is played again in one process are the robots' own measurements and the
//! ticks' stamps only: what robots tell one another is worked out anew, and must come out as it went through shared memory.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

mod feed;
mod leaders;
mod log;
mod lost;
mod replay;
mod team;
mod verdict;

use coloc_daemon::config::{Initial, InitialPose};
use coloc_daemon::record::{Recording, Step};
use coloc_estimator::{FindingState, Kind, Pose};
use coloc_shm_types::{BeliefState, Estimate, Health, Input};
use coloc_sim::{Scenario, Sensors, StepInputs, Synthetic, SyntheticConfig, World};

use feed::{Feed, Heard};
use replay::{Played, PlayedTick, Published, replay};
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
    let sensors = Sensors::new(&world, &scenario, 1, 0);
    let team = Team::start(|robot| beginning(&world.initial(robot).unwrap()));
    let drive = Drive::new(team, |step| sensors.at(step), world.steps());

    for (robot, recording) in drive.recordings.iter().enumerate() {
        assert_fed(recording, robot);
    }
    drive.assert_same_bits();
    // The messages that were fused came over shared memory: `replay` has held each against the one worked out anew.
    let messages: usize = drive.played.messages.as_flattened().iter().sum();
    println!("five daemons, full poses: told {messages}, every tick the same bits");
    assert!(messages > 500, "{messages} messages");
}

/// What is seen by range and bearing is told the robot seen, and answered: three messages over shared memory for each sighting.
#[test]
fn five_daemons_that_see_one_another_in_part_believe_what_one_process_does() {
    let world = Synthetic::new(&SyntheticConfig {
        robots: ROBOTS,
        seconds: SECONDS,
        ..SyntheticConfig::default()
    });
    let scenario = Scenario::paper();
    let sensors = Sensors::new(&world, &scenario, 1, 0);
    let team = Team::in_part(|robot| beginning(&world.initial(robot).unwrap()));
    let drive = Drive::new(team, |step| sensors.at(step), world.steps());

    drive.assert_same_bits();
    let [told, answered] = drive.played.parts;
    println!(
        "five daemons, range and bearing: told {told}, answered {answered}, every tick the same bits"
    );
    assert!(told > 500 && answered > 500, "{told}, {answered}");
}

/// It is told where it stands, to a centimetre.
fn beginning(pose: &Pose) -> Initial {
    Initial {
        pose: Some(InitialPose::Given([pose.x, pose.y, pose.phi])),
        sigma: [0.01; 3],
        ..Initial::default()
    }
}

/// What came of a drive: over shared memory, and in one process.
struct Drive {
    team: Team,
    start_ns: i64,
    heard: Vec<Heard>,
    recordings: Vec<Recording>,
    played: Played,
}

impl Drive {
    /// Feeds the team through `steps` of what its sensors say, and plays its recordings again.
    fn new(mut team: Team, sensors: impl Fn(usize) -> StepInputs, steps: usize) -> Self {
        let listeners = team.listen();
        let feed = Feed::open(&team);
        let start_ns = feed.start_ns();
        let heard = feed.drive(sensors, steps, &listeners);
        drop(listeners);
        team.stop();
        let recordings = team.recordings();
        let played = replay(&team, &recordings);
        Self {
            team,
            start_ns,
            heard,
            recordings,
            played,
        }
    }

    /// What was recorded, and what came out of shared memory, is what was worked out: at every tick, and in its state.
    fn assert_same_bits(&self) {
        for (robot, recording) in self.recordings.iter().enumerate() {
            assert_eq!(recording.ticks.len(), self.played.ticks[robot].len());
            for (tick, played) in recording.ticks.iter().zip(&self.played.ticks[robot]) {
                let recorded = Published::new(tick.stamp, &tick.belief);
                assert_eq!(recorded, played.published, "robot {robot}");
            }
            let heard = &self.heard[robot].estimates;
            assert!(
                heard.len() > 50,
                "robot {robot}: {} estimates heard",
                heard.len()
            );
            for (&tick, estimate) in heard {
                let played = self.played_at(robot, tick);
                assert_eq!(
                    Published::heard(estimate),
                    played.published,
                    "robot {robot}, tick {tick}"
                );
                assert_same_state(estimate, played.state, robot);
            }
        }
    }

    fn played_at(&self, robot: usize, number: u64) -> &PlayedTick {
        let recorded = self.recordings[robot].ticks.iter();
        let mut both = recorded.zip(&self.played.ticks[robot]);
        let own = both.find(|(tick, _)| tick.tick == number && tick.step == Step::Own);
        own.unwrap().1
    }
}

/// Whether the wheels live is the daemon's to know; for the rest the estimator's word is published.
fn assert_same_state(estimate: &Estimate, found: FindingState, robot: usize) {
    let expected = match found {
        FindingState::Ok if estimate.health_of(Input::Odometry) != Health::Ok => {
            BeliefState::Finding
        }
        FindingState::Ok => BeliefState::Ok,
        FindingState::Finding => BeliefState::Finding,
        FindingState::Contradicted => BeliefState::Contradicted,
        FindingState::Lost => BeliefState::Lost,
    };
    let tick = estimate.tick;
    assert_eq!(estimate.state(), expected, "robot {robot}, tick {tick}");
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
