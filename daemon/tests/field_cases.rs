//! Cases from the field (`COLOC_CASES`), played to a whole robot: what it believed falsely once, or did not say.
// What fails here fails the test; minutes of nanoseconds are exact.
#![allow(clippy::unwrap_used, clippy::cast_precision_loss)]

mod by_hand;

use std::path::{Path, PathBuf};

use by_hand::{PERIOD, SECOND, Subject, World};
use coloc_daemon::config::Config;
use coloc_daemon::event::Event;
use coloc_drivers::can::{BusSpec, Frame, Id, StandardId};
use coloc_drivers::encoder::WheelFrames;
use coloc_shm_types::{
    BeliefState, Clock, Estimate, Health, Input, Position, Publisher, Reject, Sender, SourceHealth,
    Status,
};
use serde_json::{Value, json};

/// `COLOC_CASES`, or `../shared/cases` from here or any directory above.
fn cases() -> Option<PathBuf> {
    let given = std::env::var_os("COLOC_CASES").map(PathBuf::from);
    let above = Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .map(|directory| directory.join("shared/cases"));
    let found = given.into_iter().chain(above).find(|cases| cases.is_dir());
    if found.is_none() {
        eprintln!(
            "SKIPPED: no cases from the field; set COLOC_CASES to the directory that holds them"
        );
    }
    found
}

/// A robot as a case describes it, and everything that happens to it.
struct Case {
    world: World,
    robot: Subject,
    frames: coloc_drivers::can::Sender,
    wheels: WheelFrames,
    /// Receivers, each a process of its own.
    receivers: Vec<(Publisher<Position>, Sender)>,
    events: Vec<Value>,
    estimates: Vec<Estimate>,
    status: Status,
    lines: Vec<String>,
}

impl Case {
    fn play(case: &str) -> Option<Self> {
        let case = cases()?.join(case);
        let events = events(&case);
        Some(Self::play_events(&case, events))
    }

    /// As the case's `robot.toml` says, and what happens by `events`.
    fn play_events(case: &Path, events: Vec<Value>) -> Self {
        let world = World::new();
        let mut config: toml::Table =
            toml::from_str(&std::fs::read_to_string(case.join("robot.toml")).unwrap()).unwrap();
        let bus = BusSpec::Local {
            directory: world.directory.path().join("bus"),
        };
        let odometry = config["odometry"].as_table_mut().unwrap();
        odometry["buses"] = vec![bus.to_string()].into();
        let config = Config::parse(&toml::to_string(&config).unwrap(), &case.join("robot.toml"));
        let mut case = Self {
            robot: world.robot_of(&config.unwrap()),
            frames: coloc_drivers::can::Sender::open(&bus).unwrap(),
            wheels: WheelFrames::new(1e-4),
            receivers: Vec::new(),
            events,
            estimates: Vec::new(),
            status: Status::default(),
            lines: Vec::new(),
            world,
        };
        case.run();
        case
    }

    fn run(&mut self) {
        let begin_ns = self.world.time.read_boot();
        let mut events = std::mem::take(&mut self.events).into_iter().peekable();
        while events.peek().is_some() {
            let now_s = seconds(self.world.time.read_boot() - begin_ns);
            while let Some(event) = events.next_if(|event| event["t"].as_f64().unwrap() <= now_s) {
                self.happen(&event);
            }
            self.tick();
        }
        // The books of the last second.
        (0..=SECOND / PERIOD).for_each(|_| self.tick());
    }

    fn tick(&mut self) {
        let estimate = self.robot.tick();
        self.estimates.push(estimate);
        while let Some(event) = self.robot.link.next_event() {
            match event {
                Event::Account(ledger) => {
                    self.status = ledger.status;
                    self.robot.link.give_back(ledger);
                }
                Event::Timing(_) => {}
                event => self.lines.push(format!("{event:?}")),
            }
        }
    }

    fn happen(&mut self, event: &Value) {
        let number = |value: &Value| value.as_f64().unwrap();
        match event["do"].as_str().unwrap() {
            "wheels" => {
                let pair = self.wheels.encode(number(&event["l"]), number(&event["r"]));
                for frame in &pair {
                    self.frames.send(frame).unwrap();
                }
            }
            "frame" => self.frames.send(&frame(event)).unwrap(),
            "fix" => {
                let who = usize::try_from(event["who"].as_u64().unwrap_or(0)).unwrap();
                self.fix(who, &event["pos"], &event["cov"]);
            }
            "note" => {}
            other => panic!("what is {other}?"),
        }
    }

    fn fix(&mut self, who: usize, position: &Value, covariance: &Value) {
        while self.receivers.len() <= who {
            let publisher = self.world.publisher("r1");
            let sender = Sender::start(0, Clock::Realtime).unwrap();
            self.receivers.push((publisher, sender));
        }
        let (publisher, sender) = &mut self.receivers[who];
        let fix = Position {
            header: sender.header(self.world.time.realtime()),
            quality: 4,
            position: serde_json::from_value(position.clone()).unwrap(),
            covariance: serde_json::from_value(covariance.clone()).unwrap(),
            ..Position::default()
        };
        publisher.send(fix).unwrap();
    }

    fn receiver(&self) -> SourceHealth {
        let mut rows = self.status.sources();
        let row = rows.find(|(input, _)| *input == Input::Position);
        *row.expect("a row").1
    }

    fn last(&self) -> &Estimate {
        self.estimates.last().unwrap()
    }

    /// How long fixes were called `health` \[s\].
    fn seconds_of(&self, health: Health) -> f64 {
        let ticks = self.estimates.iter();
        let such = ticks.filter(|it| it.health_of(Input::Position) == health);
        seconds(PERIOD) * such.count() as f64
    }

    fn refused(&self) -> u64 {
        self.status.rejected[Input::Position as usize].iter().sum()
    }
}

fn seconds(nanos: i64) -> f64 {
    nanos as f64 * 1e-9
}

fn events(case: &Path) -> Vec<Value> {
    let script = std::fs::read_to_string(case.join("script.jsonl")).unwrap();
    let event = |line| serde_json::from_str(line).unwrap();
    script.lines().map(event).collect()
}

fn frame(event: &Value) -> Frame {
    let hex = event["data"].as_str().unwrap();
    let byte = |place| u8::from_str_radix(&hex[place..place + 2], 16).unwrap();
    let data: Vec<u8> = (0..hex.len()).step_by(2).map(byte).collect();
    let id = u16::try_from(event["id"].as_u64().unwrap()).unwrap();
    let id = Id::Standard(StandardId::new(id).unwrap());
    Frame::data_frame(id, &data).unwrap()
}

/// What the case's `make_script.py` writes, its fixes with an error of their σ now this way, now that.
fn straight_with_an_outage() -> Vec<Value> {
    let period = |k: i32| {
        let t = f64::from(k) / 50.0;
        let wheels = json!({"t": t, "do": "wheels", "l": t, "r": t});
        let has_fix = k % 10 == 0 && !(10.0..200.0).contains(&t);
        let [dx, dy] = [7, 5].map(|turns| f64::from(turns * k).sin() * f64::sqrt(2.0));
        let fix =
            json!({"t": t + 0.001, "do": "fix", "pos": [t + dx, dy], "cov": [1.0, 0.0, 0.0, 1.0]});
        [Some(wheels), has_fix.then_some(fix)]
    };
    (0..=239 * 50).flat_map(period).flatten().collect()
}

/// d² of the truth in the position's ellipse.
fn d2(estimate: &Estimate, truth: [f64; 2]) -> f64 {
    let [dx, dy] = [0, 1].map(|axis| estimate.pose[axis] - truth[axis]);
    let total = estimate.total();
    let (xx, xy, yy) = (total[0], total[1], total[4]);
    (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy)
}

/// χ² of two degrees of freedom, 95 %.
const INSIDE: f64 = 5.991;

#[test]
fn after_three_minutes_without_fixes_a_robot_on_defaults_knows_how_wrong_it_is() {
    let Some(cases) = cases() else { return };
    let case = Case::play_events(
        &cases.join("loc-outage-straight"),
        straight_with_an_outage(),
    );
    for second in [20, 60, 100, 150, 199] {
        let estimate = &case.estimates[usize::try_from(second * SECOND / PERIOD).unwrap()];
        let truth = [second as f64, 0.0];
        let sigma = [0, 4].map(|at| estimate.total()[at].sqrt());
        println!(
            "{second} s: {:?}, σ {sigma:?} m, d² {}",
            estimate.pose,
            d2(estimate, truth)
        );
        assert!(d2(estimate, truth) < INSIDE, "{second} s: {estimate:?}");
    }
}

/// The estimates up to the last that the wheels speak of.
fn driving(case: &Case) -> impl DoubleEndedIterator<Item = &Estimate> {
    let is_driving = |it: &&Estimate| it.health_of(Input::Odometry) == Health::Ok;
    case.estimates.iter().filter(is_driving)
}

/// Where the last fix was.
fn last_fix(events: &[Value]) -> [f64; 2] {
    let fix = events.iter().rev().find(|it| it["do"] == "fix").unwrap();
    [0, 1].map(|axis| fix["pos"][axis].as_f64().unwrap())
}

/// For so long after the last of them it stands, and its receiver says the same ten times a second.
fn stands_on(mut events: Vec<Value>, until_s: f64) -> Vec<Value> {
    let fix = events
        .iter()
        .rev()
        .find(|it| it["do"] == "fix")
        .unwrap()
        .clone();
    let wheels = events
        .iter()
        .rev()
        .find(|it| it["do"] == "wheels")
        .unwrap()
        .clone();
    let begin_s = events.last().unwrap()["t"].as_f64().unwrap();
    for period in 1.. {
        let t = begin_s + 0.02 * f64::from(period);
        if t > until_s {
            break;
        }
        let mut at = |event: &Value| {
            let mut event = event.clone();
            event["t"] = t.into();
            events.push(event);
        };
        at(&wheels);
        if period % 5 == 0 {
            at(&fix);
        }
    }
    events
}

/// States one after another, each with the second in which it began.
fn states(case: &Case) -> Vec<(f64, BeliefState)> {
    let mut states: Vec<(f64, BeliefState)> = Vec::new();
    for (at, estimate) in driving(case).enumerate() {
        let is_new = states
            .last()
            .is_none_or(|(_, last)| *last != estimate.state());
        if is_new {
            states.push((at as f64 * PERIOD as f64 / SECOND as f64, estimate.state()));
        }
    }
    states
}

/// Every word about a belief that all fixes contradict says so.
fn assert_contradicted(case: &Case) {
    let contradicted = |it: &&Estimate| it.state() == BeliefState::Contradicted;
    for estimate in driving(case).filter(contradicted) {
        assert!(!estimate.is_fit());
        assert_eq!(estimate.health_of(Input::Position), Health::Refused);
    }
    let row = case.receiver();
    assert!(row.rejected > 0 && row.accepted > 0, "{row:?}");
    for said in [
        "to: Refused",
        "to: Contradicted",
        "gated: Some(Gated",
        "Dissent",
    ] {
        let lines = &case.lines;
        assert!(
            lines.iter().any(|it| it.contains(said)),
            "{said}: {lines:?}"
        );
    }
}

/// A start that was never confirmed gives way after three seconds.
#[test]
fn a_start_that_is_a_kilometre_off_is_noticed_and_the_robot_finds_itself() {
    let Some(cases) = cases() else { return };
    let folder = cases.join("loc-far-start");
    let case = Case::play_events(&folder, events(&folder));
    assert_contradicted(&case);
    let states = states(&case);
    let [
        ..,
        (noticed_s, BeliefState::Contradicted),
        (found_s, BeliefState::Ok),
    ] = states[..]
    else {
        panic!("{states:?}");
    };
    assert!(noticed_s < 3.0 && found_s < 15.0, "{states:?}");
    let last = driving(&case).next_back().unwrap();
    let truth = [1000.0 + last.odometry[0], 500.0];
    assert!(d2(last, truth) < INSIDE, "{last:?}, {truth:?}");
    let followed = case.lines.iter().any(|it| it.contains("Followed"));
    assert!(followed, "{:?}", case.lines);
}

/// Who was moved while it stood may have been turned: its position is known, its heading open until it drives.
#[test]
fn a_robot_that_was_pushed_on_its_dock_knows_its_position_and_not_its_heading() {
    let Some(cases) = cases() else { return };
    let folder = cases.join("loc-rtk-dock");
    let events = stands_on(events(&folder), 25.0);
    let truth = last_fix(&events);
    let case = Case::play_events(&folder, events);
    assert_contradicted(&case);
    let states = states(&case);
    let [
        ..,
        (noticed_s, BeliefState::Contradicted),
        (dropped_s, BeliefState::Finding),
    ] = states[..]
    else {
        panic!("{states:?}");
    };
    assert!(noticed_s < 5.0 && dropped_s < 20.0, "{states:?}");
    let last = driving(&case).next_back().unwrap();
    assert!(
        d2(last, truth) < INSIDE && last.total()[8] > 3.0,
        "{last:?}"
    );
}

#[test]
fn two_receivers_are_both_used() {
    let Some(case) = Case::play("loc-two-receivers") else {
        return;
    };
    assert_eq!(case.refused(), 0);
    assert_eq!(case.status.accepted_of(Input::Position), 65);
    assert!(case.seconds_of(Health::Refused) < seconds(PERIOD));
}

#[test]
fn a_fix_that_claims_to_be_perfect_is_refused_and_changes_nothing() {
    let Some(case) = Case::play("loc-zero-cov") else {
        return;
    };
    let refused = case
        .status
        .rejected_of(Input::Position, Reject::NoCovariance);
    assert_eq!(refused, 10);
    assert_eq!(case.refused(), refused, "every honest one passes");
}

#[test]
fn no_velocity_is_ever_above_the_limit() {
    for case in ["enc-burst-silence", "enc-sna", "loc-far-start"] {
        let Some(case) = Case::play(case) else { return };
        for estimate in &case.estimates {
            let [v, _, omega] = estimate.velocity;
            let fastest = v.abs() + omega.abs() * 0.3 / 2.0;
            assert!(fastest <= 2.0 * (1.0 + 1e-9), "{fastest} m/s");
        }
    }
}

#[test]
fn not_available_is_no_standstill() {
    let Some(case) = Case::play("enc-sna") else {
        return;
    };
    let at = |second: i64| &case.estimates[usize::try_from(second * SECOND / PERIOD).unwrap()];
    let sigma = |estimate: &Estimate| estimate.total()[0].sqrt();
    // It drives at 1 m/s all the time.
    for (second, way_m) in (1..6).zip([1.0, 2.0, 3.0, 4.0, 5.0]) {
        let error_m = at(second).pose[0] - way_m;
        println!("{second} s: {error_m} m, σ {} m", sigma(at(second)));
        assert!(error_m.abs() < 3.0 * sigma(at(second)), "{error_m} m");
    }
    assert!(sigma(at(3)) > sigma(at(2)));
    assert_ne!(at(3).health_of(Input::Odometry), Health::Ok);
    // The counters bridge the gap.
    let last = case.last();
    assert!((last.pose[0] - 6.0).abs() < 3.0 * sigma(last), "{last:?}");
}
