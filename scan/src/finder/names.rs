//! Which robot each body is.

use std::f64::consts::{PI, TAU};

use super::candidate::{Candidate, Mode};
use super::place::{GATES, Place};
use super::reading::Reading;
use super::seen::Seen;
use super::turned::Likeness;
use super::{Finder, MOST_PAIRS, MOST_ROBOTS};
use crate::associate::Pair;
use crate::shape::Look;

/// Twice the logarithm of how much likelier one of two headings must be.
const HEADING_SURE: f64 = 12.0;
/// How often a heading is taken for another one, at most.
const MISTAKEN: f64 = 0.1;

impl Finder {
    /// Which candidate may be which robot.
    pub(super) fn pair(&mut self) {
        self.pairs.clear();
        self.readings.clear();
        self.likenesses.clear();
        for robot in 0..self.places.len() {
            for seen in 0..self.candidates.all().len() {
                let (place, candidate) = (&self.places[robot], &self.candidates.all()[seen]);
                let Some((mut reading, weight, likeness)) = self.read(place, candidate) else {
                    continue;
                };
                reading.candidate = seen;
                let (seen, worse) = self.candidates.thing(seen);
                let worse = (-0.5 * worse).exp();
                let weight = weight * worse;
                if self.pairs.len() == MOST_PAIRS {
                    self.counts.left_out += 1;
                    continue;
                }
                self.pairs.push(Pair {
                    robot,
                    seen,
                    weight,
                });
                self.readings.push(reading);
                self.likenesses.push(likeness.times(worse));
            }
        }
    }

    /// What a candidate says of a robot, if it may be that one: the likeliest of its headings.
    fn read(&self, place: &Place, candidate: &Candidate) -> Option<(Reading, f64, Likeness)> {
        let look = self.settings.looks[candidate.look];
        let (turns, centre_m) = match look {
            Look::Rectangle { centre_m, .. } => (2, centre_m),
            Look::Cylinder { .. } | Look::Marks(_) => (1, [0.0; 2]),
        };
        let modes = || candidate.modes.iter().flatten();
        let least = modes()
            .map(|mode| mode.fit.chi2)
            .fold(f64::INFINITY, f64::min);
        let (mut best, mut second): (Option<(f64, f64, Reading)>, _) = (None, f64::INFINITY);
        let mut nearest: Option<(f64, Reading)> = None;
        for Mode {
            fit,
            time_s,
            is_settled,
        } in modes()
        {
            for turn in 0..turns {
                let reading = Reading {
                    time_s: *time_s,
                    is_clear: *is_settled,
                    ..fit.reading(f64::from(turn) * PI, centre_m)
                };
                let far = place.distance(&reading);
                let cost = far + fit.chi2 - least;
                let is_better = best.as_ref().is_none_or(|(best, ..)| cost < *best);
                second = second.min(if is_better {
                    best.map_or(f64::INFINITY, |it| it.0)
                } else {
                    cost
                });
                if is_better {
                    best = Some((cost, far, reading));
                }
                let flat = place.distance(&reading.flat());
                if nearest.is_none_or(|(near, _)| flat < near) {
                    nearest = Some((flat, reading.flat()));
                }
            }
        }
        let ((cost, far, mut reading), (flat, flat_reading)) = (best?, nearest?);
        let seen = 1.0 - self.settings.missed;
        let clutter = candidate.clutter * self.settings.clutter_per_m2;
        let mut weight = 0.0;
        let mut terms = [None; 2];
        if flat <= GATES[0] {
            // A heading may have been mistaken for another.
            let part = if reading.has_heading { MISTAKEN } else { 1.0 };
            weight += part * seen * place.likelihood(&flat_reading, flat) / clutter;
            terms[0] = Some((flat_reading, part * seen / clutter));
        }
        let is_clear = far <= GATES[1] && second - cost >= HEADING_SURE;
        if reading.has_heading && is_clear {
            let clutter = clutter * f64::from(turns) / TAU;
            weight += seen * place.likelihood(&reading, far) / clutter;
            terms[1] = Some((reading, seen / clutter));
        }
        reading.is_clear &= !reading.has_heading || is_clear;
        // Nobody asks for it where the own heading is known.
        let terms = if self.own_heading.variance > 0.0 {
            terms
        } else {
            [None; 2]
        };
        let mut likeness = Likeness::of(place, terms);
        if place.prior.look != candidate.look {
            // So little of it was seen that it may look otherwise; that proves nobody, and keeps others from being sure.
            weight *= MISTAKEN;
            likeness = likeness.times(MISTAKEN);
            reading.is_clear = false;
        }
        if weight <= 0.0 {
            return None;
        }
        let is_centred = centre_m.iter().all(|it| it.abs() < 1e-9);
        let most = self.settings.most_heading_sigma_rad;
        if reading.covariance[(2, 2)] > most * most && is_centred {
            reading.has_heading = false;
        }
        Some((reading, weight, likeness))
    }

    /// Says what is sure.
    pub(super) fn tell(&mut self) {
        self.work_out();
        let mut said = 0_u64;
        let mut doubted = 0_u64;
        for (place, odds) in self.odds.iter().enumerate() {
            let (pair, reading) = (self.pairs[place], &self.readings[place]);
            if !reading.is_clear
                || odds.own < self.settings.least_own
                || odds.others > self.settings.most_others
            {
                let is_doubted = odds.others > self.settings.most_others;
                doubted |= u64::from(is_doubted) << pair.seen;
                continue;
            }
            said |= 1 << pair.seen;
            let candidate = &self.candidates.all()[reading.candidate];
            if self.seen.len() < MOST_ROBOTS {
                self.seen.push(Seen {
                    robot: self.places[pair.robot].prior.robot,
                    time_s: reading.time_s,
                    beams: candidate.beams,
                    pose: reading.told_pose(),
                    covariance: reading.told_covariance(),
                    has_heading: reading.has_heading,
                });
            }
        }
        let ambiguous = (doubted & !said).count_ones();
        self.counts.seen += u64::from(said.count_ones());
        self.counts.ambiguous += u64::from(ambiguous);
        self.counts.nobody +=
            self.candidates.all().len() as u64 - u64::from(said.count_ones() + ambiguous);
    }
}
