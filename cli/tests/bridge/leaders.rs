//! Two leaders and three children, of which the last is seen by children alone: what went from robot to robot, and what came of it,
//! is worked out anew from each robot's recording.

use std::collections::BTreeMap;

use coloc_daemon::config::{Assist, AssistFusion, AssistMode, Initial, InitialPose};
use coloc_daemon::estimate::{Estimate, settings};
use coloc_daemon::record::{Recording, Step};
use coloc_estimator::Pose;
use coloc_estimator::assist::assistant::{Ack, Counts, Message};
use coloc_estimator::assist::readings::{HeardReadings, Readings};
use coloc_sim::{Scenario, Sensors, StepInputs, Synthetic, SyntheticConfig, World};

use crate::feed::{Feed, Heard, STEP_NS};
use crate::replay::Published;
use crate::team::{ROBOTS, Team};

const SECONDS: f64 = 12.0;
const LEADERS: usize = 2;
/// No leader sees it.
const FAR: usize = 4;
/// Who sees whom, among those who do not see all.
const SIGHTS: [(usize, usize); 7] = [(0, 2), (1, 3), (2, 3), (2, 4), (3, 2), (3, 4), (4, 2)];

/// By sender and receiver, in the order in which they were sent.
type Post<M> = BTreeMap<(usize, usize), Vec<M>>;

/// What a robot's recording comes to.
#[derive(Default)]
struct Played {
    published: BTreeMap<u64, Published>,
    data: Post<Message>,
    acks: Post<Ack>,
    /// By robot and event.
    readings: BTreeMap<(usize, i64), Readings>,
    counts: Counts,
}

fn index(id: u16) -> usize {
    usize::from(id) - 1
}

fn sights(mut inputs: StepInputs) -> StepInputs {
    inputs
        .sightings
        .retain(|it| SIGHTS.contains(&(it.observer, it.observed)));
    inputs
}

/// Children start off by half a metre, and know it.
fn initial(robot: usize, truth: &Pose) -> Initial {
    let (off_m, sigma) = if robot < LEADERS {
        (0.0, [0.01; 3])
    } else {
        (0.5, [0.5, 0.5, 0.05])
    };
    Initial {
        pose: Some(InitialPose::Given([truth.x + off_m, truth.y, truth.phi])),
        sigma,
        ..Initial::default()
    }
}

fn played(team: &Team, robot: usize, recording: &Recording) -> Played {
    let config = team.config(robot);
    let capacity = config.history.capacity;
    let mut estimate = Estimate::with(
        settings(&config),
        capacity,
        recording.stamp,
        &recording.start,
    )
    .with_part(config.assistant());
    let mut played = Played::default();
    for tick in &recording.ticks {
        let inputs = tick.inputs();
        let belief = match tick.step {
            Step::Ahead => estimate.step(&inputs).estimate.belief,
            Step::Behind => panic!("robot {robot} had no time"),
            Step::Own => {
                let (outputs, carried) = estimate.step_among(&inputs, &tick.words());
                assert_eq!(outputs.overflowed, 0);
                for told in carried.data {
                    let post = played.data.entry((robot, index(told.to.0))).or_default();
                    post.push(told.message);
                }
                for ack in carried.acks {
                    let post = played.acks.entry((robot, index(ack.robot.0))).or_default();
                    post.push(*ack);
                }
                for readings in carried.readings {
                    let event = (robot, readings.slot.0);
                    assert!(played.readings.insert(event, *readings).is_none());
                }
                outputs.estimate.belief
            }
        };
        let published = Published::new(tick.stamp, &belief);
        let recorded = Published::new(tick.stamp, &tick.belief);
        assert_eq!(published, recorded, "robot {robot}, tick {}", tick.tick);
        if tick.step == Step::Own {
            played.published.insert(tick.tick, published);
        }
    }
    played.counts = estimate.assisted().unwrap();
    played
}

/// All that it says.
fn bits(message: &Message) -> (i64, i64, Vec<u16>, Vec<u64>) {
    let Message { said, word, .. } = message;
    let poses = [said.pose, word.leader.pose].map(|it| [it.x, it.y, it.phi]);
    let covariances = [
        said.parts.independent,
        said.parts.dependent,
        word.leader.covariance,
    ];
    let numbers = poses.into_iter().flatten();
    let numbers = numbers.chain(covariances.into_iter().flat_map(|it| it.to_row_major()));
    let transitions = word.past.transitions.into_iter().flatten().flatten();
    let numbers = numbers.chain(transitions.map(f64::from));
    (
        message.slot.0,
        message.stamp.as_nanos(),
        message.path.iter().map(|it| it.0).collect(),
        numbers.map(f64::to_bits).collect(),
    )
}

/// Every datum that came over shared memory is one that was worked out here, each once; how many.
fn assert_same_data(recordings: &[Recording], played: &[Played]) -> usize {
    let mut count = 0;
    for (robot, recording) in recordings.iter().enumerate() {
        // By sender: where in the order of what it sent the first one is that came, and its count.
        let mut first: BTreeMap<usize, (usize, u64)> = BTreeMap::new();
        for heard in recording.ticks.iter().flat_map(|tick| &tick.data) {
            let sender = index(heard.origin.source);
            let (told, said) = (&played[sender].data[&(sender, robot)], bits(&heard.message));
            let sequence = heard.origin.sequence;
            let (place, before) = first.entry(sender).or_insert_with(|| {
                let same = |it: &Message| bits(it) == said;
                (told.iter().position(same).unwrap(), sequence)
            });
            let place = *place + usize::try_from(sequence - *before).unwrap();
            assert_eq!(said, bits(&told[place]), "from {sender} to {robot}");
            count += 1;
        }
    }
    count
}

/// What leaders were told is what was worked out here; how many times.
fn assert_same_readings(recordings: &[Recording], played: &[Played]) -> usize {
    let mut count = 0;
    for heard in recordings.iter().flat_map(|it| &it.ticks) {
        for HeardReadings { origin, readings } in &heard.readings {
            let sender = index(origin.source);
            let said = played[sender].readings[&(sender, readings.slot.0)];
            assert_eq!(*readings, said, "of robot {sender}");
            count += 1;
        }
    }
    count
}

/// No sighting served two leaders, and no datum was taken twice: by all that was recorded.
fn assert_used_once(recordings: &[Recording], played: &[Played]) {
    let mut used: BTreeMap<(i64, usize, usize), u16> = BTreeMap::new();
    for (robot, recording) in recordings.iter().enumerate() {
        for ack in recording.ticks.iter().flat_map(|tick| &tick.acks) {
            if ack.taken {
                let edge = (ack.slot.0, robot, index(ack.robot.0));
                let before = used.insert(edge, ack.leader.0);
                assert!(before.is_none(), "{edge:?}: {before:?}, {ack:?}");
            }
        }
    }
    let answered: usize = played
        .iter()
        .flat_map(|it| it.acks.values())
        .map(Vec::len)
        .sum();
    println!("{} sightings used of {answered} offered", used.len());
}

fn error_m(heard: &Heard, world: &Synthetic, start_ns: i64, robot: usize) -> (f64, f64) {
    let last = heard.estimates.values().next_back().unwrap();
    let step = (last.header.stamp_ns - start_ns) / STEP_NS;
    let truth = world.truth(usize::try_from(step).unwrap(), robot).unwrap();
    let [x, y, _] = last.pose;
    let variance = |place: usize| last.independent[place] + last.dependent[place];
    (
        (x - truth.x).hypot(y - truth.y),
        variance(0).max(variance(4)).sqrt(),
    )
}

#[test]
fn leaders_carry_children_that_none_of_them_sees_and_all_of_it_comes_out_the_same_in_one_process() {
    assert_carried(AssistMode::BoundedInstant);
}

#[test]
fn leaders_that_are_told_what_all_see_carry_them_too() {
    assert_carried(AssistMode::Full);
}

fn assert_carried(mode: AssistMode) {
    let world = Synthetic::new(&SyntheticConfig {
        robots: ROBOTS,
        seconds: SECONDS,
        ..SyntheticConfig::default()
    });
    let scenario = Scenario::paper();
    let sensors = Sensors::new(&world, &scenario, 1, 0);
    let assist = Assist {
        leaders: vec![1, 2],
        children: vec![3, 4, 5],
        period_s: 0.1,
        mode,
        fusion: AssistFusion::Cross,
        ..Assist::default()
    };
    let mut team = Team::led(assist, |robot| {
        initial(robot, &world.initial(robot).unwrap())
    });
    let listeners = team.listen();
    let feed = Feed::open(&team);
    let start_ns = feed.start_ns();
    let heard = feed.drive(|step| sights(sensors.at(step)), world.steps(), &listeners);
    drop(listeners);
    team.stop();
    let recordings = team.recordings();

    let all = recordings.iter().enumerate();
    let played: Vec<_> = all
        .map(|(robot, recording)| played(&team, robot, recording))
        .collect();
    for (robot, (heard, played)) in heard.iter().zip(&played).enumerate() {
        for (tick, estimate) in &heard.estimates {
            let published = played.published[tick];
            assert_eq!(Published::heard(estimate), published, "robot {robot}");
        }
    }
    let data = assert_same_data(&recordings, &played);
    assert_used_once(&recordings, &played);
    println!("{data} data");
    let readings = assert_same_readings(&recordings, &played);
    if mode == AssistMode::Full {
        assert!(data > 250 && readings > 500, "{data} data, {readings}");
    } else {
        assert!(data > 500 && readings == 0, "{data} data, {readings}");
    }
    for robot in LEADERS..ROBOTS {
        let (counts, said) = (played[robot].counts, heard[robot].assist);
        assert!(
            said.accepted > 50 && said.accepted <= counts.accepted,
            "{said:?}"
        );
        let (error, sigma) = error_m(&heard[robot], &world, start_ns, robot);
        println!("robot {robot}: {error:.3} m off, σ {sigma:.3} m, {counts:?}");
        // The wheels alone, as the paper has them, would come to metres.
        assert!(
            error < 4.0 * sigma && sigma < 0.4,
            "robot {robot}: {error}, {sigma}"
        );
    }
    assert_eq!(played[0].counts.accepted, 0, "it leads");
    assert!(played[FAR].counts.accepted > 50);
}
