//! What dies and what is cut: how soon help is back, and that nothing is left behind.
use std::time::Instant;

use coloc_link::weather::{Cloud, Weather};
use coloc_shm_types::{Input, Status};

use crate::Extent;
use crate::process::Usage;
use crate::support::{PATIENCE, free_address, roster};
use crate::talk::Talk;
use crate::team::{Robot, members, team};

/// Two robots that talk; what is between them is called at the second's address, and the first has none.
pub(crate) fn pair(home: &std::path::Path, seed: u64) -> (Vec<Robot>, Cloud) {
    let mut robots = team(home, 2);
    let cloud = Cloud::open(free_address(), robots[1].listens, Weather::default(), seed).unwrap();
    let mut listed = members(&robots);
    listed[0].addresses.clear();
    listed[1].addresses = vec![cloud.address().to_string()];
    let text = roster(1, listed);
    for robot in &mut robots {
        robot.goes_by(&text);
        robot.start_link();
    }
    (robots, cloud)
}

pub(crate) fn worst(what: &str, mut took_s: Vec<f64>) {
    took_s.sort_by(f64::total_cmp);
    println!(
        "{what}: {} times, half of them within {:.2} s, the worst {:.2} s",
        took_s.len(),
        took_s[took_s.len() / 2],
        took_s.last().unwrap()
    );
}

fn grown(what: &str, before: Usage, after: Usage) {
    println!(
        "{what}: its own memory {:.1} MiB before, {:.1} after; {} descriptors before, {} after",
        before.own_mib, after.own_mib, before.descriptors, after.descriptors
    );
    assert!(
        after.descriptors <= before.descriptors + 3,
        "descriptors grow"
    );
    assert!(after.own_mib < before.own_mib + 8.0, "memory grows");
}

/// Links are killed in turn and run again at once.
pub(crate) fn links(extent: Extent) {
    let home = tempfile::tempdir().unwrap();
    let mut robots = team(home.path(), 2);
    robots.iter_mut().for_each(Robot::start_link);
    let mut talk = Talk::new(&robots, |_, _| true, 10.0);
    talk.until_all_are_heard();
    let mut took_s = [Vec::new(), Vec::new()];
    let usage = |robots: &[Robot]| robots[0].link.as_ref().unwrap().usage();
    for (place, took_s) in took_s.iter_mut().enumerate().rev() {
        let before = usage(&robots);
        for _ in 0..extent.of(2, 50) {
            robots[place].link.as_mut().unwrap().kill();
            robots[place].start_link();
            let there = talk.until_heard(1, 2);
            took_s.push(there + talk.until_heard(2, 1));
            talk.go_on(0.5);
        }
        if place == 1 {
            talk.go_on(3.0);
            grown(
                "links: who stays while the other is killed",
                before,
                usage(&robots),
            );
        }
    }
    println!(
        "links: oldest message that was heard: {:.2} s",
        talk.oldest_s()
    );
    let [first, second] = took_s;
    worst(
        "links: who calls is killed, from its start to a message each way",
        first,
    );
    worst("links: who is called is killed, the same", second);
}

/// A daemon is killed and runs again; its link never notices.
pub(crate) fn daemons(extent: Extent) {
    let home = tempfile::tempdir().unwrap();
    let (mut robots, _cloud) = pair(home.path(), 2);
    let mut talk = Talk::new(&robots, |from, _| from == 2, 10.0);
    talk.until_heard(2, 1);
    let statuses = robots[0]
        .space
        .subscriber::<Status>(&robots[0].name())
        .unwrap();
    let usage = |robots: &[Robot]| robots[0].link.as_ref().unwrap().usage();
    let (before, mut took_s) = (usage(&robots), Vec::new());
    let mut session = 0;
    for _ in 0..extent.of(2, 50) {
        robots[0].daemon = None;
        robots[0].start_daemon();
        let begin = Instant::now();
        let mut up = None;
        loop {
            talk.turn();
            let heard = std::iter::from_fn(|| statuses.receive().unwrap()).last();
            let newer = heard.filter(|it| it.header.session != session);
            let Some(status) = newer else {
                assert!(begin.elapsed() < PATIENCE, "it is never helped again");
                continue;
            };
            let up = *up.get_or_insert_with(Instant::now);
            let used = status.accepted_of(Input::Neighbour);
            let turned_away: u64 = status.rejected[Input::Neighbour as usize].iter().sum();
            if used + turned_away > 0 {
                session = status.header.session;
                took_s.push(up.elapsed().as_secs_f64());
                break;
            }
        }
    }
    grown("daemons: the link of who is killed", before, usage(&robots));
    worst(
        "daemons: killed, from its first status (one a second) to one with a neighbour's word",
        took_s,
    );
}

/// The network is cut, and heals; and it is bad for a while.
pub(crate) fn partition(extent: Extent) {
    let home = tempfile::tempdir().unwrap();
    let (robots, cloud) = pair(home.path(), 3);
    let mut talk = Talk::new(&robots, |_, _| true, 10.0);
    talk.until_all_are_heard();
    let usage = || robots[0].link.as_ref().unwrap().usage();
    let before = usage();
    let fair = Weather::default();
    let mut took_s = Vec::new();
    for _ in 0..extent.of(1, 5) {
        cloud.set(Weather { cut: true, ..fair });
        talk.go_on(extent.of(3.0, 30.0));
        cloud.set(fair);
        let there = talk.until_heard(1, 2);
        took_s.push(there + talk.until_heard(2, 1));
    }
    worst("partition: from contact to a message each way", took_s);
    talk.forget();
    let foul = Weather {
        loss: 0.5,
        delay_s: [0.0, 0.4],
        doubled: 0.1,
        cut: false,
    };
    cloud.set(foul);
    talk.go_on(extent.of(5.0, 120.0));
    println!(
        "partition: half of all packets lost, 0 to 400 ms late, a tenth of them twice: {} of {} were heard, the longest gap {:.2} s, the oldest {:.2} s",
        talk.count(),
        talk.said,
        talk.longest_gap_s(None),
        talk.oldest_s()
    );
    cloud.set(fair);
    grown("partition: one of the links", before, usage());
}
