//! A slot of time is closed: its measurements narrow what is known, or are shown to be impossible.

use crate::diagnosis::fits_without;
use crate::measurement::{Measurement, Place, Refused};
use crate::polytope::{Arena, BadFrame, Polytope, Source};
use crate::simplex::{Conflict, NoVertex};
use crate::team::{Supports, Team};

/// What may be wrong.
#[derive(Copy, Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Suspect {
    /// The fixes of a robot.
    Fix(usize),
    /// What one robot says of another.
    Sighting(usize, usize),
    /// All that one robot says of others, where no single one of them explains it.
    Sightings(usize),
    /// Where a robot was, or how it moved.
    Motion(usize),
    /// The compass of a robot. Of headings alone: no half-plane is ever said by one.
    Compass(usize),
}

/// What came of a slot.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// All fits.
    Kept,
    /// No position of the robots satisfies all of it.
    Violated {
        /// By how much all rows would have to be relaxed \[m\].
        relaxation: f64,
        /// Everything without which alone the rest fits. One is a finding, several are "one of these", none is "more than one".
        suspects: Vec<Suspect>,
    },
    /// It could not be found out: the prediction stays.
    Failed,
}

/// What came of a slot and of its measurements.
#[derive(Clone, Debug)]
pub struct Closed {
    /// Of those that mean something, together.
    pub verdict: Verdict,
    /// Of those that mean nothing, by their place in the list.
    pub refused: Vec<(usize, Refused)>,
    /// All rows that were believed. Empty of measurements where none was.
    pub believed: Polytope,
}

/// Narrows what `team` is predicted to be at by the measurements of a slot.
///
/// After a conflict the slot goes on without all suspects; if there is none, without any measurement. No bound is ever widened. What comes out then is a
/// best guess: that those who are left tell the truth.
///
/// # Errors
/// If arena or slack mean nothing.
pub fn close(
    team: &mut Team,
    measurements: &[Measurement],
    arena: Arena,
    slack_m: f64,
) -> Result<Closed, BadFrame> {
    let mut polytope = team.polytope(arena, slack_m)?;
    let mut refused = Vec::new();
    for (index, measurement) in measurements.iter().enumerate() {
        if let Err(reason) = polytope.add(measurement, Source::Measurement(index)) {
            refused.push((index, reason));
        }
    }
    let verdict = match polytope.region() {
        Ok(mut region) => {
            team.keep(&mut region);
            Verdict::Kept
        }
        Err(NoVertex::Infeasible(conflict)) => {
            resolve(team, &mut polytope, measurements, &conflict)
        }
        Err(NoVertex::Failed) => {
            polytope.retain(is_prediction);
            Verdict::Failed
        }
    };
    Ok(Closed {
        verdict,
        refused,
        believed: polytope,
    })
}

fn is_prediction(source: Source) -> bool {
    !matches!(source, Source::Measurement(_))
}

/// Leaves in `polytope` what is believed.
fn resolve(
    team: &mut Team,
    polytope: &mut Polytope,
    measurements: &[Measurement],
    conflict: &Conflict,
) -> Verdict {
    let suspects = suspects(polytope, measurements, conflict);
    let meant = |source| suspects.iter().any(|it| it.means(source, measurements));
    if suspects.is_empty() || polytope.region_of(|source| !meant(source)).is_err() {
        polytope.retain(is_prediction);
    } else {
        polytope.retain(|source| !meant(source));
        if let Ok(mut region) = polytope.region() {
            forget(team, &suspects);
            team.keep(&mut region);
        }
    }
    Verdict::Violated {
        relaxation: conflict.relaxation,
        suspects,
    }
}

/// Where a robot was is a suspect: nothing of it is known any more but what others say.
fn forget(team: &mut Team, suspects: &[Suspect]) {
    for suspect in suspects {
        let Suspect::Motion(robot) = *suspect else {
            continue;
        };
        let count = team.regions[robot].values().len();
        team.regions[robot] = Supports::unknown(count);
        for pair in team
            .pairs
            .iter_mut()
            .filter(|it| it.i == robot || it.j == robot)
        {
            pair.region = Supports::unknown(count);
        }
    }
}

/// Only what takes part in the conflict can dissolve it.
pub(crate) fn suspects(
    polytope: &Polytope,
    measurements: &[Measurement],
    conflict: &Conflict,
) -> Vec<Suspect> {
    let mut candidates = Vec::new();
    for source in polytope.sources(conflict) {
        match source {
            Source::Measurement(index) => candidates.extend(said_by(&measurements[index])),
            Source::Motion(robot) => candidates.push(Suspect::Motion(robot)),
            Source::Pair(i, j) => candidates.extend([Suspect::Motion(i), Suspect::Motion(j)]),
        }
    }
    candidates.sort_unstable();
    candidates.dedup();
    let mut found: Vec<Suspect> = Vec::new();
    for candidate in candidates {
        let known = found.iter().any(|it| it.is_part_of(candidate));
        let explains = |source| candidate.means(source, measurements);
        if !known && fits_without(polytope, explains) == Ok(true) {
            found.push(candidate);
        }
    }
    found
}

fn said_by(measurement: &Measurement) -> Vec<Suspect> {
    match *measurement {
        Measurement::Fix { robot, .. } => vec![Suspect::Fix(robot)],
        Measurement::Between {
            from: Place::Robot(a),
            to,
            ..
        } => {
            let one = match to {
                Place::Robot(b) => Some(Suspect::Sighting(a, b)),
                Place::At(_) => None,
            };
            one.into_iter().chain([Suspect::Sightings(a)]).collect()
        }
        Measurement::Between {
            to: Place::Robot(b),
            ..
        } => vec![Suspect::Fix(b)],
        Measurement::Between { .. } => Vec::new(),
    }
}

impl Suspect {
    fn is_part_of(self, other: Self) -> bool {
        matches!((self, other), (Self::Sighting(a, _), Self::Sightings(b)) if a == b)
    }

    pub(crate) fn means(self, source: Source, measurements: &[Measurement]) -> bool {
        match source {
            Source::Measurement(index) => said_by(&measurements[index]).contains(&self),
            Source::Motion(robot) => self == Self::Motion(robot),
            Source::Pair(i, j) => self == Self::Motion(i) || self == Self::Motion(j),
        }
    }
}
