//! What a heading tells a hypothesis: which way it looks, and never where it is.
//!
//! A compass has no seat and no vote. What it says goes to every hypothesis, which takes it if it is not contradicted by what
//! it knows of its direction. Where that is open it would take anything, and one heading of ten may be of the robot's back: so it
//! waits until headings have borne each other out. A hypothesis that took headings and then contradicts its own source and the wheels begins again without
//! them: a compass that lies is found out by the first way that is driven.

use super::lifted::Lifted;
use super::moments::Point;
use super::stride::Stride;
use crate::angle::wrap;
use crate::gate::CHI2_1_99;
use crate::heading::HeadingNoise;
use crate::kind::SlowError;
use crate::stamp::Stamp;

/// So many headings more than those that say otherwise, before an open direction follows them.
const BORNE_OUT: u8 = 3;

/// Headings are the same if they are by their noise and the wheels' (variance \[rad²\]).
const WHEELS: f64 = 0.02;

/// A heading, as that of the body.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Looking {
    pub(crate) stamp: Stamp,
    pub(crate) heading: f64,
    pub(crate) variance: f64,
    pub(crate) slow: SlowError,
}

/// The headings that a hypothesis heard.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub(crate) struct Turned {
    /// So many it took.
    pub(crate) taken: u32,
    /// When it took the first and the last.
    pub(crate) first: Option<Stamp>,
    last: Option<Stamp>,
    /// What it heard before it took any.
    waiting: Option<Waiting>,
    /// It was contradicted with them, and goes on without.
    is_deaf: bool,
}

/// A heading that waits for others to bear it out.
#[derive(Copy, Clone, Debug, PartialEq)]
struct Waiting {
    /// The latest of them, as a direction, turned with the wheels since.
    ahead: Point,
    /// So many, less those that said otherwise.
    alike: u8,
}

impl Waiting {
    const fn first(ahead: Point) -> Self {
        Self { ahead, alike: 1 }
    }

    /// After another heading.
    fn after(self, said: &Looking, error: f64) -> Self {
        let ahead = direction(said);
        let apart = wrap(said.heading - libm::atan2(self.ahead.im, self.ahead.re));
        if apart * apart <= CHI2_1_99 * (2.0 * error + WHEELS) {
            let alike = self.alike.saturating_add(1);
            return Self { ahead, alike };
        }
        match self.alike {
            0 | 1 => Self::first(ahead),
            alike => Self {
                alike: alike - 1,
                ..self
            },
        }
    }
}

fn direction(said: &Looking) -> Point {
    let (sin, cos) = libm::sincos(said.heading);
    Point::new(cos, sin)
}

impl Turned {
    /// Of what comes from a belief that has heard headings until now.
    pub(crate) fn by_belief(now: Stamp) -> Self {
        Self {
            last: Some(now),
            ..Self::default()
        }
    }

    /// A motion passes.
    pub(crate) fn step(&mut self, stride: &Stride) {
        if let Some(waiting) = &mut self.waiting {
            waiting.ahead *= stride.turn;
        }
    }

    /// Turns `lifted` as it is said; whether it was.
    pub(crate) fn take(&mut self, said: &Looking, lifted: &mut Lifted) -> bool {
        let since = self.last.map(|last| said.stamp - last);
        let noise = HeadingNoise::of(said.variance, &said.slow, since);
        let apart = lifted.turn_distance(said.heading, noise.error);
        // What is not a number is not taken either.
        if self.is_deaf || !(apart <= CHI2_1_99 && noise.weight.is_finite()) {
            return false;
        }
        let is_open = self.taken == 0 && !lifted.direction().is_resolved();
        if is_open && !self.is_borne_out(said, noise.error) {
            return false;
        }
        self.waiting = None;
        lifted.turn(said.heading, noise.weight);
        self.taken = self.taken.saturating_add(1);
        self.first.get_or_insert(said.stamp);
        self.last = Some(said.stamp);
        true
    }

    fn is_borne_out(&mut self, said: &Looking, error: f64) -> bool {
        let waiting = self.waiting.map_or_else(
            || Waiting::first(direction(said)),
            |waiting| waiting.after(said, error),
        );
        self.waiting = Some(waiting);
        waiting.alike >= BORNE_OUT
    }

    /// What is left of it where the hypothesis begins again.
    pub(crate) fn contradicted(self) -> Self {
        Self {
            is_deaf: self.is_deaf || self.taken > 0,
            ..Self::default()
        }
    }
}
