//! What feeds `colocd` of what is seen of other robots: the pose of a track, or the sighting itself, never both.

use std::collections::BTreeMap;

use coloc_estimator::Stamp;
use coloc_shm_types as shm;
use coloc_track::feed::feed;
use coloc_track::{Seen, Sighting, State, Track, Verdict};

/// So many sightings are held at most until their moment comes; what is more is passed on at once.
const MOST_HELD: usize = 4096;

/// What `colocd` is to hear.
#[derive(Clone, Debug, PartialEq)]
pub enum Fed {
    /// A sighting as it came, but for [`shm::Sighting::PASSED_ON`].
    Sighting(shm::Sighting),
    /// A track's pose, of the moment of a sighting \[ns\]; the header is the sender's.
    Pose(i64, Box<shm::RelativePose>),
}

/// A sighting whose moment has not come.
#[derive(Clone, Debug)]
struct Held {
    at_ns: i64,
    sensor: u16,
    message: shm::Sighting,
    accepted: bool,
}

/// Sightings of robots that are known by name, from when they come until it is known what feeds `colocd`.
#[derive(Clone, Debug, Default)]
pub(crate) struct Feed {
    held: Vec<Held>,
    ready: Vec<Fed>,
    /// When a pose of which robot took the place of a sighting last.
    told: BTreeMap<u16, Stamp>,
}

impl Feed {
    pub(crate) fn hold(&mut self, at_ns: i64, sensor: u16, message: &shm::Sighting) {
        if self.held.len() >= MOST_HELD {
            return self.pass_on(message);
        }
        self.held.push(Held {
            at_ns,
            sensor,
            message: *message,
            accepted: false,
        });
    }

    /// Without a look at a track.
    pub(crate) fn pass_on(&mut self, message: &shm::Sighting) {
        if message.who == shm::Sighting::ROBOT {
            self.ready.push(Fed::Sighting(shm::Sighting {
                who: shm::Sighting::PASSED_ON,
                ..*message
            }));
        }
    }

    /// The first moment of one that is held, after `at_ns`.
    pub(crate) fn next_ns(&self, at_ns: i64) -> Option<i64> {
        let later = self.held.iter().map(|it| it.at_ns);
        later.filter(|it| *it > at_ns).min()
    }

    /// What its track made of it.
    pub(crate) fn judged(&mut self, sighting: &Sighting, verdict: Verdict) {
        let Seen::Neighbour { sensor, .. } = sighting.seen else {
            return;
        };
        let is_it = |it: &&mut Held| {
            let stamp_ns = sighting.stamp.as_nanos();
            (it.at_ns, it.sensor, it.message.header.sequence)
                == (stamp_ns, sensor, sighting.sequence)
        };
        if let Some(held) = self.held.iter_mut().find(is_it) {
            held.accepted = matches!(verdict, Verdict::Accepted { .. });
        }
    }

    /// All tracks are at `at`: a pose takes the place of a sighting of then that was accepted, where [`feed`] says so. Others are passed on.
    pub(crate) fn tell<'a>(&mut self, at: Stamp, track: impl Fn(u16) -> Option<&'a Track>) {
        let at_ns = at.as_nanos();
        let mut due = Vec::new();
        self.held.retain(|it| {
            let is_due = it.at_ns <= at_ns;
            due.extend(is_due.then(|| it.clone()));
            !is_due
        });
        for held in due {
            let observed = held.message.observed;
            let last = self.told.get(&observed).copied();
            let state = (held.accepted && held.at_ns == at_ns)
                .then(|| track(observed))
                .flatten()
                .and_then(|track| feed(track, last));
            match state {
                Some(state) => {
                    self.told.insert(observed, at);
                    self.ready
                        .push(Fed::Pose(at_ns, Box::new(pose(observed, &state))));
                }
                None => self.pass_on(&held.message),
            }
        }
    }

    pub(crate) fn take(&mut self) -> Vec<Fed> {
        std::mem::take(&mut self.ready)
    }
}

fn pose(observed: u16, state: &State) -> shm::RelativePose {
    let (pose, covariance) = state.relative_pose();
    shm::RelativePose {
        observed,
        components: shm::RelativePose::OF_TRACK,
        pose,
        covariance: std::array::from_fn(|it| covariance[(it / 3, it % 3)]),
        ..shm::RelativePose::default()
    }
}
