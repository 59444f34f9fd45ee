//! What slots say together: the mean of an error over some of them has a bound of its own, far below that of a single one.
//!
//! A receiver that goes away slowly takes the regions with it, because each slot alone fits. But errors change sign. Whoever promises that over N
//! slots the middle of what a sensor says is off by no more than a share of its bound, in the mean, has N-slot means of positions as unknowns of
//! one more linear program: means of sums are sums of means, so every source is a set of half-planes of them. No motion comes in, and nothing that
//! was concluded before, so nothing can have been dragged along.

use std::collections::VecDeque;

use crate::evidence::DIRECTIONS;
use crate::measurement::{HalfPlane, Measurement, Place, Seen, spaced, support_of_box, unit};
use crate::polytope::{Arena, Polytope, Projection, Source};
use crate::simplex::NoVertex;
use crate::slot::{Suspect, suspects};
use crate::team::Supports;
use crate::{AngleInterval, BadFrame};

/// What is promised of means.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Promise {
    /// Over so many slots.
    pub slots: usize,
    /// Of the bound of a single slot's fix, 0 to 1; 1 or more promises nothing at all.
    pub fixes: f64,
    /// Of the bounds of a single slot's sighting, 0 to 1.
    pub sightings: f64,
}

/// What each of the last slots said, with the bounds of means.
#[derive(Clone, Debug)]
pub struct Memory {
    /// What is promised.
    pub promise: Promise,
    slots: VecDeque<Vec<(Projection, Supports)>>,
}

impl Memory {
    /// Of nothing.
    #[must_use]
    pub fn new(promise: Promise) -> Self {
        Self {
            promise,
            slots: VecDeque::new(),
        }
    }

    /// Goes on by a slot.
    pub fn hear(&mut self, measurements: &[Measurement], robots: usize) {
        if self.promise.fixes >= 1.0 {
            return;
        }
        let said = |it: &Measurement| said(it, &self.promise);
        let valid = measurements.iter().filter(|it| it.check(robots).is_ok());
        self.slots.push_back(valid.filter_map(said).collect());
        if self.slots.len() > self.promise.slots {
            self.slots.pop_front();
        }
    }

    /// Who alone explains that the means do not fit, of those who said something in the last slot, `measurements`; `None` if they do fit, or
    /// nobody knows.
    ///
    /// # Errors
    /// If arena or slack mean nothing.
    pub fn judge(
        &self,
        measurements: &[Measurement],
        robots: usize,
        arena: Arena,
        slack_m: f64,
    ) -> Result<Option<Vec<Suspect>>, BadFrame> {
        if self.slots.len() < self.promise.slots {
            return Ok(None);
        }
        let mut polytope = Polytope::new(robots, &[], arena, slack_m)?;
        for (index, measurement) in measurements.iter().enumerate() {
            let Some(projection) = projection(measurement) else {
                continue;
            };
            if let Some(mean) = self.mean(projection) {
                for (k, rhs) in mean.into_iter().enumerate() {
                    let normal = unit(spaced(k, DIRECTIONS));
                    let half_plane = HalfPlane { normal, rhs };
                    polytope.bound(projection, half_plane, Source::Measurement(index));
                }
            }
        }
        Ok(match polytope.region() {
            Err(NoVertex::Infeasible(conflict)) => {
                Some(suspects(&polytope, measurements, &conflict))
            }
            Ok(_) | Err(NoVertex::Failed) => None,
        })
    }

    /// How far the mean goes in each direction; `None` if a slot says nothing of it.
    #[must_use]
    #[allow(clippy::cast_precision_loss)] // Dozens.
    pub fn mean(&self, of: Projection) -> Option<Vec<f64>> {
        let mut sum = Supports::zero(DIRECTIONS);
        for slot in &self.slots {
            sum.add(&slot.iter().find(|it| it.0 == of)?.1);
        }
        let count = self.slots.len() as f64;
        Some(sum.values().iter().map(|it| it / count).collect())
    }
}

/// Of whom it says something: a robot, or one seen from another.
#[must_use]
pub fn projection(measurement: &Measurement) -> Option<Projection> {
    match *measurement {
        Measurement::Fix { robot, .. } => Some(Projection::Robot(robot)),
        Measurement::Between {
            from: Place::Robot(from),
            to: Place::Robot(to),
            ..
        } => Some(Projection::Difference(to, from)),
        Measurement::Between { .. } => None,
    }
}

/// What it says with a share of its bounds.
fn said(measurement: &Measurement, promise: &Promise) -> Option<(Projection, Supports)> {
    let (share, centre, half, heading) = match *measurement {
        Measurement::Fix { centre, half, .. } => {
            (promise.fixes, centre, half, AngleInterval::new(0.0, 0.0))
        }
        Measurement::Between {
            seen:
                Seen::Box {
                    centre,
                    half,
                    heading,
                    ..
                },
            ..
        } => (promise.sightings.min(1.0), centre, half, heading),
        Measurement::Between { .. } => return None,
    };
    let half = half.map(|it| share * it);
    let heading = if heading.is_unknown() {
        heading
    } else {
        AngleInterval::new(heading.centre, share * heading.half)
    };
    let support = |k| support_of_box(spaced(k, DIRECTIONS), centre, half, heading);
    let supports = Supports::new((0..DIRECTIONS).map(support).collect());
    Some((projection(measurement)?, supports))
}
