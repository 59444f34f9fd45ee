//! What is seen in part, as it is recorded.

use coloc_estimator::partial::{self, Alone, BodySighting, SplitPosition};
use coloc_estimator::{
    Answer, Ask, Covariance2, LandmarkSighting, Measurement, NotACovariance, Origin,
    PartialSighting, Pose, RobotId, SeenPart, SightingId, Stamp,
};
use serde::{Deserialize, Serialize};

use super::Record;

/// What a sensor says, in the body frame. Covariances row-major.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "has", rename_all = "snake_case", deny_unknown_fields)]
pub enum Reading {
    /// Range and bearing.
    Place {
        /// \[m\]
        at: [f64; 2],
        /// Of what is new in every sighting.
        white: [f64; 4],
        /// Of what is not.
        slow: [f64; 4],
    },
    /// A bearing alone.
    Bearing {
        /// \[rad\]
        bearing: f64,
        /// White and slow \[rad²\].
        variances: [f64; 2],
        /// Of the sensor on the body.
        mount: [f64; 3],
    },
    /// A range alone.
    Range {
        /// \[m\]
        range: f64,
        /// White and slow \[m²\].
        variances: [f64; 2],
        /// Of the sensor on the body.
        mount: [f64; 3],
    },
}

/// A position in the common frame with both parts of its covariance.
#[derive(Copy, Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Place {
    position: [f64; 2],
    independent: [f64; 4],
    dependent: [f64; 4],
}

fn mount(pose: &Pose) -> [f64; 3] {
    [pose.x, pose.y, pose.phi]
}

fn mounted([x, y, phi]: [f64; 3]) -> Pose {
    Pose { x, y, phi }
}

impl From<&partial::Reading> for Reading {
    fn from(reading: &partial::Reading) -> Self {
        match reading {
            partial::Reading::Place(it) => Self::Place {
                at: it.at,
                white: it.white.to_row_major(),
                slow: it.slow.to_row_major(),
            },
            partial::Reading::Alone(Alone::Bearing {
                bearing_rad,
                variances,
                mount: at,
            }) => Self::Bearing {
                bearing: *bearing_rad,
                variances: *variances,
                mount: mount(at),
            },
            partial::Reading::Alone(Alone::Range {
                range_m,
                variances,
                mount: at,
            }) => Self::Range {
                range: *range_m,
                variances: *variances,
                mount: mount(at),
            },
        }
    }
}

impl TryFrom<Reading> for partial::Reading {
    type Error = NotACovariance;

    fn try_from(reading: Reading) -> Result<Self, NotACovariance> {
        Ok(match reading {
            Reading::Place { at, white, slow } => Self::Place(BodySighting {
                at,
                white: Covariance2::from_row_major(white)?,
                slow: Covariance2::from_row_major(slow)?,
            }),
            Reading::Bearing {
                bearing,
                variances,
                mount,
            } => Self::Alone(Alone::Bearing {
                bearing_rad: bearing,
                variances,
                mount: mounted(mount),
            }),
            Reading::Range {
                range,
                variances,
                mount,
            } => Self::Alone(Alone::Range {
                range_m: range,
                variances,
                mount: mounted(mount),
            }),
        })
    }
}

impl From<&SplitPosition> for Place {
    fn from(place: &SplitPosition) -> Self {
        Self {
            position: place.position,
            independent: place.independent.to_row_major(),
            dependent: place.dependent.to_row_major(),
        }
    }
}

impl TryFrom<Place> for SplitPosition {
    type Error = NotACovariance;

    fn try_from(place: Place) -> Result<Self, NotACovariance> {
        Self::from_row_major(place.position, place.independent, place.dependent)
    }
}

impl From<&PartialSighting> for Record {
    fn from(sighting: &PartialSighting) -> Self {
        Self::Partial {
            stamp_ns: sighting.stamp.as_nanos(),
            source: sighting.origin.source,
            session: sighting.origin.session,
            sequence: sighting.origin.sequence,
            observed: sighting.observed.0,
            reading: (&sighting.reading).into(),
        }
    }
}

impl From<&Ask> for Record {
    fn from(ask: &Ask) -> Self {
        Self::Ask {
            stamp_ns: ask.stamp.as_nanos(),
            sender: ask.sighting.robot.0,
            sensor: ask.sighting.sensor,
            session: ask.sighting.session,
            sighting: ask.sighting.sequence,
        }
    }
}

impl From<&SeenPart> for Record {
    fn from(seen: &SeenPart) -> Self {
        Self::Seen {
            stamp_ns: seen.stamp.as_nanos(),
            sender: seen.sighting.robot.0,
            sensor: seen.sighting.sensor,
            session: seen.sighting.session,
            sighting: seen.sighting.sequence,
            place: seen.place.as_ref().map(Place::from),
            asks: seen.asks,
        }
    }
}

impl From<&Answer> for Record {
    fn from(answer: &Answer) -> Self {
        Self::Answer {
            stamp_ns: answer.stamp.as_nanos(),
            sender: answer.sighting.robot.0,
            sensor: answer.sighting.sensor,
            session: answer.sighting.session,
            sighting: answer.sighting.sequence,
            place: (&answer.place).into(),
        }
    }
}

impl From<&LandmarkSighting> for Record {
    fn from(sighting: &LandmarkSighting) -> Self {
        Self::Landmark {
            stamp_ns: sighting.stamp.as_nanos(),
            source: sighting.origin.source,
            session: sighting.origin.session,
            sequence: sighting.origin.sequence,
            landmark: sighting.landmark,
            reading: (&sighting.reading).into(),
            position: sighting.position,
            covariance: sighting.covariance.to_row_major(),
        }
    }
}

/// The measurement of such a line; `None` if it is of something else.
pub(super) fn measurement(record: Record) -> Option<Result<Measurement, NotACovariance>> {
    let id = |robot, sensor, session, sequence| SightingId {
        robot: RobotId(robot),
        sensor,
        session,
        sequence,
    };
    let said = match record {
        Record::Ask {
            stamp_ns,
            sender,
            sensor,
            session,
            sighting,
        } => Ok(Measurement::Ask(Ask {
            stamp: Stamp::from_nanos(stamp_ns),
            sighting: id(sender, sensor, session, sighting),
        })),
        Record::Seen {
            stamp_ns,
            sender,
            sensor,
            session,
            sighting,
            place,
            asks,
        } => place.map(SplitPosition::try_from).transpose().map(|place| {
            Measurement::Seen(SeenPart {
                stamp: Stamp::from_nanos(stamp_ns),
                sighting: id(sender, sensor, session, sighting),
                place,
                asks,
            })
        }),
        Record::Answer {
            stamp_ns,
            sender,
            sensor,
            session,
            sighting,
            place,
        } => SplitPosition::try_from(place).map(|place| {
            Measurement::Answer(Answer {
                stamp: Stamp::from_nanos(stamp_ns),
                sighting: id(sender, sensor, session, sighting),
                place,
                reading: None,
            })
        }),
        other => return sighting(other),
    };
    Some(said)
}

fn sighting(record: Record) -> Option<Result<Measurement, NotACovariance>> {
    let origin = |source, session, sequence| Origin {
        source,
        session,
        sequence,
    };
    Some(match record {
        Record::Partial {
            stamp_ns,
            source,
            session,
            sequence,
            observed,
            reading,
        } => reading.try_into().map(|reading| {
            Measurement::Partial(PartialSighting {
                stamp: Stamp::from_nanos(stamp_ns),
                origin: origin(source, session, sequence),
                observed: RobotId(observed),
                reading,
            })
        }),
        Record::Landmark {
            stamp_ns,
            source,
            session,
            sequence,
            landmark,
            reading,
            position,
            covariance,
        } => reading.try_into().and_then(|reading| {
            Ok(Measurement::Landmark(LandmarkSighting {
                stamp: Stamp::from_nanos(stamp_ns),
                origin: origin(source, session, sequence),
                landmark,
                reading,
                position,
                covariance: Covariance2::from_row_major(covariance)?,
            }))
        }),
        _ => return None,
    })
}
