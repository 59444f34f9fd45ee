//! What a child knows of the correlation of its error with each leader's, and what it does when nobody can say.
//!
//! As long as a leader says what became of its error since the child heard of it last, C is known ([`super::cross`]). A child that
//! missed too much takes up the chain again, at once, by a bound of what C can be: of two errors no covariance but
//!
//! ```text
//! C P_l⁻¹ Cᵀ ≤ W      W = P, or G P_l⁻¹ Gᵀ of when C was known, G its C taken along by the child's own F
//! [[P, C], [Cᵀ, P_l]] ≤ [[P + W/b, 0], [0, (1 + b) P_l]]      for any b > 0
//! ```
//!
//! is possible, for what a leader's error becomes is in its covariance. The child goes on from the right side, with C = 0, and with D, by how
//! much it takes the leader's covariance for larger than the leader does: `D := Φ D Φᵀ`. Of both W and some b those are taken
//! that leave the smallest trace of what the child believes and of D, which all that the leader says from then on is worse by.

use nalgebra::Matrix3;

use super::change::Change;
use super::cross::{self, Crossed, Leader};
use super::events::Word;
use super::slot::Slot;
use super::team::MOST_LEADERS;
use crate::belief::Belief;
use crate::convert::GlobalPose;
use crate::covariance::Covariance3;
use crate::factor::Factor;
use crate::fix::FixUpdate;
use crate::parts::Parts;

/// Values of b that are tried.
const SHARES: [f64; 7] = [0.015_625, 0.031_25, 0.062_5, 0.125, 0.25, 0.5, 1.0];

/// What a leader says of itself at an event.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct News {
    /// Which event.
    pub slot: Slot,
    /// What it says.
    pub word: Word,
}

impl News {
    /// With a leader that errs more than it says ([`cross::DOUBT`]).
    #[must_use]
    pub fn doubted(mut self) -> Self {
        self.word.leader = self.word.leader.doubted();
        self
    }
}

/// With one leader.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
struct Bond {
    /// C when the leader was heard last, taken along by the child's own F.
    cross: Matrix3<f64>,
    /// D
    excess: Matrix3<f64>,
    /// `P_l + D`, when the leader was heard last.
    covariance: Matrix3<f64>,
    /// When that was; `None`: nothing of that leader is in the belief.
    met: Option<Slot>,
}

/// With all leaders, by their place.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Bonds {
    each: [Bond; MOST_LEADERS],
    /// By which count of events: it begins anew when the team's clock is set.
    count: u32,
}

/// When a leader was heard of which nobody can say what it has in common with the belief.
const NOBODY_KNOWS: Slot = Slot(i64::MIN);

impl Bonds {
    /// The child's own step, or a measurement of its own: F of its error.
    pub fn go_on(&mut self, by: &Matrix3<f64>) {
        for bond in self.each.iter_mut().filter(|it| it.met.is_some()) {
            bond.cross = by * bond.cross;
        }
    }

    /// What became of its error, if somebody can say.
    pub(crate) fn follow(&mut self, change: &Change) {
        match change.by() {
            Some(by) => self.go_on(by),
            None => self.lose_track(),
        }
    }

    /// Nobody can say what the belief has in common with whom.
    pub(crate) fn lose_track(&mut self) {
        let unknown = Bond {
            met: Some(NOBODY_KNOWS),
            ..Bond::default()
        };
        self.each = [unknown; MOST_LEADERS];
    }

    /// What follows counts events so.
    pub(crate) fn counted(&mut self, count: u32) {
        if self.count != count {
            for bond in self.each.iter_mut().filter(|it| it.met.is_some()) {
                bond.met = Some(NOBODY_KNOWS);
            }
            self.count = count;
        }
    }

    /// A leader is heard, but of this child it says nothing: a datum that is declined, or one for another child.
    pub fn hear(&mut self, place: usize, news: &News) {
        if let Some(bond) = self.each.get_mut(place)
            && let Some(next) = bond.at_event(news)
        {
            *bond = next;
        }
    }

    /// `own` after a datum of the leader at `place`, if d² ≤ `gate` (χ², three degrees of freedom).
    #[must_use]
    pub fn fuse(
        &mut self,
        own: &Belief,
        place: usize,
        said: (&News, &GlobalPose),
        gate: f64,
    ) -> FixUpdate {
        self.fuse_and_leave(own, place, said, gate).update
    }

    /// Whether nobody can say what the belief has in common with this leader, and the leader's own error has only begun to go its way: it
    /// may well begin anew with the next datum. To bound what is in common is then of no use later.
    pub(crate) fn is_lost(&self, place: usize, news: &News) -> bool {
        let bond = self.each.get(place).copied().unwrap_or_default();
        news.word.past.known == 0 && bond.at_event(news).is_none()
    }

    /// A datum of that leader was fused as if it may be correlated with anything; so much is `left` of the error before.
    pub(crate) fn lose(&mut self, place: usize, left: &Matrix3<f64>) {
        self.go_on(left);
        if let Some(bond) = self.each.get_mut(place) {
            *bond = Bond {
                met: Some(NOBODY_KNOWS),
                ..Bond::default()
            };
        }
    }

    /// The same as [`Self::fuse`], and what is left of the error before.
    pub(crate) fn fuse_and_leave(
        &mut self,
        own: &Belief,
        place: usize,
        (news, said): (&News, &GlobalPose),
        gate: f64,
    ) -> Crossed {
        let bond = self.each.get(place).copied().unwrap_or_default();
        let (bond, crossed) = match bond.at_event(news) {
            Some(next) => (next, next.update(own, (news, said), gate)),
            None => bond.taken_up(own, (news, said), gate),
        };
        if crossed.update.accepted {
            self.go_on(&crossed.left);
        }
        if let Some(this) = self.each.get_mut(place) {
            *this = bond;
            this.cross = crossed.with_this(&bond.cross);
        }
        crossed
    }
}

impl Bond {
    /// At an event of which the leader says what became of its error; `None` if the chain is broken.
    fn at_event(&self, news: &News) -> Option<Self> {
        let by = match self.met {
            None => Matrix3::identity(),
            Some(last) if last == news.slot => Matrix3::identity(),
            Some(_) => news.word.past.from(self.events_until(news.slot)?)?,
        };
        let next = Self {
            cross: self.cross * by.transpose(),
            excess: by * self.excess * by.transpose(),
            ..*self
        };
        Some(next.met(news))
    }

    fn met(self, news: &News) -> Self {
        Self {
            covariance: self.taken_for(&news.word.leader).matrix(),
            met: Some(news.slot),
            ..self
        }
    }

    fn events_until(&self, slot: Slot) -> Option<u8> {
        let last = self.met?;
        u8::try_from(slot.0.checked_sub(last.0)?).ok()
    }

    /// `P_l + D`
    fn taken_for(&self, leader: &Leader) -> Covariance3 {
        let excess = covariance(&self.excess);
        excess.map_or(leader.covariance, |it| leader.covariance.plus(&it))
    }

    fn update(&self, own: &Belief, (news, said): (&News, &GlobalPose), gate: f64) -> Crossed {
        let said_by = &news.word.leader;
        let leader = Leader {
            covariance: self.taken_for(said_by),
            ..*said_by
        };
        cross::update(own, &self.cross, &leader, said, gate)
    }

    /// After an event of which nobody can say what became of the leader's error until then.
    fn taken_up(
        &self,
        own: &Belief,
        (news, said): (&News, &GlobalPose),
        gate: f64,
    ) -> (Self, Crossed) {
        let mut best = (f64::INFINITY, *self, Crossed::refused(own, f64::INFINITY));
        for (most, larger) in self.bounds(own, news).into_iter().flatten() {
            for share in SHARES {
                let factor = (1.0 + share) * larger - 1.0;
                let anew = Self {
                    cross: Matrix3::zeros(),
                    excess: factor * news.word.leader.covariance.matrix(),
                    ..*self
                };
                let wider = wider(own, &most.scaled(1.0 / share));
                let crossed = anew.update(&wider, (news, said), gate);
                let cost = crossed.update.belief.total().matrix().trace() + anew.excess.trace();
                if crossed.update.accepted && cost < best.0 {
                    best = (cost, anew.met(news), crossed);
                }
            }
        }
        (best.1, best.2)
    }

    /// W, and how many times larger than it says the leader's covariance is to be taken for already.
    fn bounds(&self, own: &Belief, news: &News) -> [Option<(Covariance3, f64)>; 2] {
        [Some((own.total(), 1.0)), self.tight_bound(news)]
    }

    /// By C of when it was known, where the leader has not started anew since.
    fn tight_bound(&self, news: &News) -> Option<(Covariance3, f64)> {
        let events = self.events_until(news.slot)?;
        if events == 0 || events > news.word.past.known {
            return None;
        }
        let by = inverse(&covariance(&self.covariance)?);
        let most = covariance(&(self.cross * by * self.cross.transpose()))?;
        let plain = covariance(&(self.covariance - self.excess))?;
        Some((most, 1.0 + (inverse(&plain) * self.excess).trace()))
    }
}

fn inverse(of: &Covariance3) -> Matrix3<f64> {
    Covariance3::trusted(&Factor::new(&of.symmetric()).inverse()).matrix()
}

/// `own`, and errors more that may be correlated with anything.
fn wider(own: &Belief, by: &Covariance3) -> Belief {
    Belief {
        parts: Parts {
            dependent: own.parts.dependent.plus(by),
            ..own.parts
        },
        ..*own
    }
}

/// What was computed, its rounding taken from both sides of the diagonal; `None` if it is none.
fn covariance(matrix: &Matrix3<f64>) -> Option<Covariance3> {
    Covariance3::new(0.5 * (matrix + matrix.transpose())).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assist::transition::{Past, Transitions, driven};
    use crate::pose::Pose;

    const P: [f64; 3] = [0.01, 0.02, 0.003];
    const LEADER: [f64; 3] = [0.004, 0.003, 0.0005];
    const SIGHT: [f64; 3] = [0.0025, 0.0025, 0.0003];
    const GATE: f64 = 16.3;

    fn diagonal(variances: [f64; 3]) -> Covariance3 {
        Covariance3::diagonal(variances).unwrap()
    }

    fn news(slot: i64, past: &Past) -> News {
        let leader = Leader {
            pose: Pose::default(),
            covariance: diagonal(LEADER),
        };
        News {
            slot: Slot(slot),
            word: Word {
                leader,
                past: *past,
            },
        }
    }

    /// The child stands beside its leader, so that J is the unit matrix.
    fn said(x: f64) -> GlobalPose {
        GlobalPose {
            pose: Pose::new(x, 0.0, 0.0),
            parts: Parts {
                independent: diagonal(SIGHT),
                dependent: diagonal(LEADER),
            },
        }
    }

    fn own() -> Belief {
        Belief::independent(Pose::default(), diagonal(P))
    }

    fn fused(bonds: &mut Bonds, own: &Belief, news: &News) -> Belief {
        let update = bonds.fuse(own, 0, (news, &said(0.01)), GATE);
        assert!(update.accepted, "{update:?}");
        update.belief
    }

    #[test]
    fn c_goes_the_way_of_both_errors() {
        let (mut leader, mut bonds) = (Transitions::default(), Bonds::default());
        let first = fused(&mut bonds, &own(), &news(1, &leader.at_event()));
        let before = bonds.each[0].cross;
        let [child, by] = [0.2, 0.3].map(|phi| driven(phi, [0.1, 0.02]));
        bonds.go_on(&child);
        let mut past = Past::default();
        for _ in 0..4 {
            leader.go_on(&by);
            past = leader.at_event();
        }
        let news = news(5, &past);
        let said_by = past.from(4).unwrap();
        assert!((said_by - by * by * by * by).abs().max() < 1e-6);
        let expected = child * before * said_by.transpose();
        let mut heard = bonds;
        heard.hear(0, &news);
        assert!((heard.each[0].cross - expected).abs().max() < 1e-15);
        let (word, said) = (news.word.leader, said(0.01));
        let crossed = cross::update(&first, &heard.each[0].cross, &word, &said, GATE);
        assert_eq!(fused(&mut bonds, &first, &news), crossed.update.belief);
        assert_eq!(bonds.each[0].cross, crossed.with_this(&heard.each[0].cross));
    }

    /// A leader that stands and says the same thirty times: who believes it to be news each time is surer than the leader's error and
    /// its own first one let anybody be; who takes up a broken chain each time is not.
    #[test]
    fn a_chain_that_broke_is_taken_up_at_once_and_nothing_becomes_news_by_it() {
        let (mut bonds, mut taken_up, mut naive) = (Bonds::default(), own(), own());
        for slot in 0..30 {
            let news = news(9 * slot, &Past::default());
            naive = fused(&mut Bonds::default(), &naive, &news);
            taken_up = fused(&mut bonds, &taken_up, &news);
            assert_eq!(bonds.each[0].met, Some(news.slot));
        }
        let best = [0, 1, 2].map(|i| 1.0 / (1.0 / P[i] + 1.0 / LEADER[i]));
        let [naive, taken_up] = [naive, taken_up].map(|it| it.total().variances());
        for i in 0..3 {
            assert!(naive[i] < best[i] && best[i] <= taken_up[i], "{i}");
            assert!(taken_up[i] < P[i], "{i}");
        }
    }

    /// A leader that did not start anew meanwhile has no more in common with a child than it had, however much the child erred since.
    #[test]
    fn what_a_child_erred_since_is_no_part_of_what_may_be_common() {
        let (mut leader, mut bonds) = (Transitions::default(), Bonds::default());
        let belief = fused(&mut bonds, &own(), &news(0, &leader.at_event()));
        let far = wider(&belief, &diagonal([1.0, 1.0, 0.1]));
        let past = [(); 20].map(|()| leader.at_event())[19];
        let [loose, tight] = bonds.each[0].bounds(&far, &news(20, &past));
        let (most, larger) = tight.unwrap();
        assert!(belief.total().contains(&most) && (larger - 1.0).abs() < 1e-12);
        assert_eq!(loose, Some((far.total(), 1.0)));
        leader.break_off();
        let [_, tight] = bonds.each[0].bounds(&far, &news(20, &leader.at_event()));
        assert_eq!(tight, None);
    }

    #[test]
    fn what_the_gate_refuses_leaves_all_as_it_was() {
        let mut bonds = Bonds::default();
        let belief = fused(&mut bonds, &own(), &news(1, &Past::default()));
        let before = bonds;
        let wrong = (&news(9, &Past::default()), &said(10.0));
        let update = bonds.fuse(&belief, 0, wrong, GATE);
        assert!(!update.accepted);
        assert_eq!((update.belief, bonds), (belief, before));
    }
}
