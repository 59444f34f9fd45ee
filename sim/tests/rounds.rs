//! Rounds on a synthetic world: the joint filter's beliefs, whatever is lost; and the distributed filter beside the centralized one.

use coloc_estimator::{Belief, Covariance3, Pose};
use coloc_sim::dkf::Dkf;
use coloc_sim::method::joint::Joint;
use coloc_sim::method::{FilterSettings, Method};
use coloc_sim::rounds::reference::{Distance, distance};
use coloc_sim::rounds::{Counts, Crew, Plan, Trouble};
use coloc_sim::{Scenario, Sensors, Synthetic, SyntheticConfig, World};

fn world(seconds: f64) -> Synthetic {
    Synthetic::new(&SyntheticConfig {
        seconds,
        ..SyntheticConfig::default()
    })
}

fn beginning(world: &Synthetic) -> Vec<Belief> {
    let p0 = Covariance3::diagonal([0.0025, 0.0025, 0.001]).expect("positive");
    (0..world.robots())
        .map(|robot| Belief::independent(world.initial(robot).expect("known"), p0))
        .collect()
}

fn settings(loss: f64) -> FilterSettings {
    let mut scenario = Scenario::named("slip").expect("a scenario");
    scenario.radio.loss = loss;
    FilterSettings::new(&scenario, 0.02)
}

/// A minute and a half of rounds, and how far they were from the joint filter.
fn run(plan: Plan, loss: f64) -> (Distance, Counts) {
    let (world, settings) = (world(90.0), settings(loss));
    let initial = beginning(&world);
    let plan = Plan {
        keeps_log: true,
        ..plan
    };
    let mut crew = Crew::new(settings.clone(), &initial, plan);
    let scenario = Scenario::named("slip").expect("a scenario");
    let sensors = Sensors::new(&world, &scenario, 3, 0);
    for step in 1..world.steps() {
        crew.step(&sensors.at(step), &mut |_| ());
    }
    let beliefs: Vec<_> = initial
        .iter()
        .map(|it| (it.pose, it.total().matrix()))
        .collect();
    let found = distance(&crew, &settings, &beliefs, crew.gates());
    (found, crew.counts())
}

fn assert_exact((found, counts): (Distance, Counts), least_rounds: u64) {
    assert_eq!((counts.first_order, counts.refused), (0, 0), "{counts:?}");
    let farthest = found.farthest.into_iter().fold(found.covariance, f64::max);
    assert!(farthest <= 1e-9, "{found:?}");
    assert!(found.rounds >= least_rounds, "{found:?}");
    assert!(found.compared > 2 * found.rounds, "{found:?}");
}

#[test]
fn where_nothing_is_lost_it_is_the_joint_filter() {
    let (found, counts) = run(Plan::at(5.0), 0.0);
    assert_eq!((found.apart, counts.undone, counts.joined), (0, 0, 0));
    assert_exact((found, counts), 440);
    assert_exact(run(Plan::at(2.0), 0.0), 175);
}

#[test]
fn absent_robots_are_left_out() {
    let trouble = Trouble {
        absent: 0.4,
        ..Trouble::default()
    };
    let plan = Plan {
        trouble,
        ..Plan::at(5.0)
    };
    assert_exact(run(plan, 0.0), 150);
}

#[test]
fn a_third_of_all_messages_is_lost() {
    assert_exact(run(Plan::at(5.0), 0.3), 100);
}

#[test]
fn leaders_are_killed_in_every_slot() {
    let trouble = Trouble {
        kills_leaders: true,
        ..Trouble::default()
    };
    let plan = Plan {
        trouble,
        ..Plan::at(5.0)
    };
    assert_exact(run(plan, 0.0), 100);
}

#[test]
fn a_team_is_cut_in_two_and_comes_together_again() {
    let trouble = Trouble {
        split: Some((3, [20.0, 80.0])),
        ..Trouble::default()
    };
    let plan = Plan {
        trouble,
        ..Plan::at(5.0)
    };
    let (found, counts) = run(plan, 0.0);
    assert_eq!(counts.joined, 0, "who is back is a member as before");
    assert_exact((found, counts), 440);
}

#[test]
fn a_robot_that_forgot_what_it_shares_joins_by_a_block_bound() {
    let trouble = Trouble {
        restart: Some((2, 30.0)),
        ..Trouble::default()
    };
    let plan = Plan {
        trouble,
        ..Plan::at(5.0)
    };
    let (found, counts) = run(plan, 0.0);
    assert_eq!((found.bounds, counts.joined), (1, 1));
    assert_exact((found, counts), 440);
}

#[test]
fn the_distributed_filter_and_full_rounds_are_the_centralized_one() {
    let (world, settings) = (world(30.0), settings(0.0));
    let initial = beginning(&world);
    let plan = Plan {
        fixes_in_rounds: true,
        ..Plan::at(10.0)
    };
    let mut methods: [Box<dyn Method>; 3] = [
        Box::new(Joint::new(settings.clone(), &initial)),
        Box::new(Dkf::new(settings.clone(), &initial)),
        Box::new(Crew::new(settings, &initial, plan)),
    ];
    let scenario = Scenario::named("slip").expect("a scenario");
    let sensors = Sensors::new(&world, &scenario, 3, 0);
    for step in 1..world.steps() {
        let inputs = sensors.at(step);
        for method in &mut methods {
            method.step(&inputs, &mut |_| ());
        }
        for robot in 0..world.robots() {
            let [central, others @ ..] = &methods;
            let (pose, p) = central.estimate(robot);
            for other in others {
                let (found, q) = other.estimate(robot);
                let off = [pose, found].map(Pose::to_vector);
                let off = (off[0] - off[1]).map(coloc_estimator::angle::wrap);
                assert!(
                    off.amax() <= 1e-9 && (p - q).amax() <= 1e-10,
                    "step {step}, {off}"
                );
            }
        }
    }
}
