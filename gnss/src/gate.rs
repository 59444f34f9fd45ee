//! What a fix must have to be published, and where it may be.

use std::f64::consts::SQRT_2;

use crate::fix::Fix;
use crate::refusal::Refusal;
use crate::section::{Gnss, Jump, Limits};
use crate::sigma::Sigma;

/// Fixes must be good for so long before less is asked of them (ns).
const MINUTE_NS: i64 = 60_000_000_000;
/// After so long without a good fix it begins anew (ns), and nothing is known of where the robot may be.
const GAP_NS: i64 = 10_000_000_000;
/// A deviation of so many sigmas is none.
const SIGMAS: f64 = 3.0;
/// By so much may a stated velocity be off (m/s).
const VELOCITY_OFF_M_S: f64 = 0.5;

/// A fix in the common frame.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Placed {
    /// When (ns).
    pub at_ns: i64,
    /// Where (m).
    pub place: [f64; 2],
    /// How it moves (m/s).
    pub velocity: Option<[f64; 2]>,
    /// How good it is.
    pub sigma: Sigma,
    /// Quality field of GGA.
    pub quality: u8,
}

/// The gates, which remember the fixes that passed.
#[derive(Clone, Debug)]
pub struct Gates {
    normal: Limits,
    start: Limits,
    jump: Jump,
    /// The first and the last of the good fixes in a row.
    good: Option<(i64, Placed)>,
    /// The same of fixes that agree with one another, and not with those.
    elsewhere: Option<(i64, Placed)>,
}

impl Gates {
    /// As `[gnss]` says.
    #[must_use]
    pub fn new(section: &Gnss) -> Self {
        Self {
            normal: section.gate.clone(),
            start: section.start_gate.clone(),
            jump: section.jump.clone(),
            good: None,
            elsewhere: None,
        }
    }

    /// Whether a minute was good.
    #[must_use]
    pub fn is_settled(&self) -> bool {
        let lasts = |(first_ns, last): &(i64, Placed)| last.at_ns - first_ns >= MINUTE_NS;
        self.good.as_ref().is_some_and(lasts)
    }

    /// What the receiver says of the fix. Until a minute was good it is held to both gates.
    ///
    /// # Errors
    /// The first reason against it.
    pub fn check(&self, fix: &Fix) -> Result<(), Refusal> {
        self.normal.check(fix)?;
        if self.is_settled() {
            return Ok(());
        }
        self.start.check(fix)
    }

    /// The same of one whose moment is known: after a gap it is the first again.
    ///
    /// # Errors
    /// The first reason against it.
    pub fn check_after_gap(&self, fix: &Fix, at_ns: i64) -> Result<(), Refusal> {
        let goes_on = |(_, last): &(i64, Placed)| at_ns.saturating_sub(last.at_ns) <= GAP_NS;
        if self.good.as_ref().is_some_and(goes_on) {
            return Ok(());
        }
        self.start.check(fix)
    }

    /// Whether it can have come there from the fix before. One that passed all else.
    ///
    /// # Errors
    /// If it cannot.
    pub fn pass(&mut self, fix: Placed) -> Result<(), Refusal> {
        let goes_on = |last: &(i64, Placed)| fix.at_ns - last.1.at_ns <= GAP_NS;
        let Some((first_ns, last)) = self.good.filter(goes_on) else {
            self.begin(fix);
            return Ok(());
        };
        if self.jump.leads(&last, &fix) {
            self.good = Some((first_ns, fix));
            self.elsewhere = None;
            return Ok(());
        }
        let agree = |it: &(i64, Placed)| goes_on(it) && self.jump.leads(&it.1, &fix);
        let since_ns = self.elsewhere.filter(agree).map_or(fix.at_ns, |it| it.0);
        self.elsewhere = Some((since_ns, fix));
        if seconds(fix.at_ns - since_ns) >= self.jump.believed_after_s {
            self.begin(fix);
            return Ok(());
        }
        // The good ones wait for it to come back: they are no gap.
        self.good = Some((
            first_ns.max(fix.at_ns - MINUTE_NS),
            last.drifted_to(fix.at_ns),
        ));
        Err(Refusal::Jump)
    }

    fn begin(&mut self, fix: Placed) {
        self.good = Some((fix.at_ns, fix));
        self.elsewhere = None;
    }
}

impl Limits {
    fn check(&self, fix: &Fix) -> Result<(), Refusal> {
        if fix.quality == 0 {
            return Err(Refusal::NoFix);
        }
        if !self.qualities.contains(&fix.quality) {
            return Err(Refusal::Quality);
        }
        if fix.satellites.is_some_and(|it| it < self.satellites) {
            return Err(Refusal::Satellites);
        }
        let is_beyond =
            |value: Option<f64>, most: f64| value.is_some_and(|it| it.is_nan() || it > most);
        if is_beyond(fix.hdop, self.hdop) {
            return Err(Refusal::Hdop);
        }
        if is_beyond(fix.worst_m(), self.sigma_m) {
            return Err(Refusal::Accuracy);
        }
        Ok(())
    }
}

impl Jump {
    /// Whether the way from one fix leads to the other.
    fn leads(&self, from: &Placed, to: &Placed) -> bool {
        let time_s = seconds(to.at_ns - from.at_ns);
        let way = match (from.velocity, to.velocity) {
            (Some(a), Some(b)) => Some([0, 1].map(|it| 0.5 * (a[it] + b[it]) * time_s)),
            _ => None,
        };
        let off = [0, 1].map(|it| to.place[it] - from.place[it] - way.map_or(0.0, |way| way[it]));
        let speed = if way.is_some() {
            VELOCITY_OFF_M_S
        } else {
            self.most_speed_m_s
        };
        let moved_m = speed * time_s + 0.5 * self.most_acceleration_m_s2 * time_s * time_s;
        let [a, b] = [from.sigma, to.sigma];
        let slow_m = if from.quality == to.quality {
            // What of the slow error has passed meanwhile.
            let kept = (-time_s / b.slow_time_s).exp();
            b.slow_m * (2.0 * (1.0 - kept)).sqrt()
        } else {
            a.slow_m.hypot(b.slow_m)
        };
        let noise_m = SIGMAS * SQRT_2 * a.new_m.hypot(b.new_m).hypot(slow_m);
        off[0].hypot(off[1]) <= moved_m + noise_m
    }
}

impl Placed {
    /// The same as if it had been measured later, and the robot had gone on.
    fn drifted_to(mut self, at_ns: i64) -> Self {
        let time_s = seconds(at_ns - self.at_ns);
        if let Some(velocity) = self.velocity {
            self.place = [0, 1].map(|it| self.place[it] + velocity[it] * time_s);
        }
        self.at_ns = at_ns;
        self
    }
}

#[allow(clippy::cast_precision_loss)] // To a microsecond it is exact for centuries.
fn seconds(ns: i64) -> f64 {
    ns as f64 * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: i64 = 1_000_000_000;

    fn fix(second: i64, x: f64, speed: f64) -> Placed {
        Placed {
            at_ns: second * SECOND,
            place: [x, 0.0],
            velocity: Some([speed, 0.0]),
            sigma: Sigma {
                new_m: 0.3,
                slow_m: 1.0,
                slow_time_s: 60.0,
            },
            quality: 2,
        }
    }

    fn said(satellites: u32, hdop: f64, quality: u8) -> Fix {
        Fix {
            satellites: Some(satellites),
            hdop: Some(hdop),
            quality,
            ..Fix::default()
        }
    }

    fn gates() -> Gates {
        Gates::new(&Gnss::of("stdin"))
    }

    /// That has driven at 5 m/s for so long.
    fn driven(seconds: i64) -> Gates {
        let mut gates = gates();
        for second in 0..=seconds {
            let x = 5.0 * f64::from(i32::try_from(second).unwrap());
            assert_eq!(gates.pass(fix(second, x, 5.0)), Ok(()), "{second}");
        }
        gates
    }

    #[test]
    fn less_is_asked_once_a_minute_was_good() {
        let mut gates = driven(59);
        assert_eq!(gates.check(&said(5, 1.0, 1)), Err(Refusal::Satellites));
        assert_eq!(gates.check(&said(8, 3.0, 1)), Err(Refusal::Hdop));
        gates.pass(fix(60, 300.0, 5.0)).unwrap();
        assert_eq!(gates.check(&said(5, 3.0, 1)), Ok(()));
        assert_eq!(gates.check(&said(4, 3.0, 1)), Err(Refusal::Satellites));
        gates.pass(fix(71, 0.0, 5.0)).unwrap();
        assert!(!gates.is_settled(), "a gap begins anew");
    }

    #[test]
    fn until_a_minute_was_good_both_gates_hold() {
        let section = Gnss {
            gate: Limits {
                qualities: vec![4],
                ..Limits::default()
            },
            ..Gnss::of("stdin")
        };
        let gates = Gates::new(&section);
        assert_eq!(gates.check(&said(9, 1.0, 1)), Err(Refusal::Quality));
        assert_eq!(gates.check(&said(9, 1.0, 4)), Ok(()));
    }

    #[test]
    fn the_first_fix_after_a_gap_is_a_first_one() {
        let gates = driven(70);
        let poor = said(5, 3.0, 1);
        assert_eq!(gates.check_after_gap(&poor, 75 * SECOND), Ok(()));
        let refused = gates.check_after_gap(&poor, 81 * SECOND);
        assert_eq!(refused, Err(Refusal::Satellites));
    }

    #[test]
    fn each_limit_has_its_reason_and_what_is_not_said_is_not_asked_for() {
        let gates = gates();
        for (fix, refusal) in [
            (said(9, 1.0, 0), Refusal::NoFix),
            (said(9, 1.0, 6), Refusal::Quality),
            (said(9, f64::NAN, 1), Refusal::Hdop),
            (
                Fix {
                    stated_m: Some([9.0, 1.0]),
                    ..said(9, 1.0, 1)
                },
                Refusal::Accuracy,
            ),
        ] {
            assert_eq!(gates.check(&fix), Err(refusal));
        }
        let bare = Fix {
            quality: 1,
            ..Fix::default()
        };
        assert_eq!(gates.check(&bare), Ok(()));
    }

    #[test]
    fn a_jump_is_refused_and_who_comes_back_is_welcome() {
        let mut gates = driven(70);
        assert_eq!(gates.pass(fix(71, 380.0, 5.0)), Err(Refusal::Jump));
        assert_eq!(gates.pass(fix(72, 20.0, 5.0)), Err(Refusal::Jump));
        assert_eq!(gates.pass(fix(73, 365.0, 5.0)), Ok(()));
        assert!(gates.is_settled());
    }

    #[test]
    fn another_place_is_believed_once_all_agree_on_it() {
        let mut gates = driven(70);
        let seconds = 71_i32..;
        let passed = seconds.map(|second| {
            let x = 5.0 * f64::from(second) + 30.0;
            (second, gates.pass(fix(second.into(), x, 5.0)))
        });
        let (second, _) = passed.take(60).find(|(_, passed)| passed.is_ok()).unwrap();
        assert_eq!(second, 81);
        assert!(!gates.is_settled());
    }

    #[test]
    fn without_a_velocity_the_robot_may_go_as_fast_as_it_can() {
        let mut gates = gates();
        let mute = |second, x| Placed {
            velocity: None,
            ..fix(second, x, 0.0)
        };
        assert_eq!(gates.pass(mute(0, 0.0)), Ok(()));
        assert_eq!(gates.pass(mute(1, 15.0)), Ok(()));
        assert_eq!(gates.pass(mute(2, 45.0)), Err(Refusal::Jump));
    }
}
