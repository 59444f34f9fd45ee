//! A robot's own part between rounds, made for the thread that ticks: `x̂`, P and Ψ, with a history.
//!
//! ```text
//! odometry:   x̂ ← f(x̂, u), P ← Φ P Φᵀ + Q, Ψ ← Φ Ψ
//! fix:        silent (the others' gain is zero): x̂ += K r, P −= K S Kᵀ, Ψ ← (I − K H) Ψ
//! slot:       what is believed now is shared
//! correction: the belief at its slot is replaced, Ψ := I, and all that came since is applied again
//! ```
//!
//! A correction is an entry of the history like any other, so a late one gives the bits of a prompt one. Where the history has forgotten
//! the slot, it is applied to first order: `x̂ += Ψ (x̂⁺ − x̂(s))`, `P −= Ψ (P(s) − P⁺) Ψᵀ` with what was shared at s.
//!
//! Nothing here allocates after [`Member::new`], and nothing depends on how many robots there are.

use std::collections::VecDeque;

use coloc_estimator::angle::wrap;
use coloc_estimator::rounds::{Correction, Refusal, Shared, Standing, gate};
use coloc_estimator::{Covariance2, Motion, Pose};
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use crate::joint::Outcome;
use crate::model;

/// Beliefs that were shared are remembered for so many slots.
const SHARES: usize = 64;

/// What a robot knows of itself.
#[derive(Copy, Clone, Debug, PartialEq)]
struct State {
    pose: Pose,
    covariance: Matrix3<f64>,
    psi: Matrix3<f64>,
    standing: Standing,
}

/// What happens to a robot.
#[derive(Copy, Clone, Debug, PartialEq)]
enum Event {
    Drive {
        motion: Motion,
        dt_s: f64,
    },
    Fix {
        position: [f64; 2],
        noise: Covariance2,
    },
    Slot,
    Correction(Correction),
}

#[derive(Copy, Clone, Debug)]
struct Entry {
    /// \[ns\], the end of a drive.
    stamp_ns: i64,
    before: State,
    event: Event,
}

/// How a robot is set.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Settings {
    /// Robots in the team, of which a block bound is at most.
    pub robots: usize,
    /// χ² of fixes, two degrees of freedom.
    pub fix_gate: f64,
    /// χ² of corrections, three degrees of freedom.
    pub correction_gate: f64,
    /// Entries of the history.
    pub history: usize,
}

/// How a correction was taken.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Taken {
    /// In the history: as if it had come at once.
    Exact,
    /// After it, to first order.
    FirstOrder,
}

/// A robot's own part.
#[derive(Clone, Debug)]
pub struct Member {
    settings: Settings,
    now: State,
    now_ns: i64,
    history: VecDeque<Entry>,
    shares: VecDeque<Shared>,
}

impl Member {
    /// A robot that is at `pose`, of covariance P, at `stamp_ns`.
    #[must_use]
    pub fn new(
        settings: Settings,
        stamp_ns: i64,
        (pose, covariance): (Pose, Matrix3<f64>),
        standing: Standing,
    ) -> Self {
        Self {
            settings,
            now: State {
                pose,
                covariance,
                psi: Matrix3::identity(),
                standing,
            },
            now_ns: stamp_ns,
            history: VecDeque::with_capacity(settings.history + 1),
            shares: VecDeque::with_capacity(SHARES + 1),
        }
    }

    /// Where it believes to be, and P.
    #[must_use]
    pub fn estimate(&self) -> (Pose, Matrix3<f64>) {
        (self.now.pose, self.now.covariance)
    }

    /// What its cross-covariances refer to.
    #[must_use]
    pub fn standing(&self) -> Standing {
        self.now.standing
    }

    /// `dt_s` seconds of `motion` that end at `stamp_ns`, later than all before.
    pub fn drive(&mut self, stamp_ns: i64, motion: Motion, dt_s: f64) {
        self.now_ns = self.now_ns.max(stamp_ns);
        self.append(stamp_ns, Event::Drive { motion, dt_s });
    }

    /// A fix \[m\] at `stamp_ns`, now or within the history; an older one is not taken.
    pub fn fix(&mut self, stamp_ns: i64, position: [f64; 2], noise: Covariance2) -> Outcome {
        let event = Event::Fix { position, noise };
        let refused = Outcome {
            accepted: false,
            d2: f64::INFINITY,
        };
        if !position.iter().all(|it| it.is_finite()) || stamp_ns > self.now_ns {
            return refused;
        }
        let place = self.after(stamp_ns);
        if place == 0 && stamp_ns < self.now_ns {
            return refused;
        }
        let before = self.before(place);
        let outcome = silent_fix(&before, position, &noise, self.settings.fix_gate).1;
        // One that the gate refuses may pass it once a correction has come, and the other way round.
        self.insert(place, stamp_ns, event);
        outcome
    }

    /// What is believed at `slot`, which is now: to be shared.
    pub fn share(&mut self, slot: u64) -> Shared {
        let shared = Shared {
            slot,
            pose: self.now.pose,
            covariance: self.now.covariance,
            psi: self.now.psi,
            standing: self.now.standing,
        };
        self.append(self.now_ns, Event::Slot);
        if self.shares.len() == SHARES {
            self.shares.pop_front();
        }
        self.shares.push_back(shared);
        shared
    }

    /// Takes a correction that passes the [`gate`].
    ///
    /// # Errors
    /// Why it is refused; nothing has changed then.
    pub fn correct(&mut self, told: &Correction) -> Result<Taken, Refusal> {
        let mut shares = self.shares.iter();
        let shared = *shares
            .find(|shared| shared.slot == told.slot)
            .ok_or(Refusal::TookNoPart)?;
        if shared.standing != self.now.standing {
            return Err(Refusal::TookNoPart);
        }
        let robots = self.settings.robots;
        gate::check(&shared, told, robots, self.settings.correction_gate)?;
        if let Some(place) = self.slot_in_history(&shared) {
            let stamp_ns = self.history[place].stamp_ns;
            self.insert(place + 1, stamp_ns, Event::Correction(*told));
            return Ok(Taken::Exact);
        }
        self.correct_late(&shared, told).map(|()| Taken::FirstOrder)
    }

    /// Forgets every correction of a later round than that of slot `last`, of all if `None`: the team went on without them. Whether
    /// that could be; if not, nothing has changed, and the robot has to [`join`](Self::join) again.
    pub fn undo(&mut self, last: Option<u64>) -> bool {
        let is_later = |entry: &Entry| match entry.event {
            Event::Correction(told) => last.is_none_or(|last| told.slot > last),
            _ => false,
        };
        let Some(place) = self.history.iter().position(is_later) else {
            return false;
        };
        let state = self.history[place].before;
        let is_on_the_way = match (state.standing, last) {
            (Standing::Since(slot), Some(last)) => slot <= last,
            (Standing::Since(_), None) => false,
            (Standing::Joining(from), last) => last.is_none_or(|last| last < from),
        };
        if !is_on_the_way {
            return false;
        }
        let mut index = place;
        while index < self.history.len() {
            if matches!(self.history[index].event, Event::Correction(_)) {
                self.history.remove(index);
            } else {
                index += 1;
            }
        }
        self.replay(place, state);
        true
    }

    /// Begins anew at the slots from `slot` on: what is shared with others is unknown from now on.
    pub fn join(&mut self, slot: u64) {
        self.history.clear();
        self.shares.clear();
        self.now.psi = Matrix3::identity();
        self.now.standing = Standing::Joining(slot);
    }

    fn append(&mut self, stamp_ns: i64, event: Event) {
        self.insert(self.history.len(), stamp_ns, event);
    }

    /// The place after all entries up to `stamp_ns`.
    fn after(&self, stamp_ns: i64) -> usize {
        self.history
            .partition_point(|entry| entry.stamp_ns <= stamp_ns)
    }

    fn before(&self, place: usize) -> State {
        self.history
            .get(place)
            .map_or(self.now, |entry| entry.before)
    }

    fn insert(&mut self, place: usize, stamp_ns: i64, event: Event) {
        let before = self.before(place);
        let entry = Entry {
            stamp_ns,
            before,
            event,
        };
        self.history.insert(place, entry);
        self.replay(place, before);
        if self.history.len() > self.settings.history {
            self.history.pop_front();
        }
    }

    /// Goes through everything again from `place` on, before which it was `state`.
    fn replay(&mut self, place: usize, mut state: State) {
        for entry in self.history.range_mut(place..) {
            entry.before = state;
            state = after(&state, &entry.event, self.settings.fix_gate);
        }
        self.now = state;
    }

    /// Where the slot stands from which `shared` was.
    fn slot_in_history(&self, shared: &Shared) -> Option<usize> {
        let mut slots = self.shares.iter().rev();
        let later = slots.position(|it| it.slot == shared.slot)?;
        let is_slot = |(_, entry): &(usize, &Entry)| entry.event == Event::Slot;
        let mut entries = self.history.iter().enumerate().rev().filter(is_slot);
        entries.nth(later).map(|(place, _)| place)
    }

    fn correct_late(&mut self, shared: &Shared, told: &Correction) -> Result<(), Refusal> {
        let back = shared.psi.try_inverse().ok_or(Refusal::TookNoPart)?;
        let since = self.now.psi * back;
        let Pose { x, y, phi } = shared.pose;
        let turn = wrap(told.pose.phi - phi);
        let moved = since * Vector3::new(told.pose.x - x, told.pose.y - y, turn);
        let learned = shared.covariance - told.covariance;
        let covariance = symmetric(&(self.now.covariance - since * learned * since.transpose()));
        if covariance.cholesky().is_none() {
            return Err(Refusal::NotABelief);
        }
        let Pose { x, y, phi } = self.now.pose;
        self.now = State {
            pose: Pose::new(x + moved.x, y + moved.y, phi + moved.z),
            covariance,
            psi: since,
            standing: Standing::Since(told.slot),
        };
        self.history.clear();
        Ok(())
    }
}

fn after(state: &State, event: &Event, fix_gate: f64) -> State {
    match event {
        Event::Drive { motion, dt_s } => {
            let step = model::drive(&state.pose, motion, *dt_s);
            let phi = step.jacobian;
            State {
                pose: step.pose,
                covariance: symmetric(&(phi * state.covariance * phi.transpose() + step.noise)),
                psi: phi * state.psi,
                ..*state
            }
        }
        Event::Fix { position, noise } => silent_fix(state, *position, noise, fix_gate).0,
        Event::Slot => *state,
        Event::Correction(told) => State {
            pose: told.pose,
            covariance: told.covariance,
            psi: Matrix3::identity(),
            standing: Standing::Since(told.slot),
        },
    }
}

fn silent_fix(
    state: &State,
    position: [f64; 2],
    noise: &Covariance2,
    gate: f64,
) -> (State, Outcome) {
    let across = state.covariance.fixed_columns::<2>(0).into_owned();
    let innovation = Vector2::new(position[0] - state.pose.x, position[1] - state.pose.y);
    let s: Matrix2<f64> = across.fixed_rows::<2>(0) + noise.matrix();
    let refused = |d2| {
        let outcome = Outcome {
            accepted: false,
            d2,
        };
        (*state, outcome)
    };
    let Some(inverse) = s.cholesky().map(|root| root.inverse()) else {
        return refused(f64::INFINITY);
    };
    let d2 = innovation.dot(&(inverse * innovation));
    if d2.is_nan() || d2 > gate {
        return refused(d2);
    }
    let gain = across * inverse;
    let step = gain * innovation;
    let mut left = Matrix3::identity();
    let mut columns = left.fixed_columns_mut::<2>(0);
    columns -= gain;
    let Pose { x, y, phi } = state.pose;
    let updated = State {
        pose: Pose::new(x + step.x, y + step.y, phi + step.z),
        covariance: symmetric(&(state.covariance - gain * across.transpose())),
        psi: left * state.psi,
        ..*state
    };
    (updated, Outcome { accepted: true, d2 })
}

fn symmetric(matrix: &Matrix3<f64>) -> Matrix3<f64> {
    0.5 * (matrix + matrix.transpose())
}
