//! What the default noise makes of a robot: parked for an hour, creeping, silent, and after 100 m.
// What fails here fails the test; ticks are few.
#![allow(clippy::unwrap_used, clippy::cast_precision_loss)]

mod by_hand;

use std::path::Path;

use by_hand::{PERIOD, SECOND, Subject, World};
use coloc_daemon::config::Config;
use coloc_daemon::config::understood::Understood;
use coloc_daemon::tick::Outcome;
use coloc_daemon::wait::Wake;
use coloc_drivers::can::Sender;
use coloc_drivers::encoder::WheelFrames;
use coloc_shm_types::{Estimate, Position};

const MINUTE: i64 = 60 * SECOND;

/// A robot and its encoders, every `period_ns` a frame of each and a tick.
struct Parked {
    world: World,
    robot: Subject,
    encoders: Sender,
    wheels: WheelFrames,
    way_m: f64,
    period_ns: i64,
}

impl Parked {
    fn new(period_ns: i64, lines: &str) -> Self {
        let world = World::new();
        let hz = SECOND / period_ns;
        let lines = format!(
            "{}[tick]\nrate_hz = {hz}\n[initial]\nsigma = [0.0, 0.0, 0.0]\n{lines}",
            world.wheels()
        );
        Self {
            robot: world.robot("a", 1, &lines),
            encoders: world.sender(),
            wheels: WheelFrames::new(by_hand::METRES_PER_TICK),
            way_m: 0.0,
            period_ns,
            world,
        }
    }

    /// Four times a second: as fine as an hour needs.
    fn for_an_hour(lines: &str) -> Self {
        Self::new(SECOND / 4, lines)
    }

    fn tick(&mut self) -> Estimate {
        self.world.time.run(self.period_ns);
        let deadline_ns = self.world.time.read_boot();
        let wake = Wake::Deadline {
            deadline_ns,
            missed: 0,
        };
        assert_eq!(self.robot.robot.wake(wake), Outcome::Ticked);
        self.robot.estimates.receive().unwrap().expect("published")
    }

    /// A period later the encoders say `way_m`.
    fn drive_to(&mut self, way_m: f64) -> Estimate {
        self.way_m = way_m;
        for frame in self.wheels.encode(way_m, way_m) {
            self.encoders.send(&frame).unwrap();
        }
        self.tick()
    }

    fn stand_for(&mut self, nanos: i64) -> Estimate {
        let ticks = (0..nanos / self.period_ns).map(|_| self.drive_to(self.way_m));
        ticks.last().expect("a tick")
    }

    fn be_silent_for(&mut self, nanos: i64) -> Estimate {
        let ticks = (0..nanos / self.period_ns).map(|_| self.tick());
        ticks.last().expect("a tick")
    }
}

/// Of x, y and heading.
fn sigmas(estimate: &Estimate) -> [f64; 3] {
    let total = estimate.total();
    [total[0], total[4], total[8]].map(f64::sqrt)
}

/// The number before `unit` on the line that `colocd check` begins or goes on with `words`.
fn said(lines: &str, words: &str, before: &str, unit: &str) -> f64 {
    let world = World::new();
    let text = format!("[robot]\nname = \"a\"\nid = 1\n{}{lines}", world.wheels());
    let config = Config::parse(&text, Path::new("a.toml")).unwrap();
    let page = Understood(&config).to_string();
    let line = page.lines().find(|line| line.contains(words)).expect(&page);
    let (_, rest) = line.split_once(words).unwrap();
    let (_, rest) = rest.split_once(before).expect(line);
    let (number, _) = rest.split_once(unit).expect(line);
    number.trim().parse().expect(line)
}

/// Two digits are said.
fn is_as_said(found: f64, said: f64) -> bool {
    (found / said - 1.0).abs() < 0.06
}

#[test]
fn a_robot_parked_for_an_hour_doubts_itself_by_a_degree_at_most() {
    let mut robot = Parked::for_an_hour("");
    let before = sigmas(&robot.stand_for(10 * SECOND));
    let after = sigmas(&robot.stand_for(60 * MINUTE));
    let [along_m, _, heading_rad] = std::array::from_fn(|axis| after[axis] - before[axis]);
    assert!(heading_rad.to_degrees() <= 1.0, "{heading_rad} rad");
    assert!(along_m <= 0.04, "{along_m} m");
    let [along_m, across_m, heading_rad] =
        std::array::from_fn(|axis| (after[axis].powi(2) - before[axis].powi(2)).sqrt());
    let hour = "after an hour of standing: heading";
    assert!(is_as_said(
        heading_rad.to_degrees(),
        said("", hour, "±", "°")
    ));
    assert!(is_as_said(along_m, said("", hour, "°, ±", "m along")));
    assert!(is_as_said(across_m, said("", hour, "along, ±", "m across")));
}

/// The paper's letter: it knows of no standing.
#[test]
fn the_papers_robot_loses_its_heading_while_parked() {
    let paper = "[motion]\npreset = \"paper\"\n";
    let mut robot = Parked::for_an_hour(paper);
    let [.., heading_rad] = sigmas(&robot.stand_for(10 * MINUTE));
    let expected = (0.345 * 0.02 * 600.0_f64).sqrt();
    assert!(
        (heading_rad / expected - 1.0).abs() < 0.01,
        "{heading_rad} rad"
    );
}

/// Its wheels do not turn, and it does, by so much in the hour: whether that is within 3 σ at every minute of it.
fn is_within_3_sigma_when_it_creeps_by(rad_per_hour: f64) -> bool {
    // Nobody doubts where it was before the first frame.
    let certain = "[motion]\noutage_variance = [1e-9, 1e-9, 1e-9]\n";
    let mut robot = Parked::for_an_hour(certain);
    let mut minutes = (1..=60).map(|minute| {
        let [.., sigma] = sigmas(&robot.stand_for(MINUTE));
        rad_per_hour * f64::from(minute) / 60.0 <= 3.0 * sigma
    });
    minutes.all(|is_within| is_within)
}

#[test]
fn a_robot_that_creeps_as_stated_is_within_3_sigma_of_itself_for_an_hour() {
    assert!(is_within_3_sigma_when_it_creeps_by(0.05));
    assert!(!is_within_3_sigma_when_it_creeps_by(0.06));
}

/// Whether a fix at `x_m`, σ 2 cm, moves a robot that has been parked for an hour.
fn is_moved_by_a_fix_at(x_m: f64) -> bool {
    let mut robot = Parked::for_an_hour("[motion]\noutage_variance = [1e-9, 1e-9, 1e-9]\n");
    robot.stand_for(60 * MINUTE);
    let publisher = robot.world.publisher("a");
    let fix = Position {
        header: robot.world.header(1),
        quality: 4,
        position: [x_m, 0.0],
        covariance: [4e-4, 0.0, 0.0, 4e-4],
        ..Position::default()
    };
    publisher.send(fix).unwrap();
    robot.stand_for(SECOND).pose[0] > 0.1 * x_m
}

/// Somebody who pushes it with its wheels blocked is found out by the next fix.
#[test]
fn a_fix_is_judged_by_the_creep_that_was_stated() {
    assert!(is_moved_by_a_fix_at(0.08));
    assert!(!is_moved_by_a_fix_at(0.5));
}

#[test]
fn a_robot_whose_encoders_fall_silent_is_not_taken_to_stand() {
    let mut robot = Parked::new(PERIOD, "");
    let parked = sigmas(&robot.stand_for(10 * SECOND));
    let silent = sigmas(&robot.be_silent_for(10 * SECOND));
    for (variance, (parked, silent)) in [5.075, 5.075, 0.345]
        .into_iter()
        .zip(parked.into_iter().zip(silent))
    {
        assert!(silent > 10.0 * parked, "{silent} {parked}");
        let outage = f64::sqrt(variance * 0.02 * 10.0);
        assert!((silent / outage - 1.0).abs() < 0.05, "{silent} {outage}");
    }
}

#[test]
fn check_says_what_100_m_make_of_the_robot() {
    let mut robot = Parked::new(PERIOD, "");
    robot.drive_to(0.0);
    let last = (1..=5000)
        .map(|period| robot.drive_to(f64::from(period) * 0.02))
        .last()
        .unwrap();
    let [along_m, across_m, heading_rad] = sigmas(&last);
    let words = "after 100 m straight at 1 m/s, the heading known at the start:";
    println!("{along_m} m, {across_m} m, {heading_rad} rad");
    assert!(
        is_as_said(along_m, said("", words, "±", "m along")),
        "{along_m}"
    );
    assert!(
        is_as_said(across_m, said("", words, "along, ±", "m across")),
        "{across_m}"
    );
    assert!(is_as_said(
        heading_rad.to_degrees(),
        said("", words, "heading ±", "°")
    ));
}

/// Silent for so long it drives out, turns by so much in all and is back: the farthest that it is from its belief then, in σ of
/// either direction and of the heading.
fn sigmas_off_after_a_loop_of(seconds: i64, turn_rad: f64) -> f64 {
    let mut robot = Parked::new(PERIOD, "");
    robot.stand_for(SECOND);
    let before = (0..=50).map(|step| robot.drive_to(f64::from(step) * 0.01));
    let [x, y, _] = before.last().unwrap().pose;
    let half_m = 0.45 * seconds as f64;
    let turn_m = 0.5 * turn_rad * 0.3;
    robot.be_silent_for(seconds * SECOND);
    let way_m = 0.5 + 2.0 * half_m;
    for frame in robot.wheels.encode(way_m - turn_m, way_m + turn_m) {
        robot.encoders.send(&frame).unwrap();
    }
    let after = robot.tick();
    let [along, across, heading] = sigmas(&after);
    let turned = (after.pose[2] - turn_rad).sin();
    [
        (after.pose[0] - x) / along,
        (after.pose[1] - y) / across,
        turned / heading,
    ]
    .into_iter()
    .fold(0.0, |most, it| it.abs().max(most))
}

#[test]
fn a_path_that_nobody_counted_is_within_3_sigma() {
    for seconds in [1, 5, 20, 60] {
        for turns in [0.5, 1.0, -3.0] {
            let off = sigmas_off_after_a_loop_of(seconds, turns * std::f64::consts::TAU);
            assert!(off <= 3.0, "{seconds} s, {turns} turns: {off} σ");
        }
    }
}

/// By how much the heading's σ grows in an hour in which a count comes and goes \[rad\].
fn dithering_for_an_hour(periods: i64) -> f64 {
    let mut robot = Parked::for_an_hour("");
    let before = sigmas(&robot.stand_for(10 * SECOND));
    let ways = (0..14_400).map(|period| f64::from(u8::from(period / periods % 2 == 0)));
    let ticks = ways.map(|way| robot.drive_to(way * by_hand::METRES_PER_TICK));
    sigmas(&ticks.last().unwrap())[2] - before[2]
}

#[test]
fn a_parked_robot_whose_encoders_dither_doubts_itself_no_more_than_one_that_stands() {
    for periods in [1, 2, 4, 40] {
        let grown = dithering_for_an_hour(periods).to_degrees();
        assert!(grown <= 1.0, "every {periods} periods: {grown}°");
    }
}
