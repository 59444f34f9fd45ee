//! What came of one robot.

use coloc_estimator::angle::wrap;
use coloc_estimator::{Decision, Estimate, FindingState, TickOutputs};
use nalgebra::Vector3;

use super::world::seconds;
use crate::honest::increment::Place;

/// A pose with a higher NEES is wrong: χ² with three degrees of freedom, 1e-6.
pub(super) const WRONG: f64 = 30.66;

/// When the NEES is looked at after it was found \[s\].
pub(super) const MOMENTS_S: [u32; 8] = [0, 1, 2, 5, 10, 20, 30, 60];

/// Who leaves `ok` so soon after the event had not been found yet, but not noticed \[s\].
const UNNOTICED_S: f64 = 20.0;

/// How many kinds of decisions there are.
const DECISIONS: usize = 5;

/// Of one robot. Times are counted from the event \[s\].
#[derive(Clone, Debug, Default, PartialEq)]
#[allow(clippy::struct_excessive_bools)] // Each is a fact of its own.
pub struct Outcome {
    /// Not `ok` for the first time.
    pub noticed_s: Option<f64>,
    /// Not `ok`, and what is published holds the truth, without a belief, for the first time; or found.
    pub placed_s: Option<f64>,
    /// `ok` and not wrong.
    pub found_s: Option<f64>,
    /// `lost` for the first time.
    pub lost_s: Option<f64>,
    /// Hypotheses that became the belief, and those of them that were wrong then.
    pub followed: u32,
    /// See `followed`.
    pub wrongly: u32,
    /// The longest time that it was `ok` and wrong, all of it, and when it was so for the last time.
    pub wrong_longest_s: f64,
    /// See `wrong_longest_s`.
    pub wrong_s: f64,
    /// See `wrong_longest_s`.
    pub wrong_last_s: f64,
    /// Not `ok`, and what is published does not hold the truth: how long.
    pub uncovered_s: f64,
    /// How often it left `ok`.
    pub alarms: u32,
    /// For how long it was not `ok`.
    pub not_ok_s: f64,
    /// How often an honest source stood against the belief.
    pub honest_named: u32,
    /// Whether the liar did, ever, and at the end.
    pub liar_named: bool,
    /// See `liar_named`.
    pub liar_at_end: bool,
    /// Whether it was `ok` and not wrong, 20 s after the event.
    pub right_at_20: bool,
    /// Whether it was `ok` and wrong at the end.
    pub ends_wrong: bool,
    /// NEES at `MOMENTS_S` after it was found, while `ok`.
    pub nees: [Option<f64>; MOMENTS_S.len()],
    /// Followed, dropped, widened, second chances, anew.
    pub decided: [u32; DECISIONS],
}

/// Looks at every tick.
#[derive(Clone, Debug, Default)]
pub(super) struct Watch {
    event: u32,
    liar: Option<u16>,
    was_ok: bool,
    named: u32,
    wrong_since: Option<u32>,
    found: Option<u32>,
    outcome: Outcome,
}

/// eᵀ P⁻¹ e of the pose; infinite where P says that something is certain.
fn nees(estimate: &Estimate, place: &Place) -> f64 {
    let [x, y] = place.position;
    let pose = estimate.belief.pose;
    let apart = Vector3::new(pose.x - x, pose.y - y, wrap(pose.phi - place.heading));
    let covariance = estimate.belief.total();
    let solved = covariance.matrix().cholesky().map(|it| it.solve(&apart));
    solved.map_or(f64::INFINITY, |solved| apart.dot(&solved))
}

impl Watch {
    /// From tick number `event` on.
    pub(super) fn new(event: u32, liar: Option<u16>, was_ok: bool) -> Self {
        Self {
            event,
            liar,
            was_ok,
            ..Self::default()
        }
    }

    /// How long ago it was found, in ticks.
    pub(super) fn found_for(&self, tick: u32) -> Option<u32> {
        self.found.map(|found| tick - found)
    }

    /// After a tick that took `stride` ticks of 20 ms.
    pub(super) fn see(&mut self, tick: u32, stride: u32, outputs: &TickOutputs<'_>, place: &Place) {
        let since_s = seconds(tick - self.event);
        let state = outputs.finding.state;
        let is_ok = state == FindingState::Ok;
        let nees = nees(&outputs.estimate, place);
        let is_right = nees <= WRONG;
        self.note_state(state, since_s, seconds(stride));
        self.note_names(outputs);
        self.note_decisions(outputs, is_ok && !is_right);
        self.note_wrong(tick, stride, is_ok && !is_right);
        if !is_ok && !is_right {
            self.outcome.uncovered_s += seconds(stride);
        }
        if !is_ok && is_right && state != FindingState::Contradicted {
            self.outcome.placed_s.get_or_insert(since_s);
        }
        if is_ok && is_right {
            self.outcome.placed_s.get_or_insert(since_s);
            self.outcome.found_s.get_or_insert(since_s);
            self.found.get_or_insert(tick);
        }
        if let Some(found) = self.found.filter(|_| is_ok) {
            let passed = tick - found;
            for (moment, sample) in MOMENTS_S.iter().zip(&mut self.outcome.nees) {
                let due = super::world::ticks(f64::from(*moment));
                if (due..due + stride).contains(&passed) {
                    *sample = Some(nees);
                }
            }
        }
        if since_s <= UNNOTICED_S {
            self.outcome.right_at_20 = is_ok && is_right;
        }
        self.was_ok = is_ok;
    }

    fn note_state(&mut self, state: FindingState, since_s: f64, took_s: f64) {
        let outcome = &mut self.outcome;
        if state == FindingState::Lost {
            outcome.lost_s.get_or_insert(since_s);
        }
        if state == FindingState::Ok {
            return;
        }
        outcome.noticed_s.get_or_insert(since_s);
        outcome.not_ok_s += took_s;
        if self.was_ok {
            outcome.alarms += 1;
            if since_s <= UNNOTICED_S {
                (outcome.found_s, outcome.placed_s, self.found) = (None, None, None);
                outcome.nees = Default::default();
            }
        }
    }

    fn note_names(&mut self, outputs: &TickOutputs<'_>) {
        let mut named = 0;
        self.outcome.liar_at_end = false;
        for dissent in outputs.finding.dissents() {
            if Some(dissent.source.number) == self.liar {
                (self.outcome.liar_named, self.outcome.liar_at_end) = (true, true);
            } else {
                named |= 1 << dissent.source.number;
            }
        }
        let anew: u32 = named & !self.named;
        self.outcome.honest_named += anew.count_ones();
        self.named = named;
    }

    fn note_decisions(&mut self, outputs: &TickOutputs<'_>, is_wrong: bool) {
        for (_, decision) in outputs.finding.decisions() {
            let kind = match decision {
                Decision::Followed { .. } => 0,
                Decision::Dropped { .. } => 1,
                Decision::Widened { .. } => 2,
                Decision::SecondChance { .. } => 3,
                Decision::Anew { .. } => 4,
                Decision::Set { .. } => continue, // Nobody sets a pose here.
            };
            self.outcome.decided[kind] += 1;
            if kind == 0 {
                self.outcome.followed += 1;
                self.outcome.wrongly += u32::from(is_wrong);
            }
        }
    }

    fn note_wrong(&mut self, tick: u32, stride: u32, is_wrong: bool) {
        self.outcome.ends_wrong = is_wrong;
        if !is_wrong {
            self.wrong_since = None;
            return;
        }
        let since = *self.wrong_since.get_or_insert(tick - stride);
        let outcome = &mut self.outcome;
        outcome.wrong_longest_s = outcome.wrong_longest_s.max(seconds(tick - since));
        outcome.wrong_s += seconds(stride);
        outcome.wrong_last_s = seconds(tick - self.event);
    }

    pub(super) fn outcome(self) -> Outcome {
        self.outcome
    }
}
