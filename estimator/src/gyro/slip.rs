//! Whether wheels and gyro say the same.
//!
//! Both measure one turn. The innovation of a leg is white with a known variance, so that it, and what has come together of it in half
//! a second, tell when one of the two lies. It is the wheels, which slip: a gyro has no ground to lose. But for a single sample that is wild:
//! that one is not here any more (`history/turns.rs`).

use crate::stamp::Stamp;

/// 5.5 σ of what has come together, and more than this \[rad\], is slip. By chance that is less than once in a year; the angle is what
/// stamps that are off by milliseconds make of a robot that begins to turn.
const GATE: f64 = 30.0;
const ANGLE: f64 = 0.01;

/// One leg beyond 3.5 σ is of such stamps or begins a slip: it teaches nothing.
const OUTLIER: f64 = 12.25;

/// What has come together fades with this \[s\].
const MEMORY_S: f64 = 0.5;

/// Wheels that agree for so long hold again \[s\].
const CALM_S: f64 = 1.0;

/// Wheels that disagree for so long may be right: the bias becomes doubtful \[s\].
const LONG_S: f64 = 20.0;

/// How wheels and gyro have agreed.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub(crate) struct Parting {
    sum: f64,
    variance: f64,
    /// They have agreed for so long \[s\].
    calm_s: f64,
    /// They have disagreed for so long, with short times of agreement \[s\].
    parted_s: f64,
    pub(crate) since: Option<Stamp>,
    /// What the wheels turned too little in the last leg \[rad/s\].
    missing: f64,
    /// Nothing was heard of the gyro for so long while they slip \[s\].
    blind_s: f64,
}

impl Parting {
    /// A leg from `from` of `dt_s` with this innovation, of that variance. True if the wheels are believed.
    #[inline]
    pub(crate) fn judge(&mut self, from: Stamp, dt_s: f64, innovation: f64, variance: f64) -> bool {
        (self.missing, self.blind_s) = (innovation / dt_s, 0.0);
        let kept = MEMORY_S / (MEMORY_S + dt_s);
        self.sum = kept * self.sum + innovation;
        self.variance = kept * kept * self.variance + variance;
        let square = self.sum * self.sum;
        if square > GATE * self.variance && square > ANGLE * ANGLE {
            (self.sum, self.variance, self.calm_s) = (0.0, 0.0, 0.0);
            self.since.get_or_insert(from);
        }
        if self.since.is_some() {
            self.calm_s += dt_s;
            self.parted_s += dt_s;
            if self.calm_s > CALM_S {
                (self.since, self.parted_s) = (None, 0.0);
            }
        }
        self.since.is_none() && innovation * innovation <= OUTLIER * variance
    }

    /// A leg of wheels alone. Where they slip: what they turn too little, as in the leg before \[rad\].
    #[inline]
    pub(crate) fn bridge(&mut self, dt_s: f64) -> Option<f64> {
        self.since?;
        self.blind_s += dt_s;
        if self.blind_s > CALM_S {
            *self = Self::default(); // Nobody says so any more.
            return None;
        }
        Some(self.missing * dt_s)
    }

    /// It has lasted longer than wheels slip.
    #[inline]
    pub(crate) fn is_long(&self) -> bool {
        self.parted_s > LONG_S
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(parting: &mut Parting, legs: u32, innovation: f64) -> bool {
        for leg in 0..legs {
            let from = Stamp::from_nanos(20_000_000 * i64::from(leg));
            let _ = parting.judge(from, 0.02, innovation, 1.0);
        }
        parting.since.is_some()
    }

    #[test]
    fn one_leg_that_is_off_by_a_small_angle_is_no_slip_and_not_believed() {
        let mut parting = Parting::default();
        let variance = 1e-10;
        assert!(!parting.judge(Stamp::default(), 0.02, 0.009, variance));
        assert_eq!(parting.since, None);
        assert!(parting.judge(Stamp::default(), 0.02, 3e-5, variance));
    }

    #[test]
    fn one_leg_that_is_far_off_is_slip_and_a_second_of_agreement_ends_it() {
        let mut parting = Parting::default();
        assert!(!run(&mut parting, 100, 0.1));
        assert!(run(&mut parting, 1, 60.0));
        assert!(run(&mut parting, 45, 0.0));
        assert!(!run(&mut parting, 10, 0.0));
    }

    #[test]
    fn what_is_lost_of_the_gyro_is_made_up_for_while_wheels_slip_and_not_for_long() {
        let mut parting = Parting::default();
        assert_eq!(parting.bridge(0.01), None);
        assert!(run(&mut parting, 1, 6.0));
        assert_eq!(parting.bridge(0.01), Some(0.01 * (6.0 / 0.02)));
        assert_eq!((parting.bridge(1.0), parting.since), (None, None));
    }

    /// 1.5 σ in every leg is 5.5 σ of what has come together in 0.4 s.
    #[test]
    fn what_comes_together_is_slip_too() {
        let mut parting = Parting::default();
        assert!(!run(&mut parting, 10, 1.5));
        assert!(run(&mut parting, 15, 1.5));
        assert!(!parting.is_long() && run(&mut parting, 1000, 1.5) && parting.is_long());
    }
}
