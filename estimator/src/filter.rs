//! The filter behind the history: all that is specific to split covariance intersection, in five operations.
//!
//! The history knows when things happened and in which order they act; what they do to the belief is said here alone.
//! Another filter takes this one's place by offering the same: *predict* over time, *tell* a robot where it is seen,
//! *hear* what it says, *correct* by a fix, and *settle* what an exchange leaves behind.

use nalgebra::Matrix3;

use crate::assist::bond::Bonds;
use crate::assist::change::Change;
use crate::assist::cross;
use crate::assist::ties::Said;
use crate::belief::Belief;
use crate::convert::{GlobalPose, tell};
use crate::covariance::Covariance3;
use crate::fix::FixUpdate;
use crate::found::{Gauge, OPEN, Start};
use crate::fusion::fuse_and_leave;
use crate::gyro::{Bias, GyroSettings, GyroState, Passage};
use crate::heading::{self, HeadingNoise};
use crate::honest::{Moved, ThereAndBack, step};
use crate::kind::{HeadingFix, Measured, PositionFix, SlowError};
use crate::motion::{Motion, drive, propagate};
use crate::output::Verdict;
use crate::pace::Pace;
use crate::partial::{BodySighting, Innovation, SplitPosition, fuse_and_leave as fuse_part};
use crate::parts::Parts;
use crate::pose::Pose;
use crate::rounds::{Bond, Late, Lates, Of};
use crate::settings::{Propagation, Settings};
use crate::stamp::Stamp;
use crate::symmetric::Square3;
use crate::terms::Terms;
use crate::{fix, lever, partial, slow};

/// What is carried from one measurement to the next.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct Filter {
    pub(crate) state: State,
    /// Of the gyro, if there is one: apart, so that nobody else copies it.
    pub(crate) bias: Option<Bias>,
    /// Where the robot may take part in rounds; likewise.
    pub(crate) bond: Option<Bond>,
    /// What became of the error since somebody asked, if somebody did.
    pub(crate) change: Option<Change>,
}

/// What every robot carries.
#[derive(Copy, Clone, Debug, Default)]
pub(crate) struct State {
    /// As Algorithm 3 left it: its `P_i` still stands for the neighbours' poses yet to come in this event.
    belief: Belief,
    /// Poses were exchanged in this event: `P_i := 0` once no neighbour's pose can follow (Algorithm 4, line 19).
    exchanged: bool,
    /// It is not known where the robot is: the belief means nothing, and nothing changes it.
    nowhere: bool,
    /// When a fix with a slow error was heard last.
    slow_heard: Stamp,
    /// When a heading with a slow error was heard last.
    slow_heading_heard: Option<Stamp>,
    /// `[v, ω]` of the last motion \[m/s, rad/s\]; NaN of a base that can move sideways.
    velocity: [f64; 2],
    /// Of the neighbours' poses up to here.
    pace: Pace,
    /// Where the wheels alone have taken the robot since its start: no measurement moves it.
    driven: Pose,
}

/// What a measurement of the pose teaches of the gyro's bias.
enum Learnt {
    /// As much as the pose tells of it.
    OfAll,
    /// Nothing; so much of the pose's error is left. An error that fixes share would count as news of the bias at each of them.
    OfPose(Square3),
}

impl Filter {
    /// Believes `belief`, and has heard nobody up to `stamp`.
    pub(crate) fn beginning(stamp: Stamp, belief: Belief) -> Self {
        let state = State {
            belief,
            exchanged: false,
            nowhere: false,
            slow_heard: stamp,
            slow_heading_heard: None,
            velocity: [f64::NAN; 2],
            driven: Pose::default(),
            pace: if belief.parts.dependent == Covariance3::ZERO {
                Pace::beginning(stamp)
            } else {
                Pace::beginning(stamp).met()
            },
        };
        Self {
            state,
            bias: None,
            bond: None,
            change: None,
        }
    }

    /// Believes what is known at the start.
    pub(crate) fn starting(stamp: Stamp, start: &Start) -> Self {
        let mut filter = Self::beginning(stamp, start.belief());
        filter.state.nowhere = !start.is_known();
        filter
    }

    /// With a gyro, of which this is known.
    pub(crate) fn with_gyro(self, settings: Option<&GyroSettings>) -> Self {
        Self {
            bias: settings.map(Bias::beginning),
            ..self
        }
    }

    /// That may take part in rounds, if there are settings for that, and does not yet.
    pub(crate) fn with_bond(self, may: bool) -> Self {
        Self {
            bond: may.then(Bond::default),
            ..self
        }
    }

    /// Whether it takes part in rounds.
    #[inline]
    fn is_tied(&self) -> bool {
        self.bond.as_ref().is_some_and(|it| !it.is_apart())
    }

    /// `dt_s` seconds of `motion` pass.
    #[inline]
    pub(crate) fn predict(&mut self, motion: &Motion, dt_s: f64, propagation: Propagation) {
        self.close();
        let before = self.state.belief.pose;
        if self.is_tied() {
            self.step_tied(motion, dt_s);
        } else {
            self.state.belief = propagate(&self.state.belief, motion, dt_s, propagation);
        }
        let state = &mut self.state;
        if let Some(change) = &mut self.change {
            change.go(&before, &state.belief.pose);
        }
        state.driven = drive(state.driven, motion.velocity().map(|it| dt_s * it));
        state.velocity = straight_on(motion);
    }

    /// The belief and Ψ by one map.
    #[inline]
    fn step_tied(&mut self, motion: &Motion, dt_s: f64) {
        if dt_s == 0.0 {
            return;
        }
        let belief = &mut self.state.belief;
        let moved = step(belief, &motion.swept(belief.pose.phi, dt_s));
        *belief = moved.belief;
        if let Some(bond) = &mut self.bond {
            bond.moved(&moved.map);
        }
    }

    /// A leg passes beside a gyro.
    #[inline(never)]
    pub(crate) fn predict_turning(&mut self, passage: &Passage, settings: &GyroSettings) {
        self.close();
        let (state, Some(bias)) = (&mut self.state, &mut self.bias) else {
            return; // Without one, nobody calls this.
        };
        let held = bias.predict(&mut state.belief, passage, settings);
        if let Some(change) = &mut self.change {
            change.break_off(); // The bias is in the error of all that follows.
        }
        state.driven = drive(state.driven, held);
        let [v, _] = straight_on(&passage.motion);
        state.velocity = [v, held[2] / passage.dt_s];
    }

    /// What is known of the gyro.
    pub(crate) fn gyro(&self) -> Option<GyroState> {
        self.bias.as_ref().map(Bias::state)
    }

    /// Where the wheels alone have taken the robot since its start.
    #[inline]
    pub(crate) fn driven(&self) -> Pose {
        self.state.driven
    }

    /// Algorithm 2: where the robot that was seen is.
    pub(crate) fn tell(
        &self,
        relative: &Pose,
        covariance: &Covariance3,
        settings: &Settings,
    ) -> GlobalPose {
        let told = if self.is_tied() {
            tell(&self.said_of(true), relative, covariance, settings)
        } else {
            tell(&self.state.belief, relative, covariance, settings)
        };
        GlobalPose {
            parts: kept(&told.parts, settings.propagation),
            ..told
        }
    }

    /// It was told.
    #[inline]
    pub(crate) fn told(&mut self, settings: &Settings) {
        self.state.exchanged |= settings.fusion.reset_on_transmit;
    }

    /// Algorithm 3, and what the gate said. Whom it does not trust it does not fuse.
    pub(crate) fn hear(
        &mut self,
        stamp: Stamp,
        received: &GlobalPose,
        trusted: bool,
        settings: &Settings,
    ) -> (Verdict, Gauge) {
        if self.state.nowhere {
            return (Verdict::Heard, Gauge::default());
        }
        let gauge = if settings.found.enabled {
            Gauge::of_pose(&self.state.belief, received)
        } else {
            Gauge::default()
        };
        if self.is_tied() {
            return (Verdict::Heard, gauge);
        }
        self.state.pace = self.state.pace.heard(stamp);
        let damped = self.state.pace.damped(&settings.fusion);
        let mut left = Square3::IDENTITY;
        let fusion = fuse_and_leave(&self.state.belief, received, &damped, &mut left);
        self.state.exchanged = true;
        let accepted = fusion.accepted && trusted;
        if accepted {
            self.state.belief = fusion.belief;
            self.break_off();
            if let Some(bias) = &mut self.bias {
                bias.hear(&left);
            }
        }
        (verdict(accepted, fusion.d2), gauge)
    }

    /// What a leader says, fused as the settings have it. Whom it does not trust it does not fuse.
    #[inline(never)]
    pub(crate) fn hear_leader(
        &mut self,
        said: &GlobalPose,
        trusted: bool,
        settings: &Settings,
    ) -> (Verdict, Gauge) {
        if self.state.nowhere {
            return (Verdict::Heard, Gauge::default());
        }
        let gauge = if settings.found.enabled {
            Gauge::of_pose(&self.state.belief, said)
        } else {
            Gauge::default()
        };
        if self.is_tied() {
            return (Verdict::Heard, gauge);
        }
        let mut left = None;
        let fusion = settings
            .assist
            .fuse_and_leave(&self.state.belief, said, &mut left);
        self.state.exchanged |= settings.assist.resets();
        let accepted = fusion.accepted && trusted;
        if accepted {
            match (&mut self.bias, &left) {
                (Some(bias), Some(left)) => bias.hear(left),
                (Some(_), None) => self.learn(&fusion.belief, &Learnt::OfAll),
                (None, _) => {}
            }
            self.state.belief = fusion.belief;
            self.break_off();
        }
        (verdict(accepted, fusion.d2), gauge)
    }

    /// The same where it is known what the belief has in common with the leader.
    #[inline(never)]
    pub(crate) fn hear_tied(
        &mut self,
        pose: &GlobalPose,
        (bonds, said): (&mut Bonds, &Said),
        trusted: bool,
        settings: &Settings,
    ) -> (Verdict, Gauge) {
        bonds.counted(said.count);
        if self.state.nowhere {
            return (Verdict::Heard, Gauge::default());
        }
        let gauge = if settings.found.enabled {
            Gauge::of_pose(&self.state.belief, pose)
        } else {
            Gauge::default()
        };
        let (place, news) = (said.place, said.news());
        if self.bias.is_some() || bonds.is_lost(place, &news) {
            return (
                self.hear_lost(pose, (bonds, place), trusted, settings),
                gauge,
            );
        }
        let pose = cross::with_ways(pose, &news.word.leader, said.leaders);
        let news = news.doubted();
        let mut fused = *bonds;
        let gate = settings.assist.gate();
        let crossed = fused.fuse_and_leave(&self.state.belief, place, (&news, &pose), gate);
        self.state.exchanged = true;
        let accepted = crossed.update.accepted && trusted;
        if trusted {
            *bonds = fused;
        } else {
            bonds.hear(place, &news);
        }
        if accepted {
            self.state.belief = crossed.update.belief;
            if let Some(bias) = &mut self.bias {
                bias.hear(&Square3(crossed.left.transpose().into()));
            }
        }
        (verdict(accepted, crossed.update.d2), gauge)
    }

    /// What a leader says of which nobody can say what the belief has in common with it.
    fn hear_lost(
        &mut self,
        pose: &GlobalPose,
        (bonds, place): (&mut Bonds, usize),
        trusted: bool,
        settings: &Settings,
    ) -> Verdict {
        let mut left = None;
        let belief = &self.state.belief;
        let fusion = settings.assist.fuse_and_leave(belief, pose, &mut left);
        self.state.exchanged = true;
        let accepted = fusion.accepted && trusted;
        if accepted {
            self.state.belief = fusion.belief;
            let left = left.unwrap_or(Square3::IDENTITY);
            bonds.lose(place, &Matrix3::from(left.0).transpose());
            if let Some(bias) = &mut self.bias {
                bias.hear(&left);
            }
        }
        verdict(accepted, fusion.d2)
    }

    /// Nobody can say what became of the error.
    fn break_off(&mut self) {
        if let Some(change) = &mut self.change {
            change.break_off();
        }
    }

    /// A measurement with white noise leaves `after`.
    fn record(&mut self, after: &Belief) {
        let before = self.state.belief.total();
        if let Some(change) = &mut self.change {
            change.learn(&before, &after.total());
        }
    }

    /// Where what was seen in part stands. Of who has `told` something later, that holds what is independent of the belief.
    pub(crate) fn tell_part(&self, sighting: &BodySighting, told: bool) -> SplitPosition {
        partial::tell(&self.said_of(told), sighting)
    }

    /// Where the robot believes to be; likewise.
    pub(crate) fn answer(&self, told: bool) -> SplitPosition {
        SplitPosition::of(&self.said_of(told))
    }

    /// In rounds nothing is independent.
    fn said_of(&self, told: bool) -> Belief {
        let mut belief = self.state.belief;
        if told || self.is_tied() {
            belief.make_dependent();
        }
        belief
    }

    /// Something of the belief was told, and the error of who heard it may be the same.
    #[inline]
    pub(crate) fn shared(&mut self) {
        self.state.exchanged = true;
    }

    /// What says a part of the pose only, as `learn` makes it of the belief, and what the gate said. Whom it does not trust it does not
    /// fuse.
    pub(crate) fn hear_part(
        &mut self,
        stamp: Stamp,
        learn: impl FnOnce(&Belief) -> Option<Innovation>,
        trusted: bool,
        settings: &Settings,
    ) -> (Verdict, Gauge) {
        if self.state.nowhere {
            return (Verdict::Heard, Gauge::of_part(0.0));
        }
        self.state.pace = self.state.pace.heard(stamp);
        self.state.exchanged = true;
        let Some(innovation) = learn(&self.state.belief) else {
            return (Verdict::Heard, Gauge::default());
        };
        let damped = settings.partial.damped(&self.state.pace);
        let mut left = Square3::IDENTITY;
        let fusion = fuse_part(&self.state.belief, &innovation, &damped, &mut left);
        let is_open = settings.found.enabled && self.state.belief.heading_variance() > OPEN;
        if is_open || self.is_tied() {
            return (Verdict::Heard, Gauge::of_part(fusion.d2));
        }
        let accepted = fusion.accepted && trusted;
        if accepted {
            self.state.belief = fusion.belief;
            self.break_off();
            if let Some(bias) = &mut self.bias {
                bias.hear(&left);
            }
        }
        (verdict(accepted, fusion.d2), Gauge::default())
    }

    /// A position fix, and what the gate said.
    pub(crate) fn correct(&mut self, fix: &PositionFix, terms: &Terms<'_>) -> (Verdict, Gauge) {
        self.close();
        if self.state.nowhere {
            return (Verdict::Heard, Gauge::default());
        }
        let settings = terms.settings;
        let (update, normalised, learnt) = self.corrected(fix, settings.position_gate, settings);
        let wide = self.state.belief.heading_variance() > settings.found.wide;
        let gauge = Gauge {
            d2: update.d2,
            normalised,
            wide,
        };
        if !(update.accepted && terms.trusts(fix.source())) {
            return (verdict(false, update.d2), gauge);
        }
        if settings.found.enabled && wide {
            return (Verdict::Heard, gauge);
        }
        if self.is_tied() {
            self.take_silently(fix);
        } else {
            self.take(fix, &update, &learnt);
        }
        (verdict(true, update.d2), gauge)
    }

    fn take(&mut self, fix: &PositionFix, update: &FixUpdate, learnt: &Learnt) {
        self.learn(&update.belief, learnt);
        if fix.slow.is_there() {
            self.break_off(); // The next one has the same error.
        } else {
            self.record(&update.belief);
        }
        self.state.belief = update.belief;
        if fix.slow.is_there() {
            self.state.slow_heard = fix.stamp;
        }
    }

    /// In rounds: nobody else's gain is anything but zero, and a slow error is white noise that is as strong.
    #[inline(never)]
    fn take_silently(&mut self, fix: &PositionFix) {
        let since = fix.stamp - self.state.slow_heard;
        let slow = HeadingNoise::of(0.0, &fix.slow, Some(since)).weight;
        if !slow.is_finite() {
            return; // Of the same moment as another one, which it only repeats.
        }
        let white = PositionFix {
            covariance: fix.covariance.plus(slow),
            slow: SlowError::default(),
            ..*fix
        };
        let antenna = lever::moved(&self.state.belief, fix.lever);
        let left = fix::complement(&antenna.belief, &white.covariance);
        let (update, _) = fix::judged(
            &antenna.belief,
            fix.position,
            &white.covariance,
            f64::INFINITY,
        );
        let (belief, left) = if lever::is_none(fix.lever) {
            (update.belief, left)
        } else {
            let body = lever::moved(&update.belief, lever::back(fix.lever));
            let left = body.map.after(&antenna.map.before(&left));
            (self.back_from(&white, &antenna, &body), left)
        };
        if !(update.accepted && belief.is_finite()) {
            return;
        }
        self.state.belief = belief;
        if let Some(bond) = &mut self.bond {
            bond.learnt(&left);
        }
        if fix.slow.is_there() {
            self.state.slow_heard = fix.stamp;
        }
    }

    /// The bias learns what the pose does; the pose itself comes after it.
    fn learn(&mut self, after: &Belief, learnt: &Learnt) {
        let Some(bias) = &mut self.bias else {
            return;
        };
        match learnt {
            Learnt::OfAll => bias.learn(&self.state.belief, after),
            Learnt::OfPose(complement) => bias.stand(complement),
        }
    }

    /// Where the antenna is, and back at the heading that the belief has then.
    fn corrected(
        &self,
        fix: &PositionFix,
        gate: f64,
        settings: &Settings,
    ) -> (FixUpdate, [f64; 2], Learnt) {
        if lever::is_none(fix.lever) {
            return self.corrected_at(&self.state.belief, fix, gate, settings);
        }
        let antenna = lever::moved(&self.state.belief, fix.lever);
        let (update, normalised, learnt) = self.corrected_at(&antenna.belief, fix, gate, settings);
        let body = lever::moved(&update.belief, lever::back(fix.lever));
        let belief = self.back_from(fix, &antenna, &body);
        let accepted = update.accepted && belief.is_finite();
        let update = FixUpdate {
            belief: if accepted { belief } else { self.state.belief },
            accepted,
            ..update
        };
        let learnt = match learnt {
            Learnt::OfAll => Learnt::OfAll,
            Learnt::OfPose(left) => Learnt::OfPose(body.map.after(&antenna.map.before(&left))),
        };
        (update, normalised, learnt)
    }

    /// The belief of the body, to the last digit where the fix has no slow error.
    fn back_from(&self, fix: &PositionFix, antenna: &Moved, body: &Moved) -> Belief {
        if fix.slow.is_there() {
            return body.belief;
        }
        let round = ThereAndBack {
            own: &self.state.belief,
            lever: fix.lever,
            there: &antenna.map,
            complement: &fix::complement(&antenna.belief, &fix.covariance),
            back: &body.map,
        };
        round.exact(&body.belief)
    }

    fn corrected_at(
        &self,
        own: &Belief,
        fix: &PositionFix,
        gate: f64,
        settings: &Settings,
    ) -> (FixUpdate, [f64; 2], Learnt) {
        if !fix.slow.is_there() {
            let (update, normalised) = fix::judged(own, fix.position, &fix.covariance, gate);
            return (update, normalised, Learnt::OfAll);
        }
        let all = fix.covariance.plus(fix.slow.variance);
        let (update, normalised) = fix::judged(own, fix.position, &all, gate);
        if !update.accepted {
            return (update, normalised, Learnt::OfAll);
        }
        let since = fix.stamp - self.state.slow_heard;
        let (belief, complement) = slow::update(own, fix, since, &settings.fusion);
        let update = FixUpdate { belief, ..update };
        (update, normalised, Learnt::OfPose(complement))
    }

    /// A heading, and what the gate said.
    pub(crate) fn turn(&mut self, fix: &HeadingFix, terms: &Terms<'_>) -> Verdict {
        self.close();
        let Some(heading) = self.looking(fix) else {
            return Verdict::NotMoving;
        };
        if self.state.nowhere {
            return Verdict::Heard;
        }
        let since = self.state.slow_heading_heard.map(|last| fix.stamp - last);
        let noise = HeadingNoise::of(fix.variance, &fix.slow, since);
        let update = heading::update(
            &self.state.belief,
            heading,
            &noise,
            terms.settings.heading_gate,
        );
        if update.accepted {
            self.learn(&update.belief, &Learnt::OfAll);
            if let Some(bond) = &mut self.bond {
                bond.learnt(&heading::complement(&self.state.belief, noise.weight));
            }
            // The white noise that stands for a slow error bounds it in all sums, so in what errors have in common too.
            self.record(&update.belief);
            self.state.belief = update.belief;
            if fix.slow.is_there() {
                self.state.slow_heading_heard = Some(fix.stamp);
            }
        }
        verdict(update.accepted, update.d2)
    }

    /// Where the body looks, as `fix` has it; `None` if it says nothing of that.
    pub(crate) fn looking(&self, fix: &HeadingFix) -> Option<f64> {
        fix.looking(self.state.velocity)
    }

    /// It is not known where the robot is.
    pub(crate) fn lose(&mut self) {
        self.state.nowhere = true;
        if let Some(bond) = &mut self.bond {
            bond.untie();
        }
    }

    /// This is believed from now on, and was learnt from others.
    pub(crate) fn find(&mut self, belief: &Belief) {
        self.state.belief = *belief;
        (self.state.nowhere, self.state.exchanged) = (false, false);
        self.state.pace = self.state.pace.met();
        if let Some(bias) = &mut self.bias {
            bias.forget_pose();
        }
        if let Some(bond) = &mut self.bond {
            bond.untie();
        }
    }

    /// What a round made of the belief that was shared, if that is what was believed up to here.
    pub(crate) fn follow(&mut self, slot: u64, belief: &Belief, of: &Of, lates: &Lates) {
        let is_it = |it: &Bond| it.knot() == of.knot();
        if self.state.nowhere || !self.bond.as_ref().is_some_and(is_it) {
            return;
        }
        let late = of.is_late.then(|| self.corrected_late(lates.of(slot)?));
        let Some(bond) = &mut self.bond else {
            return;
        };
        match late {
            None => {
                bond.corrected(slot);
                self.state.belief = *belief;
            }
            Some(Some((belief, since))) => {
                bond.corrected_late(slot, &since);
                self.state.belief = belief;
            }
            // By what else came late nothing positive is left: what is shared is not known any more.
            Some(None) => return bond.join(),
        }
        self.state.exchanged = false;
        self.state.pace = self.state.pace.met();
    }

    /// The belief and Ψ after a correction whose slot has left the history; `None` if it can be none of this belief.
    pub(crate) fn corrected_late(&self, late: &Late) -> Option<(Belief, Matrix3<f64>)> {
        let bond = self.bond.as_ref()?;
        let believed = &self.state.belief;
        let (pose, covariance, since) =
            late.apply(&believed.pose, &believed.total(), &bond.psi_matrix())?;
        Some((Belief::gaussian(pose, Parts::dependent(covariance)), since))
    }

    /// It takes part in rounds, and shares nothing that is known.
    pub(crate) fn join(&mut self) {
        self.close();
        if let Some(bond) = &mut self.bond {
            bond.join();
        }
    }

    /// It takes no part in rounds any more; what it believes is others' as much as its own.
    pub(crate) fn leave(&mut self) {
        self.state.exchanged |= self.is_tied();
        self.close();
        if let Some(bond) = &mut self.bond {
            bond.leave();
        }
    }

    /// The belief as it is before what follows.
    pub(crate) fn belief(&self) -> &Belief {
        &self.state.belief
    }

    /// No neighbour's pose can follow at this stamp.
    #[inline]
    fn close(&mut self) {
        if self.state.exchanged || self.is_tied() {
            self.state.belief.make_dependent();
            if let Some(bias) = &mut self.bias {
                bias.make_dependent();
            }
            self.state.exchanged = false;
            self.state.pace = self.state.pace.met();
        }
    }

    /// The belief once no neighbour's pose can follow at this stamp.
    #[inline]
    pub(crate) fn settle(mut self, propagation: Propagation) -> Belief {
        self.close();
        self.state.belief.parts = kept(&self.state.belief.parts, propagation);
        self.state.belief
    }
}

/// Only the paper's difference can lose its sign.
#[inline]
fn kept(parts: &Parts, propagation: Propagation) -> Parts {
    match propagation {
        Propagation::Honest => *parts,
        Propagation::Paper => parts.with_its_sign(),
    }
}

fn verdict(accepted: bool, d2: f64) -> Verdict {
    if accepted {
        Verdict::Accepted { d2 }
    } else {
        Verdict::Gated { d2 }
    }
}

/// `[v, ω]` of a robot that goes where it looks, slip aside; nothing of one that moves sideways.
#[inline]
fn straight_on(motion: &Motion) -> [f64; 2] {
    match *motion {
        Motion::Nonholonomic { velocity, .. } => velocity,
        Motion::Holonomic {
            velocity: [v, 0.0, omega],
            ..
        } => [v, omega],
        Motion::Holonomic { .. } => [f64::NAN; 2],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::covariance::Covariance2;
    use crate::motion::Motion;

    fn predicted() -> Filter {
        let covariance = Covariance3::diagonal([0.01, 0.02, 0.03]).unwrap();
        Filter::beginning(
            Stamp::default(),
            Belief::independent(Pose::default(), covariance),
        )
    }

    #[test]
    fn telling_moves_the_independent_part_only_where_the_settings_say_so() {
        let after = |settings: &Settings| {
            let mut filter = predicted();
            filter.told(settings);
            filter
        };
        let settle = |filter: Filter| filter.settle(Propagation::Honest);
        let told = after(&Settings::default());
        assert_eq!(
            told.state.belief,
            predicted().state.belief,
            "neighbours' poses of this event still see it"
        );
        let total = predicted().state.belief.total();
        assert_eq!(settle(told).parts, Parts::dependent(total));
        assert_eq!(settle(after(&Settings::paper())), predicted().state.belief);
    }

    #[test]
    fn hearing_moves_the_independent_part_even_if_the_gate_refuses() {
        let improbable = GlobalPose {
            pose: Pose::new(100.0, 0.0, 0.0),
            parts: Parts::dependent(Covariance3::diagonal([0.01, 0.01, 0.001]).unwrap()),
        };
        for settings in [Settings::default(), Settings::paper()] {
            let mut heard = predicted();
            let (gate, _) = heard.hear(Stamp::default(), &improbable, true, &settings);
            assert!(matches!(gate, Verdict::Gated { d2 } if d2 > 1e4));
            assert_eq!(heard.state.belief, predicted().state.belief);
            let settled = heard.settle(settings.propagation);
            assert_eq!(settled.parts.independent, Covariance3::ZERO);
        }
    }

    /// Parked for a while with a poor heading and never met: what is dependent is curvature alone.
    #[test]
    fn who_has_met_nobody_gives_up_nothing_by_the_first_word() {
        let motion = Motion::Nonholonomic {
            velocity: [1.0, 0.0],
            noise: Covariance2::diagonal([0.01, 0.01]).unwrap(),
        };
        let wanders = |mut filter: Filter| {
            filter.predict(&motion, 1.0, Propagation::Honest);
            filter
        };
        let word = GlobalPose {
            pose: Pose::new(1.0, 0.0, 0.0),
            parts: Parts::dependent(Covariance3::diagonal([0.001; 3]).unwrap()),
        };
        let settings = Settings::default();
        let (mut alone, mut other) = (wanders(predicted()), predicted());
        assert_ne!(alone.state.belief.parts.dependent, Covariance3::ZERO);
        other.told(&settings);
        other = wanders(other);
        let half = Stamp::default() + crate::stamp::Span::from_millis(500);
        let heading = |filter: &mut Filter, stamp| {
            let (gate, _) = filter.hear(stamp, &word, true, &settings);
            assert!(matches!(gate, Verdict::Accepted { .. }));
            filter.state.belief.total().variances()[2]
        };
        let first = heading(&mut alone, half);
        assert!(first < 0.0015, "{first}");
        assert!(
            heading(&mut other, half) > 1.2 * first,
            "who has met weighs it"
        );
        assert!(
            alone
                .state
                .pace
                .heard(half)
                .damped(&settings.fusion)
                .damping
                < 1.0
        );
    }
}
