//! What a source did to the belief before it was named.
//!
//! A receiver that drifts drags the belief along, a fraction of its σ with every fix, and none of them is refused. Once it is named it is
//! not fused any more, but what it did would stay: of a belief that is certain of itself, and of others whose errors may be its own,
//! little is changed by each of their words. So the belief's doubt grows by the mean of the liar's innovations, as long as that is,
//! and those who stand by the belief pull it back within a second.

use super::word::Word;
use super::{Found, Ruling, planar_trace};
use crate::belief::Belief;
use crate::covariance::Covariance3;
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
