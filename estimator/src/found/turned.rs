//! What a heading tells a hypothesis: which way it looks, and never where it is.
//!
//! A compass has no seat and no vote. What it says goes to every hypothesis, which takes it if it is not contradicted by what
//! it knows of its direction. A hypothesis that took headings and then contradicts its own source and the wheels begins again without
//! them: a compass that lies is found out by the first way that is driven.

use super::lifted::Lifted;
use crate::gate::CHI2_1_99;
use crate::heading::HeadingNoise;
use crate::kind::SlowError;
use crate::stamp::Stamp;

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
    /// It was contradicted with them, and goes on without.
    is_deaf: bool,
}

impl Turned {
    /// Of what comes from a belief that has heard headings until now.
    pub(crate) fn by_belief(now: Stamp) -> Self {
        Self {
            last: Some(now),
            ..Self::default()
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
        lifted.turn(said.heading, noise.weight);
        self.taken = self.taken.saturating_add(1);
        self.first.get_or_insert(said.stamp);
        self.last = Some(said.stamp);
        true
    }

    /// What is left of it where the hypothesis begins again.
    pub(crate) fn contradicted(self) -> Self {
        Self {
            is_deaf: self.is_deaf || self.taken > 0,
            ..Self::default()
        }
    }
}
