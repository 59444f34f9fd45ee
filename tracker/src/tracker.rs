//! All tracks of this robot, on the time line of its computer.

use std::collections::BTreeMap;

use coloc_daemon::config::{self, Config};
use coloc_estimator::{Pose, RobotId, Stamp};
use coloc_sensors::{Hearing, Moment, Report};
use coloc_shm_types::{self as shm, Clock, Estimate, Sessions, Tracked};
use coloc_track::manager::{MOST_TRACKS, Odometry};
use coloc_track::{
    Core, Increment, MOST_SENSORS, Manager, Published, Rate, Reading, Seen, Sensor, Sensors,
    Sighting, SlowErrors, State, Status, Track, publish,
};
use nalgebra::{Matrix3, Vector3};

use crate::feed::{Fed, Feed};
use crate::refusal::Refusal;
use crate::section;
use crate::way::Way;

/// A longer step is taken in pieces: velocities are held over one \[ns\].
const PIECE_NS: i64 = 50_000_000;

/// After a longer silence of this robot's `colocd` it is as if nothing had been known \[ns\].
const LONGEST_SILENCE_NS: i64 = 10_000_000_000;

/// So many sightings wait for their moment at most.
const MOST_WAITING: usize = 4096;

/// Names of the figures in the driver's status, in their order.
pub const FIGURES: [&str; 4] = ["tracks", "confirmed", "coasted", "headings"];

/// At which bearing this robot saw another one: for that one's tracks.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Bearing {
    /// Who was seen.
    pub to: u16,
    /// When, by `CLOCK_BOOTTIME` of this computer.
    pub at_ns: i64,
    /// In the body frame \[rad\].
    pub bearing_rad: f64,
    /// Of all its errors \[rad²\].
    pub variance: f64,
}

/// How this robot moved, for all others' tracks.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Moved {
    /// Begin and end, by `CLOCK_BOOTTIME` of this computer.
    pub span_ns: [i64; 2],
    /// By its own wheels.
    pub increment: Increment,
}

/// It.
#[derive(Debug)]
pub struct Tracker {
    team: Vec<u16>,
    section: section::Track,
    mounts: config::Sighting,
    reference_s: f64,
    manager: Manager<Vec<Option<Track>>>,
    /// Where the tracks are in time; `None` before the first step.
    at_ns: Option<i64>,
    sensors: Vec<(u16, Sensor)>,
    session: u64,
    own_way: Way,
    ways: BTreeMap<u16, Way>,
    waiting: Vec<Sighting>,
    /// What `colocd` hears by way of it, if it does.
    feed: Option<Feed>,
    hearing: Hearing<Refusal>,
    told_ns: Option<i64>,
    remarks: Vec<String>,
}

/// Kinds of messages, for [`Hearing`].
const SIGHTINGS: usize = 0;
const INCREMENTS: usize = 1;

impl Tracker {
    /// Of the robot of a configuration.
    #[must_use]
    pub fn new(config: &Config, section: &section::Track) -> Self {
        let team: Vec<u16> = config.peers().map(|it| it.id).collect();
        let speakers = [Sessions::SENSORS, team.len().max(1)];
        let robots: Vec<u16> = team.iter().copied().chain([config.robot.id]).collect();
        Self {
            section: section.clone(),
            mounts: config.sighting.clone(),
            reference_s: config.motion.reference_period_s,
            manager: manager(section, &team, &[], 0),
            at_ns: None,
            sensors: Vec::new(),
            session: 0,
            own_way: Way::default(),
            ways: team.iter().map(|it| (*it, Way::default())).collect(),
            waiting: Vec::new(),
            feed: config.sighting.through_track.then(Feed::default),
            hearing: Hearing::new(config.robot.id, robots.clone(), &speakers),
            told_ns: None,
            team: robots,
            remarks: Vec::new(),
        }
    }

    /// This robot's `colocd` says how its wheels took it. Of another daemon the frame of the wheels begins anew.
    pub fn hear_estimate(&mut self, estimate: &Estimate, now: Moment) {
        // Whatever clock the robot speaks by, it says the same moment by this one.
        let header = shm::Header {
            stamp_ns: estimate.boot_ns,
            clock: Clock::Boottime as u8,
            ..estimate.header
        };
        let own = Estimate {
            header,
            ..*estimate
        };
        let checked = self.hearing.check(now, |limits| own.validate(limits));
        if checked.is_none() {
            return;
        }
        if self.session != estimate.header.session {
            self.session = estimate.header.session;
            self.own_way = Way::default();
            self.told_ns = None;
        }
        let per_s = Matrix3::from_row_slice(&estimate.velocity_covariance) * self.reference_s;
        let pose = Vector3::from(estimate.odometry);
        self.own_way.at(estimate.boot_ns, pose, &per_s);
    }

    /// A sensor of this robot saw something. What the robot seen should know of it, if anything.
    pub fn hear_sighting(&mut self, message: &shm::Sighting, now: Moment) -> Option<Bearing> {
        if [shm::Sighting::LANDMARK, shm::Sighting::PASSED_ON].contains(&message.who) {
            return None;
        }
        self.hearing
            .check(now, |limits| message.validate_of_robot(limits))?;
        let at_ns = self.hearing.accept(SIGHTINGS, &message.header, now)?;
        let Some(sensor) = self.sensor(message) else {
            self.pass_on(message);
            return None;
        };
        let id = (message.who == shm::Sighting::ROBOT).then_some(RobotId(message.observed));
        let seen = Seen::Neighbour {
            id,
            sensor,
            reading: reading(message),
        };
        if !self.wait(at_ns, message.header.sequence, seen) {
            self.pass_on(message);
        } else if let (Some(feed), Some(_)) = (&mut self.feed, id) {
            feed.hold(at_ns, sensor, message);
        }
        let mount = self.mount_of(message);
        let (bearing_rad, variance) = bearing(message, &mount)?;
        Some(Bearing {
            to: id?.0,
            at_ns,
            bearing_rad,
            variance,
        })
    }

    /// Another robot says how it moved, or at which bearing it saw this one.
    pub fn hear_increment(&mut self, message: &shm::Increment, now: Moment) {
        let checked = self.hearing.check(now, |limits| message.validate(limits));
        let at_ns = checked.and_then(|()| self.hearing.accept(INCREMENTS, &message.header, now));
        let Some(at_ns) = at_ns else {
            return;
        };
        let source = message.header.source;
        let way = self.ways.get_mut(&source).filter(|_| message.has_motion());
        if let Some(way) = way {
            let took_ns = message.header.stamp_ns.saturating_sub(message.start_ns);
            let increment = Increment {
                displacement: message.displacement.into(),
                covariance: Matrix3::from_row_slice(&message.covariance),
            };
            way.moved(at_ns.saturating_sub(took_ns), at_ns, &increment);
        }
        if message.has_bearing() {
            let seen = Seen::Reciprocal {
                id: RobotId(source),
                bearing_rad: message.bearing,
                variance: message.bearing_variance,
            };
            self.wait(at_ns, message.header.sequence, seen);
        }
    }

    /// Which of the sensors it is. With a new one all tracks begin anew, because its slow errors are a part of them.
    fn sensor(&mut self, message: &shm::Sighting) -> Option<u16> {
        let source = message.header.source;
        let known = self.sensors.iter().position(|(it, _)| *it == source);
        let place = known.or_else(|| self.new_sensor(source, message))?;
        u16::try_from(place).ok()
    }

    fn new_sensor(&mut self, source: u16, message: &shm::Sighting) -> Option<usize> {
        let place = self.sensors.len();
        if place == MOST_SENSORS {
            self.hearing.refuse(Refusal::Sensors);
            return None;
        }
        let sensor = Sensor {
            mount: self.mount_of(message),
            slow: slow(message),
        };
        self.sensors.push((source, sensor));
        self.begin(self.at_ns.unwrap_or_default());
        self.remarks.push(format!("sensor {source} is heard"));
        Some(place)
    }

    fn begin(&mut self, at_ns: i64) {
        self.manager = manager(&self.section, &self.team, &self.sensors, at_ns);
    }

    fn mount_of(&self, message: &shm::Sighting) -> Pose {
        let mut entries = self.mounts.sensor.iter();
        let own = entries.find(|it| it.source == message.header.source);
        let [x, y, phi] = if message.mount.iter().all(|it| *it == 0.0) {
            own.map_or(self.mounts.mount, |it| it.mount)
        } else {
            message.mount
        };
        Pose::new(x, y, phi)
    }

    /// What the tracks cannot use may be of use to `colocd`.
    fn pass_on(&mut self, message: &shm::Sighting) {
        if let Some(feed) = &mut self.feed {
            feed.pass_on(message);
        }
    }

    /// Whether it is taken in when its moment comes.
    fn wait(&mut self, at_ns: i64, sequence: u64, seen: Seen) -> bool {
        let is_over = self.at_ns.is_some_and(|now_ns| at_ns < now_ns);
        if is_over || self.waiting.len() >= MOST_WAITING {
            self.hearing.refuse(Refusal::Late);
            return false;
        }
        self.waiting.push(Sighting {
            stamp: Stamp::from_nanos(at_ns),
            sequence,
            seen,
        });
        true
    }

    /// Takes the tracks to as far behind the present as they are to be.
    pub fn step(&mut self, now: Moment) {
        let until_ns = now.boottime_ns.saturating_sub(nanos(self.section.delay_s));
        let begun = self.at_ns;
        let mut at_ns = begun
            .filter(|it| until_ns.saturating_sub(*it) <= LONGEST_SILENCE_NS)
            .unwrap_or_else(|| {
                self.begin(until_ns);
                until_ns
            });
        while at_ns < until_ns {
            let next_ns = until_ns
                .min(at_ns.saturating_add(PIECE_NS))
                .min(self.next_fed_ns(at_ns).unwrap_or(i64::MAX));
            self.piece(at_ns, next_ns);
            at_ns = next_ns;
        }
        self.at_ns = Some(at_ns);
    }

    fn piece(&mut self, from_ns: i64, to_ns: i64) {
        let until = Stamp::from_nanos(to_ns);
        let mut due: Vec<Sighting> = Vec::new();
        self.waiting.retain(|it| {
            let is_due = it.stamp <= until;
            due.extend(is_due.then_some(*it));
            !is_due
        });
        let ways = self.ways.iter();
        let neighbours: Vec<(RobotId, Rate)> = ways
            .filter_map(|(id, way)| Some((RobotId(*id), way.rate(from_ns, to_ns)?)))
            .collect();
        let odometry = Odometry {
            observer: self.own_way.rate(from_ns, to_ns),
            neighbours: &neighbours,
        };
        let mut refused: Vec<Refusal> = Vec::new();
        let feed = &mut self.feed;
        let tell = |it: &Sighting, verdict| {
            refused.extend(Refusal::of(verdict));
            if let Some(feed) = feed {
                feed.judged(it, verdict);
            }
        };
        self.manager.step(until, &odometry, &mut due, tell);
        for refusal in refused {
            self.hearing.refuse(refusal);
        }
        if let Some(feed) = &mut self.feed {
            let manager = &self.manager;
            feed.tell(until, |id| manager.tracks().find(|it| it.id.0 == id));
        }
    }

    /// A pose of a track is of the moment of what was seen, so the tracks stop there.
    fn next_fed_ns(&self, at_ns: i64) -> Option<i64> {
        self.feed.as_ref()?.next_ns(at_ns)
    }

    /// What `colocd` is to hear by way of it, since it was last asked.
    pub fn fed(&mut self) -> Vec<Fed> {
        self.feed.as_mut().map(Feed::take).unwrap_or_default()
    }

    /// What may be told of the tracks, and when they are of; headers are the sender's.
    pub fn told(&self) -> impl Iterator<Item = (i64, Tracked)> + '_ {
        let at_ns = self.at_ns.unwrap_or_default();
        let all = self.manager.tracks().filter_map(tracked);
        all.map(move |it| (at_ns, it))
    }

    /// How this robot moved since that was last asked, if that is long enough ago.
    pub fn moved(&mut self) -> Option<Moved> {
        let end_ns = self.own_way.end_ns()?;
        let start_ns = *self.told_ns.get_or_insert(end_ns);
        if end_ns.saturating_sub(start_ns) < nanos(self.section.period_s) {
            return None;
        }
        self.told_ns = Some(end_ns);
        let increment = self.own_way.between(start_ns, end_ns)?;
        Some(Moved {
            span_ns: [start_ns, end_ns],
            increment,
        })
    }

    /// A message went out, or did not.
    pub fn note_said(&mut self, at_ns: i64, is_taken: bool) {
        if is_taken {
            self.hearing.note_said(at_ns);
        } else {
            self.hearing.refuse(Refusal::Channel);
        }
    }

    /// What it has to tell of itself.
    #[must_use]
    pub fn report(&self) -> Report {
        let count = |is: &dyn Fn(&Track) -> bool| -> f64 {
            let number = self.manager.tracks().filter(|it| is(it)).count();
            u16::try_from(number).map_or(f64::NAN, f64::from)
        };
        let nan = f64::NAN;
        self.hearing.report([
            count(&|_| true),
            count(&|it| it.status == Status::Confirmed),
            count(&|it| it.status == Status::Coasted),
            count(&|it| it.state.core == Core::Heading),
            nan,
            nan,
            nan,
            nan,
        ])
    }

    /// What a person should hear, since it was last asked.
    pub fn remarks(&mut self) -> Vec<String> {
        let refused = self.hearing.fresh();
        self.remarks
            .extend(refused.into_iter().map(|it| it.said().into()));
        std::mem::take(&mut self.remarks)
    }
}

fn manager(
    section: &section::Track,
    team: &[u16],
    sensors: &[(u16, Sensor)],
    at_ns: i64,
) -> Manager<Vec<Option<Track>>> {
    let list: Vec<Sensor> = sensors.iter().map(|(_, it)| *it).collect();
    let places = vec![None; team.len().clamp(1, MOST_TRACKS)];
    // As many as there is room for: whoever adds one has looked.
    let sensors = Sensors::new(&list).unwrap_or_default();
    Manager::new(section.config(), sensors, Stamp::from_nanos(at_ns), places)
}

fn slow(message: &shm::Sighting) -> Option<SlowErrors> {
    let [range_sigma, range_tau_s, bearing_sigma, bearing_tau_s] = message.slow;
    let lasting = |sigma: f64, tau_s: f64| if sigma > 0.0 { tau_s } else { 1.0 };
    (range_sigma > 0.0 || bearing_sigma > 0.0).then(|| SlowErrors {
        range_sigma,
        range_tau_s: lasting(range_sigma, range_tau_s),
        bearing_sigma,
        bearing_tau_s: lasting(bearing_sigma, bearing_tau_s),
    })
}

/// Of a message that was checked: it has one of them at least.
fn reading(message: &shm::Sighting) -> Reading {
    let (range_m, bearing_rad, white) = (message.range, message.bearing, message.white);
    match (message.has_range(), message.has_bearing()) {
        (true, false) => Reading::Range {
            range_m,
            white: white[0],
        },
        (false, _) => Reading::Bearing {
            bearing_rad,
            white: white[1],
        },
        (true, true) => Reading::RangeBearing {
            range_m,
            bearing_rad,
            white,
        },
    }
}

/// From the body's middle, with the variance of all its errors. From a sensor off the middle that takes the range too.
fn bearing(message: &shm::Sighting, mount: &Pose) -> Option<(f64, f64)> {
    let [_, _, slow, _] = message.slow;
    let variance = message.white[1] + slow * slow;
    let azimuth = message.bearing + mount.phi;
    let is_central = mount.x == 0.0 && mount.y == 0.0;
    let seen_at = if is_central {
        azimuth
    } else {
        let (sin, cos) = azimuth.sin_cos();
        let [x, y] = [mount.x + message.range * cos, mount.y + message.range * sin];
        y.atan2(x)
    };
    let is_known = message.has_bearing() && (is_central || message.has_range());
    is_known.then(|| (coloc_estimator::angle::wrap(seen_at), variance))
}

fn tracked(track: &Track) -> Option<Tracked> {
    let (has, pose, covariance) = match publish(track) {
        Published::Nothing => return None,
        Published::Position(state) => {
            let (pose, covariance) = position_alone(&state);
            (Tracked::POSITION, pose, covariance)
        }
        Published::Pose(state) => {
            let (pose, covariance) = state.relative_pose();
            (Tracked::POSITION | Tracked::HEADING, pose, covariance)
        }
    };
    Some(Tracked {
        observed: track.id.0,
        has,
        status: match track.status {
            Status::Coasted => Tracked::COASTED,
            Status::Tentative | Status::Confirmed => Tracked::CONFIRMED,
        },
        seen_ns: track.last.as_nanos(),
        pose,
        covariance: std::array::from_fn(|it| covariance[(it / 3, it % 3)]),
        ..Tracked::default()
    })
}

fn position_alone(state: &State) -> ([f64; 3], Matrix3<f64>) {
    let mut covariance = Matrix3::zeros();
    let mut block = covariance.fixed_view_mut::<2, 2>(0, 0);
    block.copy_from(&state.position_covariance());
    let position = state.position();
    ([position.x, position.y, 0.0], covariance)
}

/// Of seconds that were checked with the configuration.
#[allow(clippy::cast_possible_truncation)]
fn nanos(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}
