//! A motion as a random linear map of position and direction, and how such maps follow each other.
//!
//! With vectors of the plane as complex numbers a motion is `p⁺ = p + t u`, `u⁺ = g u`: a way t and a turn g, both random, and the
//! same whatever the direction u is. Of t and g the first two moments are known exactly, and those of many motions in a row follow
//! from those of each. So all hypotheses share one map, and one way from what has left the history to now.

use super::moments::{Crossed, Point, Squared, left};
use crate::motion::Motion;
use crate::symmetric::Symmetric3;

/// The moments of a way and of a turn.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Stride {
    /// `E t` \[m\]
    pub(crate) way: Point,
    /// `E g = kept · turn`, turn of length one.
    pub(crate) turn: Point,
    pub(crate) kept: f64,
    /// `1 − kept²`
    pub(crate) lost: f64,
    /// Of t, what the noise of the ways adds, and that of turns by the way that followed \[m²\].
    pub(crate) added: Squared,
    /// Of t without its mean, and g.
    pub(crate) crossed: Crossed,
}

impl Stride {
    /// No motion.
    pub(crate) const NONE: Self = Self {
        way: Point::new(0.0, 0.0),
        turn: Point::new(1.0, 0.0),
        kept: 1.0,
        lost: 0.0,
        added: Squared::ZERO,
        crossed: Crossed::ZERO,
    };

    /// `dt_s` of `motion`.
    pub(crate) fn of(motion: &Motion, dt_s: f64) -> Self {
        let (swept, [sin, cos]) = motion.swept_with_half(dt_s);
        let Symmetric3 {
            xx,
            xy,
            xp,
            yy,
            yp,
            pp,
        } = swept.noise;
        let fallen = libm::expm1(-0.5 * pp);
        let kept = 1.0 + fallen;
        let turn = Point::new(cos * cos - sin * sin, 2.0 * sin * cos);
        let to_left = left(kept * turn);
        let with_turn = Point::new(xp, yp);
        Self {
            way: Point::new(swept.way.x, swept.way.y),
            turn,
            kept,
            lost: -fallen * (1.0 + kept),
            added: Squared {
                length: xx + yy,
                plain: Point::new(xx - yy, 2.0 * xy),
            },
            crossed: Crossed {
                with_conjugate: with_turn * to_left.conj(),
                plain: with_turn * to_left,
            },
        }
    }

    /// This and then `next`, which knows nothing of this: `t + g t'`, `g g'`.
    pub(crate) fn then(&self, next: &Self) -> Self {
        let (mean, next_mean) = (self.mean_turn(), next.mean_turn());
        let (twice, scatter) = (self.turn_squared(), self.turn_scatter());
        let way = next.way;
        let Crossed {
            with_conjugate,
            plain,
        } = self.crossed;
        Self {
            way: self.way + mean * way,
            turn: self.turn * next.turn,
            kept: self.kept * next.kept,
            lost: self.lost + self.kept * self.kept * next.lost,
            added: Squared {
                length: self.added.length
                    + next.added.length
                    + self.lost * way.norm_sqr()
                    + 2.0 * (with_conjugate * way.conj()).re,
                plain: self.added.plain
                    + twice * next.added.plain
                    + way * (scatter * way + 2.0 * plain),
            },
            crossed: Crossed {
                with_conjugate: (with_conjugate + self.lost * way) * next_mean.conj()
                    + next.crossed.with_conjugate,
                plain: (plain + scatter * way) * next_mean + twice * next.crossed.plain,
            },
        }
    }

    /// `E g`
    pub(crate) fn mean_turn(&self) -> Point {
        self.kept * self.turn
    }

    /// `E g²`
    fn turn_squared(&self) -> Point {
        let kept = self.kept * self.kept;
        kept * kept * (self.turn * self.turn)
    }

    /// `E g² − (E g)²`
    pub(crate) fn turn_scatter(&self) -> Point {
        -self.kept * self.kept * self.lost * (self.turn * self.turn)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::covariance::Covariance3;

    fn stride(k: u32) -> Stride {
        let k = f64::from(k);
        let velocity = [
            1.0 + 0.3 * libm::sin(k),
            0.1 * libm::cos(k),
            libm::sin(0.37 * k),
        ];
        let noise =
            Covariance3::from_row_major([0.05, 0.01, 0.02, 0.01, 0.02, 0.01, 0.02, 0.01, 0.04]);
        let noise = noise.unwrap();
        Stride::of(&Motion::Holonomic { velocity, noise }, 0.7)
    }

    fn numbers(it: &Stride) -> [f64; 13] {
        let Stride {
            way,
            turn,
            added,
            crossed,
            ..
        } = *it;
        let points = [
            way,
            turn,
            added.plain,
            crossed.plain,
            crossed.with_conjugate,
        ];
        let mut all = [it.kept, it.lost, added.length].into_iter();
        let mut points = points.into_iter().flat_map(|point| [point.re, point.im]);
        core::array::from_fn(|_| points.next().or_else(|| all.next()).unwrap())
    }

    fn assert_same(a: &Stride, b: &Stride) {
        for (a, b) in numbers(a).into_iter().zip(numbers(b)) {
            assert!((a - b).abs() < 1e-13 * (1.0 + b.abs()), "{a} is not {b}");
        }
    }

    /// Whatever is put together first.
    #[test]
    fn three_motions_are_one_motion_in_either_way() {
        let [a, b, c] = [1, 2, 3].map(stride);
        assert_same(&a.then(&b).then(&c), &a.then(&b.then(&c)));
        assert_same(&Stride::NONE.then(&a), &a);
        assert_same(&a.then(&Stride::NONE), &a);
    }
}
