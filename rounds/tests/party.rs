//! Who leads, who takes part, and what a block bound holds.

use std::sync::Arc;

use coloc_estimator::Pose;
use coloc_rounds::model::{Kind, predict};
use coloc_rounds::party::{Advice, advice};
use coloc_rounds::{
    Correction, Going, Joint, Message, Party, Post, Round, Rules, Share, Shared, Sighting, Standing,
};
use nalgebra::Matrix3;

const GATES: [f64; 3] = [6.63, 9.21, 11.34];

fn rules(robots: usize) -> Rules {
    Rules {
        robots,
        hello_ns: 40,
        deadline_ns: 100,
        patience: 3,
        gates: GATES,
    }
}

#[allow(clippy::cast_precision_loss)]
fn belief(robot: usize) -> (Pose, Matrix3<f64>) {
    let k = robot as f64;
    let covariance = Matrix3::from_diagonal(&[0.04, 0.03, 0.01].into()) * (1.0 + 0.3 * k);
    (Pose::new(3.0 * k, k * k - 1.0, 0.7 * k), covariance)
}

fn beginning(robots: usize) -> Vec<(Pose, Matrix3<f64>)> {
    (0..robots).map(belief).collect()
}

fn share(robot: usize, slot: u64, standing: Standing) -> Share {
    let (pose, covariance) = belief(robot);
    Share {
        robot,
        shared: Shared {
            slot,
            pose,
            covariance,
            psi: Matrix3::identity(),
            standing,
        },
        going: Going::default(),
        sightings: Vec::new(),
    }
}

fn noise() -> Matrix3<f64> {
    Matrix3::from_diagonal(&[0.01, 0.01, 3e-4].into())
}

fn seen(a: usize, b: usize) -> Sighting {
    let y = predict(Kind::Pose, &belief(a).0, &belief(b).0).value;
    Sighting {
        kind: Kind::Pose,
        observed: b,
        y: [y.x + 0.05, y.y - 0.03, y.z + 0.01],
        noise: noise(),
        age_s: 0.0,
    }
}

/// A slot of the robots that are there; messages pass where `passes` says so. Rounds that were made.
fn slot(
    parties: &mut [Party],
    here: &[usize],
    slot: u64,
    passes: &dyn Fn(&Message, usize) -> bool,
) -> usize {
    let mut made = 0;
    let mut waiting: Vec<(usize, Post)> = Vec::new();
    let mut say = |from: usize, post: &mut Vec<Post>, waiting: &mut Vec<(usize, Post)>| {
        for it in post.drain(..) {
            made += usize::from(matches!(it.message, Message::Round(_)) && it.to.is_none());
            waiting.push((from, it));
        }
    };
    for &robot in here {
        let last = parties[robot].round().last(robot).unwrap_or_default();
        let mut post = Vec::new();
        let own = share(robot, slot, Standing::Since(last));
        parties[robot].begin(0, own, &mut post);
        say(robot, &mut post, &mut waiting);
    }
    for now in [0, 40, 100] {
        for &robot in here {
            let mut post = Vec::new();
            parties[robot].tick(now, &mut post);
            say(robot, &mut post, &mut waiting);
        }
        while !waiting.is_empty() {
            for (from, it) in std::mem::take(&mut waiting) {
                for &to in here.iter().filter(|to| **to != from) {
                    if it.to.is_none_or(|only| only == to) && passes(&it.message, to) {
                        let mut post = Vec::new();
                        parties[to].hear(now, &it.message, &mut post);
                        say(to, &mut post, &mut waiting);
                    }
                }
            }
        }
    }
    made
}

fn team(robots: usize) -> Vec<Party> {
    let round = Arc::new(Round::together(&beginning(robots)));
    (0..robots)
        .map(|robot| Party::knowing(robot, rules(robots), round.clone()))
        .collect()
}

const ALL: &dyn Fn(&Message, usize) -> bool = &|_, _| true;

#[test]
fn everybody_follows_one_leader() {
    let mut parties = team(5);
    for number in 1..4 {
        assert_eq!(slot(&mut parties, &[0, 1, 2, 3, 4], number, ALL), 1);
        for party in &parties {
            assert_eq!((party.round().slot, party.round().leader), (number, 0));
        }
    }
}

#[test]
fn more_than_half_goes_on_and_of_two_halves_the_one_with_the_lowest() {
    let mut five = team(5);
    assert_eq!(slot(&mut five, &[2, 3, 4], 1, ALL), 1);
    assert_eq!(slot(&mut five, &[0, 1], 2, ALL), 0);
    let mut four = team(4);
    assert_eq!(slot(&mut four, &[2, 3], 1, ALL), 0);
    assert_eq!(slot(&mut four, &[0, 1], 1, ALL), 1);
    assert_eq!(four[2].round().slot, 0);
}

#[test]
fn who_knows_the_newest_round_leads_and_hands_it_on() {
    let mut parties = team(5);
    // Only robot 3 hears the round of slot 1; then its leader is gone.
    let passes = |message: &Message, to: usize| !matches!(message, Message::Round(_)) || to == 3;
    assert_eq!(slot(&mut parties, &[0, 1, 2, 3, 4], 1, &passes), 1);
    assert_eq!(slot(&mut parties, &[1, 2, 3, 4], 2, ALL), 1);
    assert_eq!(parties[3].round().leader, 3);
    assert_eq!(
        parties[1].round().last(0),
        Some(1),
        "nothing of slot 1 is lost"
    );
    // Who was away learns of it as soon as it hears anybody.
    assert_eq!(slot(&mut parties, &[0, 1, 2, 3, 4], 3, ALL), 1);
    assert!(parties.iter().all(|it| it.round().slot == 3));
}

#[test]
fn a_round_that_was_overtaken_is_taken_back() {
    let mut parties = team(5);
    // Nobody hears the round of robot 0, which goes away with it; the others make their own.
    let passes = |message: &Message, _: usize| !matches!(message, Message::Round(_));
    assert_eq!(slot(&mut parties, &[0, 1, 2, 3, 4], 1, &passes), 1);
    assert_eq!(parties[0].round().slot, 1);
    assert_eq!(slot(&mut parties, &[1, 2, 3, 4], 2, ALL), 1);
    let newest = parties[1].round();
    assert_eq!(newest.last(0), Some(0));
    assert_eq!(advice(newest, 0, Standing::Since(1)), Advice::Undo(Some(0)));
    assert!(matches!(advice(newest, 1, Standing::Since(0)), Advice::Correct(it) if it.slot == 2));
    assert_eq!(advice(newest, 1, Standing::Since(2)), Advice::Nothing);
    assert_eq!(
        advice(&Round::beginning(5), 1, Standing::Since(2)),
        Advice::Nothing
    );
}

#[test]
fn foreign_shares_and_rounds_change_nothing() {
    let round = Round::together(&beginning(3));
    let mut shares = vec![
        share(0, 1, Standing::Since(0)),
        share(7, 1, Standing::Since(0)),
    ];
    let mut nan = share(1, 1, Standing::Since(0));
    nan.shared.pose.x = f64::NAN;
    let mut none = share(2, 1, Standing::Since(0));
    none.shared.covariance[(0, 0)] = -1.0;
    shares.extend([nan, none]);
    let mut old = share(2, 0, Standing::Since(0));
    old.sightings.push(seen(2, 0));
    shares.push(old);
    let (next, verdicts) = round
        .next(1, 0, &shares, &GATES)
        .expect("robot 0 takes part");
    assert_eq!(next.last(0), Some(1));
    assert_eq!((next.last(1), next.last(2)), (Some(0), Some(0)));
    assert!(verdicts.is_empty());
    let mut party = Party::new(0, rules(5));
    let foreign = Message::Round(Arc::new(next));
    party.hear(0, &foreign, &mut Vec::new());
    assert_eq!(party.round().slot, 0, "a round of another team");
    let ghost = Message::Hello {
        from: 9,
        slot: 1,
        known: 0,
    };
    assert!(party.hear(0, &ghost, &mut Vec::new()).is_empty());
}

#[test]
fn a_block_bound_is_never_below_the_joint_filter() {
    // Robots 0 and 1 share something; robot 0 forgets it. The true joint has any correlation that it can have.
    let robots = beginning(3);
    for strength in [-0.95, -0.5, 0.0, 0.5, 0.95] {
        let mut truth = Joint::new(&robots);
        let root = |robot: usize| robots[robot].1.cholesky().expect("positive").l();
        truth.set_block(0, 1, &(root(0) * root(1).transpose() * strength));
        truth.measure(Kind::Pose, [0, 1], seen(0, 1).y, &noise(), 1e9);
        let mut first = share(0, 5, Standing::Joining(5));
        first.sightings.push(seen(0, 1));
        let others = [1, 2].map(|it| share(it, 5, Standing::Since(0)));
        let shares = [&[first][..], &others].concat();
        let gates = [1e9; 3];
        let round = Round::together(&robots);
        let (next, _) = round.next(5, 0, &shares, &gates).expect("a round");
        for robot in 0..3 {
            let Correction {
                covariance, factor, ..
            } = *next.correction(robot).expect("it took part");
            assert_eq!(factor.to_bits(), 2.0_f64.to_bits());
            let more = covariance - truth.block(robot, robot);
            let least = more.symmetric_eigen().eigenvalues.min();
            assert!(least >= -1e-12, "robot {robot} at {strength}: {least:e}");
        }
    }
}
