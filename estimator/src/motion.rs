//! Algorithm 1: propagation of the belief through the motion model \[8–17\].

use crate::belief::Belief;
use crate::covariance::{Covariance2, Covariance3};

/// A velocity and the covariance of its noise, for the two kinds of drive \[1\].
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Motion {
    /// No sideways velocity: `[v, ω]` \[m/s, rad/s\].
    Nonholonomic {
        /// `[v, ω]`
        velocity: [f64; 2],
        /// Q
        noise: Covariance2,
    },
    /// `[v_x, v_y, ω]` \[m/s, m/s, rad/s\].
    Holonomic {
        /// `[v_x, v_y, ω]`
        velocity: [f64; 3],
        /// Q
        noise: Covariance3,
    },
}

/// Algorithm 1: the belief after `dt_s` seconds of `motion`.
#[must_use]
pub fn propagate(belief: &Belief, motion: &Motion, dt_s: f64) -> Belief {
    let _ = (belief, motion, dt_s);
    unimplemented!()
}
