//! What is seen in part: own sightings, what other robots tell that have seen this one, and what they answer.

use coloc_estimator::partial::{Alone, BodySighting, Reading, ReadingNoise, SplitPosition};
use coloc_estimator::{
    Answer, Covariance2, LandmarkSighting, Measurement, PartialSighting, RobotId, SeenPart,
    SightingId, Stamp,
};
use coloc_shm_types::{
    self as shm, Input, Limits, PortError, Reject, RobotName, Sessions, Sighting, Space,
};

use super::list::List;
use super::messages::{not_a_covariance, origin, stamp};
use super::port::Port;
use super::sensors::Sensors;
use crate::account::Account;
use crate::clock::Moment;
use crate::config;

/// A tick takes in so many messages at most; the others wait in shared memory for the next one.
const SIGHTINGS: usize = 64;
const SEEN: usize = 64;
const ANSWERS: usize = 64;
/// So many of all kinds.
pub(super) const MOST: usize = SIGHTINGS + SEEN + ANSWERS;

/// The subscribers of a robot that takes part.
#[derive(Debug)]
pub(super) struct Parts {
    sightings: Port<Sighting>,
    seen: Port<shm::Seen>,
    answers: Port<shm::Answer>,
    landmarks: Landmarks,
    /// Other robots are heard of by way of `coloc-track` alone.
    through_track: bool,
}

/// By their numbers.
#[derive(Clone, Debug)]
pub struct Landmarks(Box<[(u16, SplitPosition)]>);

impl Landmarks {
    /// Those of a configuration.
    #[must_use]
    pub fn of(listed: &[config::Landmark]) -> Self {
        let mut all: Vec<_> = listed
            .iter()
            .map(|it| {
                // The square of a number that was checked with the configuration: always a covariance.
                let variance = it.sigma_m * it.sigma_m;
                let covariance = Covariance2::diagonal([variance; 2]).unwrap_or_default();
                (it.number, SplitPosition::known(it.position, covariance))
            })
            .collect();
        all.sort_by_key(|(number, _)| *number);
        Self(all.into_boxed_slice())
    }

    fn get(&self, number: u16) -> Result<&SplitPosition, Reject> {
        let place = self.0.binary_search_by_key(&number, |(number, _)| *number);
        let found = place.ok().and_then(|place| self.0.get(place));
        found.map(|(_, place)| place).ok_or(Reject::UnknownLandmark)
    }
}

impl Parts {
    /// Subscribes to the channels of `name`, one of so many robots.
    pub(super) fn open(
        space: &Space,
        name: &RobotName,
        robots: usize,
        (landmarks, through_track): (Landmarks, bool),
    ) -> Result<Self, PortError> {
        let sensors = Sessions::SENSORS;
        Ok(Self {
            sightings: Port::open(space, name, (Input::Sighting, sensors, SIGHTINGS))?,
            seen: Port::open(space, name, (Input::Seen, robots, SEEN))?,
            answers: Port::open(space, name, (Input::Answer, robots, ANSWERS))?,
            landmarks,
            through_track,
        })
    }

    pub(super) fn deaf(&self) -> impl Iterator<Item = Input> {
        let inputs = [self.sightings.deaf(), self.seen.deaf(), self.answers.deaf()];
        inputs.into_iter().flatten()
    }

    pub(super) fn tell_sessions(&self, now: Stamp, account: &mut Account) {
        self.sightings.tell_sessions(now, account);
        self.seen.tell_sessions(now, account);
        self.answers.tell_sessions(now, account);
    }

    pub(super) fn receive(
        &mut self,
        moment: &Moment,
        (limits, sensors): (&Limits<'_>, &Sensors),
        into: &mut List<Measurement>,
        account: &mut Account,
    ) {
        let (landmarks, through_track) = (&self.landmarks, self.through_track);
        let is_raw =
            |it: &Sighting| through_track && matches!(it.who, Sighting::ROBOT | Sighting::UNKNOWN);
        self.sightings
            .drain_but(is_raw, moment, into, account, |it| {
                if through_track {
                    it.validate_passed_on(limits)?;
                } else {
                    it.validate(limits)?;
                }
                of_sighting(it, sensors, landmarks)
            });
        self.seen
            .drain(moment, into, account, |it| seen(it, limits));
        self.answers
            .drain(moment, into, account, |it| answer(it, limits));
    }

    pub(super) fn clear(&mut self) {
        self.sightings.clear();
        self.seen.clear();
        self.answers.clear();
    }
}

/// A sighting as the estimator takes it, of a robot or of a landmark, whatever the message holds.
///
/// # Errors
/// Why it is none.
pub fn sighting(
    message: &Sighting,
    limits: &Limits<'_>,
    sensors: &Sensors,
    landmarks: &Landmarks,
) -> Result<Measurement, Reject> {
    message.validate(limits)?;
    of_sighting(message, sensors, landmarks)
}

fn of_sighting(
    message: &Sighting,
    sensors: &Sensors,
    landmarks: &Landmarks,
) -> Result<Measurement, Reject> {
    let (stamp, origin, reading) = (stamp(message), origin(message), reading(message, sensors));
    if message.who != Sighting::LANDMARK {
        return Ok(Measurement::Partial(PartialSighting {
            stamp,
            origin,
            observed: RobotId(message.observed),
            reading,
        }));
    }
    let place = landmarks.get(message.observed)?;
    Ok(Measurement::Landmark(LandmarkSighting {
        stamp,
        origin,
        landmark: message.observed,
        reading,
        position: place.position,
        covariance: place.dependent,
    }))
}

fn reading(message: &Sighting, sensors: &Sensors) -> Reading {
    let mount = sensors.mount_of(message);
    let ([range, bearing], [scale, _, turn, _]) = (message.white, message.slow);
    match (message.has_range(), message.has_bearing()) {
        (true, false) => {
            let slow = scale * message.range;
            Reading::Alone(Alone::Range {
                range_m: message.range,
                variances: [range, slow * slow],
                mount,
            })
        }
        (false, true) => Reading::Alone(Alone::Bearing {
            bearing_rad: message.bearing,
            variances: [bearing, turn * turn],
            mount,
        }),
        _ => {
            let noise = ReadingNoise {
                white: message.white,
                slow: [scale, turn],
            };
            let place = BodySighting::of(message.range, message.bearing, &mount, &noise);
            Reading::Place(place)
        }
    }
}

/// What another robot tells as the estimator takes it, whatever the message holds.
///
/// # Errors
/// Why it is none.
pub fn seen(message: &shm::Seen, limits: &Limits<'_>) -> Result<Measurement, Reject> {
    message.validate(limits)?;
    let tells = message.flags & shm::Seen::NOTHING_TOLD == 0;
    let said = || place(message.position, message.independent, message.dependent);
    Ok(Measurement::Seen(SeenPart {
        stamp: stamp(message),
        sighting: SightingId {
            robot: RobotId(message.header.source),
            sensor: message.sensor,
            session: message.session,
            sequence: message.sighting,
        },
        place: tells.then(said).transpose()?,
        asks: message.flags & shm::Seen::NO_ANSWER == 0,
    }))
}

/// What a robot answers as the estimator takes it, whatever the message holds.
///
/// # Errors
/// Why it is none.
pub fn answer(message: &shm::Answer, limits: &Limits<'_>) -> Result<Measurement, Reject> {
    message.validate(limits)?;
    Ok(Measurement::Answer(Answer {
        stamp: stamp(message),
        sighting: SightingId {
            robot: RobotId(message.header.source),
            sensor: message.sensor,
            session: message.session,
            sequence: message.sighting,
        },
        place: place(message.position, message.independent, message.dependent)?,
        reading: None,
    }))
}

fn place(
    position: [f64; 2],
    independent: [f64; 4],
    dependent: [f64; 4],
) -> Result<SplitPosition, Reject> {
    SplitPosition::from_row_major(position, independent, dependent).map_err(not_a_covariance)
}
