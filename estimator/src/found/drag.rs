//! What a source did to the belief before it was named.
//!
//! A receiver that drifts drags the belief along, a fraction of its σ with every fix, and none of them is refused. Once it is named it is
//! not fused any more, but what it did would stay: of a belief that is certain of itself, and of others whose errors may be its own,
//! little is changed by each of their words. So the belief's doubt grows by the mean of the liar's innovations, as long as that is,
//! and those who stand by the belief pull it back within a second.
//!
//! Before that, when the mean is more than chance explains and not yet enough for a name, the belief claims no less doubt than that
//! mean, if neighbours alone stand by it: a certain belief hardly listens to them. Another receiver is heard as it is, and beside one a
//! belief in doubt would follow whichever neighbour lies.

use super::seat::Seat;
use super::word::Word;
use super::{Found, Ruling, planar_trace};
use crate::belief::Belief;
use crate::covariance::Covariance3;
use crate::kind::Kind;
use crate::symmetric::Symmetric3;

impl Found {
    /// The source of `word` has begun to disagree, if it does, and `prior` is the belief before it. What others had against the belief
    /// was that it was dragged: their means begin anew.
    pub(super) fn undo_drag(&mut self, at: usize, word: &Word, prior: &Belief) -> Ruling {
        let now = word.stamp;
        let Some(seat) = self.seats[at].as_ref().filter(|seat| seat.disagrees(now)) else {
            return Ruling::Stands;
        };
        let mean = seat.mean.norm_squared();
        let is_another = |source| source != word.source;
        let healed = self
            .taken()
            .any(|it| is_another(it.source) && it.stands_by(now));
        if mean == 0.0 || !healed {
            return Ruling::Stands;
        }
        for other in self.seats[..self.seated].iter_mut().flatten() {
            if is_another(other.source) {
                other.mean.clear();
            }
        }
        let innovation = planar_trace(&prior.total().symmetric()) + planar_trace(&word.noise());
        Ruling::Replaced(wider(prior, 0.5 * innovation * mean))
    }

    /// The belief before `word`, whose source has a mean that chance hardly explains, claims no less doubt than that.
    pub(super) fn doubt(&self, at: usize, word: &Word, prior: &Belief) -> Ruling {
        let seat = self.seats[at].as_ref();
        let suspect = seat.filter(|it| it.mean.is_doubtful() && !it.disagrees(word.stamp));
        let Some(seat) = suspect.filter(|_| self.only_neighbours_stand_by(word)) else {
            return Ruling::Stands;
        };
        let own = planar_trace(&prior.total().symmetric());
        let innovation = own + planar_trace(&word.noise());
        let lacks = innovation * seat.mean.norm_squared() - own;
        if lacks > 0.0 {
            Ruling::Replaced(wider(prior, 0.5 * lacks))
        } else {
            Ruling::Stands
        }
    }

    /// Others stand by the belief, and none of them is a receiver.
    fn only_neighbours_stand_by(&self, word: &Word) -> bool {
        let stands = |it: &&Seat| it.source != word.source && it.stands_by(word.stamp);
        let mut others = self.taken().filter(stands).peekable();
        others.peek().is_some() && others.all(|it| it.source.kind != Kind::Fix)
    }
}

/// By a variance of the position \[m²\], which nobody may call his own.
fn wider(belief: &Belief, variance: f64) -> Belief {
    let grown = Symmetric3 {
        xx: variance,
        yy: variance,
        ..Symmetric3::ZERO
    };
    let mut wider = *belief;
    let dependent = belief.parts.dependent.symmetric() + grown;
    wider.parts.dependent = Covariance3::trusted(&dependent);
    wider
}
