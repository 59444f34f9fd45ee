//! Everything around one robot: its wheels, its sensors, four neighbours and whoever listens.
//!
//! Open them before the robot: then everything is connected when it starts, and its first tick maps no memory.
//!
//! ```
//! # use coloc_daemon::config::Trigger;
//! # use coloc_shm_types::Space;
//! # use coloc_tests::surroundings::{Surroundings, config};
//! let directory = tempfile::tempdir().unwrap();
//! let config = config(directory.path(), Trigger::Timer);
//! let space = Space::open(&config.shm.root, &config.shm.prefix, "test").unwrap();
//! let mut surroundings = Surroundings::new(directory.path(), &space);
//! surroundings.send();
//! assert_eq!(surroundings.receive().estimates, 0);
//! ```

use std::ops::AddAssign;
use std::path::Path;

use coloc_daemon::config::{
    Assist as Carried, Config, History, Member, Robot, Shm, Sighting as Part, Tick, Trigger,
};
use coloc_drivers::can::{BusSpec, Frame, Sender};
use coloc_drivers::encoder::{OdometryConfig, WheelFrames};
use coloc_shm_types::{
    Answer, Assist, AssistAck, Clock, Estimate, Gyro, Header, Heading, Message, Neighbour, Pose,
    Position, Publisher, RelativePose, RobotName, Seen, Sighting, Space, Subscriber,
};
use rustix::time::{ClockId, clock_gettime};

/// Distance between the wheels \[m\].
pub const TRACK_M: f64 = 0.3;
const METRES_PER_TICK: f64 = 1e-4;
/// Team numbers of the neighbours; the robot is number 1.
const NEIGHBOURS: [u16; 4] = [2, 3, 4, 5];
/// How far they are from the robot, each in its own direction \[m\].
const DISTANCE_M: f64 = 2.0;

/// From one event of leaders and children to the next.
const EVENT_NS: i64 = 20_000_000;
const EVENT_S: f64 = 0.02;

/// From one word of the gyro to the next.
const TURN_NS: i64 = 5_000_000;

/// The robot's: number 1 of five, with its bus, its shared memory and its files below `directory`; 500 Hz.
#[must_use]
pub fn config(directory: &Path, trigger: Trigger) -> Config {
    let name = |id: u16| RobotName::new(&format!("robot{id}")).unwrap();
    let member = |id| Member { name: name(id), id };
    let bus = BusSpec::Local {
        directory: directory.join("bus"),
    };
    Config {
        team: NEIGHBOURS.map(member).into(),
        tick: Tick {
            rate_hz: 500.0,
            trigger,
            ..Tick::default()
        },
        history: History {
            length_s: 0.1,
            ..History::default()
        },
        shm: Shm {
            root: directory.join("shm"),
            prefix: "test".into(),
            ..Shm::default()
        },
        odometry: Some(OdometryConfig::differential(
            bus,
            TRACK_M,
            METRES_PER_TICK,
            5.0,
        )),
        ..Config::of(Robot {
            name: name(1),
            id: 1,
        })
    }
}

/// The same, of a robot that takes part in the exchange of what is seen in part.
#[must_use]
pub fn config_in_part(directory: &Path, trigger: Trigger) -> Config {
    Config {
        sighting: Part {
            heard: true,
            ..Part::default()
        },
        ..config(directory, trigger)
    }
}

/// The same, of a robot that two leaders carry; the other two are children as it is, and it sees them.
#[must_use]
pub fn config_carried(directory: &Path, trigger: Trigger) -> Config {
    let [first, second, near, far] = NEIGHBOURS;
    Config {
        assist: Carried {
            leaders: vec![first, second],
            children: vec![1, near, far],
            period_s: EVENT_S,
            ack_timeout_ms: 20,
            close_after_ms: 60,
            ..Carried::default()
        },
        ..config(directory, trigger)
    }
}

/// What leaders and children say of the robot, and who listens to what it hands on and answers.
#[derive(Debug)]
struct Carriers {
    data: Publisher<Assist>,
    answers: Publisher<AssistAck>,
    told: Vec<Subscriber<Assist>>,
    answered: Vec<Subscriber<AssistAck>>,
}

/// What four neighbours say and answer, and who listens to what they are told, of what is seen in part.
#[derive(Debug)]
struct Parts {
    camera: Publisher<Sighting>,
    seen: Vec<Publisher<Seen>>,
    answers: Vec<Publisher<Answer>>,
    told: Vec<Subscriber<Seen>>,
    answered: Vec<Subscriber<Answer>>,
    /// The stamp of the sightings before, and the number of the first of them.
    asked: Option<(i64, u64)>,
}

/// All that talks to the robot and listens to it.
#[derive(Debug)]
pub struct Surroundings {
    /// Where the frames go.
    pub bus: BusSpec,
    wheels: Sender,
    frames: WheelFrames,
    laser: Publisher<RelativePose>,
    receiver: Publisher<Position>,
    map: Publisher<Pose>,
    /// Once they have spoken: most robots have none.
    compass: Option<Publisher<Heading>>,
    gyro: Option<Publisher<Gyro>>,
    /// Of a robot that takes part.
    parts: Option<Parts>,
    /// Of a robot that is carried.
    carriers: Option<Carriers>,
    neighbours: Vec<Publisher<Neighbour>>,
    told: Vec<Subscriber<Neighbour>>,
    /// What the robot believes.
    pub estimates: Subscriber<Estimate>,
    sent: u64,
    turned: u64,
    space: Space,
    robot: RobotName,
}

/// What the robot has published.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Heard {
    /// Estimates.
    pub estimates: u64,
    /// Poses that its neighbours were told.
    pub poses: u64,
    /// Positions that they were told, of sightings that say a part only, and answers.
    pub parts: u64,
    /// What leaders say that was handed on to them, and answers.
    pub data: u64,
}

impl AddAssign for Heard {
    fn add_assign(&mut self, more: Self) {
        self.estimates += more.estimates;
        self.poses += more.poses;
        self.parts += more.parts;
        self.data += more.data;
    }
}

impl Surroundings {
    /// Opens the bus and all ports of [`config`]`(directory, …)`.
    #[must_use]
    pub fn new(directory: &Path, space: &Space) -> Self {
        let bus = BusSpec::Local {
            directory: directory.join("bus"),
        };
        let robot = RobotName::new("robot1").unwrap();
        let name = |id: &u16| RobotName::new(&format!("robot{id}")).unwrap();
        let publishers = NEIGHBOURS.iter().map(|_| space.publisher(&robot));
        let subscribers = NEIGHBOURS.iter().map(|id| space.subscriber(&name(id)));
        Self {
            wheels: Sender::open(&bus).unwrap(),
            bus,
            frames: WheelFrames::new(METRES_PER_TICK),
            laser: space.publisher(&robot).unwrap(),
            receiver: space.publisher(&robot).unwrap(),
            map: space.publisher(&robot).unwrap(),
            compass: None,
            gyro: None,
            parts: None,
            carriers: None,
            neighbours: publishers.collect::<Result<_, _>>().unwrap(),
            told: subscribers.collect::<Result<_, _>>().unwrap(),
            estimates: space.subscriber(&robot).unwrap(),
            sent: 0,
            turned: 0,
            space: space.clone(),
            robot,
        }
    }

    /// One message of everything, stamped now: what a robot gets that stands at the origin.
    pub fn send(&mut self) {
        self.send_frames([0.0; 2]);
        let stamp_ns = realtime_ns();
        let header = header(stamp_ns, self.sent);
        self.map.send(said(header)).unwrap();
        self.send_heading(stamp_ns);
        self.send_messages(stamp_ns, [0.0; 3]);
    }

    /// The same, and what a gyro says of the last 20 ms: some of it is older than what it has said before.
    pub fn send_with_turns(&mut self) {
        self.send();
        self.send_turns(realtime_ns());
    }

    /// Two frames, of wheels that have come this far, left and right \[m\].
    pub fn send_frames(&mut self, [left_m, right_m]: [f64; 2]) {
        for frame in self.frames.encode(left_m, right_m) {
            self.wheels.send(&frame).unwrap();
        }
    }

    /// Those two frames, to be sent one after the other.
    pub fn frames(&mut self, [left_m, right_m]: [f64; 2]) -> [Frame; 2] {
        self.frames.encode(left_m, right_m)
    }

    /// One of them.
    pub fn send_frame(&mut self, frame: &Frame) {
        self.wheels.send(frame).unwrap();
    }

    /// Four sightings, a fix, four neighbours' poses; all true, if the robot is at `pose` \[m, m, rad\].
    pub fn send_messages(&mut self, stamp_ns: i64, pose: [f64; 3]) {
        for (sequence, &observed) in (4 * self.sent..).zip(&NEIGHBOURS) {
            let message = sighting(header(stamp_ns, sequence), observed);
            self.laser.send(message).unwrap();
        }
        self.send_what_others_know(stamp_ns, pose);
    }

    /// A fix and four neighbours' poses; true, if the robot is at `pose` \[m, m, rad\].
    pub fn send_what_others_know(&mut self, stamp_ns: i64, pose: [f64; 3]) {
        let header = header(stamp_ns, self.sent);
        self.receiver.send(fix(header, pose)).unwrap();
        for (port, &sender) in self.neighbours.iter().zip(&NEIGHBOURS) {
            port.send(word(header, sender, pose)).unwrap();
        }
        self.sent += 1;
    }

    /// A heading.
    pub fn send_heading(&mut self, stamp_ns: i64) {
        let open = || self.space.publisher(&self.robot).unwrap();
        let compass = self.compass.get_or_insert_with(open);
        let sequence = self.sent + self.turned;
        compass.send(looking(header(stamp_ns, sequence))).unwrap();
    }

    /// What a gyro at 200 Hz says in 20 ms: that the robot stands. How often it has spoken before.
    pub fn send_turns(&mut self, stamp_ns: i64) -> u64 {
        let before = self.turned;
        let open = || self.space.publisher(&self.robot).unwrap();
        let gyro = self.gyro.get_or_insert_with(open);
        for part in (0..4).rev() {
            let header = header(stamp_ns - part * TURN_NS, self.turned);
            gyro.send(still(header)).unwrap();
            self.turned += 1;
        }
        before
    }

    /// From now on there is what is seen in part too. Before the robot is opened, as all of this.
    pub fn take_part(&mut self) {
        let name = |id: &u16| RobotName::new(&format!("robot{id}")).unwrap();
        let (space, robot) = (&self.space, &self.robot);
        let each = || NEIGHBOURS.iter();
        self.parts = Some(Parts {
            camera: space.publisher(robot).unwrap(),
            seen: each().map(|_| space.publisher(robot).unwrap()).collect(),
            answers: each().map(|_| space.publisher(robot).unwrap()).collect(),
            told: each()
                .map(|id| space.subscriber(&name(id)).unwrap())
                .collect(),
            answered: each()
                .map(|id| space.subscriber(&name(id)).unwrap())
                .collect(),
            asked: None,
        });
    }

    /// From now on there are leaders and children too. Before the robot is opened, as all of this.
    pub fn carry(&mut self) {
        let name = |id: &u16| RobotName::new(&format!("robot{id}")).unwrap();
        let (space, robot) = (&self.space, &self.robot);
        let each = || NEIGHBOURS.iter();
        self.carriers = Some(Carriers {
            data: space.publisher(robot).unwrap(),
            answers: space.publisher(robot).unwrap(),
            told: each()
                .map(|id| space.subscriber(&name(id)).unwrap())
                .collect(),
            answered: each()
                .map(|id| space.subscriber(&name(id)).unwrap())
                .collect(),
        });
    }

    /// One message of everything, and what two leaders say of the robot, one of them by way of a child; two children have used what it
    /// has handed on.
    pub fn send_with_data(&mut self) {
        let header = header(realtime_ns(), self.sent);
        self.send();
        if let Some(carriers) = &self.carriers {
            carriers.say(header);
        }
    }

    /// Four sightings by range and bearing, the answers to those before, and a fix; true, if the robot stands at the origin.
    pub fn send_sightings_in_part(&mut self, stamp_ns: i64) {
        let own = header(stamp_ns, self.sent);
        self.receiver.send(fix(own, [0.0; 3])).unwrap();
        let first = 4 * self.sent;
        if let Some(parts) = &mut self.parts {
            for (sequence, &observed) in (first..).zip(&NEIGHBOURS) {
                let message = in_part(header(stamp_ns, sequence), observed);
                parts.camera.send(message).unwrap();
            }
            parts.answer(own, first);
        }
        self.sent += 1;
    }

    /// The same, and what four neighbours say that have seen the robot so.
    pub fn send_parts(&mut self, stamp_ns: i64) {
        let own = header(stamp_ns, self.sent);
        if let Some(parts) = &self.parts {
            parts.see(own);
        }
        self.send_sightings_in_part(stamp_ns);
    }

    /// From now on whoever listens is woken by what the robot publishes, and has to be.
    pub fn wait(&self) {
        let _ = self.estimates.bell().unwrap();
        for told in &self.told {
            let _ = told.bell().unwrap();
        }
    }

    /// Takes what the robot has published since the last time.
    #[must_use]
    pub fn receive(&self) -> Heard {
        Heard {
            estimates: drain(&self.estimates),
            poses: self.told.iter().map(drain).sum(),
            parts: self.parts.as_ref().map_or(0, Parts::heard),
            data: self.carriers.as_ref().map_or(0, Carriers::heard),
        }
    }
}

impl Carriers {
    fn say(&self, own: Header) {
        let [first, second, near, far] = NEIGHBOURS;
        let from = |source| Header { source, ..own };
        self.data.send(datum(from(first), &[first, 1])).unwrap();
        self.data
            .send(datum(from(near), &[second, near, 1]))
            .unwrap();
        for child in [near, far] {
            let answer = AssistAck {
                header: from(child),
                slot: own.stamp_ns.div_euclid(EVENT_NS),
                leader: first,
                taken: 1,
                ..AssistAck::default()
            };
            self.answers.send(answer).unwrap();
        }
    }

    fn heard(&self) -> u64 {
        let told: u64 = self.told.iter().map(drain).sum();
        told + self.answered.iter().map(drain).sum::<u64>()
    }
}

impl Parts {
    fn see(&self, own: Header) {
        for (port, &sender) in self.seen.iter().zip(&NEIGHBOURS) {
            let header = Header {
                source: sender,
                ..own
            };
            port.send(seen(header)).unwrap();
        }
    }

    fn answer(&mut self, own: Header, first: u64) {
        let asked = self.asked.replace((own.stamp_ns, first));
        let Some((stamp_ns, before)) = asked else {
            return;
        };
        for ((port, &sender), sighting) in self.answers.iter().zip(&NEIGHBOURS).zip(before..) {
            let header = Header {
                source: sender,
                stamp_ns,
                ..own
            };
            port.send(answer(header, sighting)).unwrap();
        }
    }

    fn heard(&self) -> u64 {
        let told: u64 = self.told.iter().map(drain).sum();
        told + self.answered.iter().map(drain).sum::<u64>()
    }
}

/// How many there were.
fn drain<M: Message>(port: &Subscriber<M>) -> u64 {
    std::iter::from_fn(|| port.receive().unwrap())
        .map(|_| 1)
        .sum()
}

fn header(stamp_ns: i64, sequence: u64) -> Header {
    Header {
        stamp_ns,
        session: 1,
        sequence,
        clock: Clock::Realtime as u8,
        ..Header::default()
    }
}

fn sighting(header: Header, observed: u16) -> RelativePose {
    let angle = f64::from(observed);
    let pose = [DISTANCE_M * angle.cos(), DISTANCE_M * angle.sin(), 0.5];
    RelativePose {
        header,
        observed,
        pose,
        covariance: diagonal([1e-2, 1e-2, 3e-4]),
        ..Default::default()
    }
}

/// By a camera, of a neighbour in its own direction.
fn in_part(header: Header, observed: u16) -> Sighting {
    Sighting {
        header,
        observed,
        has: Sighting::RANGE | Sighting::BEARING,
        who: Sighting::ROBOT,
        range: DISTANCE_M,
        bearing: f64::from(observed),
        white: [1e-2, 1e-3],
        slow: [0.01, 6.0, 0.01, 10.0],
        ..Default::default()
    }
}

/// Where the robot is, which stands at the origin.
fn seen(header: Header) -> Seen {
    Seen {
        header,
        sighting: header.sequence,
        independent: ROUND,
        dependent: ROUND,
        ..Default::default()
    }
}

/// Where a neighbour is.
fn answer(header: Header, sighting: u64) -> Answer {
    let angle = f64::from(header.source);
    Answer {
        header,
        session: 1,
        sighting,
        position: [DISTANCE_M * angle.cos(), DISTANCE_M * angle.sin()],
        independent: ROUND,
        dependent: ROUND,
        ..Default::default()
    }
}

/// That the robot is at the origin.
fn datum(header: Header, way: &[u16]) -> Assist {
    let mut path = [0; 16];
    for (place, robot) in path.iter_mut().zip(way) {
        *place = *robot;
    }
    Assist {
        header,
        slot: header.stamp_ns.div_euclid(EVENT_NS),
        independent: diagonal([1e-2; 3]),
        dependent: diagonal([1e-2; 3]),
        leader_covariance: diagonal([1e-2; 3]),
        path,
        robots: u8::try_from(way.len()).unwrap(),
        ..Assist::default()
    }
}

/// A decimetre in every direction.
const ROUND: [f64; 4] = [1e-2, 0.0, 0.0, 1e-2];

fn fix(header: Header, [x, y, _]: [f64; 3]) -> Position {
    Position {
        header,
        quality: 4,
        position: [x, y],
        covariance: [1e-2, 0.0, 0.0, 1e-2],
        ..Default::default()
    }
}

fn word(header: Header, sender: u16, pose: [f64; 3]) -> Neighbour {
    let header = Header {
        source: sender,
        ..header
    };
    Neighbour {
        header,
        pose,
        independent: diagonal([1e-2; 3]),
        dependent: diagonal([1e-2; 3]),
    }
}

/// At the origin.
fn said(header: Header) -> Pose {
    Pose {
        header,
        set: Pose::SAID,
        covariance: diagonal([1e-2; 3]),
        ..Default::default()
    }
}

/// Along the x axis.
fn looking(header: Header) -> Heading {
    Heading {
        header,
        what: Heading::COMPASS,
        quality: 1,
        variance: 1e-2,
        ..Default::default()
    }
}

fn still(header: Header) -> Gyro {
    Gyro {
        header,
        rate_radps: 0.001,
        ..Default::default()
    }
}

fn diagonal([x, y, phi]: [f64; 3]) -> [f64; 9] {
    [x, 0.0, 0.0, 0.0, y, 0.0, 0.0, 0.0, phi]
}

/// The clock of the stamps \[ns\].
#[must_use]
pub fn realtime_ns() -> i64 {
    let now = clock_gettime(ClockId::Realtime);
    now.tv_sec * 1_000_000_000 + now.tv_nsec
}
