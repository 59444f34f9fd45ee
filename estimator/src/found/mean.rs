//! Whether the innovations of a source have a mean: a shift that drags the belief along without a refusal.

/// Of the latest innovation in the mean: `2/0.05 − 1 = 39` of them count.
const SMOOTHING: f64 = 0.05;
const COUNTED: f64 = 39.0;

/// χ² with two degrees of freedom, 3e-7.
const LIMIT: f64 = 30.0;

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
        let length = libm::hypot(x, y);
        let kept = if length > LONGEST {
            LONGEST / length
        } else {
            1.0
        };
        let [mx, my] = self.mean;
        self.mean = [
            mx + SMOOTHING * (kept * x - mx),
            my + SMOOTHING * (kept * y - my),
        ];
        let [mx, my] = self.mean;
        if COUNTED * (mx * mx + my * my) > LIMIT {
            self.disagrees = true;
        }
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
