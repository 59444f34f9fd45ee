//! A gyro beside the wheels, from a CAN signal and from its channel: its bias is learnt, wheels that slip are named, a daemon that is
//! started again knows the bias, and the recording plays to the same bits.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

mod support;

use std::time::{Duration, Instant};

use coloc_daemon::config::Config;
use coloc_daemon::estimate::{places, settings_knowing};
use coloc_daemon::record::{Recording, Step};
use coloc_drivers::can::{BusSpec, Frame, Sender as BusSender, StandardId};
use coloc_drivers::encoder::WheelFrames;
use coloc_estimator::{Belief, Estimator, Measurement, step};
use coloc_shm_types::{
    Clock, Estimate, Gyro, Header, Heading, Health, Input, Position, Publisher, Sender,
};
use support::{Site, wait_for};

/// What it reads when nothing turns \[rad/s\].
const BIAS_RADPS: f64 = 0.035;
const METRES_PER_TICK: f64 = 1e-5;
const PERIOD: Duration = Duration::from_millis(5);
/// A gyro on the bus says degrees in steps of so much.
const STEP_DEG: f64 = 0.01;

const IMU: &str =
    "BO_ 513 Imu: 8 Imu\n SG_ YawRate : 0|16@1- (0.01,0) [-300|300] \"deg/s\" Colocd\n";

const LINES: &str = "[initial]\npose = [0.0, 0.0, 0.0]\nresume = true\n[telemetry]\nstate_hz = 50\nrecord = \"{at}/record.jsonl\"\n\
    [gyro]\nrate_hz = 200\nnoise_density = 1e-3\n";

/// With wheels on a bus, and a gyro that is heard there or on its channel.
fn site(source: &str) -> Site {
    let site = Site::new("robot1", &format!("{LINES}{source}\n"));
    let wheels = include_str!("../../drivers/coloc.dbc");
    let (before, after) = wheels.split_once("CM_").unwrap();
    let dbc = format!("{before}{IMU}\nCM_{after}");
    std::fs::write(site.path("base.dbc"), dbc).unwrap();
    let odometry = "[odometry]\ndbc = \"base.dbc\"\n";
    let config = site.config().replace("[odometry]\n", odometry);
    std::fs::write(site.config_path(), config).unwrap();
    site
}

/// Wheels, gyro, compass and receiver of a robot on the spot.
struct Base {
    bus: BusSender,
    frames: WheelFrames,
    /// If that is where it is heard.
    gyro: Option<Publisher<Gyro>>,
    compass: Publisher<Heading>,
    receiver: Publisher<Position>,
    senders: [Sender; 3],
}

impl Base {
    fn new(site: &Site, on_channel: bool) -> Self {
        let (space, robot) = (site.space(), site.robot());
        // The bus has a place for each who listens.
        site.drive();
        let sender = || Sender::start(0, Clock::Realtime).unwrap();
        Self {
            bus: BusSender::open(&BusSpec::Local {
                directory: site.bus(),
            })
            .unwrap(),
            frames: WheelFrames::new(METRES_PER_TICK),
            gyro: on_channel.then(|| space.publisher(&robot).unwrap()),
            compass: space.publisher(&robot).unwrap(),
            receiver: space.publisher(&robot).unwrap(),
            senders: [sender(), sender(), sender()],
        }
    }

    /// For so many samples of the gyro, which reads so much beside its bias, while the wheels do not turn.
    fn stand(&mut self, samples: u32, turn_radps: f64) {
        let start = Instant::now();
        for index in 1..=samples {
            std::thread::sleep((start + PERIOD * index).saturating_duration_since(Instant::now()));
            self.turn(BIAS_RADPS + turn_radps);
            if index.is_multiple_of(4) {
                for frame in self.frames.encode(0.0, 0.0) {
                    self.bus.send(&frame).unwrap();
                }
            }
            if index.is_multiple_of(20) {
                self.speak();
            }
        }
    }

    #[allow(clippy::cast_possible_truncation)] // Some degrees.
    fn turn(&mut self, rate_radps: f64) {
        let header = self.senders[0].header(now_ns());
        if let Some(gyro) = &self.gyro {
            let sample = Gyro {
                header,
                rate_radps,
                ..Gyro::default()
            };
            gyro.send(sample).unwrap();
            return;
        }
        let raw = (rate_radps.to_degrees() / STEP_DEG).round() as i16;
        let mut data = [0; 8];
        data[..2].copy_from_slice(&raw.to_le_bytes());
        let id = StandardId::new(513).unwrap();
        self.bus
            .send(&Frame::data_frame(id, &data).unwrap())
            .unwrap();
    }

    /// A heading and a fix.
    fn speak(&mut self) {
        let [_, compass, receiver] = &mut self.senders;
        let header = |sender: &mut Sender| -> Header { sender.header(now_ns()) };
        let looks = Heading {
            header: header(compass),
            quality: 1,
            variance: 0.01,
            ..Heading::default()
        };
        self.compass.send(looks).unwrap();
        let fix = Position {
            header: header(receiver),
            quality: 4,
            covariance: [0.01, 0.0, 0.0, 0.01],
            lever_m: [0.2, 0.1],
            slow_sigma_m: 0.1,
            slow_time_s: 10.0,
            position: [0.2, 0.1],
            ..Position::default()
        };
        self.receiver.send(fix).unwrap();
    }
}

fn now_ns() -> i64 {
    let now = std::time::SystemTime::now();
    let since = now.duration_since(std::time::UNIX_EPOCH).unwrap();
    i64::try_from(since.as_nanos()).unwrap()
}

/// Off by less than 3 σ, and less than a step of the signal beside.
fn is_found(estimate: &Estimate) -> bool {
    let off = (estimate.gyro_bias_radps - BIAS_RADPS).abs();
    let sigma = estimate.gyro_bias_sigma_radps;
    sigma > 0.0 && sigma < 2e-3 && off < 3.0 * sigma + STEP_DEG.to_radians()
}

fn bits(belief: &Belief) -> Vec<u64> {
    let pose = belief.pose.to_vector();
    let parts = [belief.parts.independent, belief.parts.dependent].map(|it| it.to_row_major());
    let all = pose.iter().chain(parts.as_flattened());
    all.copied()
        .chain(belief.bend.to_array())
        .map(f64::to_bits)
        .collect()
}

/// Plays it again to the same bits; how much of a gyro, of wheels, headings and fixes was in it.
fn replay(recording: &Recording, config: &Config) -> [usize; 4] {
    let settings = settings_knowing(config, recording.gyro);
    let places = places(&settings, config.history.capacity);
    let mut estimator = Estimator::starting(settings, recording.stamp, &recording.start, places);
    assert_eq!(recording.gaps.ticks, 0);
    let mut counts = [0; 4];
    for tick in &recording.ticks {
        let played = match tick.step {
            Step::Behind => estimator.extrapolated(tick.stamp),
            Step::Own | Step::Ahead => step(&mut estimator, &tick.inputs()).estimate,
        };
        assert_eq!(bits(&played.belief), bits(&tick.belief), "{}", tick.tick);
        for measurement in &tick.measurements {
            let kind = match measurement {
                Measurement::Gyro(_) => 0,
                Measurement::Odometry(_) => 1,
                Measurement::Heading(_) => 2,
                Measurement::Fix(_) => 3,
                _ => continue,
            };
            counts[kind] += 1;
        }
    }
    counts
}

/// Whoever waits meanwhile waits for a robot that goes on standing.
fn until(site: &Site, base: &mut Base, what: &str, holds: impl Fn(&Estimate) -> bool) -> Estimate {
    let estimates = site.space().subscriber::<Estimate>(&site.robot()).unwrap();
    let mut last = None;
    wait_for(what, || {
        base.stand(4, 0.0);
        last = estimates.receive().unwrap().or(last);
        last.filter(&holds).ok_or(last.map(|it| it.gyro_bias_radps))
    })
}

fn learns_names_and_remembers(source: &str, on_channel: bool) {
    let site = site(source);
    let config = Config::load(&site.config_path()).unwrap();
    let mut daemon = site.start();
    let mut base = Base::new(&site, on_channel);
    let ok = |it: &Estimate| it.health_of(Input::Gyro) == Health::Ok && is_found(it);
    let known = until(&site, &mut base, "a bias that is known", ok);
    let estimates = site.listen();
    // The wheels stand still and the robot turns.
    base.stand(100, 1.0);
    let slips = |it: &Estimate| {
        it.health_of(Input::Odometry) == Health::Faulty && it.pose[2] - known.pose[2] > 0.3
    };
    estimates.until("wheels that slip", slips);
    let holds = |it: &Estimate| it.health_of(Input::Odometry) == Health::Ok;
    until(&site, &mut base, "wheels that hold again", holds);
    let status = site.status_until("a status", |it| it.gyro_bias_sigma_radps > 0.0);
    assert!((status.gyro_bias_radps - BIAS_RADPS).abs() < 0.01);
    assert!(status.accepted_of(Input::Gyro) > 100);
    site.saved_until("a saved bias", |saved| {
        saved.gyro.is_some_and(|[_, sigma]| sigma < 2e-3)
    });
    daemon.terminate();

    let mut again = site.start();
    let before = known.header.session;
    let first = site
        .listen()
        .until("the next session", |it| it.header.session != before);
    assert!(is_found(&Estimate {
        gyro_bias_sigma_radps: first.gyro_bias_sigma_radps / 2.0,
        ..first
    }));
    base.stand(40, 0.0);
    again.terminate();

    let read = |name: &str| Recording::read(&site.path(name)).unwrap();
    let [turns, wheels, headings, fixes] = replay(&read("record.jsonl"), &config);
    assert!(turns > 100 && wheels > 20 && headings > 3 && fixes > 3);
    let second = read("record.jsonl.1");
    let [bias, _] = second.gyro.unwrap();
    assert!((bias - BIAS_RADPS).abs() < 0.01);
    let [turns, ..] = replay(&second, &config);
    assert!(turns > 3);
}

#[test]
fn a_gyro_on_its_channel() {
    learns_names_and_remembers("source = \"channel\"", true);
}

#[test]
fn a_gyro_on_the_bus() {
    let signal =
        "signal = { message = \"Imu\", signal = \"YawRate\", unit = \"degrees_per_second\" }";
    learns_names_and_remembers(&format!("source = \"can\"\n{signal}"), false);
}
