//! What a link costs: processor time, memory, messages, by neighbours and by members.
use std::time::Instant;

use crate::Extent;
use crate::process::Usage;
use crate::support::PREFIX;
use crate::talk::Talk;
use crate::team::{Robot, team};

/// Four others, ten times a second each way, and then as fast as this computer lets them.
pub(crate) fn cost(extent: Extent) {
    let home = tempfile::tempdir().unwrap();
    let mut robots = team(home.path(), 5);
    start(&mut robots);
    let mut talk = Talk::new(&robots, |_, _| true, 10.0);
    talk.until_all_are_heard();
    talk.go_on(extent.of(1.0, 5.0));
    let (used, messages) = over(&robots, &mut talk, extent.of(3.0, 60.0));
    println!(
        "cost: 4 others at 10 Hz each way: {:.2} % of a core, {:.1} MiB resident, {:.1} of them its own, {} descriptors, {:.0} messages a second of the whole team",
        100.0 * used.busy_s,
        used.resident_mib,
        used.own_mib,
        used.descriptors,
        messages.per_s()
    );
    let mut talk = Talk::new(&robots, |_, _| true, 200.0);
    talk.go_on(extent.of(1.0, 5.0));
    let steps: Vec<_> = (0..extent.of(2, 8))
        .map(|_| over(&robots, &mut talk, extent.of(1.0, 15.0)))
        .collect();
    for (used, messages) in &steps {
        println!(
            "cost: {:.0} messages a second of the whole team, {} of {} were heard: {:.1} % of a core, {:.2} MiB resident, {:.2} its own, {} descriptors",
            messages.per_s(),
            messages.heard,
            messages.said,
            100.0 * used.busy_s,
            used.resident_mib,
            used.own_mib,
            used.descriptors
        );
    }
    println!("cost: {}", robots[0].last_words());
    let [first, last] = [steps.first(), steps.last()].map(|it| it.unwrap().0);
    assert!(
        last.descriptors <= first.descriptors + 2,
        "descriptors grow"
    );
    assert!(last.own_mib < first.own_mib + 4.0, "memory grows");
}

/// Two robots that talk as fast as nobody would, until a million words were carried.
pub(crate) fn million(extent: Extent) {
    let home = tempfile::tempdir().unwrap();
    let mut robots = team(home.path(), 2);
    for robot in &robots {
        robot.set("max_bytes_per_s = 4000000");
    }
    start(&mut robots);
    let mut talk = Talk::new(&robots, |_, _| true, 1000.0);
    talk.until_all_are_heard();
    talk.go_on(extent.of(0.2, 10.0));
    let step = extent.of(200, 100_000);
    let begin = Instant::now();
    let (mut heard, mut said, mut twice) = (0, 0, 0);
    let mut own_mib = Vec::new();
    for _ in 0..10 {
        talk.forget();
        while talk.said < step {
            talk.go_on(extent.of(0.1, 1.0));
        }
        talk.wait(0.2);
        (heard, said, twice) = (heard + talk.count(), said + talk.said, twice + talk.twice());
        let usage = robots[0].link.as_ref().unwrap().usage();
        own_mib.push(usage.own_mib);
        println!(
            "million: {heard} of {said} were heard, {twice} of them twice, after {:.0} s: {:.2} MiB its own, {} descriptors",
            begin.elapsed().as_secs_f64(),
            usage.own_mib,
            usage.descriptors
        );
    }
    println!("million: {}", robots[0].last_words());
    assert_eq!(twice, 0, "a word is heard twice");
    assert!(own_mib[9] < own_mib[0] + 2.0, "memory grows");
}

/// By members and by neighbours, each a link of its own: what a robot says to so many of the next ones round a ring.
pub(crate) fn numbers(extent: Extent) {
    let all: &[(u16, u16)] = extent.of(
        &[(6, 2)],
        &[(3, 2), (6, 2), (12, 2), (12, 4), (12, 8), (12, 0), (6, 0)],
    );
    println!(
        "numbers: prefix {PREFIX}; of the first robot, ten times a second to and from each neighbour"
    );
    println!(
        "numbers: | members | neighbours | core [%] | own [MiB] | sent [B/s] | heard [B/s] | words of all: heard, said | of its link, at the end |"
    );
    for (members, neighbours) in all {
        let home = tempfile::tempdir().unwrap();
        let mut robots = team(home.path(), *members);
        start(&mut robots);
        let is_near = |from: u16, to: u16| {
            let apart = (members + to - from) % members;
            apart.min(members - apart) <= neighbours / 2
        };
        let mut talk = Talk::new(&robots, is_near, 10.0);
        talk.until_all_are_heard();
        // Until words about clocks go to neighbours alone.
        talk.go_on(extent.of(1.0, 16.0));
        let before = robots[0].figures();
        let begin = Instant::now();
        let (used, messages) = over(&robots, &mut talk, extent.of(2.0, 20.0));
        let after = robots[0].figures();
        let seconds = begin.elapsed().as_secs_f64();
        let [sent, heard] = [2, 3].map(|place| (after[place] - before[place]) / seconds);
        let words = robots[0].last_words();
        println!(
            "numbers: | {members} | {neighbours} | {:.2} | {:.1} | {sent:.0} | {heard:.0} | {}, {} | {words} |",
            100.0 * used.busy_s,
            used.own_mib,
            messages.heard,
            messages.said
        );
    }
}

fn start(robots: &mut [Robot]) {
    robots.iter_mut().for_each(Robot::start_link);
}

/// Of the first robot's link while all talk for so long: processor time a second, the rest at the end. And how many messages of all
/// were heard a second.
fn over(robots: &[Robot], talk: &mut Talk, seconds: f64) -> (Usage, Words) {
    let link = robots[0].link.as_ref().unwrap();
    talk.forget();
    let (before, begin) = (link.usage(), Instant::now());
    talk.go_on(seconds);
    let (after, took_s) = (link.usage(), begin.elapsed().as_secs_f64());
    let busy_s = (after.busy_s - before.busy_s) / took_s;
    talk.wait(0.5);
    let (heard, said) = (talk.count(), talk.said);
    (
        Usage { busy_s, ..after },
        Words {
            heard,
            said,
            took_s,
        },
    )
}

/// What was heard of what was said in so long (s).
struct Words {
    heard: usize,
    said: usize,
    took_s: f64,
}

impl Words {
    #[expect(clippy::cast_precision_loss, reason = "a count, for people")]
    fn per_s(&self) -> f64 {
        self.heard as f64 / self.took_s
    }
}
