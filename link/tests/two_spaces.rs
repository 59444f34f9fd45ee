//! Robots in spaces of their own, with links over QUIC on loopback: what crosses, what does not, and what comes back after a fault.
#![allow(clippy::unwrap_used)] // A test may panic.

mod support;

use std::net::SocketAddr;

use coloc_link::roster::Role;
use coloc_link::weather::{Cloud, Weather};
use coloc_link::wire::Versions;
use coloc_shm_types::{
    Answer, Call, Clock, Estimate, Header, Message, Neighbour, Publisher, Round, Sender, Share,
    Subscriber,
};
use support::{Site, all, free_address, member, name, roster, until, wall_ns};

/// What a robot says to another.
struct Voice<M: Message> {
    port: Publisher<M>,
    sender: Sender,
}

impl<M: Message> Voice<M> {
    fn new(site: &Site, to: u16) -> Self {
        Self {
            port: site.space.publisher(&name(to)).unwrap(),
            sender: Sender::start(site.id, Clock::Realtime).unwrap(),
        }
    }

    fn header(&mut self) -> Header {
        self.sender.header(wall_ns())
    }

    fn say(&mut self, message: impl FnOnce(Header) -> M) {
        let header = self.header();
        self.port.send(message(header)).unwrap();
    }
}

fn neighbour(header: Header) -> Neighbour {
    Neighbour {
        header,
        pose: [1.0, 2.0, 0.5],
        independent: [0.1, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.1],
        ..Neighbour::default()
    }
}

/// Two robots; the first calls the second at `called`.
fn pair(home: &std::path::Path, called: SocketAddr, listens: SocketAddr) -> ([Site; 2], String) {
    let first = free_address();
    let text = roster(
        1,
        vec![
            // It has no address: nobody calls it past what is between them.
            member(1, Role::Robot, None),
            member(2, Role::Robot, Some(called)),
        ],
    );
    let mut sites = [Site::new(home, 1, first), Site::new(home, 2, listens)];
    for site in &mut sites {
        site.start(&text);
    }
    (sites, text)
}

fn hears(voice: &mut Voice<Neighbour>, ear: &Subscriber<Neighbour>) -> Vec<Neighbour> {
    until(
        "the other robot hears it",
        || voice.say(neighbour),
        || Some(all(ear)).filter(|heard| !heard.is_empty()),
    )
}

#[test]
fn what_a_robot_says_to_another_is_said_in_the_others_space_byte_for_byte() {
    let home = tempfile::tempdir().unwrap();
    let second = free_address();
    let (sites, _) = pair(home.path(), second, second);
    let [one, two] = &sites;
    let mut to_two = Voice::<Neighbour>::new(one, 2);
    let mut to_one = Voice::<Answer>::new(two, 1);
    let two_hears = two.space.subscriber::<Neighbour>(&name(2)).unwrap();
    let one_hears = one.space.subscriber::<Answer>(&name(1)).unwrap();
    let heard = hears(&mut to_two, &two_hears);
    for message in &heard {
        let own = message.header;
        assert_eq!((own.source, own.clock()), (1, Ok(Clock::Realtime)));
        assert_eq!(*message, neighbour(own));
    }
    let answered = until(
        "the answer comes back",
        || {
            to_one.say(|header| Answer {
                header,
                ..Answer::default()
            });
        },
        || all(&one_hears).pop(),
    );
    assert_eq!(answered.header.source, 2);
    // Nothing of it came back to where it was said, or was said to somebody else.
    let echo = one.space.subscriber::<Neighbour>(&name(1)).unwrap();
    let own = two.space.subscriber::<Answer>(&name(2)).unwrap();
    hears(&mut to_two, &two_hears);
    assert!(all(&echo).is_empty() && all(&own).is_empty());
}

#[test]
fn words_of_others_and_of_another_clock_are_not_carried() {
    let home = tempfile::tempdir().unwrap();
    let second = free_address();
    let (sites, _) = pair(home.path(), second, second);
    let [one, two] = &sites;
    let mut own = Voice::<Neighbour>::new(one, 2);
    let mut liar = Voice::<Neighbour>::new(one, 2);
    liar.sender = Sender::start(7, Clock::Realtime).unwrap();
    let mut unset = Voice::<Neighbour>::new(one, 2);
    unset.sender = Sender::start(1, Clock::Boottime).unwrap();
    let ear = two.space.subscriber::<Neighbour>(&name(2)).unwrap();
    let mut heard = Vec::new();
    while heard.len() < 20 {
        liar.say(neighbour);
        unset.say(neighbour);
        heard.extend(hears(&mut own, &ear));
    }
    assert!(
        heard
            .iter()
            .all(|it| it.header.source == 1 && it.header.clock() == Ok(Clock::Realtime))
    );
}

#[test]
fn a_link_that_was_started_again_and_a_network_that_was_cut_are_found_again() {
    let home = tempfile::tempdir().unwrap();
    let listens = free_address();
    let fair = Weather::default();
    let cloud = Cloud::open(free_address(), listens, fair, 1).unwrap();
    let (mut sites, text) = pair(home.path(), cloud.address(), listens);
    let mut voice = Voice::<Neighbour>::new(&sites[0], 2);
    let ear = sites[1].space.subscriber::<Neighbour>(&name(2)).unwrap();
    hears(&mut voice, &ear);
    for place in [1, 0] {
        sites[place].stop();
        all(&ear);
        sites[place].start(&text);
        hears(&mut voice, &ear);
    }
    cloud.set(Weather { cut: true, ..fair });
    // What is on its way still passes; then nothing does, for long enough that the connection is given up.
    std::thread::sleep(std::time::Duration::from_secs(4));
    voice.say(neighbour);
    all(&ear);
    cloud.set(fair);
    let healed_ns = wall_ns();
    let heard = hears(&mut voice, &ear);
    assert!(
        heard
            .iter()
            .all(|it| it.header.stamp_ns >= healed_ns - 5_000_000_000),
        "nothing is older than its kind may be"
    );
}

#[test]
fn half_of_all_packets_are_enough() {
    let home = tempfile::tempdir().unwrap();
    let listens = free_address();
    let foul = Weather {
        loss: 0.5,
        delay_s: [0.0, 0.4],
        doubled: 0.1,
        cut: false,
    };
    let cloud = Cloud::open(free_address(), listens, foul, 2).unwrap();
    let (sites, _) = pair(home.path(), cloud.address(), listens);
    let mut voice = Voice::<Neighbour>::new(&sites[0], 2);
    let ear = sites[1].space.subscriber::<Neighbour>(&name(2)).unwrap();
    let mut sequences = Vec::new();
    while sequences.len() < 20 {
        sequences.extend(hears(&mut voice, &ear).iter().map(|it| it.header.sequence));
    }
    let all = sequences.len();
    sequences.sort_unstable();
    sequences.dedup();
    assert_eq!(sequences.len(), all, "nothing comes twice");
    assert!(cloud.tally().came > cloud.tally().passed / 2);
}

#[test]
fn who_was_revoked_is_cut_off_while_connected_and_nobody_was_restarted() {
    let home = tempfile::tempdir().unwrap();
    let second = free_address();
    let (sites, _) = pair(home.path(), second, second);
    let [one, two] = &sites;
    let mut voice = Voice::<Neighbour>::new(one, 2);
    let ear = two.space.subscriber::<Neighbour>(&name(2)).unwrap();
    hears(&mut voice, &ear);
    let newer = roster(2, vec![member(2, Role::Robot, Some(second))]);
    std::fs::write(two.directory.join("fleet.toml"), &newer).unwrap();
    // Once its link has read it, nothing comes any more: not the last second's messages, and not those of a new connection.
    let mut silent = 0;
    until(
        "it is silent",
        || voice.say(neighbour),
        || {
            silent = if all(&ear).is_empty() { silent + 1 } else { 0 };
            (silent > 150).then_some(())
        },
    );
}

#[test]
fn a_station_hears_estimates_of_all_and_says_nothing() {
    let home = tempfile::tempdir().unwrap();
    let addresses = [free_address(), free_address()];
    let members = vec![
        member(1, Role::Robot, Some(addresses[0])),
        member(9, Role::Station, Some(addresses[1])),
    ];
    let text = roster(1, members);
    let mut robot = Site::new(home.path(), 1, addresses[0]);
    let mut station = Site::new(home.path(), 9, addresses[1]);
    robot.start(&text);
    station.start(&text);
    let mut estimates = Voice::<Estimate>::new(&robot, 1);
    let heard = station.space.subscriber::<Estimate>(&name(1)).unwrap();
    let mut to_robot = Voice::<Neighbour>::new(&station, 1);
    let robot_hears = robot.space.subscriber::<Neighbour>(&name(1)).unwrap();
    let estimate = until(
        "the station hears it",
        || {
            estimates.say(|header| Estimate {
                header,
                pose: [3.0, 2.0, 1.0],
                ..Estimate::default()
            });
            to_robot.say(neighbour);
        },
        || all(&heard).pop(),
    );
    assert_eq!(
        estimate.pose.map(f64::to_bits),
        [3.0, 2.0, 1.0].map(f64::to_bits)
    );
    assert!(all(&robot_hears).is_empty());
}

#[test]
fn links_of_two_versions_understand_one_another_and_those_too_far_apart_do_not() {
    let home = tempfile::tempdir().unwrap();
    let addresses = [(); 3].map(|()| free_address());
    let members = (1..).zip(addresses);
    let members = members.map(|(id, it)| member(id, Role::Robot, Some(it)));
    let text = roster(1, members.collect());
    let mut sites = [1, 2, 3].map(|id| Site::new(home.path(), id, addresses[usize::from(id) - 1]));
    // The one in the middle is the first that was upgraded; the last speaks only what comes then.
    for (site, (oldest, newest)) in sites.iter_mut().zip([(1, 1), (1, 2), (2, 2)]) {
        site.versions = Versions { oldest, newest };
        site.start(&text);
    }
    let [one, two, three] = &sites;
    let ears = [one, two, three].map(|it| it.space.subscriber::<Neighbour>(&name(it.id)).unwrap());
    for (from, to) in [(one, two), (two, one), (two, three), (three, two)] {
        let mut voice = Voice::new(from, to.id);
        hears(&mut voice, &ears[usize::from(to.id) - 1]);
    }
    let [mut to_three, mut to_one] = [Voice::new(one, 3), Voice::new(three, 1)];
    let mut to_two = Voice::new(one, 2);
    for _ in 0..5 {
        to_three.say(neighbour);
        to_one.say(neighbour);
        hears(&mut to_two, &ears[1]);
    }
    let [heard, _, last] = ears.each_ref().map(all);
    assert!(heard.iter().all(|it| it.header.source == 2));
    assert!(last.iter().all(|it| it.header.source == 2));
}

/// Says something on a robot's own channel until it is heard on the channel of that robot in the other's space.
fn crosses<M: Message>(from: &Site, to: &Site, message: fn(Header) -> M) {
    let mut voice = Voice::<M>::new(from, from.id);
    let ear = to.space.subscriber::<M>(&name(from.id)).unwrap();
    let heard = until(
        M::TYPE_NAME,
        || voice.say(message),
        || all(&ear).into_iter().next(),
    );
    let said = message(*heard.header());
    let [mut said_bytes, mut heard_bytes] = [(); 2].map(|()| vec![0; M::BYTES]);
    assert!(said.put(&mut said_bytes).is_some() && heard.put(&mut heard_bytes).is_some());
    assert_eq!(said_bytes, heard_bytes);
}

#[test]
fn a_team_makes_its_rounds_over_links() {
    let home = tempfile::tempdir().unwrap();
    let second = free_address();
    let ([one, two], _) = pair(home.path(), second, second);
    for (from, to) in [(&one, &two), (&two, &one)] {
        crosses(from, to, |header| Call {
            header,
            ..Call::default()
        });
        crosses(from, to, |header| Share {
            header,
            ..Share::default()
        });
        crosses(from, to, |header| Round {
            header,
            ..Round::default()
        });
    }
}

#[test]
fn a_newer_roster_in_a_robots_directory_reaches_those_that_are_connected() {
    let home = tempfile::tempdir().unwrap();
    let second = free_address();
    let (sites, _) = pair(home.path(), second, second);
    let mut voice = Voice::<Neighbour>::new(&sites[0], 2);
    let ear = sites[1].space.subscriber::<Neighbour>(&name(2)).unwrap();
    hears(&mut voice, &ear);
    let first = sites[0].directory.join("fleet.toml");
    let members = vec![
        member(1, Role::Robot, None),
        member(2, Role::Robot, Some(second)),
    ];
    let newer = roster(2, members);
    std::fs::write(first, &newer).unwrap();
    let theirs = sites[1].directory.join("fleet.toml");
    until(
        "the other has it too",
        || voice.say(neighbour),
        || {
            std::fs::read_to_string(&theirs)
                .ok()
                .filter(|it| *it == newer)
        },
    );
}
