//! What a robot may say of its belief.

use coloc_estimator::{Belief, FindingState};
use coloc_shm_types::{BeliefState, Health, Input, Unfit, WhyUnfit, worst_sigmas};

use crate::config;

/// Of the belief of a tick.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Standing {
    /// Whether it knows where it is.
    pub state: BeliefState,
    /// Why it does not know well enough to drive, with the limit that is exceeded \[m, rad; 0 for a state\].
    pub unfit: Option<(Unfit, f32)>,
    /// Its wheels alone are missing: with them it would know.
    pub waits_for_wheels: bool,
}

impl Default for Standing {
    /// As long as nothing is known.
    fn default() -> Self {
        Self {
            state: BeliefState::default(),
            unfit: Some((Unfit::Belief, 0.0)),
            waits_for_wheels: false,
        }
    }
}

impl Standing {
    /// Why it is not fit, with how uncertain `belief` is.
    #[must_use]
    pub fn why_unfit(&self, belief: &Belief) -> Option<WhyUnfit> {
        let [sigma_m, sigma_rad] = worst_sigmas(&belief.total().to_row_major());
        let (why, limit) = self.unfit?;
        let limit = f64::from(limit);
        Some(match why {
            Unfit::Belief => WhyUnfit::Belief(self.state),
            Unfit::Position => WhyUnfit::Position {
                sigma_m,
                limit_m: limit,
            },
            Unfit::Heading => WhyUnfit::Heading {
                sigma_rad,
                limit_rad: limit,
            },
        })
    }

    /// As payloads say it: whether it is fit, why not, and the limit.
    #[must_use]
    pub fn fitness(&self) -> (u8, u8, f32) {
        match self.unfit {
            None => (1, 0, 0.0),
            Some((why, limit)) => (0, why as u8, limit),
        }
    }
}

/// The largest σ to drive with.
#[derive(Copy, Clone, Debug)]
pub(super) struct Limits {
    position_m: f64,
    heading_rad: f64,
}

impl Limits {
    pub(super) fn new(config: &config::Health) -> Self {
        Self {
            position_m: asked(config.fit_position_m),
            heading_rad: asked(config.fit_heading_rad),
        }
    }

    /// By each input's health, and by what the estimator finds; where it does not look (the paper's letter), by whether it was the
    /// gate that refused an input.
    pub(super) fn standing(
        self,
        health: [Health; Input::COUNT],
        gated: [bool; Input::COUNT],
        belief: &Belief,
        found: Option<FindingState>,
    ) -> Standing {
        let state = found.map_or_else(
            || by_gates(health, gated),
            |found| with_wheels(found, health),
        );
        Standing {
            state,
            unfit: if state == BeliefState::Ok {
                self.exceeded(belief)
            } else {
                Some((Unfit::Belief, 0.0))
            },
            waits_for_wheels: state == BeliefState::Finding
                && found.is_none_or(|it| it == FindingState::Ok),
        }
    }

    /// Of the limits that σ exceeds the one by most.
    #[allow(clippy::cast_possible_truncation)] // For people.
    fn exceeded(self, belief: &Belief) -> Option<(Unfit, f32)> {
        let [position_m, heading_rad] = worst_sigmas(&belief.total().to_row_major());
        if position_m <= self.position_m && heading_rad <= self.heading_rad {
            return None;
        }
        Some(
            if position_m / self.position_m > heading_rad / self.heading_rad {
                (Unfit::Position, self.position_m as f32)
            } else {
                (Unfit::Heading, self.heading_rad as f32)
            },
        )
    }
}

/// A limit of zero asks for nothing.
fn asked(limit: f64) -> f64 {
    if limit > 0.0 { limit } else { f64::INFINITY }
}

/// Without wheels a robot that knew where it is does not know it any more.
#[allow(clippy::indexing_slicing)] // One place for each of the inputs' numbers.
fn with_wheels(found: FindingState, health: [Health; Input::COUNT]) -> BeliefState {
    match found {
        FindingState::Ok if health[Input::Odometry as usize] == Health::Ok => BeliefState::Ok,
        FindingState::Ok | FindingState::Finding => BeliefState::Finding,
        FindingState::Contradicted => BeliefState::Contradicted,
        FindingState::Lost => BeliefState::Lost,
    }
}

/// Without wheels a robot does not know where it is, and not if every fix is beyond the gate, or, where there are no fixes, every
/// neighbour's word.
#[allow(clippy::indexing_slicing)] // One place for each of the inputs' numbers.
fn by_gates(health: [Health; Input::COUNT], gated: [bool; Input::COUNT]) -> BeliefState {
    let of = |input: Input| health[input as usize];
    let contradicts = |input: Input| of(input) == Health::Refused && gated[input as usize];
    let word_alone = of(Input::Position) != Health::Ok;
    match of(Input::Odometry) {
        Health::Ok if contradicts(Input::Position) => BeliefState::Contradicted,
        Health::Ok if contradicts(Input::Neighbour) && word_alone => BeliefState::Contradicted,
        Health::Ok => BeliefState::Ok,
        _ => BeliefState::Finding,
    }
}

#[cfg(test)]
mod tests {
    use coloc_estimator::{Covariance3, Pose};

    use super::*;

    fn standing(
        refused: &[Input],
        gated: bool,
        belief: &Belief,
        config: &config::Health,
    ) -> Standing {
        let health = Input::ALL.map(|input| {
            if refused.contains(&input) {
                Health::Refused
            } else {
                Health::Ok
            }
        });
        Limits::new(config).standing(health, [gated; Input::COUNT], belief, None)
    }

    #[test]
    fn a_belief_that_everything_contradicts_says_so() {
        let state = |refused: &[Input], gated| {
            let config = config::Health::default();
            standing(refused, gated, &Belief::default(), &config).state
        };
        assert_eq!(state(&[], true), BeliefState::Ok);
        assert_eq!(state(&[Input::Position], true), BeliefState::Contradicted);
        let neighbours = state(&[Input::Neighbour], true);
        assert_eq!(neighbours, BeliefState::Ok, "fixes pass");
        let both = [Input::Position, Input::Neighbour];
        assert_eq!(state(&both, true), BeliefState::Contradicted);
        let late = state(&both, false);
        assert_eq!(late, BeliefState::Ok, "late is no contradiction");
        assert_eq!(state(&[Input::Odometry], false), BeliefState::Finding);
    }

    #[test]
    fn where_there_are_no_fixes_neighbours_alone_contradict() {
        let mut health = [Health::Ok; Input::COUNT];
        health[Input::Neighbour as usize] = Health::Refused;
        for silent in [Health::NeverSeen, Health::Stale, Health::Faulty] {
            health[Input::Position as usize] = silent;
            let said = by_gates(health, [true; Input::COUNT]);
            assert_eq!(said, BeliefState::Contradicted);
        }
    }

    #[test]
    fn what_the_estimator_finds_is_said_and_without_wheels_nothing_is_ok() {
        let limits = Limits::new(&config::Health::default());
        let refused = [Health::Refused; Input::COUNT];
        let said = |found, odometry| {
            let mut health = refused;
            health[Input::Odometry as usize] = odometry;
            let gated = [true; Input::COUNT];
            let belief = Belief::default();
            limits.standing(health, gated, &belief, Some(found)).state
        };
        assert_eq!(said(FindingState::Ok, Health::Ok), BeliefState::Ok);
        assert_eq!(said(FindingState::Ok, Health::Stale), BeliefState::Finding);
        for (found, wheels, waits) in [
            (FindingState::Ok, Health::Stale, true),
            (FindingState::Ok, Health::Ok, false),
            (FindingState::Finding, Health::Stale, false),
            (FindingState::Lost, Health::Stale, false),
        ] {
            let mut health = refused;
            health[Input::Odometry as usize] = wheels;
            let gated = [false; Input::COUNT];
            let standing = limits.standing(health, gated, &Belief::default(), Some(found));
            assert_eq!(standing.waits_for_wheels, waits, "{found:?}, {wheels}");
        }
        for wheels in [Health::Ok, Health::Stale] {
            let said = |found| said(found, wheels);
            assert_eq!(said(FindingState::Finding), BeliefState::Finding);
            assert_eq!(said(FindingState::Contradicted), BeliefState::Contradicted);
            assert_eq!(said(FindingState::Lost), BeliefState::Lost);
        }
    }

    #[test]
    fn fit_is_who_knows_as_well_as_was_asked_for() {
        let config = config::Health {
            fit_position_m: 0.5,
            fit_heading_rad: 0.1,
            ..config::Health::default()
        };
        let why = |[x, y]: [f64; 2], correlation: f64, phi: f64, refused: &[Input]| {
            let xy = correlation * x * y;
            let total = [x * x, xy, 0.0, xy, y * y, 0.0, 0.0, 0.0, phi * phi];
            let covariance = Covariance3::from_row_major(total).unwrap();
            let belief = Belief::independent(Pose::default(), covariance);
            let standing = standing(refused, true, &belief, &config);
            assert_eq!(standing.fitness().0 == 1, standing.unfit.is_none());
            standing.unfit
        };
        let position = Some((Unfit::Position, 0.5));
        let heading = Some((Unfit::Heading, 0.1));
        for sigmas in [[0.49, 0.49], [0.49, 0.1], [0.1, 0.49]] {
            assert_eq!(why(sigmas, 0.0, 0.09, &[]), None);
        }
        let diagonal = why([0.49, 0.49], 0.9, 0.09, &[]);
        assert_eq!(diagonal, position, "worst in a diagonal direction");
        assert_eq!(why([0.51, 0.1], 0.0, 0.09, &[]), position);
        assert_eq!(why([0.1, 0.51], 0.0, 0.09, &[]), position);
        assert_eq!(why([0.49, 0.49], 0.0, 0.11, &[]), heading);
        assert_eq!(why([0.6, 0.1], 0.0, 0.11, &[]), position, "by most");
        assert_eq!(why([0.6, 0.1], 0.0, 0.13, &[]), heading, "by most");
        let contradicted = why([0.49, 0.49], 0.0, 0.09, &[Input::Position]);
        assert_eq!(contradicted, Some((Unfit::Belief, 0.0)));
    }
}
