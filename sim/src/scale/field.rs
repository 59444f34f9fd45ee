//! How large the field is.

use super::RANGE_M;

/// A square, its centre at the origin.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct Field {
    /// \[m\]
    pub(super) side_m: f64,
}

impl Field {
    /// On which so many robots have that many others in range on average, those at its edge included; where there are hardly more, all
    /// are in range of one another, or nearly.
    #[allow(clippy::cast_precision_loss)] // Some thousand robots.
    pub(super) fn of(robots: usize, neighbours: f64) -> Self {
        let others = robots.saturating_sub(1) as f64;
        let (mut near, mut far) = (1.0, 1e6);
        while far - near > 1e-9 * far {
            let middle = f64::midpoint(near, far);
            if others * within(1.0 / middle) > neighbours {
                near = middle;
            } else {
                far = middle;
            }
        }
        Self {
            side_m: RANGE_M * far,
        }
    }
}

/// How likely two places in a square are no farther apart than `d` of its sides, at most 1.
fn within(d: f64) -> f64 {
    d * d * (std::f64::consts::PI - 8.0 / 3.0 * d + 0.5 * d * d)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Noise, Purpose};

    #[test]
    fn places_at_random_have_as_many_neighbours_as_was_meant() {
        let fields = [(10, 4.0), (100, 4.0), (1000, 4.0), (1000, 2.0)];
        for (robots, neighbours) in fields {
            let field = Field::of(robots, neighbours);
            let mut draws = Noise::new(1, 0).draws(Purpose::Start, 0, 0, 0);
            let mut place = || [0; 2].map(|_| draws.uniform(0.0, field.side_m));
            let pairs = 40_000;
            let near = (0..pairs).filter(|_| {
                let ([ax, ay], [bx, by]) = (place(), place());
                libm::hypot(ax - bx, ay - by) <= RANGE_M
            });
            let share = f64::from(i32::try_from(near.count()).unwrap()) / f64::from(pairs);
            let expected = neighbours / (f64::from(u16::try_from(robots).unwrap()) - 1.0);
            let sigma = (expected / f64::from(pairs)).sqrt();
            assert!((share - expected).abs() < 4.0 * sigma, "{share} {expected}");
        }
    }
}
