//! A filter of each other robot beside every robot, and what it makes of a sighting before the exchange has it.

use std::collections::BTreeMap;

use coloc_estimator::{Pose, Stamp};
use coloc_track::feed::feed;
use coloc_track::manager::Odometry;
use coloc_track::{
    Config, Manager, Reading, Seen, Sensor, Sensors, Sighting, SlowErrors, State, Track, Verdict,
};

use super::super::recorded::{Recorded, Subject};
use super::super::tracks::rate;
use super::method::Method;
use super::team::{Look, stamp, stamp_of};
use crate::fleet::id;
use crate::world::World;

/// How long slow errors of a camera last, of range and bearing \[s\].
const LASTS_S: [f64; 2] = [6.0, 10.0];

/// The tracks of all robots.
pub(super) struct Feeds {
    managers: Vec<Manager<Vec<Option<Track>>>>,
    /// When a pose was told last, by observer and robot seen.
    told: BTreeMap<(usize, usize), Stamp>,
}

impl Feeds {
    pub(super) fn new(robots: usize, method: &Method) -> Self {
        let [range_sigma, bearing_sigma] = method.camera.slow;
        let [range_tau_s, bearing_tau_s] = LASTS_S;
        let camera = Sensor {
            mount: Pose::default(),
            slow: Some(SlowErrors {
                range_sigma,
                range_tau_s,
                bearing_sigma,
                bearing_tau_s,
            }),
        };
        let sensors = Sensors::new(&[camera]).unwrap_or_default();
        let manager = |_| {
            let places = vec![None; robots];
            Manager::new(Config::default(), sensors, Stamp::default(), places)
        };
        Self {
            managers: (0..robots).map(manager).collect(),
            told: BTreeMap::new(),
        }
    }

    /// Takes the tracks of `robot` to the end of `step`. Of each sighting of its own in `image` the pose that feeds the exchange in its
    /// place, if there is one, in their order.
    pub(super) fn step(
        &mut self,
        recorded: &Recorded,
        (step, robot): (usize, usize),
        (method, image): (&Method, &[Look]),
    ) -> Vec<Option<State>> {
        let mut poses = Vec::new();
        for looks in image.chunk_by(|a, b| stamp_of(a) == stamp_of(b)) {
            let mut given: Vec<Sighting> = looks
                .iter()
                .filter_map(|it| method.given(it, robot))
                .collect();
            let mut accepted = Vec::new();
            self.pass(
                recorded,
                (step, robot),
                stamp_of(&looks[0]),
                &mut given,
                |it, verdict| {
                    if matches!(verdict, Verdict::Accepted { .. }) {
                        accepted.push(it.sequence);
                    }
                },
            );
            for look in looks.iter().filter(|it| it.sighting.observer == robot) {
                let is_accepted = accepted.contains(&look.number);
                poses.push(is_accepted.then(|| self.pose(robot, look)).flatten());
            }
        }
        let end = stamp(recorded, step);
        self.pass(recorded, (step, robot), end, &mut [], |_, _| ());
        poses
    }

    fn pass(
        &mut self,
        recorded: &Recorded,
        (step, robot): (usize, usize),
        until: Stamp,
        given: &mut [Sighting],
        tell: impl FnMut(&Sighting, Verdict),
    ) {
        let world = &recorded.world;
        let rates = (0..world.robots()).map(|it| rate(world.odometry(step - 1, it)));
        let rates: Vec<_> = (0..).map(id).zip(rates).collect();
        let odometry = Odometry {
            observer: rates.get(robot).map(|(_, it)| *it),
            neighbours: &rates,
        };
        self.managers[robot].step(until, &odometry, given, tell);
    }

    fn pose(&mut self, robot: usize, look: &Look) -> Option<State> {
        let Subject::Robot(seen) = look.sighting.subject else {
            return None;
        };
        let track = self.managers[robot].tracks().find(|it| it.id == id(seen))?;
        let last = self.told.get(&(robot, seen)).copied();
        let state = feed(track, last)?;
        self.told.insert((robot, seen), track.last);
        Some(state)
    }
}

impl Method {
    /// What `robot`'s tracks are given of a sighting.
    fn given(&self, look: &Look, robot: usize) -> Option<Sighting> {
        let it = &look.sighting;
        let Subject::Robot(subject) = it.subject else {
            return None;
        };
        let [[range, _], [bearing, turn]] = self.variances(it.range_m);
        let seen = if it.observer == robot {
            Seen::Neighbour {
                id: Some(id(subject)),
                sensor: 0,
                reading: Reading::RangeBearing {
                    range_m: it.range_m,
                    bearing_rad: it.bearing_rad,
                    white: [range, bearing],
                },
            }
        } else if subject == robot {
            Seen::Reciprocal {
                id: id(it.observer),
                bearing_rad: it.bearing_rad,
                variance: bearing + turn,
            }
        } else {
            return None;
        };
        Some(Sighting {
            stamp: stamp_of(look),
            sequence: look.number,
            seen,
        })
    }
}
