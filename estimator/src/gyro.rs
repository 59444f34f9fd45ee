//! A gyro beside the wheels: its bias, learnt while driving and while standing, and wheels that slip.
//!
//! # Model
//!
//! A gyro reads `ω + b + white noise`. The bias b is a random walk. Over a leg of the history of dt seconds the wheels measured the
//! increments `d = (x, y, Δ)` with the covariance D, of which q is that of Δ, and the gyro an angle with white noise of variance g.
//! With `v = Var(b)` and `c = Cov(pose, b)`, both in the two parts of the belief (`v = v_i + v_d`, `c = c_i + c_d`):
//!
//! ```text
//! ν = angle − Δ − b dt        S = q + g + v dt²
//! k = D e_Δ / S               K = c dt / S               κ = v dt² / S
//! d⁺ = d + k ν                x̂⁺ = x̂ + K ν               b⁺ = b + κ ν / dt
//! ```
//!
//! That is the Kalman filter's update of pose, bias and the increments of this leg by one number. Then the pose takes the step of
//! [`crate::honest`] with `d⁺`. What is learnt of the bias corrects the heading that it has bent before: `K`. Pose and increments
//! are correlated afterwards, and in the end pose and bias are. With `A` and `G` the step's maps, `a = A K`, `h = G k` and
//! `ρ = 1 − κ`, both parts go through one linear map each (Joseph's form), so that neither can lose its sign:
//!
//! ```text
//! P_i' = P_i − dt (K c_iᵀ + c_i Kᵀ) + (q + g + dt² v_i) K Kᵀ        D_i = (I − k eᵀ) D (I − k eᵀ)ᵀ + (g + dt² v_i) k kᵀ
//! P_d' = P_d − dt (K c_dᵀ + c_d Kᵀ) + dt² v_d K Kᵀ
//! P_i⁺ = step(P_i', D_i) − dt (m hᵀ + h mᵀ)                           m = A c_i + dt v_d a
//! P_d⁺ = step(P_d')      − dt (m hᵀ + h mᵀ) + dt² v_d h hᵀ            m = A c_d − dt v_d a
//! c_i⁺ = ρ (A c_i + dt v_d a) − dt (v_i + κ v_d) h                    v_i⁺ = ρ² v_i + κ² (q + g)/dt² + walk dt
//! c_d⁺ = ρ (A c_d − dt v_d (a + h))                                   v_d⁺ = ρ² v_d
//! ```
//!
//! A robot that stands says so by wheels with next to no noise: that teaches the bias within seconds, and nothing has to know that it
//! stands. The correlation between the bias and the direction, beyond what is linear, is neglected in the bend.
//!
//! # Fixes and headings
//!
//! What teaches the pose teaches the bias, by the same joint filter. With `π = P⁻¹ c` and what is left, `b − πᵀ x`, not touched by a
//! measurement of x, all of it follows from the belief before and after (`learn`).
//!
//! # Neighbours
//!
//! What a neighbour says may depend on our bias, by what we have told it. Split covariance intersection would count that by making the
//! bias more uncertain at every word: soon nothing would be left of it. So from the first word of a neighbour on, poses teach the bias
//! nothing and the bias moves no pose but forward (a Schmidt–Kalman filter). What wheels and standstills teach is our own.
//!
//! # Slip
//!
//! Where gyro and wheels part, the turn is the gyro's alone, and the bias learns nothing (`slip.rs`). A single sample of the gyro that
//! parts from the wheels and from its own neighbours is not used (`history/turns.rs`).

mod slip;

use crate::angle::wrap;
use crate::belief::Belief;
use crate::covariance::Covariance3;
use crate::factor::Factor;
use crate::history::Turned;
use crate::honest::{Map, Swept, step_with_column};
use crate::motion::Motion;
use crate::parts::Parts;
use crate::pose::Pose;
use crate::stamp::{Span, Stamp};
use crate::symmetric::{Square3, Symmetric3};
use slip::Parting;

/// The turn of wheels that are not believed: any \[rad²\].
const ANY_TURN: f64 = 100.0;

/// Wheels that slip are wrong by this part of the way …
const SLIPPED: f64 = 0.3;

/// … for so long \[s\].
const SLIP_S: f64 = 5.0;

/// The variance of a bias that became doubtful grows as fast as it is in this \[s\].
const DOUBTED_S: f64 = 5.0;

/// What a hypothesis ([`crate::found`]) has in common with the bias: so many seconds of it. A hypothesis is born and wins or loses
/// within some 20 s, and carries no correlation with the bias.
const HYPOTHESIS_S: f64 = 20.0;

/// How the gyro is.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct GyroSettings {
    /// Density of its white noise \[rad²/s\]: the square of what data sheets give in rad/s/√Hz.
    pub noise: f64,
    /// Variance for each radian turned \[rad²/rad\]: of its scale, and of how it is mounted.
    pub noise_per_turn: f64,
    /// The bias at the start \[rad/s\].
    pub bias: f64,
    /// Its variance \[rad²/s²\].
    pub bias_variance: f64,
    /// How fast the bias walks: its variance grows by so much in a second \[rad²/s³\].
    pub bias_walk: f64,
    /// From one sample to the next.
    pub period: Span,
}

/// What is known of the gyro.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct GyroState {
    /// Its bias \[rad/s\].
    pub bias: f64,
    /// Variance of the bias \[rad²/s²\].
    pub bias_variance: f64,
    /// Since when the wheels slip.
    pub slipping_since: Option<Stamp>,
    /// So many of its samples were wild, since the start: they were not used.
    pub wild: u32,
}

/// The bias, its error jointly with the pose's, and how wheels and gyro agree.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub(crate) struct Bias {
    mean: f64,
    independent: Row,
    dependent: Row,
    /// A neighbour was heard.
    heard: bool,
    parting: Parting,
    /// So many of the gyro's samples.
    wild: u32,
}

/// The bias in one of the two parts of the covariance.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
struct Row {
    /// c \[m·rad/s, m·rad/s, rad²/s\]
    with_pose: [f64; 3],
    /// v \[rad²/s²\]
    variance: f64,
}

/// A leg of the history, as wheels and gyro measured it.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Passage {
    pub(crate) from: Stamp,
    pub(crate) dt_s: f64,
    pub(crate) motion: Motion,
    /// The wheels measured the motion then.
    pub(crate) is_measured: bool,
    /// By the gyro, if it covers the leg.
    pub(crate) turned: Option<Turned>,
}

/// A leg after the gyro's angle was fused with the wheels.
#[derive(Copy, Clone, Debug)]
struct Fused {
    dt_s: f64,
    /// `d⁺`
    held: [f64; 3],
    /// `D_i`
    noise: Symmetric3,
    /// k
    gain: [f64; 3],
    /// `ν / S`
    innovation: f64,
    /// `1/S`, zero where nothing is learnt.
    learnt: f64,
    /// q + g
    white: f64,
    /// v dt²
    common: f64,
}

impl GyroSettings {
    /// One of a phone or a small robot: 0.01 °/s/√Hz, 0.1° after a radian, 3 °/s of bias at the start that walks by 0.01 °/s in a
    /// minute, 200 Hz.
    pub const ORDINARY: Self = Self {
        noise: 1.7e-4 * 1.7e-4,
        noise_per_turn: 1.7e-3 * 1.7e-3,
        bias: 0.0,
        bias_variance: 0.05 * 0.05,
        bias_walk: 2.2e-5 * 2.2e-5,
        period: Span::from_millis(5),
    };

    /// The density of a sample that says this of its own.
    #[inline]
    pub(crate) fn density(&self, said: f64) -> f64 {
        if said > 0.0 { said } else { self.noise }
    }
}

impl Bias {
    /// As it is at the start.
    pub(crate) fn beginning(settings: &GyroSettings) -> Self {
        Self {
            mean: settings.bias,
            independent: Row {
                with_pose: [0.0; 3],
                variance: settings.bias_variance,
            },
            ..Self::default()
        }
    }

    pub(crate) fn state(&self) -> GyroState {
        GyroState {
            bias: self.mean,
            bias_variance: self.variance(),
            slipping_since: self.parting.since,
            wild: self.wild,
        }
    }

    pub(crate) fn mean(&self) -> f64 {
        self.mean
    }

    #[inline]
    fn variance(&self) -> f64 {
        self.independent.variance + self.dependent.variance
    }

    #[inline]
    fn with_pose(&self) -> [f64; 3] {
        plus(self.independent.with_pose, 1.0, self.dependent.with_pose)
    }

    /// Brings `belief` over the leg; gives the arc that the leg was.
    #[inline]
    pub(crate) fn predict(
        &mut self,
        belief: &mut Belief,
        passage: &Passage,
        settings: &GyroSettings,
    ) -> [f64; 3] {
        let Some(fused) = self.fuse(passage) else {
            return self.predict_blind(belief, passage, settings);
        };
        let gain = self.gain_on_pose(&fused);
        self.correct(belief, &fused, gain);
        let (swept, column) =
            Swept::arc_with(belief.pose.phi, fused.held, &fused.noise, fused.gain);
        let (moved, column) = step_with_column(belief, &swept, column);
        let ahead = moved.map.apply(gain);
        *belief = moved.belief;
        self.carry(&moved.map);
        self.correlate(&mut belief.parts, &fused, ahead, column);
        self.learn_by_turn(&fused, ahead, column);
        self.dependent.hold(&belief.parts.dependent);
        self.walk(fused.dt_s, settings);
        fused.held
    }

    /// By the wheels alone.
    #[inline(never)]
    fn predict_blind(
        &mut self,
        belief: &mut Belief,
        passage: &Passage,
        settings: &GyroSettings,
    ) -> [f64; 3] {
        let motion = self.bridged(passage);
        let swept = motion.swept(belief.pose.phi, passage.dt_s);
        let (moved, _) = step_with_column(belief, &swept, [0.0; 3]);
        *belief = moved.belief;
        self.carry(&moved.map);
        self.dependent.hold(&belief.parts.dependent);
        self.walk(passage.dt_s, settings);
        motion.velocity().map(|it| passage.dt_s * it)
    }

    /// The motion of the leg for whoever knows nothing of the bias, and what the leg teaches of it.
    pub(crate) fn drive(&mut self, passage: &Passage, settings: &GyroSettings) -> Motion {
        let motion = if let Some(fused) = self.fuse(passage) {
            let all = self.variance();
            self.learn_by_turn(&fused, [0.0; 3], [0.0; 3]);
            fused.motion_alone(all)
        } else {
            self.bridged(passage)
        };
        self.walk(passage.dt_s, settings);
        motion
    }

    /// A velocity and the covariance of its mean over `period_s`, its turn fused with what the gyro reads: a rate, and the density of its
    /// noise.
    pub(crate) fn turning(
        &self,
        (velocity, covariance): &([f64; 3], Covariance3),
        [rate, density]: [f64; 2],
        period_s: f64,
        is_known: bool,
    ) -> ([f64; 3], Covariance3) {
        let mut noise = covariance.symmetric();
        if !is_known || self.parting.since.is_some() {
            (noise.xp, noise.yp, noise.pp) = (0.0, 0.0, ANY_TURN);
        }
        let own = density / period_s + self.variance();
        let sum = noise.pp + own;
        let [_, _, turn] = *velocity;
        let gain = [noise.xp, noise.yp, noise.pp].map(|it| it / sum);
        let fused = plus(*velocity, rate - self.mean - turn, gain);
        (
            fused,
            Covariance3::trusted(&after(&noise, gain, sum, own, own)),
        )
    }

    /// The wheels alone. Where they slip and the gyro's samples were lost, it goes on turning as it did, to half of that.
    #[inline]
    fn bridged(&mut self, passage: &Passage) -> Motion {
        let Some(missing) = self.parting.bridge(passage.dt_s) else {
            return passage.motion;
        };
        let dt_s = passage.dt_s;
        let (held, noise) = slipped(passage);
        let noise = Symmetric3 {
            pp: noise.pp + 0.25 * missing * missing,
            ..noise
        };
        moving(plus(held, missing, [0.0, 0.0, 1.0]), &noise, dt_s)
    }

    /// `None` where there is nothing to fuse.
    #[inline]
    fn fuse(&mut self, passage: &Passage) -> Option<Fused> {
        let (turned, dt_s) = (passage.turned?, passage.dt_s);
        self.wild = self.wild.saturating_add_signed(turned.wild);
        let (held, mut noise) = passage.motion.held_over(dt_s);
        let [_, _, turn] = held;
        let common = self.variance() * dt_s * dt_s;
        let innovation = turned.angle - turn - self.mean * dt_s;
        let sum = noise.pp + turned.variance + common;
        let is_believed =
            passage.is_measured && self.parting.judge(passage.from, dt_s, innovation, sum);
        if !is_believed {
            if passage.is_measured {
                (_, noise) = slipped(passage);
            }
            (noise.xp, noise.yp, noise.pp) = (0.0, 0.0, ANY_TURN);
        }
        let white = noise.pp + turned.variance;
        let sum = white + common;
        if !(sum > 0.0 && innovation.is_finite()) {
            return None;
        }
        let gain = [noise.xp, noise.yp, noise.pp].map(|it| it / sum);
        let independent = turned.variance + self.independent.variance * dt_s * dt_s;
        Some(Fused {
            dt_s,
            held: plus(held, innovation, gain),
            noise: after(&noise, gain, sum, turned.variance + common, independent),
            gain,
            innovation: innovation / sum,
            learnt: if is_believed { 1.0 / sum } else { 0.0 },
            white,
            common,
        })
    }

    /// K
    #[inline]
    fn gain_on_pose(&self, fused: &Fused) -> [f64; 3] {
        if self.heard {
            return [0.0; 3];
        }
        self.with_pose().map(|it| it * fused.dt_s * fused.learnt)
    }

    /// Corrects the belief before the leg by what the leg teaches of the bias.
    #[inline]
    fn correct(&self, belief: &mut Belief, fused: &Fused, gain: [f64; 3]) {
        if is_zero(gain) {
            return;
        }
        let dt_s = fused.dt_s;
        let [dx, dy, dphi] = gain.map(|it| it * fused.innovation / fused.learnt);
        let taken = |part: &Covariance3, row: &Row, white: f64| {
            let square = white + dt_s * dt_s * row.variance;
            part.symmetric() + Symmetric3::outer(square, gain) - both(gain, row.with_pose) * dt_s
        };
        let independent = taken(&belief.parts.independent, &self.independent, fused.white);
        let dependent = taken(&belief.parts.dependent, &self.dependent, 0.0);
        let (Pose { x, y, phi }, heading) = (belief.pose, independent.pp + dependent.pp);
        belief.bend = belief.bend.shrunk(belief.heading_variance(), heading);
        belief.pose = Pose::new(x + dx, y + dy, phi + dphi);
        belief.parts = parts(&independent, &dependent);
    }

    /// The correlation of pose and increments in the parts after the step. The rows have taken it.
    #[inline]
    fn correlate(&self, stepped: &mut Parts, fused: &Fused, ahead: [f64; 3], column: [f64; 3]) {
        let dt_s = fused.dt_s;
        let common = dt_s * self.dependent.variance;
        let (of_own, of_others) = (
            plus(self.independent.with_pose, common, ahead),
            plus(self.dependent.with_pose, -common, ahead),
        );
        let independent = stepped.independent.symmetric() - both(of_own, column) * dt_s;
        let dependent = stepped.dependent.symmetric() - both(of_others, column) * dt_s
            + Symmetric3::outer(dt_s * common, column);
        *stepped = parts(&independent, &dependent);
    }

    /// `A c`
    #[inline]
    fn carry(&mut self, map: &Map) {
        self.independent.with_pose = map.apply(self.independent.with_pose);
        self.dependent.with_pose = map.apply(self.dependent.with_pose);
    }

    /// The bias and its rows, which the step has carried.
    #[inline]
    fn learn_by_turn(&mut self, fused: &Fused, ahead: [f64; 3], column: [f64; 3]) {
        let Fused { dt_s, learnt, .. } = *fused;
        let (own, others) = (self.independent.variance, self.dependent.variance);
        let (taken, left) = if learnt > 0.0 {
            (fused.common * learnt, fused.white * learnt)
        } else {
            (0.0, 1.0)
        };
        let turned = plus(ahead, 1.0, column);
        if learnt > 0.0 {
            self.mean += (own + others) * dt_s * fused.innovation;
        }
        let by_own = plus(self.independent.with_pose, dt_s * others, ahead);
        let by_others = plus(self.dependent.with_pose, -dt_s * others, turned);
        self.independent.with_pose = plus(
            by_own.map(|it| left * it),
            -dt_s * (own + taken * others),
            column,
        );
        self.dependent.with_pose = by_others.map(|it| left * it);
        // κ² (q + g)/dt² = κ v ρ
        self.independent.variance = left * (left * own + taken * (own + others));
        self.dependent.variance = left * left * others;
    }

    /// A bias of which wheels and gyro have disagreed for too long is doubtful again.
    #[inline]
    fn walk(&mut self, dt_s: f64, settings: &GyroSettings) {
        let doubt = if self.parting.is_long() {
            (settings.bias_variance + self.variance()) / DOUBTED_S
        } else {
            0.0
        };
        self.independent.variance += (settings.bias_walk + doubt) * dt_s;
    }

    /// What a measurement of the pose, its gain the Kalman filter's, teaches of the bias.
    pub(crate) fn learn(&mut self, before: &Belief, after: &Belief) {
        let all = self.with_pose();
        if is_zero(all) && is_zero(self.independent.with_pose) {
            return;
        }
        let inverse = Factor::new(&before.total().symmetric()).inverse();
        let left = after.total().symmetric();
        if self.heard {
            let shrunk = |c: [f64; 3]| left.apply(inverse.apply(c));
            self.independent.with_pose = shrunk(self.independent.with_pose);
            self.dependent.with_pose = shrunk(self.dependent.with_pose);
            return;
        }
        let slope = inverse.apply(all);
        self.mean += dot(slope, moved(&before.pose, &after.pose));
        let own = before.parts.independent.symmetric();
        let beside = plus(self.independent.with_pose, -1.0, own.apply(slope));
        let beside = left.apply(inverse.apply(beside));
        let (before, after) = (&before.parts, &after.parts);
        self.independent =
            self.independent
                .learnt(slope, [&before.independent, &after.independent], beside);
        self.dependent = self.dependent.learnt(
            slope,
            [&before.dependent, &after.dependent],
            beside.map(|it| -it),
        );
    }

    /// A measurement of the pose that leaves `complement` of its error and teaches nothing of the bias.
    pub(crate) fn stand(&mut self, complement: &Square3) {
        self.independent.with_pose = complement.apply(self.independent.with_pose);
        self.dependent.with_pose = complement.apply(self.dependent.with_pose);
    }

    /// A neighbour's word was fused.
    pub(crate) fn hear(&mut self, complement: &Square3) {
        self.heard = true;
        self.stand(complement);
    }

    /// All that was known is now shared.
    #[inline]
    pub(crate) fn make_dependent(&mut self) {
        self.dependent = Row {
            with_pose: self.with_pose(),
            variance: self.variance(),
        };
        self.independent = Row::default();
    }

    /// The pose is another one, of which it is not known how it depends on the bias.
    pub(crate) fn forget_pose(&mut self) {
        self.make_dependent();
        self.dependent.with_pose = [0.0; 3];
    }
}

impl Row {
    /// A bias that depends on more of the pose than the part has of it is as uncertain as that takes.
    ///
    /// The bend may take from the dependent part what the row still has: their own correlation is neglected.
    #[inline]
    fn hold(&mut self, part: &Covariance3) {
        if is_zero(self.with_pose) {
            return;
        }
        let part = part.symmetric();
        let factor = Factor::new(&part);
        let held = factor.held(&part, self.with_pose);
        self.with_pose = Square3::IDENTITY.columns(&factor).apply(held);
        self.variance = self.variance.max(factor.explained(held));
    }

    /// After a measurement that made of the part before what is after, `slope` the regression of the bias on the pose and `beside` what
    /// the part has beside it.
    fn learnt(&self, slope: [f64; 3], parts: [&Covariance3; 2], beside: [f64; 3]) -> Self {
        let [before, after] = parts.map(|part| part.symmetric().apply(slope));
        let unexplained = self.variance - 2.0 * dot(slope, self.with_pose) + dot(slope, before);
        let variance = unexplained + dot(slope, after) + 2.0 * dot(slope, beside);
        Self {
            with_pose: plus(after, 1.0, beside),
            variance: variance.max(0.0),
        }
    }
}

impl Fused {
    /// With all that the bias does to a robot that has had it for long; `variance` is its own.
    fn motion_alone(&self, variance: f64) -> Motion {
        let noise = Symmetric3 {
            pp: self.noise.pp + variance * HYPOTHESIS_S * self.dt_s,
            ..self.noise
        };
        moving(self.held, &noise, self.dt_s)
    }
}

/// What moves by this in a time.
#[inline]
fn moving(held: [f64; 3], noise: &Symmetric3, dt_s: f64) -> Motion {
    let rate = 1.0 / dt_s;
    Motion::Holonomic {
        velocity: held.map(|it| it * rate),
        noise: Covariance3::trusted(&(*noise * (rate * rate))),
    }
}

/// What wheels that slip say of a leg.
fn slipped(passage: &Passage) -> ([f64; 3], Symmetric3) {
    let (held, noise) = passage.motion.held_over(passage.dt_s);
    let [x, y, _] = passage.motion.velocity();
    let added = SLIPPED * SLIPPED * SLIP_S * passage.dt_s * (x * x + y * y);
    let noise = Symmetric3 {
        xx: noise.xx + added,
        yy: noise.yy + added,
        ..noise
    };
    (held, noise)
}

/// `D_i` by the gain `k = D e/S`; `rest` is S without D, `own` as much of it as is independent. What is left of the turn is a product,
/// no difference.
#[inline]
fn after(d: &Symmetric3, gain: [f64; 3], sum: f64, rest: f64, own: f64) -> Symmetric3 {
    let left = rest / sum;
    let [kx, ky, kp] = gain;
    let taken = own - (sum + rest);
    Symmetric3 {
        xx: d.xx + taken * kx * kx,
        yy: d.yy + taken * ky * ky,
        xy: d.xy + taken * kx * ky,
        xp: left * left * d.xp + own * kx * kp,
        yp: left * left * d.yp + own * ky * kp,
        pp: left * left * d.pp + own * kp * kp,
    }
}

fn moved(before: &Pose, after: &Pose) -> [f64; 3] {
    [
        after.x - before.x,
        after.y - before.y,
        wrap(after.phi - before.phi),
    ]
}

#[inline]
fn parts(independent: &Symmetric3, dependent: &Symmetric3) -> Parts {
    Parts {
        independent: Covariance3::trusted(independent),
        dependent: Covariance3::trusted(dependent),
    }
}

/// `a bᵀ + b aᵀ`
#[inline]
fn both([ax, ay, ap]: [f64; 3], [bx, by, bp]: [f64; 3]) -> Symmetric3 {
    Symmetric3 {
        xx: 2.0 * ax * bx,
        yy: 2.0 * ay * by,
        xp: ax * bp + ap * bx,
        yp: ay * bp + ap * by,
        xy: ax * by + ay * bx,
        pp: 2.0 * ap * bp,
    }
}

#[inline]
fn is_zero(v: [f64; 3]) -> bool {
    v.iter().all(|it| *it == 0.0)
}

/// `a + w b`
#[inline]
fn plus([ax, ay, ap]: [f64; 3], w: f64, [bx, by, bp]: [f64; 3]) -> [f64; 3] {
    [ax + w * bx, ay + w * by, ap + w * bp]
}

#[inline]
fn dot([ax, ay, ap]: [f64; 3], [bx, by, bp]: [f64; 3]) -> f64 {
    ax * bx + ay * by + ap * bp
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix4;

    use super::*;
    use crate::covariance::Covariance2;
    use crate::fix;
    use crate::history::Turned;

    /// Divided by its standard deviations.
    fn joint(part: &Covariance3, row: &Row) -> Matrix4<f64> {
        let mut all = Matrix4::zeros();
        all.fixed_view_mut::<3, 3>(0, 0).copy_from(&part.matrix());
        for (at, entry) in row.with_pose.into_iter().enumerate() {
            (all[(at, 3)], all[(3, at)]) = (entry, entry);
        }
        all[(3, 3)] = row.variance;
        let scale = all
            .diagonal()
            .map(|it| if it > 0.0 { 1.0 / libm::sqrt(it) } else { 0.0 });
        Matrix4::from_fn(|a, b| all[(a, b)] * scale[a] * scale[b])
    }

    fn assert_semidefinite(belief: &Belief, bias: &Bias, at: u32) {
        let pairs = [
            (&belief.parts.independent, &bias.independent),
            (&belief.parts.dependent, &bias.dependent),
        ];
        for (part, row) in pairs {
            let joint = joint(part, row);
            let smallest = joint.symmetric_eigenvalues().min();
            assert!(smallest > -1e-9, "{at}: {smallest:e} of {joint}");
        }
    }

    fn passage(at: u32, turn: f64) -> Passage {
        let stands = (at / 200) % 3 == 1;
        let noise = if stands {
            [1e-10, 1e-10, 1e-8]
        } else {
            [1e-3, 1e-4, 1e-3]
        };
        let motion = Motion::Holonomic {
            velocity: if stands { [0.0; 3] } else { [1.0, 0.1, turn] },
            noise: Covariance3::diagonal(noise).unwrap(),
        };
        Passage {
            from: Stamp::default(),
            dt_s: 0.02,
            motion,
            is_measured: !at.is_multiple_of(7),
            turned: (!at.is_multiple_of(11)).then_some(Turned {
                angle: 0.02 * (if stands { 0.03 } else { turn + 0.03 }),
                variance: 1e-8,
                wild: 0,
            }),
        }
    }

    /// Legs with and without gyro and wheels, fixes, words that are told and heard.
    #[test]
    fn each_part_stays_a_covariance_of_pose_and_bias() {
        for hears in [false, true] {
            let independent = Covariance3::diagonal([1e-4, 1e-4, 1e-2]).unwrap();
            let mut belief = Belief::independent(Pose::default(), independent);
            let mut bias = Bias::beginning(&GyroSettings::ORDINARY);
            for at in 0..3000_u32 {
                let turn = libm::sin(0.01 * f64::from(at));
                let passage = passage(at, turn);
                bias.predict(&mut belief, &passage, &GyroSettings::ORDINARY);
                assert_semidefinite(&belief, &bias, at);
                if at % 50 == 20 {
                    let noise = Covariance2::diagonal([1e-3, 1e-2]).unwrap();
                    let position = [belief.pose.x + 0.01, belief.pose.y - 0.01];
                    let after = fix::update(&belief, position, &noise, f64::INFINITY).belief;
                    bias.learn(&belief, &after);
                    belief = after;
                    assert_semidefinite(&belief, &bias, at);
                }
                if at % 170 == 100 {
                    belief.make_dependent();
                    bias.make_dependent();
                }
                if hears && at % 500 == 400 {
                    let received = crate::GlobalPose {
                        pose: belief.pose,
                        parts: Parts::dependent(Covariance3::diagonal([1e-3; 3]).unwrap()),
                    };
                    let settings = crate::FusionSettings::default();
                    let mut left = Square3::IDENTITY;
                    let fusion =
                        crate::fusion::fuse_and_leave(&belief, &received, &settings, &mut left);
                    bias.hear(&left);
                    belief = fusion.belief;
                    assert_semidefinite(&belief, &bias, at);
                }
            }
            let sigma = libm::sqrt(bias.variance());
            assert!(
                (bias.mean - 0.03).abs() < 4.0 * sigma && sigma < 1e-3,
                "{sigma}"
            );
        }
    }
}
