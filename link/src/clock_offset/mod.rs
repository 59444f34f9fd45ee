//! How far a peer's clock is off, how fast that changes, and between which bounds both must lie.
//!
//! Let θ(t) = peer's clock − own clock at own time t. No message arrives before it was sent, whatever the network does. So what is
//! sent at S by the own clock and heard at R by the peer's says θ ≤ R − S, and what is sent at S by the peer's and heard at R by the
//! own says θ ≥ S − R. Each is as sharp as its delay was short; nothing is assumed of the other way's, which is where the half of a
//! round trip goes wrong (Mills, "Internet time synchronization: the network time protocol", 1991). With θ(t) = a + b (t − now) and
//! |b| ≤ B every message is a half-plane of (a, b), and what they have in common is a convex polygon (Moon, Skelly and Towsley,
//! "Estimation and removal of clock skew from network delay measurements", 1999, have its corners as a linear program). Its extent is
//! what is known: bounds, not deviations. So a clock that is called wrong is wrong.
//!
//! A clock that is set, or slewed faster than B, leaves the polygon empty: then the newest messages that agree are believed and all
//! before them forgotten.

mod correction;
mod polygon;
mod whose;

use std::collections::VecDeque;

use polygon::{HalfPlane, Polygon};

pub use correction::{Correction, blur};
pub use whose::{Whose, whose_clock};

/// The fastest that two clocks may drift apart \[s/s\]: quartz is within 100 ppm, and what disciplines a clock slews by up to 500.
pub const LARGEST_DRIFT: f64 = 500e-6;

/// How much the drift may change within what is remembered \[s/s\].
const WANDER: f64 = 1e-6;

/// How exactly stamps are taken (s).
const RESOLUTION_S: f64 = 2e-6;

/// So long is one slot, of which the sharpest bound of each side is kept (ns).
const SLOT_NS: i64 = 1_000_000_000;

/// Slots of a side that are kept.
const SLOTS: usize = 96;

/// What is known of a peer's clock.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Offset {
    /// The peer's clock minus the own one, in the middle of its bounds (s).
    pub offset_s: f64,
    /// It lies within so much of that (s).
    pub within_s: f64,
    /// How fast it grows, in the middle of its bounds (s/s).
    pub drift: f64,
    /// It lies within so much of that (s/s).
    pub drift_within: f64,
}

impl Offset {
    /// Whether the clocks surely differ: by more than what is not known of it.
    #[must_use]
    pub fn is_off(&self) -> bool {
        self.offset_s.abs() > self.within_s
    }

    /// Whether they surely differ by more than `limit_s`.
    #[must_use]
    pub fn exceeds(&self, limit_s: f64) -> bool {
        self.offset_s.abs() - self.within_s > limit_s
    }

    /// Its variance, everything between the bounds being as likely (s²).
    #[must_use]
    pub fn variance_s2(&self) -> f64 {
        self.within_s * self.within_s / 3.0
    }
}

/// Measures one peer's clock. It has no clock of its own: moments are given (ns of a clock that never steps).
#[derive(Clone, Debug, Default)]
pub struct ClockOffset {
    sides: [VecDeque<Bound>; 2],
    steps: u32,
}

/// θ at a moment is at most (of the first side) or at least (of the second) so much.
#[derive(Copy, Clone, Debug)]
struct Bound {
    at_ns: i64,
    theta_ns: i64,
}

impl ClockOffset {
    /// Of a peer of which nothing is known.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// The peer's clock was ahead by `theta_ns` at most at `at_ns`: what was sent by the own clock and heard by the peer's.
    pub fn at_most(&mut self, at_ns: i64, theta_ns: i64) {
        keep(&mut self.sides[0], Bound { at_ns, theta_ns }, i64::lt);
    }

    /// The peer's clock was ahead by `theta_ns` at least at `at_ns`: what was sent by the peer's clock and heard by the own.
    pub fn at_least(&mut self, at_ns: i64, theta_ns: i64) {
        keep(&mut self.sides[1], Bound { at_ns, theta_ns }, i64::gt);
    }

    /// A word of the peer that echoes one of the own, both with their stamps (ns): `sent` by the own clock, `heard` and `replied` by
    /// the peer's, `back` by the own; the last of them at `at_ns`.
    pub fn round(&mut self, at_ns: i64, sent: i64, heard: i64, replied: i64, back: i64) {
        let held = replied.saturating_sub(heard).max(0);
        let travelled = back.saturating_sub(sent).saturating_sub(held).max(0);
        // It was heard somewhere within the way back before `at − held`: that may be as old as all of the way.
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_precision_loss,
            reason = "a slack, rounded"
        )]
        let slack_ns = (travelled as f64 * LARGEST_DRIFT) as i64;
        let theta_ns = heard.saturating_sub(sent).saturating_add(slack_ns);
        self.at_most(at_ns.saturating_sub(held), theta_ns);
        self.at_least(at_ns, replied.saturating_sub(back));
    }

    /// How often it was found to have been set.
    #[must_use]
    pub const fn steps(&self) -> u32 {
        self.steps
    }

    /// What is known at `now_ns`; `None` until a message has gone each way. What contradicts the newest messages is forgotten.
    pub fn at(&mut self, now_ns: i64) -> Option<Offset> {
        let newest = [self.sides[0].back()?, self.sides[1].back()?];
        let reference_ns = newest[1].theta_ns;
        // Not larger than it has to be, for the sake of rounding: both of the newest bounds hold, or nothing is known.
        let apart_s = seconds(newest[0].theta_ns.saturating_sub(reference_ns)).abs();
        let ages_s = newest.map(|bound| seconds(now_ns.saturating_sub(bound.at_ns)).abs());
        let largest_s = LARGEST_DRIFT.mul_add(ages_s[0] + ages_s[1], apart_s + 1.0);
        let mut polygon = Polygon::between(largest_s, LARGEST_DRIFT);
        let mut used = [false; 2];
        for (side, bound) in self.newest_first() {
            let age_s = seconds(now_ns.saturating_sub(bound.at_ns));
            let slack_s = WANDER.mul_add(age_s.abs(), RESOLUTION_S);
            let theta_s = seconds(bound.theta_ns.saturating_sub(reference_ns));
            let sign = if side == 0 { 1.0 } else { -1.0 };
            // ±(a − b age) ≤ ±θ + slack.
            let half = HalfPlane {
                normal: [sign, -sign * age_s],
                limit: sign.mul_add(theta_s, slack_s),
            };
            let Some(smaller) = polygon.cut(&half) else {
                self.forget_up_to(bound.at_ns);
                self.steps = self.steps.saturating_add(1);
                break;
            };
            polygon = smaller;
            used[side] = true;
        }
        if used != [true; 2] {
            return None;
        }
        let [(offset_s, within_s), (drift, drift_within)] = [0, 1].map(|axis| polygon.extent(axis));
        Some(Offset {
            offset_s: seconds(reference_ns) + offset_s,
            within_s,
            drift,
            drift_within,
        })
    }

    fn newest_first(&self) -> Vec<(usize, Bound)> {
        let sides = self.sides.iter().enumerate();
        let mut all: Vec<_> = sides
            .flat_map(|(side, bounds)| bounds.iter().map(move |bound| (side, *bound)))
            .collect();
        all.sort_by_key(|(side, bound)| (core::cmp::Reverse(bound.at_ns), *side));
        all
    }

    fn forget_up_to(&mut self, at_ns: i64) {
        for side in &mut self.sides {
            side.retain(|bound| bound.at_ns > at_ns);
        }
    }
}

/// Keeps the sharpest bound of each slot.
fn keep(side: &mut VecDeque<Bound>, new: Bound, sharper: fn(&i64, &i64) -> bool) {
    let slot = |bound: &Bound| bound.at_ns.div_euclid(SLOT_NS);
    if let Some(last) = side.back_mut()
        && slot(last) >= slot(&new)
    {
        if sharper(&new.theta_ns, &last.theta_ns) {
            *last = new;
        }
        return;
    }
    if side.len() == SLOTS {
        side.pop_front();
    }
    side.push_back(new);
}

#[expect(
    clippy::cast_precision_loss,
    reason = "below 2⁵³ ns, 104 days, it is exact, and above a microsecond is enough"
)]
fn seconds(ns: i64) -> f64 {
    ns as f64 * 1e-9
}

#[cfg(test)]
mod tests;
