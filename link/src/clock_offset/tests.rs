//! Clocks that are set, that drift, and that are heard through a network which loses half and delays the rest unevenly.
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::*;

const SECOND: i64 = 1_000_000_000;

/// A peer's clock, and the network in between.
struct World {
    chance: ChaCha8Rng,
    /// θ(t), at own time t (ns).
    theta: fn(i64) -> i64,
    /// Shortest and longest delay there and back (ns).
    delays: [[i64; 2]; 2],
    lost: f64,
    clock: ClockOffset,
}

impl World {
    fn new(seed: u64, theta: fn(i64) -> i64) -> Self {
        Self {
            chance: ChaCha8Rng::seed_from_u64(seed),
            theta,
            delays: [[100_000, 300_000]; 2],
            lost: 0.0,
            clock: ClockOffset::new(),
        }
    }

    fn hostile(seed: u64, theta: fn(i64) -> i64) -> Self {
        Self {
            delays: [[0, 400_000_000]; 2],
            lost: 0.5,
            ..Self::new(seed, theta)
        }
    }

    /// A question at `now_ns`, and its answer 3 ms after it was heard, if neither is lost.
    fn ask(&mut self, now_ns: i64) {
        let lost = [0, 1].map(|_| self.chance.random::<f64>() < self.lost);
        let [there, back] = self
            .delays
            .map(|[least, most]| self.chance.random_range(least..=most));
        if lost != [false; 2] {
            return;
        }
        let heard_at = now_ns + there;
        let replied_at = heard_at + 3_000_000;
        let back_at = replied_at + back;
        let theirs = |at: i64| at + (self.theta)(at);
        let (heard, replied) = (theirs(heard_at), theirs(replied_at));
        self.clock.round(back_at, now_ns, heard, replied, back_at);
    }

    /// Two questions a second from one moment to another (s); what is known then.
    fn run(&mut self, from_s: i64, until_s: i64) -> Option<Offset> {
        let mut known = None;
        for half in 2 * from_s..2 * until_s {
            self.ask(half * SECOND / 2);
            known = self.clock.at(half * SECOND / 2 + SECOND);
            if let Some(offset) = known {
                self.assert_true(&offset, half * SECOND / 2 + SECOND);
            }
        }
        known
    }

    /// A clock that was set a moment ago is known to have been once a message has gone each way.
    fn assert_true(&self, offset: &Offset, now_ns: i64) {
        let theta_s = seconds((self.theta)(now_ns));
        let wrong_s = (theta_s - offset.offset_s).abs();
        assert!(
            wrong_s <= offset.within_s + 1e-6,
            "{wrong_s} {offset:?} at {now_ns}"
        );
    }
}

#[test]
fn nothing_is_known_until_a_message_has_gone_each_way() {
    let mut clock = ClockOffset::new();
    assert_eq!(clock.at(0), None);
    clock.at_least(0, -5);
    assert_eq!(clock.at(0), None);
    clock.at_most(0, 5);
    let offset = clock.at(0).unwrap();
    assert!(offset.offset_s.abs() < 1e-8 && !offset.is_off());
}

#[test]
fn a_good_network_tells_the_clock_to_its_delay() {
    let offset = World::new(1, |_| 0).run(0, 30).unwrap();
    assert!(!offset.is_off() && offset.within_s < 150e-6, "{offset:?}");
}

#[test]
fn a_second_either_way_is_named_with_the_first_answer() {
    for theta in [(|_| SECOND) as fn(i64) -> i64, |_| -SECOND] {
        for seed in 0..20 {
            let mut world = World::hostile(seed, theta);
            let named = (0..60).find(|second| {
                world
                    .run(*second, second + 1)
                    .is_some_and(|offset| offset.exceeds(0.25))
            });
            assert!(named.is_some_and(|second| second < 30), "{seed} {named:?}");
        }
    }
}

#[test]
fn drift_is_told_from_the_messages_alone_and_bounded() {
    let offset = World::new(2, |at| at / 5000).run(0, 90).unwrap();
    assert!(
        (offset.drift - 200e-6).abs() <= offset.drift_within,
        "{offset:?}"
    );
    assert!(offset.drift_within < 5e-6, "{offset:?}");
}

#[test]
fn bounds_hold_with_half_lost_and_delays_of_any_asymmetry() {
    for seed in 0..40 {
        let mut world = World::hostile(seed, |at| at / 5000 - 40_000_000);
        // Every look of them is held against the truth.
        let offset = world.run(0, 120).unwrap();
        assert!(offset.within_s < 0.12, "{offset:?}");
        let mut uneven = World::hostile(100 + seed, |at| -at / 5000);
        uneven.delays = [[0, 1_000_000], [350_000_000, 400_000_000]];
        let _ = uneven.run(0, 60).unwrap();
    }
}

#[test]
fn an_offset_beyond_its_bounds_is_named_within_a_minute() {
    for seed in 0..40 {
        let mut world = World::hostile(200 + seed, |at| 200_000_000 + at / 5000);
        let offset = world.run(0, 60).unwrap();
        assert!(offset.is_off(), "{seed} {offset:?}");
    }
}

#[test]
fn a_clock_that_is_right_is_never_called_wrong() {
    for seed in 0..40 {
        let mut world = World::hostile(300 + seed, |_| 0);
        for second in 0..60 {
            let known = world.run(second, second + 1);
            assert!(!known.is_some_and(|offset| offset.is_off()));
        }
    }
}

#[test]
fn a_clock_that_is_set_is_measured_anew() {
    for step in [SECOND, -SECOND] {
        let mut clock = ClockOffset::new();
        let mut chance = ChaCha8Rng::seed_from_u64(4);
        let mut ask = |clock: &mut ClockOffset, at: i64, theta: i64| {
            let [there, back] = [0, 1].map(|_| chance.random_range(0..400_000_000_i64));
            let heard = at + there;
            clock.round(heard + back, at, heard + theta, heard + theta, heard + back);
        };
        for second in 0..60 {
            ask(&mut clock, second * SECOND, 0);
            let offset = clock.at(second * SECOND + SECOND).unwrap();
            assert!(!offset.is_off());
        }
        assert_eq!(clock.steps(), 0);
        ask(&mut clock, 60 * SECOND, step);
        let offset = clock.at(61 * SECOND).unwrap();
        assert!(
            (offset.offset_s - seconds(step)).abs() <= offset.within_s,
            "{offset:?}"
        );
        assert!(offset.exceeds(0.5));
        assert_eq!(clock.steps(), 1);
    }
}

#[test]
fn what_was_not_measured_for_long_is_known_less_well() {
    let mut world = World::new(5, |_| 0);
    let fresh = world.run(0, 10).unwrap();
    let later = world.clock.at(100 * SECOND).unwrap();
    assert!(later.within_s > fresh.within_s);
}

#[test]
fn a_correction_stays_while_it_may_be_right() {
    let measured = |offset_s, within_s| Offset {
        offset_s,
        within_s,
        drift: 0.0,
        drift_within: 0.0,
    };
    let first = Correction::of(&measured(1.0, 0.2));
    assert_eq!(first.by_ns, -SECOND);
    let same = first.after(&measured(1.05, 0.19));
    assert_eq!(same.by_ns, first.by_ns);
    // What is then wrong is both: how far the middle went, and the doubt around it.
    assert!((same.variance_s2 - (0.05_f64.powi(2) + 0.19_f64.powi(2) / 3.0)).abs() < 1e-12);
    let sharper = first.after(&measured(1.05, 0.05));
    assert_eq!(sharper.by_ns, -1_050_000_000);
    let elsewhere = first.after(&measured(2.0, 0.2));
    assert_eq!(elsewhere.by_ns, -2 * SECOND);
}

#[test]
fn an_error_of_the_stamp_lies_along_the_way() {
    let rows = blur([2.0, 0.0, 0.5], core::f64::consts::FRAC_PI_2, 0.01);
    let expected = [0.0, 0.0, 0.0, 0.0, 0.04, 0.01, 0.0, 0.01, 0.0025];
    for (found, expected) in rows.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-15, "{rows:?}");
    }
}

/// NEES of a pose that is told with a stamp that is wrong by a common δ: with the blur its mean is that of three dimensions, without it not.
#[test]
fn poses_by_a_corrected_clock_are_as_uncertain_as_they_say() {
    let mut chance = ChaCha8Rng::seed_from_u64(6);
    let (velocity, heading, noise) = ([1.5, 0.0, 0.2], 0.7_f64, 0.05_f64);
    let mut sums = [0.0; 2];
    let runs = 4000;
    for _ in 0..runs {
        let within_s = 0.1;
        let delta_s = chance.random_range(-within_s..within_s);
        // The sum of twelve uniform numbers is close to normal.
        let mut normal = || (0..12).map(|_| chance.random::<f64>()).sum::<f64>() - 6.0;
        let rate = [
            velocity[0] * heading.cos(),
            velocity[0] * heading.sin(),
            velocity[2],
        ];
        let error = rate.map(|rate| noise.mul_add(normal(), -rate * delta_s));
        // (s I + r rᵀ σ²)⁻¹ by Sherman and Morrison.
        let quadratic = |variance: f64| {
            let s = noise * noise;
            let [own, along, length] = [(error, error), (error, rate), (rate, rate)]
                .map(|(one, two)| one.iter().zip(two).map(|(a, b)| a * b).sum::<f64>());
            own / s - variance * along * along / (s * s) / (1.0 + variance * length / s)
        };
        let offset = Offset {
            offset_s: 0.0,
            within_s,
            drift: 0.0,
            drift_within: 0.0,
        };
        sums[0] += quadratic(offset.variance_s2());
        sums[1] += quadratic(0.0);
    }
    let [blurred, bare] = sums.map(|sum| sum / f64::from(runs));
    assert!((blurred - 3.0).abs() < 0.15, "{blurred}");
    assert!(bare > 5.0, "{bare}");
}

#[test]
fn most_peers_tell_whose_clock_it_is() {
    let off = |offset_s| Offset {
        offset_s,
        within_s: 0.01,
        drift: 0.0,
        drift_within: 0.0,
    };
    assert_eq!(whose_clock(&[]), Whose::Nobodys);
    assert_eq!(
        whose_clock(&[(2, off(0.0)), (3, off(0.005))]),
        Whose::Nobodys
    );
    assert_eq!(
        whose_clock(&[(2, off(1.0)), (3, off(0.0))]),
        Whose::Theirs(vec![2])
    );
    // Of two nobody can tell.
    assert_eq!(whose_clock(&[(2, off(1.0))]), Whose::Theirs(vec![2]));
    assert_eq!(whose_clock(&[(2, off(1.0)), (3, off(1.001))]), Whose::Mine);
    let apart = [(2, off(1.0)), (3, off(-4.0)), (4, off(0.0))];
    assert_eq!(whose_clock(&apart), Whose::Theirs(vec![2, 3]));
}
