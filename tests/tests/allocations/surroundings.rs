//! Everything around one robot: its wheels, its sensors, four neighbours and whoever listens.

use std::path::Path;

use coloc_daemon::config::Config;
use coloc_drivers::can::{BusSpec, Sender};
use coloc_drivers::encoder::WheelFrames;
use coloc_shm_types::{
    Estimate, Header, Neighbour, Position, Publisher, RelativePose, RobotName, Space, Subscriber,
};
use rustix::time::{ClockId, clock_gettime};

const METRES_PER_TICK: f64 = 1e-4;
/// Team numbers of the neighbours; the robot is number 1.
const NEIGHBOURS: [u16; 4] = [2, 3, 4, 5];
/// Where they stand, seen from the robot, which stands as well [m].
const DISTANCE_M: f64 = 2.0;

pub(crate) fn config(directory: &Path, trigger: &str) -> Config {
    let at = directory.display();
    let team = NEIGHBOURS
        .map(|id| format!("[[team]]\nname = \"robot{id}\"\nid = {id}\n"))
        .concat();
    let wheel = |message| {
        format!(
            "{{ message = \"{message}\", signal = \"Ticks\", metres_per_tick = {METRES_PER_TICK} }}"
        )
    };
    let text = format!(
        "{team}[robot]\nname = \"robot1\"\nid = 1\n\
         [tick]\nrate_hz = 500.0\ntrigger = \"{trigger}\"\n\
         [history]\nlength_s = 0.1\n\
         [shm]\nroot = \"{at}/shm\"\nprefix = \"test\"\n\
         [odometry]\nbuses = [\"local:{at}/bus\"]\nmax_speed_mps = 5.0\n\
         [odometry.wheels]\ntrack_m = 0.3\nleft = {}\nright = {}\n",
        wheel("WheelLeft"),
        wheel("WheelRight"),
    );
    Config::parse(&text, Path::new("robot.toml")).unwrap()
}

pub(crate) struct Surroundings {
    wheels: Sender,
    frames: WheelFrames,
    laser: Publisher<RelativePose>,
    receiver: Publisher<Position>,
    neighbours: Vec<Publisher<Neighbour>>,
    told: Vec<Subscriber<Neighbour>>,
    estimates: Subscriber<Estimate>,
    sent: u64,
}

impl Surroundings {
    /// Before the robot, so that everything is connected when it starts.
    pub(crate) fn new(directory: &Path, space: &Space) -> Self {
        let robot = RobotName::new("robot1").unwrap();
        let name = |id: &u16| RobotName::new(&format!("robot{id}")).unwrap();
        Self {
            wheels: Sender::open(&BusSpec::Local {
                directory: directory.join("bus"),
            })
            .unwrap(),
            frames: WheelFrames::new(METRES_PER_TICK),
            laser: space.publisher(&robot).unwrap(),
            receiver: space.publisher(&robot).unwrap(),
            neighbours: NEIGHBOURS
                .iter()
                .map(|_| space.publisher(&robot).unwrap())
                .collect(),
            told: NEIGHBOURS
                .iter()
                .map(|id| space.subscriber(&name(id)).unwrap())
                .collect(),
            estimates: space.subscriber(&robot).unwrap(),
            sent: 0,
        }
    }

    /// One message of everything: two frames, four sightings, a fix, four neighbours' poses.
    pub(crate) fn send(&mut self) {
        let header = Header {
            stamp_ns: realtime_ns(),
            session_ns: 1,
            sequence: self.sent,
        };
        for frame in self.frames.encode(0.0, 0.0) {
            self.wheels.send(&frame).unwrap();
        }
        for (k, &observed) in (0_u64..).zip(&NEIGHBOURS) {
            self.laser
                .send(sighting(
                    Header {
                        sequence: 4 * self.sent + k,
                        ..header
                    },
                    observed,
                ))
                .unwrap();
        }
        self.receiver.send(fix(header)).unwrap();
        for (port, &sender) in self.neighbours.iter().zip(&NEIGHBOURS) {
            port.send(pose(header, sender)).unwrap();
        }
        self.sent += 1;
    }

    /// Takes what the robot has published: how many poses its neighbours were told, and how many estimates there were.
    pub(crate) fn receive(&self) -> (usize, usize) {
        let told = self
            .told
            .iter()
            .map(|port| std::iter::from_fn(|| port.receive().unwrap()).count())
            .sum();
        (
            told,
            std::iter::from_fn(|| self.estimates.receive().unwrap()).count(),
        )
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

fn fix(header: Header) -> Position {
    let covariance = [1e-2, 0.0, 0.0, 1e-2];
    Position {
        header,
        quality: 4,
        covariance,
        ..Default::default()
    }
}

fn pose(header: Header, sender: u16) -> Neighbour {
    let (total, independent) = (diagonal([2e-2; 3]), diagonal([1e-2; 3]));
    Neighbour {
        header,
        sender,
        total,
        independent,
        ..Default::default()
    }
}

fn diagonal([x, y, phi]: [f64; 3]) -> [f64; 9] {
    [x, 0.0, 0.0, 0.0, y, 0.0, 0.0, 0.0, phi]
}

fn realtime_ns() -> i64 {
    let now = clock_gettime(ClockId::Realtime);
    now.tv_sec * 1_000_000_000 + now.tv_nsec
}
