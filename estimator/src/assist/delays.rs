//! How long answers take, and so how long one is waited for.
//!
//! As TCP does (RFC 6298): a mean and a mean deviation that forget, and the time-out is the mean and four deviations. What comes after the
//! time-out counts too, so that a radio which is slower than believed is learnt.
//!
//! ```text
//! D := D + (|d − m| − D)/4    m := m + (d − m)/8    time-out = m + 4 D
//! ```

/// Of all children that this one hands on to.
#[derive(Copy, Clone, Debug, Default)]
pub(super) struct Delays {
    /// m, D, in ticks of the search.
    measured: Option<[f64; 2]>,
}

/// Within which a time-out is chosen, in ticks of the search.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Bounds {
    /// It is no shorter.
    pub least: u32,
    /// As long as no answer has come.
    pub first: u32,
    /// It is no longer.
    pub most: u32,
}

impl Delays {
    /// An answer took so long.
    pub(super) fn add(&mut self, ticks: u32) {
        let taken = f64::from(ticks);
        self.measured = Some(match self.measured {
            None => [taken, 0.5 * taken],
            Some([mean, deviation]) => {
                let off = taken - mean;
                [
                    mean + 0.125 * off,
                    deviation + 0.25 * (libm::fabs(off) - deviation),
                ]
            }
        });
    }

    /// How long an answer is waited for.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // It saturates.
    pub(super) fn timeout(&self, bounds: Bounds) -> u32 {
        let Some([mean, deviation]) = self.measured else {
            return bounds.first;
        };
        let ticks = libm::ceil(mean + 4.0 * deviation) as u32;
        ticks.max(bounds.least).min(bounds.most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOUNDS: Bounds = Bounds {
        least: 40,
        first: 160,
        most: 900,
    };

    #[test]
    fn it_comes_down_to_the_floor_and_covers_what_is_late() {
        let mut delays = Delays::default();
        assert_eq!(delays.timeout(BOUNDS), 160);
        delays.add(100);
        assert_eq!(delays.timeout(BOUNDS), 300);
        (0..40).for_each(|_| delays.add(20));
        assert_eq!(delays.timeout(BOUNDS), 40);
        // A radio that is late by 40 to 800 ms, there and back.
        let mut outside = 0;
        for round in 0..400_u32 {
            let taken = 40 + 40 * (round * 7 % 20);
            outside += u32::from(round > 20 && taken > delays.timeout(BOUNDS));
            delays.add(taken);
        }
        assert_eq!(outside, 0);
        assert!(delays.timeout(BOUNDS) <= 900);
    }
}
