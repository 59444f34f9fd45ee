//! The observer's sensors.

use coloc_estimator::Pose;

/// More sensors one robot does not have.
pub const MOST_SENSORS: usize = 4;

/// Errors that stay for seconds (Gauss and Markov's): of the range relative, of the bearing in rad.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct SlowErrors {
    /// σ of the relative error of the range.
    pub range_sigma: f64,
    /// Its time constant \[s\].
    pub range_tau_s: f64,
    /// σ of the error of the bearing \[rad\].
    pub bearing_sigma: f64,
    /// Its time constant \[s\].
    pub bearing_tau_s: f64,
}

/// A sensor of range, bearing or both.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Sensor {
    /// Where it is on the observer's body.
    pub mount: Pose,
    /// Its slow errors, if it has any.
    pub slow: Option<SlowErrors>,
}

/// All of them.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Sensors {
    list: [Sensor; MOST_SENSORS],
    count: usize,
}

impl Sensors {
    /// `None` of more than there is room for.
    #[must_use]
    pub fn new(given: &[Sensor]) -> Option<Self> {
        let mut list = [Sensor::default(); MOST_SENSORS];
        list.get_mut(..given.len())?.copy_from_slice(given);
        Some(Self {
            list,
            count: given.len(),
        })
    }

    /// Number `index`, if there is one.
    #[must_use]
    pub fn get(&self, index: usize) -> Option<&Sensor> {
        self.list[..self.count].get(index)
    }

    /// The slow errors of those that have any, in the order of the sensors: so they stand in a state.
    pub(crate) fn slow(&self) -> impl Iterator<Item = SlowErrors> + '_ {
        self.list[..self.count].iter().filter_map(|it| it.slow)
    }

    /// Which of them sensor `index` has.
    pub(crate) fn slow_place(&self, index: usize) -> Option<usize> {
        self.get(index)?.slow?;
        let before = self.list.iter().take(index);
        Some(before.filter(|it| it.slow.is_some()).count())
    }
}
