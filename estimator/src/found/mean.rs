//! Whether the innovations of a source have a mean: a shift that drags the belief along without a refusal.

/// Of the latest innovation in the mean: `2/0.05 − 1 = 39` of them count.
const SMOOTHING: f64 = 0.05;
const COUNTED: f64 = 39.0;

/// χ² with two degrees of freedom, 3e-7.
const LIMIT: f64 = 30.0;

/// The same, 2.5e-3.
const DOUBTFUL: f64 = 12.0;

/// No innovation counts as longer.
const LONGEST: f64 = 3.0;

/// The mean of the normalised innovations.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub(crate) struct Mean {
    mean: [f64; 2],
    disagrees: bool,
}

impl Mean {
    /// After `innovation`, normalised by its covariance.
    pub(crate) fn take(&mut self, [x, y]: [f64; 2]) {
        let squared = x * x + y * y;
        let kept = if squared > LONGEST * LONGEST {
            LONGEST / libm::sqrt(squared)
        } else {
            1.0
        };
        let [mx, my] = self.mean;
        self.mean = [
            mx + SMOOTHING * (kept * x - mx),
            my + SMOOTHING * (kept * y - my),
        ];
        if COUNTED * self.norm_squared() > LIMIT {
            self.disagrees = true;
        }
    }

    /// Its length, squared.
    #[inline]
    pub(crate) fn norm_squared(&self) -> f64 {
        let [x, y] = self.mean;
        x * x + y * y
    }

    /// As it is after `innovation`.
    #[inline]
    pub(crate) fn after(mut self, innovation: [f64; 2]) -> Self {
        self.take(innovation);
        self
    }

    /// Chance hardly explains it.
    #[inline]
    pub(crate) fn is_doubtful(&self) -> bool {
        COUNTED * self.norm_squared() > DOUBTFUL
    }

    pub(crate) fn disagrees(&self) -> bool {
        self.disagrees
    }

    /// Its hypothesis is where the belief is: what it had against that is over.
    pub(crate) fn reconcile(&mut self) {
        if self.disagrees {
            self.clear();
        }
    }

    /// All of it is forgotten.
    pub(crate) fn clear(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A shift of a σ, of which no single innovation tells.
    #[test]
    fn a_shift_that_is_never_refused_is_found_and_no_shift_is_not() {
        let words_until = |shift: f64| {
            let mut mean = Mean::default();
            (1..=1000).find(|k| {
                let scatter = if k % 2 == 0 { 1.0 } else { -1.0 };
                mean.take([scatter + shift, -scatter]);
                mean.disagrees()
            })
        };
        assert!(words_until(1.0).is_some_and(|words| words < 50));
        assert_eq!(words_until(0.0), None);
    }

    #[test]
    fn it_ends_when_it_is_taken_back() {
        let mut mean = Mean::default();
        (0..50).for_each(|_| mean.take([9.0, 0.0]));
        assert!(mean.disagrees());
        mean.reconcile();
        assert_eq!(mean, Mean::default());
    }
}
