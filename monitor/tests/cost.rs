//! What the process costs: one robot's `coloc-bounds`, the evidence of whose team is said by this test. Nothing is asserted of time:
//! `cargo test --release -p coloc-monitor --test cost -- --ignored --nocapture`

#![allow(clippy::unwrap_used)] // What fails here fails the test.

use std::thread::sleep;
use std::time::{Duration, Instant};

use coloc_rig::Rig;
use coloc_sensors::Moment;
use coloc_shm_types::{
    Clock, DriverStatus, Estimate, Evidence, Heading, Odometry, OdometryKind, Position, Publisher,
    RelativePose, SeenWithin, Sender, Subscriber,
};

const SLOT_NS: i64 = 500_000_000;
const TICK: Duration = Duration::from_millis(20);
/// Sensors speak every so many ticks: 10 Hz.
const EVERY: u32 = 5;
/// Robots stand so far apart, and see one another so far \[m\].
const PITCH_M: f64 = 3.0;
const SEEN_M: f64 = 6.5;
const SETTLE: Duration = Duration::from_secs(6);
const MEASURED: Duration = Duration::from_secs(20);

/// A small generator: the same noise in every run.
struct Chance(u64);

impl Chance {
    /// Between -1 and 1.
    #[allow(clippy::cast_precision_loss)] // Noise.
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

#[allow(clippy::cast_precision_loss)] // Sixteen.
fn truth(robot: usize) -> [f64; 2] {
    [(robot % 4) as f64, (robot / 4) as f64].map(|it| PITCH_M * it)
}

fn id(robot: usize) -> u16 {
    u16::try_from(robot + 1).unwrap()
}

/// Whom a robot sees, and where.
fn seen(robot: usize, robots: usize) -> Vec<(usize, [f64; 2])> {
    let [x, y] = truth(robot);
    let others = (0..robots).filter(|it| *it != robot);
    let all = others.map(|it| (it, [truth(it)[0] - x, truth(it)[1] - y]));
    all.filter(|it| it.1[0].hypot(it.1[1]) < SEEN_M).collect()
}

/// What one of the others tells of a slot: it stands, looks along x, and has a fix if it is the second.
fn evidence(robot: usize, robots: usize, end_ns: i64, chance: &mut Chance) -> Evidence {
    let mut message = Evidence {
        epoch: u64::try_from(end_ns / SLOT_NS).unwrap(),
        moved: [0.05; 16],
        turn: [0.0, 0.35],
        has: Evidence::COMPASS,
        compass: [0.02 * chance.next(), 0.087],
        ..Evidence::default()
    };
    if robot == 1 {
        message.has |= Evidence::FIX;
        message.fix = truth(robot).map(|it| it + 0.1 * chance.next());
        message.fix_half = [0.3; 2];
    }
    for (place, (observed, at)) in message.seen.iter_mut().zip(seen(robot, robots)) {
        *place = SeenWithin {
            observed: id(observed),
            centre: at.map(|it| it + 0.1 * chance.next()),
            half: [0.4; 2],
            turn: 0.01 * chance.next(),
            turn_half: 0.1,
            ..SeenWithin::default()
        };
        message.seen_count += 1;
    }
    message
}

struct Mouth {
    odometry: (Publisher<Odometry>, Sender),
    headings: (Publisher<Heading>, Sender),
    fixes: (Publisher<Position>, Sender),
    sightings: (Publisher<RelativePose>, Sender),
    estimates: (Publisher<Estimate>, Sender),
    team: Vec<(usize, Publisher<Evidence>, Sender)>,
    before_ns: i64,
    ticks: u32,
    slot: i64,
    chance: Chance,
}

fn diagonal([x, y, phi]: [f64; 3]) -> [f64; 9] {
    [x * x, 0.0, 0.0, 0.0, y * y, 0.0, 0.0, 0.0, phi * phi]
}

impl Mouth {
    fn open(rig: &Rig, names: &[&str]) -> Self {
        let own = names[0];
        let sensor = || Sender::start(0, Clock::Boottime).unwrap();
        let others = names.iter().enumerate().skip(1);
        Self {
            odometry: (rig.publisher(own), sensor()),
            headings: (rig.publisher(own), sensor()),
            fixes: (rig.publisher(own), sensor()),
            sightings: (rig.publisher(own), sensor()),
            estimates: (
                rig.publisher(own),
                Sender::start(1, Clock::Boottime).unwrap(),
            ),
            team: others
                .map(|(robot, name)| {
                    let sender = Sender::start(id(robot), Clock::Realtime).unwrap();
                    (robot, rig.publisher(name), sender)
                })
                .collect(),
            before_ns: Moment::now().boottime_ns - 1,
            ticks: 0,
            slot: 0,
            chance: Chance(7),
        }
    }

    /// What all say at this moment.
    fn speak(&mut self, robots: usize) {
        let now = Moment::now();
        let now_ns = now.boottime_ns;
        let (port, sender) = &mut self.odometry;
        port.send(Odometry {
            header: sender.header(now_ns),
            start_ns: std::mem::replace(&mut self.before_ns, now_ns),
            kind: OdometryKind::Twist as u8,
            ..Odometry::default()
        })
        .unwrap();
        let (port, sender) = &mut self.estimates;
        port.send(Estimate {
            header: sender.header(now_ns),
            boot_ns: now_ns,
            independent: diagonal([0.1; 3]),
            velocity_covariance: diagonal([0.01; 3]),
            ..Estimate::default()
        })
        .unwrap();
        self.ticks += 1;
        if self.ticks.is_multiple_of(EVERY) {
            self.sense(now_ns, robots);
        }
        let slot = now.realtime_ns.div_euclid(SLOT_NS);
        // A part of the grace has gone by, as where robots run it.
        if slot > self.slot && now.realtime_ns.rem_euclid(SLOT_NS) > 50_000_000 {
            self.slot = slot;
            let end_ns = slot * SLOT_NS;
            for (robot, port, sender) in &mut self.team {
                let header = sender.header(end_ns);
                let told = evidence(*robot, robots, end_ns, &mut self.chance);
                port.send(Evidence { header, ..told }).unwrap();
            }
        }
    }

    fn sense(&mut self, now_ns: i64, robots: usize) {
        let (port, sender) = &mut self.headings;
        port.send(Heading {
            header: sender.header(now_ns),
            quality: 1,
            heading: 0.02 * self.chance.next(),
            variance: 1e-4,
            ..Heading::default()
        })
        .unwrap();
        let (port, sender) = &mut self.fixes;
        port.send(Position {
            header: sender.header(now_ns),
            quality: 4,
            position: [0.1 * self.chance.next(), 0.1 * self.chance.next()],
            covariance: [0.01, 0.0, 0.0, 0.01],
            ..Position::default()
        })
        .unwrap();
        let (port, sender) = &mut self.sightings;
        for (observed, [x, y]) in seen(0, robots) {
            port.send(RelativePose {
                header: sender.header(now_ns),
                observed: id(observed),
                pose: [
                    x + 0.1 * self.chance.next(),
                    y + 0.1 * self.chance.next(),
                    0.01 * self.chance.next(),
                ],
                covariance: diagonal([0.1, 0.1, 0.02]),
                ..RelativePose::default()
            })
            .unwrap();
        }
    }

    fn speak_for(&mut self, time: Duration, robots: usize) {
        let begun = Instant::now();
        while begun.elapsed() < time {
            self.speak(robots);
            sleep(TICK);
        }
    }
}

/// Of a process, all threads \[s\].
#[allow(clippy::cast_precision_loss)] // Hundredths of seconds.
fn processor_s(pid: u32) -> f64 {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap();
    let after = stat.rsplit(") ").next().unwrap();
    let ticks = after.split(' ').skip(11).take(2);
    let ticks: u64 = ticks.map(|it| it.parse::<u64>().unwrap()).sum();
    ticks as f64 / rustix::param::clock_ticks_per_second() as f64
}

fn last(statuses: &Subscriber<DriverStatus>) -> Option<DriverStatus> {
    std::iter::from_fn(|| statuses.receive().unwrap()).last()
}

/// Per cent of a core, with slots closed and skipped meanwhile, and the state at the end.
fn measured(robots: usize, means: &str) {
    let names: Vec<_> = (0..robots).map(|it| format!("r{it}")).collect();
    let names: Vec<_> = names.iter().map(String::as_str).collect();
    let mut rig = Rig::new("cost", env!("CARGO_BIN_EXE_coloc-bounds"));
    let more = format!(
        "[odometry]\nmax_speed_mps = 2.0\nmax_turn_rate_radps = 3.0\n[odometry.base]\n[bounds]\nsigmas = 3.0\ncompass_rad = 0.087\n{means}"
    );
    rig.configure(names[0], &names, &more);
    let mut mouth = Mouth::open(&rig, &names);
    let statuses = rig.subscriber::<DriverStatus>(names[0]);
    let command = rig.command("run", names[0]);
    let pid = rig.start(command);
    mouth.speak_for(SETTLE, robots);
    let (begun, before_s, first) = (Instant::now(), processor_s(pid), last(&statuses));
    mouth.speak_for(MEASURED, robots);
    let spent_s = processor_s(pid) - before_s;
    let share = 100.0 * spent_s / begun.elapsed().as_secs_f64();
    let of = |status: Option<DriverStatus>| {
        status.map_or([0.0; 3], |it| [0, 1, 2].map(|at| it.figures[at]))
    };
    let ([closed, skipped, _], [all, missed, state]) = (of(first), of(last(&statuses)));
    println!(
        "{robots} robots, {}: {share:.2} % of a core; {} slots closed, {} skipped, state {state}",
        if means.is_empty() {
            "no means"
        } else {
            "means"
        },
        all - closed,
        missed - skipped,
    );
    assert!(rig.stop().iter().all(|it| it.status.success()));
}

#[test]
#[ignore = "it only measures"]
fn cost_of_the_process() {
    const MEANS: &str = "mean_slots = 8\nmean_share = 0.2\nmean_share_sightings = 0.36\n";
    for robots in [1, 5, 16] {
        measured(robots, "");
        measured(robots, MEANS);
    }
}
