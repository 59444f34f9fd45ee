//! How good a fix is believed to be: never better than its quality allows, never better than the receiver says.

use crate::fix::Fix;
use crate::section::Floor;

/// The error of a fix in each coordinate.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Sigma {
    /// What is another error in every fix (m).
    pub new_m: f64,
    /// What the next fix has again (m).
    pub slow_m: f64,
    /// How long that lasts (s).
    pub slow_time_s: f64,
}

impl Sigma {
    /// What a receiver states beyond the floor is slow: of one that filters, and all do, hardly anything else is left. One that states
    /// nothing is judged by how its satellites stand.
    #[must_use]
    pub fn of(floor: Floor, fix: &Fix) -> Self {
        let least_m = floor.sigma_m.hypot(floor.slow_sigma_m);
        let spread = fix.hdop.unwrap_or(1.0).max(1.0);
        let stated_m = fix.worst_m().unwrap_or(spread * least_m);
        let beyond = stated_m * stated_m - floor.sigma_m * floor.sigma_m;
        Self {
            new_m: floor.sigma_m,
            slow_m: beyond.max(0.0).sqrt().max(floor.slow_sigma_m),
            slow_time_s: floor.slow_time_s,
        }
    }

    /// Both together (m).
    #[must_use]
    pub fn total_m(&self) -> f64 {
        self.new_m.hypot(self.slow_m)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const FLOOR: Floor = Floor {
        sigma_m: 0.3,
        slow_sigma_m: 1.0,
        slow_time_s: 60.0,
    };

    fn sigma(stated_m: Option<f64>, hdop: Option<f64>) -> Sigma {
        let fix = Fix {
            stated_m: stated_m.map(|stated| [stated, stated / 2.0]),
            hdop,
            ..Fix::default()
        };
        Sigma::of(FLOOR, &fix)
    }

    proptest! {
        #[test]
        fn a_fix_is_never_believed_more_than_its_floor_or_the_receiver(
            stated in proptest::option::of(0.0_f64..1e4),
            hdop in proptest::option::of(0.0_f64..100.0),
        ) {
            let sigma = sigma(stated, hdop);
            prop_assert!(sigma.new_m >= FLOOR.sigma_m && sigma.slow_m >= FLOOR.slow_sigma_m);
            prop_assert!(sigma.total_m() >= stated.unwrap_or(0.0) * (1.0 - 1e-9));
        }
    }

    #[test]
    fn what_is_stated_beyond_the_floor_is_slow() {
        let believed = sigma(Some(5.0), None);
        assert!((believed.total_m() - 5.0).abs() < 1e-9 && believed.new_m <= 0.3);
        assert!((sigma(None, Some(3.0)).total_m() - 3.0 * 0.3_f64.hypot(1.0)).abs() < 1e-9);
        // Zeros say that nothing is known.
        assert_eq!(sigma(Some(0.0), Some(1.0)), sigma(None, None));
    }
}
