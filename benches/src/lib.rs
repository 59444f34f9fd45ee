//! What the estimator's speed is measured against.
//!
//! * [`floor`]: the transcendental functions and square roots that a step cannot avoid, and nothing else.
//! * [`naive`]: the same equations with dynamically sized matrices, as a user would first write them.
//! * [`case`]: the beliefs and messages that every bench works on, typical of the paper's team.
//! * [`child`]: a robot that leaders carry, among fifteen others.
//! * [`hot`]: a robot with everything around it, whose ticks follow each other at once.
//! * [`robot`]: a robot that lives through a bench, tick after tick.
//!
//! The rivals of the literature (naive Bayes, covariance intersection, …) are `coloc-sim`'s.

pub mod case;
pub mod child;
pub mod floor;
pub mod hot;
pub mod naive;
pub mod robot;
