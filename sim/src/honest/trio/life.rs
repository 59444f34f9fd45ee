//! How teams live.

use crate::honest::sort::Sort;

/// σ of the heading at the start, unless it is said otherwise \[rad\].
const HEADING: f64 = 0.05;

const FLOOR_M: f64 = 10.0;

/// How a team lives.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct Life {
    pub(super) sort: Sort,
    /// Ticks from one exchange to the next.
    pub(super) exchange: u32,
    /// Ticks from one fix to the next, if there are any.
    pub(super) fixes: Option<u32>,
    /// σ of the headings at the start \[rad\].
    pub(super) heading: f64,
    /// Radius of the floor beyond which they turn back \[m\].
    pub(super) floor_m: f64,
    /// What an independent implementation of the same equations found, in another world, with cubature and with the bend carried.
    pub(super) elsewhere: Option<[Elsewhere; 2]>,
}

/// Root mean square error of the position \[m\], and mean NEES.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct Elsewhere {
    pub(super) rms_m: f64,
    pub(super) nees: f64,
}

const fn life(
    sort: Sort,
    exchange: u32,
    fixes: Option<u32>,
    [[a, nees_a], [b, nees_b]]: [[f64; 2]; 2],
) -> Life {
    Life {
        sort,
        exchange,
        fixes,
        heading: HEADING,
        floor_m: FLOOR_M,
        elsewhere: Some([
            Elsewhere {
                rms_m: a,
                nees: nees_a,
            },
            Elsewhere {
                rms_m: b,
                nees: nees_b,
            },
        ]),
    }
}

/// The same where nothing keeps them together.
const fn scattered(life: Life) -> Life {
    Life {
        floor_m: f64::INFINITY,
        elsewhere: None,
        ..life
    }
}

impl Life {
    /// Whether robots stay together, as robots that help one another do.
    pub(super) fn is_held(&self) -> bool {
        self.floor_m.is_finite()
    }
}

/// In ticks of a tenth of a second.
pub(super) const LIVES: [Life; 8] = [
    life(Sort::Sane, 100, Some(600), [[0.56, 1.2], [0.56, 1.2]]),
    Life {
        heading: 0.5,
        ..life(Sort::Sane, 100, Some(600), [[1.13, 4.6], [0.67, 1.2]])
    },
    life(Sort::Paper, 5, Some(200), [[0.68, 1.4], [0.67, 1.35]]),
    life(Sort::Paper, 100, Some(600), [[3.5, 1.7], [3.71, 1.1]]),
    life(Sort::Paper, 600, Some(600), [[6.6, 3.3], [5.7, 1.4]]),
    life(Sort::Paper, 20, None, [[8.45, 2.2], [8.5, 0.65]]),
    scattered(life(Sort::Paper, 100, Some(600), [[0.0; 2]; 2])),
    scattered(life(Sort::Paper, 20, None, [[0.0; 2]; 2])),
];
