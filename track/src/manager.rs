//! Which tracks there are: one for each neighbour, however many sensors see it.
//!
//! A sighting with an identity starts a track, teaches it, or is refused; who is refused again and again is started anew. A sighting
//! without identity belongs to the track that it fits best, if no other fits it nearly as well. What is not seen is coasted, and then
//! deleted.

mod assign;

use coloc_estimator::{RobotId, Span, Stamp};

use crate::increment::Rate;
use crate::reading::Reading;
use crate::rules::{Linear, Rules, convert_if_ready};
use crate::sensor::Sensors;
use crate::state::State;
use crate::update::{Gates, Outcome};
use assign::Unknown;

/// More neighbours than this are not tracked at once.
pub const MOST_TRACKS: usize = 64;

/// How tracks live.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Config {
    /// What is accepted.
    pub gates: Gates,
    /// Accepted sightings until a track is confirmed.
    pub confirm_hits: u32,
    /// A tentative track that is not seen for so long is deleted.
    pub tentative: Span,
    /// A confirmed track that is not seen for so long is coasted.
    pub coast: Span,
    /// A track that is not seen for so long is deleted.
    pub delete: Span,
    /// A tentative track refused so often is started anew.
    pub tentative_rejects: u32,
    /// Any track refused so often is started anew.
    pub max_rejects: u32,
    /// A track less certain than this is deleted \[m\].
    pub max_sigma_m: f64,
    /// A heading known to this is one \[rad\].
    pub convert_sigma_rad: f64,
    /// A sighting without identity is ambiguous if another track's cost is at most so much larger.
    pub margin: f64,
    /// How fast a robot may be whose odometry is missing: variances of its displacement in a second \[m²/s, m²/s, rad²/s\].
    pub outage: [f64; 3],
}

impl Default for Config {
    fn default() -> Self {
        Self {
            gates: Gates::default(),
            confirm_hits: 3,
            tentative: Span::from_millis(2000),
            coast: Span::from_millis(500),
            delete: Span::from_millis(5000),
            tentative_rejects: 2,
            max_rejects: 5,
            max_sigma_m: 1.0,
            convert_sigma_rad: 0.35,
            margin: 4.0,
            outage: [0.1015, 0.1015, 0.0069],
        }
    }
}

/// How a track stands.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Status {
    /// Seen too seldom to be believed.
    Tentative,
    /// Believed.
    Confirmed,
    /// Believed, and not seen of late.
    Coasted,
}

/// One neighbour.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Track {
    /// Who it is.
    pub id: RobotId,
    /// Where it is.
    pub state: State,
    /// Whether that is believed.
    pub status: Status,
    /// Sightings accepted.
    pub hits: u32,
    /// Sightings refused since the last that was accepted.
    pub rejects: u32,
    /// The last that was accepted.
    pub last: Stamp,
    /// A sighting with its identity came at this stamp.
    pub(crate) identified: bool,
}

/// What was seen.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Seen {
    /// A neighbour, by a sensor of the observer; of `None` it is not known which.
    Neighbour {
        /// Who.
        id: Option<RobotId>,
        /// Which of the observer's sensors.
        sensor: u16,
        /// What it measured.
        reading: Reading,
    },
    /// The observer, by a neighbour.
    Reciprocal {
        /// Who saw it.
        id: RobotId,
        /// In the neighbour's body frame \[rad\].
        bearing_rad: f64,
        /// Of all its errors \[rad²\].
        variance: f64,
    },
}

/// What was seen, and when.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Sighting {
    /// When.
    pub stamp: Stamp,
    /// Its number among those of its source.
    pub sequence: u64,
    /// What.
    pub seen: Seen,
}

/// What came of a sighting.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Verdict {
    /// A new track begins with it.
    Started,
    /// The track was refused too often and begins anew with it.
    Restarted,
    /// Its track has learnt of it.
    Accepted {
        /// Whose track.
        id: RobotId,
        /// Normalised innovation squared.
        d2: f64,
    },
    /// It does not fit its track.
    Rejected {
        /// Normalised innovation squared.
        d2: f64,
    },
    /// There is no track that could learn of it, and it cannot begin one.
    Ignored,
    /// It fits two tracks, or another sighting fits its track.
    Ambiguous,
    /// It fits no track.
    Unassigned,
    /// It is of before the step, or of after it.
    OutOfStep,
}

impl Sighting {
    /// In which order sightings act.
    fn order(&self) -> (Stamp, u32, u64) {
        let rank = match self.seen {
            Seen::Neighbour { sensor, .. } => u32::from(sensor),
            Seen::Reciprocal { .. } => u32::MAX,
        };
        (self.stamp, rank, self.sequence)
    }

    /// Whether it is not known who was seen.
    fn is_unknown(&self) -> bool {
        matches!(self.seen, Seen::Neighbour { id: None, .. })
    }
}

impl Track {
    fn started(id: RobotId, state: &State, stamp: Stamp) -> Self {
        Self {
            id,
            state: *state,
            status: Status::Tentative,
            hits: 1,
            rejects: 0,
            last: stamp,
            identified: true,
        }
    }

    fn accept(&mut self, stamp: Stamp, config: &Config) {
        self.hits += 1;
        self.rejects = 0;
        self.last = stamp;
        if self.status != Status::Tentative || self.hits >= config.confirm_hits {
            self.status = Status::Confirmed;
        }
        convert_if_ready(&mut self.state, config.convert_sigma_rad);
    }

    fn is_refused_too_often(&self, config: &Config) -> bool {
        self.rejects
            >= match self.status {
                Status::Tentative => config.tentative_rejects,
                Status::Confirmed | Status::Coasted => config.max_rejects,
            }
    }

    /// Whether it is still worth keeping.
    fn is_alive(&self, now: Stamp, config: &Config) -> bool {
        let longest = match self.status {
            Status::Tentative => config.tentative,
            Status::Confirmed | Status::Coasted => config.delete,
        };
        now - self.last <= longest && self.state.position_sigma() <= config.max_sigma_m
    }
}

/// All tracks of one observer, in storage of the caller's: as many as it has places, up to [`MOST_TRACKS`].
#[derive(Clone, Debug)]
pub struct Manager<S, R = Linear> {
    config: Config,
    sensors: Sensors,
    rules: R,
    now: Stamp,
    tracks: S,
    unknown: Unknown,
}

/// How the robots move: held over a step.
#[derive(Copy, Clone, Debug)]
pub struct Odometry<'a> {
    /// The observer; `None` if it is missing.
    pub observer: Option<Rate>,
    /// The neighbours' whose odometry is there.
    pub neighbours: &'a [(RobotId, Rate)],
}

impl Odometry<'_> {
    fn of(&self, id: RobotId) -> Option<Rate> {
        let mut all = self.neighbours.iter();
        all.find(|(of, _)| *of == id).map(|(_, rate)| *rate)
    }
}

impl<S: AsRef<[Option<Track>]> + AsMut<[Option<Track>]>> Manager<S> {
    /// No tracks yet, at `now`.
    #[must_use]
    pub fn new(config: Config, sensors: Sensors, now: Stamp, storage: S) -> Self {
        Self::with_rules(config, sensors, now, storage, Linear)
    }
}

impl<S: AsRef<[Option<Track>]> + AsMut<[Option<Track>]>, R: Rules> Manager<S, R> {
    /// [`Manager::new`], of tracks that follow other rules.
    #[must_use]
    pub fn with_rules(
        config: Config,
        sensors: Sensors,
        now: Stamp,
        mut storage: S,
        rules: R,
    ) -> Self {
        storage.as_mut().fill(None);
        Self {
            config,
            sensors,
            rules,
            now,
            tracks: storage,
            unknown: Unknown::default(),
        }
    }

    /// The tracks, in no particular order.
    pub fn tracks(&self) -> impl Iterator<Item = &Track> {
        self.places().iter().flatten()
    }

    fn places(&self) -> &[Option<Track>] {
        let all = self.tracks.as_ref();
        &all[..all.len().min(MOST_TRACKS)]
    }

    fn places_mut(&mut self) -> &mut [Option<Track>] {
        places_mut(&mut self.tracks)
    }

    /// The track of a neighbour.
    #[must_use]
    pub fn track(&self, id: RobotId) -> Option<&Track> {
        self.tracks().find(|it| it.id == id)
    }

    /// Until `now`, with what was seen since the last step, in any order; it is put in its own. `tell` hears what came of each.
    pub fn step(
        &mut self,
        now: Stamp,
        odometry: &Odometry<'_>,
        sightings: &mut [Sighting],
        mut tell: impl FnMut(&Sighting, Verdict),
    ) {
        sightings.sort_unstable_by_key(Sighting::order);
        let mut rest = &*sightings;
        while let Some(first) = rest.first() {
            let same = rest.iter().take_while(|it| it.stamp == first.stamp).count();
            let (image, later) = rest.split_at(same);
            rest = later;
            if first.stamp < self.now || first.stamp > now {
                for sighting in image {
                    tell(sighting, Verdict::OutOfStep);
                }
                continue;
            }
            self.pass(first.stamp, odometry);
            self.see(image, &mut tell);
        }
        self.pass(now, odometry);
    }

    /// Time passes.
    fn pass(&mut self, until: Stamp, odometry: &Odometry<'_>) {
        let seconds = (until - self.now).as_seconds();
        let missing = Rate::unknown(self.config.outage);
        let own = odometry.observer.unwrap_or(missing).over(seconds);
        for track in places_mut(&mut self.tracks).iter_mut().flatten() {
            let seen = odometry.of(track.id).unwrap_or(missing).over(seconds);
            self.rules
                .predict(&mut track.state, &own, &seen, &self.sensors, seconds);
        }
        self.now = until;
        self.age();
    }

    /// What is not seen is coasted, and then deleted.
    fn age(&mut self) {
        let (now, config) = (self.now, self.config);
        for place in self.places_mut() {
            if place.is_some_and(|it| !it.is_alive(now, &config)) {
                *place = None;
            }
        }
        for track in self.places_mut().iter_mut().flatten() {
            if track.status == Status::Confirmed && now - track.last > config.coast {
                track.status = Status::Coasted;
            }
        }
    }

    /// What was seen at this stamp: what has an identity first.
    fn see(&mut self, image: &[Sighting], tell: &mut impl FnMut(&Sighting, Verdict)) {
        for track in self.places_mut().iter_mut().flatten() {
            track.identified = false;
        }
        for sighting in image.iter().filter(|it| !it.is_unknown()) {
            let verdict = self.identified(sighting);
            tell(sighting, verdict);
        }
        self.assign(image, tell);
    }

    fn identified(&mut self, sighting: &Sighting) -> Verdict {
        match sighting.seen {
            Seen::Reciprocal {
                id,
                bearing_rad,
                variance,
            } => self.reciprocal(id, bearing_rad, variance),
            Seen::Neighbour {
                id: Some(id),
                sensor,
                reading,
            } => self.neighbour(sighting.stamp, id, usize::from(sensor), &reading),
            Seen::Neighbour { id: None, .. } => Verdict::Unassigned,
        }
    }

    fn reciprocal(&mut self, id: RobotId, bearing_rad: f64, variance: f64) -> Verdict {
        let config = self.config;
        let Some(track) = self.track_mut(id) else {
            return Verdict::Ignored;
        };
        let Outcome { accepted, d2 } =
            track
                .state
                .update_reciprocal(bearing_rad, variance, &config.gates);
        if !accepted {
            return Verdict::Rejected { d2 };
        }
        convert_if_ready(&mut track.state, config.convert_sigma_rad);
        Verdict::Accepted { id, d2 }
    }

    fn neighbour(
        &mut self,
        stamp: Stamp,
        id: RobotId,
        sensor: usize,
        reading: &Reading,
    ) -> Verdict {
        let Some(index) = self.index(id) else {
            return match self.begun(sensor, reading) {
                Some(state) => self.start(&Track::started(id, &state, stamp)),
                None => Verdict::Ignored,
            };
        };
        let anew = self.begun(sensor, reading);
        let Some(track) = &mut places_mut(&mut self.tracks)[index] else {
            return Verdict::Ignored;
        };
        track.identified = true;
        let gates = &self.config.gates;
        let outcome = self
            .rules
            .update(&mut track.state, reading, &self.sensors, sensor, gates);
        if outcome.accepted {
            track.accept(stamp, &self.config);
            return Verdict::Accepted { id, d2: outcome.d2 };
        }
        track.rejects += 1;
        match anew.filter(|_| track.is_refused_too_often(&self.config)) {
            Some(state) => {
                *track = Track::started(id, &state, stamp);
                Verdict::Restarted
            }
            None => Verdict::Rejected { d2: outcome.d2 },
        }
    }

    /// The state with which a reading begins a track: one number alone begins none.
    fn begun(&self, sensor: usize, reading: &Reading) -> Option<State> {
        match *reading {
            Reading::RangeBearing {
                range_m,
                bearing_rad,
                white,
            } => Some(
                self.rules
                    .start(range_m, bearing_rad, white, &self.sensors, sensor),
            ),
            Reading::Range { .. } | Reading::Bearing { .. } => None,
        }
    }

    fn start(&mut self, track: &Track) -> Verdict {
        match self.places_mut().iter_mut().find(|it| it.is_none()) {
            Some(place) => {
                *place = Some(*track);
                Verdict::Started
            }
            None => Verdict::Ignored,
        }
    }

    fn index(&self, id: RobotId) -> Option<usize> {
        self.places()
            .iter()
            .position(|it| it.is_some_and(|it| it.id == id))
    }

    fn track_mut(&mut self, id: RobotId) -> Option<&mut Track> {
        self.places_mut()
            .iter_mut()
            .flatten()
            .find(|it| it.id == id)
    }
}

/// Not a method: the manager lends out other parts of itself beside it.
fn places_mut<S: AsMut<[Option<Track>]>>(storage: &mut S) -> &mut [Option<Track>] {
    let all = storage.as_mut();
    let count = all.len().min(MOST_TRACKS);
    &mut all[..count]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensor::Sensor;

    /// Room for so many that a test need not have more.
    const PLACES: usize = 8;

    fn manager() -> Manager<[Option<Track>; PLACES]> {
        let sensors = Sensors::new(&[Sensor::default()]).unwrap();
        let storage = [None; PLACES];
        Manager::new(Config::default(), sensors, Stamp::default(), storage)
    }

    fn at(millis: i64) -> Stamp {
        Stamp::default() + Span::from_millis(millis)
    }

    fn sighting(millis: i64, id: Option<u16>, range_m: f64) -> Sighting {
        Sighting {
            stamp: at(millis),
            sequence: 0,
            seen: Seen::Neighbour {
                id: id.map(RobotId),
                sensor: 0,
                reading: Reading::RangeBearing {
                    range_m,
                    bearing_rad: 0.0,
                    white: [0.01, 0.001],
                },
            },
        }
    }

    fn verdicts(
        manager: &mut Manager<[Option<Track>; PLACES]>,
        now: i64,
        given: &mut [Sighting],
    ) -> [Option<Verdict>; 16] {
        let (mut all, mut count) = ([None; 16], 0);
        let nobody = Odometry {
            observer: None,
            neighbours: &[],
        };
        manager.step(at(now), &nobody, given, |_, verdict| {
            all[count] = Some(verdict);
            count += 1;
        });
        all
    }

    #[test]
    fn more_neighbours_than_there_is_room_for_are_ignored() {
        let mut manager = manager();
        let mut all: [Sighting; PLACES + 2] =
            core::array::from_fn(|id| sighting(10, u16::try_from(id).ok(), 3.0));
        let told = verdicts(&mut manager, 20, &mut all);
        let of = |verdict| told.iter().filter(|it| **it == Some(verdict)).count();
        assert_eq!((of(Verdict::Started), of(Verdict::Ignored)), (PLACES, 2));
        assert_eq!(manager.tracks().count(), PLACES);
    }

    #[test]
    fn what_is_not_of_this_step_changes_nothing() {
        let mut manager = manager();
        verdicts(&mut manager, 100, &mut [sighting(50, Some(1), 3.0)]);
        let before = *manager.track(RobotId(1)).unwrap();
        let mut late = [sighting(99, Some(1), 3.1), sighting(101, Some(2), 3.1)];
        let told = verdicts(&mut manager, 100, &mut late);
        assert_eq!(told[..2], [Some(Verdict::OutOfStep); 2]);
        assert_eq!(manager.track(RobotId(1)), Some(&before));
        assert_eq!(manager.track(RobotId(2)), None);
    }

    #[test]
    fn who_is_not_seen_is_coasted_and_then_forgotten() {
        let mut manager = manager();
        for millis in [100, 200, 300] {
            verdicts(&mut manager, millis, &mut [sighting(millis, Some(1), 3.0)]);
        }
        let status = |manager: &Manager<[Option<Track>; PLACES]>| {
            manager.track(RobotId(1)).map(|it| it.status)
        };
        assert_eq!(status(&manager), Some(Status::Confirmed));
        verdicts(&mut manager, 801, &mut []);
        assert_eq!(status(&manager), Some(Status::Coasted));
        verdicts(&mut manager, 10_000, &mut []);
        assert_eq!(status(&manager), None);
    }

    #[test]
    fn two_that_fit_one_track_are_ambiguous() {
        let mut manager = manager();
        for millis in [100, 200, 300] {
            verdicts(&mut manager, millis, &mut [sighting(millis, Some(1), 3.0)]);
        }
        let mut two = [sighting(310, None, 3.0), sighting(310, None, 3.01)];
        let told = verdicts(&mut manager, 310, &mut two);
        assert_eq!(told[0], Some(Verdict::Ambiguous));
        let far = verdicts(&mut manager, 320, &mut [sighting(320, None, 9.0)]);
        assert_eq!(far[0], Some(Verdict::Unassigned));
    }
}
