//! The ways in which poses are handed on, a file for each.

use std::collections::BTreeMap;

use coloc_estimator::assist::datum::{Reading, extend, first, joined};
use coloc_estimator::assist::team::Place;
use coloc_estimator::assist::tree::{Forest, by_priority};
use coloc_estimator::assist::wait::Bound;
use coloc_estimator::{GlobalPose, RobotId};

use super::radio::{Radio, began};
use super::world::{PAPER, Poses, World, numbers, run};
use crate::distributed::{around, waited};
use crate::replay::Account;
use crate::sync::{Got, Lost, Order, Run};
use crate::trees::place;

/// Chapter 3: leaders know all readings.
#[test]
fn full() {
    run("leader/sequence_full.json", |world, step| {
        let Some(stated) = &step.expected.event else {
            return;
        };
        let (graph, readings) = world.readings(step);
        let ranked = world.leaders.iter().map(|(id, belief)| {
            let trace = belief.total().variances().into_iter().sum::<f64>();
            (trace, place(&world.team, *id))
        });
        let mut ranked: Vec<_> = ranked.collect();
        by_priority(&mut ranked);
        let order: Vec<Place> = ranked.into_iter().map(|it| it.1).collect();
        let ids: Vec<u16> = order.iter().map(|it| world.team.id(*it).0).collect();
        assert_eq!(ids, stated.order);
        let forest = Forest::new(&world.team, &graph, &order);
        let mut poses = Poses::new();
        for (tree, stated) in forest.trees().iter().zip(&stated.trees) {
            let leader = world.team.id(tree.leader()).0;
            assert_eq!(
                (leader, tree.edges().len()),
                (stated.leader, stated.poses.len())
            );
            let mut seen: BTreeMap<u16, Reading> = BTreeMap::new();
            for (edge, stated) in tree.edges().iter().zip(&stated.poses) {
                let (parent, child) = (world.team.id(edge.parent).0, world.team.id(edge.child).0);
                let found = [f64::from(parent), f64::from(child), f64::from(edge.degree)];
                assert_eq!(found.as_slice(), &stated[..3]);
                let last = readings[&(parent, child)];
                let reading = seen.get(&parent);
                let reading = reading.map_or(last, |near| joined(near, &last, PAPER));
                seen.insert(child, reading);
                let said = first(&world.leaders[&leader], &reading, PAPER);
                world.compare_datum(&said, &stated[3..]);
                poses
                    .entry(child)
                    .or_default()
                    .push((RobotId(leader), said));
            }
        }
        world.fuse_now(&poses, &stated.fusions);
    });
}

/// The datum of every message that was taken, by child and leader.
fn data_of(
    world: &World,
    run: &Run,
    readings: &BTreeMap<(u16, u16), Reading>,
) -> BTreeMap<(u16, u16), GlobalPose> {
    let mut data = BTreeMap::new();
    for (_, from, to, leader, _, result, _) in &run.messages {
        if result == "accept" {
            let reading = &readings[&(*from, *to)];
            let said = match world.leaders.get(from) {
                Some(belief) => first(belief, reading, PAPER),
                None => extend(&data[&(*from, *leader)], reading, PAPER),
            };
            data.insert((*to, *leader), said);
        }
    }
    data
}

/// Chapter 4, instantaneous.
#[test]
fn instant() {
    run("leader/sequence_instant.json", |world, step| {
        let Some(stated) = &step.expected.event else {
            return;
        };
        let (graph, readings) = world.readings(step);
        let team = world.team;
        let run = Run::new(&team, &graph, &stated.arrival, Order::Fifo, Lost::default());
        let data = data_of(world, &run, &readings);
        assert_eq!(run.messages.len(), stated.messages.len());
        for (found, line) in run.messages.iter().zip(&stated.messages) {
            let (_, from, to, leader, path, result, _) = found;
            let found = serde_json::json!([from, to, leader, path, result]);
            assert_eq!(found.as_array().unwrap()[..], line[..5]);
            if line.len() > 5 {
                world.compare_datum(&data[&(*to, *leader)], &numbers(line, 5));
            }
        }
        let mut poses = Poses::new();
        for ((child, leader), said) in &data {
            let poses = poses.entry(*child).or_default();
            poses.push((RobotId(*leader), *said));
        }
        world.fuse_now(&poses, &stated.fusions);
    });
}

/// Chapter 4, one step a hop, with losses.
#[test]
fn delayed() {
    // By the step in which they are fused: the event, and the poses.
    let mut due: BTreeMap<u32, Vec<(usize, Poses)>> = BTreeMap::new();
    run("leader/sequence_delayed.json", |world, step| {
        if let (Some(stated), Some(given)) = (&step.expected.event, &step.event) {
            let (graph, readings) = world.readings(step);
            let lost = Lost {
                data: &given.lost,
                acks: &given.ack_lost,
            };
            let team = world.team;
            let run = Run::new(&team, &graph, &given.arrival, Order::Sender, lost);
            let data = data_of(world, &run, &readings);
            assert_eq!(run.messages.len(), stated.messages.len());
            for (found, line) in run.messages.iter().zip(&stated.messages) {
                let (tick, from, to, leader, path, result, ack) = found;
                let found = serde_json::json!([tick, from, to, leader, path, result, ack]);
                assert_eq!(found.as_array().unwrap()[..], line[..7]);
                if line.len() > 7 {
                    world.compare_datum(&data[&(*to, *leader)], &numbers(line, 7));
                }
            }
            assert_eq!(stated.points.len(), team.children().count());
            for (child, n_bar, max_delay, k_lp, fuse, close) in &stated.points {
                let around = around(&team, &graph, place(&team, *child));
                let got: Vec<Got> = run
                    .got
                    .iter()
                    .filter(|it| it.0 == *child)
                    .copied()
                    .collect();
                let (delay, liberated, fused, leaders, closes) = waited(&around, Bound::Team, &got);
                assert_eq!(around.seen.min(around.leaders), *n_bar);
                let found = (delay, liberated, fused, closes);
                assert_eq!(found, (*max_delay, *k_lp, *fuse, *close));
                let Some(fused) = fused else { continue };
                let poses = leaders
                    .iter()
                    .map(|it| (RobotId(*it), data[&(*child, *it)]));
                let poses = Poses::from([(*child, poses.collect())]);
                let then = due.entry(step.k + fused).or_default();
                then.push((step.k as usize, poses));
            }
        }
        let mut found: BTreeMap<String, Vec<(u16, Account)>> = BTreeMap::new();
        for (at, poses) in due.remove(&step.k).unwrap_or_default() {
            for (variant, account) in world.fuse(at, &poses) {
                found.entry(variant).or_default().extend(account);
            }
        }
        let fused: usize = found.values().map(Vec::len).sum();
        let stated: usize = step.expected.fusions.values().map(Vec::len).sum();
        assert_eq!(fused, stated, "step {}", step.k);
        for (variant, account) in found {
            let stated = step.expected.fusions.get(&variant);
            let stated = stated.map_or(&[][..], |it| it.as_slice());
            assert_eq!(account.len(), stated.len(), "step {}", step.k);
            for ((child, (at, leader, fusion)), line) in account.iter().zip(stated) {
                let (event, stated_child, of, d2, accepted, alpha) = *line;
                assert_eq!(*at, event);
                let line = (stated_child, of, d2, accepted, alpha);
                world.check_fusion((*child, *leader, fusion), &line);
            }
        }
    });
}

/// As daemons live: messages take steps, several events are open, and what comes is fused when it comes.
#[test]
fn asynchronous() {
    let mut radio = None;
    run("leader/sequence_async.json", |world, step| {
        let radio = radio.get_or_insert_with(|| Radio::new(world.meta, world.team));
        if let Some(given) = &step.event {
            radio.begin(world, step, &given.arrival);
        }
        for child in &world.meta.children {
            for (slot, leader, said) in radio.act(*child, step.k) {
                let poses = Poses::from([(*child, vec![(leader, said)])]);
                world.fuse(began(slot) as usize, &poses);
            }
        }
        radio.check_sent(&step.expected.sent);
        radio.check_received(world, &step.expected.received);
    });
}
