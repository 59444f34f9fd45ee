//! Where what was seen stands in the common frame, and what both learn of it.

use super::columns::Columns;
use super::innovation::{Innovation, Numbers};
use super::reading::BodySighting;
use super::symmetric::Symmetric2;
use crate::belief::Belief;
use crate::covariance::{Covariance2, NotACovariance};
use crate::honest::Circle;

/// A position in the common frame with its covariance in two parts: what goes from robot to robot.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct SplitPosition {
    /// \[m\]
    pub position: [f64; 2],
    /// Correlated with nothing \[m²\].
    pub independent: Covariance2,
    /// May be correlated with anything \[m²\].
    pub dependent: Covariance2,
}

impl SplitPosition {
    /// Where a robot of this belief is: its answer to who sees it, from the belief before anything of that stamp.
    #[must_use]
    pub fn of(belief: &Belief) -> Self {
        let part = |it: &crate::Covariance3| Symmetric2::of_position(&it.symmetric()).covariance();
        Self {
            position: [belief.pose.x, belief.pose.y],
            independent: part(&belief.parts.independent),
            dependent: part(&belief.parts.dependent),
        }
    }

    /// A landmark's answer. Its error never changes, so all of it is dependent.
    #[must_use]
    pub fn known(position: [f64; 2], covariance: Covariance2) -> Self {
        Self {
            position,
            independent: Covariance2::ZERO,
            dependent: covariance,
        }
    }

    /// From outside, the four entries of each part row by row.
    ///
    /// # Errors
    /// What is wrong with the first of them that is none.
    pub fn from_row_major(
        position: [f64; 2],
        independent: [f64; 4],
        dependent: [f64; 4],
    ) -> Result<Self, NotACovariance> {
        Ok(Self {
            position,
            independent: Covariance2::from_row_major(independent)?,
            dependent: Covariance2::from_row_major(dependent)?,
        })
    }

    /// The whole covariance's variances \[m²\].
    pub(crate) fn variances(&self) -> [f64; 2] {
        let sum = Symmetric2::of(&self.independent) + Symmetric2::of(&self.dependent);
        [sum.xx, sum.yy]
    }

    /// With no variance of the whole below that of `floor`. What is added may be anything: it is dependent.
    pub(crate) fn with_floor(&self, [x, y]: [f64; 2]) -> Self {
        let ([xx, yy], dependent) = (self.variances(), Symmetric2::of(&self.dependent));
        let raised = Symmetric2 {
            xx: dependent.xx + (x - xx).max(0.0),
            yy: dependent.yy + (y - yy).max(0.0),
            ..dependent
        };
        Self {
            dependent: raised.covariance(),
            ..*self
        }
    }

    /// The same, nothing of it independent: of who has already told something later ([`super`]).
    #[must_use]
    pub fn wholly_dependent(&self) -> Self {
        let sum = Symmetric2::of(&self.independent) + Symmetric2::of(&self.dependent);
        Self {
            independent: Covariance2::ZERO,
            dependent: sum.covariance(),
            ..*self
        }
    }
}

/// Where `z` in the body's frame is: `y + H δx + Z w`.
struct Place {
    /// y
    at: [f64; 2],
    /// H
    by_state: [[f64; 3]; 2],
    /// Z
    by_direction: [[f64; 2]; 2],
    circle: Circle,
    /// Sine and cosine of φ̄.
    sin: f64,
    cos: f64,
}

impl Place {
    fn new(belief: &Belief, [forward, left]: [f64; 2]) -> Self {
        let circle = Circle::of(belief.heading_variance(), 0.0);
        let (sin, cos) = libm::sincos(belief.pose.phi);
        let (dx, dy) = (cos * forward - sin * left, sin * forward + cos * left);
        let mean = circle.mean;
        Self {
            at: [belief.pose.x + mean * dx, belief.pose.y + mean * dy],
            by_state: [[1.0, 0.0, -mean * dy], [0.0, 1.0, mean * dx]],
            by_direction: [[forward, -left], [left, forward]],
            circle,
            sin,
            cos,
        }
    }

    /// What an uncertain heading makes of a sighting's noise: as much as goes through its mean, and what is bent.
    fn noise(&self, noise: &Covariance2) -> [Symmetric2; 2] {
        let turned = Symmetric2::of(noise).turned(self.sin, self.cos);
        let linear = turned * (self.circle.mean * self.circle.mean);
        let bent = turned.across() * self.circle.sine + turned * self.circle.along;
        [linear, bent]
    }

    /// `R_i` of what is white of the sighting, `R_d` of all the rest of it.
    fn sighting(&self, sighting: &BodySighting) -> [Symmetric2; 2] {
        let ([white, white_bent], [slow, slow_bent]) =
            (self.noise(&sighting.white), self.noise(&sighting.slow));
        [white, white_bent + slow + slow_bent]
    }
}

/// What the observer tells the robot seen: where it must be.
#[must_use]
pub fn tell(observer: &Belief, sighting: &BodySighting) -> SplitPosition {
    let place = Place::new(observer, sighting.at);
    let [independent, dependent] = place.sighting(sighting);
    let own = Columns::new(observer, &place.by_state, &place.by_direction).seen();
    let own_independent =
        Symmetric2::seen(&place.by_state, &observer.parts.independent.symmetric());
    SplitPosition {
        position: place.at,
        independent: (own_independent + independent).covariance(),
        dependent: (own + dependent).covariance(),
    }
}

/// What the robot seen learns of what it is told.
#[must_use]
pub fn told(own: &Belief, said: &SplitPosition) -> Innovation {
    Innovation {
        numbers: Numbers::Two,
        difference: [said.position[0] - own.pose.x, said.position[1] - own.pose.y],
        by_state: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        by_direction: [[0.0; 2]; 2],
        independent: said.independent,
        dependent: said.dependent,
    }
}

/// What the observer learns of the answer of the robot that it saw, or of a landmark's.
#[must_use]
pub fn observed(observer: &Belief, sighting: &BodySighting, answer: &SplitPosition) -> Innovation {
    let place = Place::new(observer, sighting.at);
    let [independent, dependent] = place.sighting(sighting);
    let with = |part: &Covariance2, noise| (Symmetric2::of(part) + noise).covariance();
    Innovation {
        numbers: Numbers::Two,
        difference: [
            answer.position[0] - place.at[0],
            answer.position[1] - place.at[1],
        ],
        by_state: place.by_state,
        by_direction: place.by_direction,
        independent: with(&answer.independent, independent),
        dependent: with(&answer.dependent, dependent),
    }
}
