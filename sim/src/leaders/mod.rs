//! Leaders carry children that they do not see: the simulations of the thesis, §3.6.
//!
//! | part | what |
//! | --- | --- |
//! | [`single`] | one leader that stands, four children in circles: cases 1 to 4 |
//! | [`tracked`] | one leader, two children, and tracks of range and bearing between them |
//! | [`team`] | two leaders and three children, the robots of MR.CLAM 1 with their own wheels: cases 5 to 8 |
//!
//! All leaders know all readings, as in chapter 3. What a child does with a pose is
//!
//! | method | what a child does |
//! | --- | --- |
//! | `leader-kf` | the thesis: a Kalman update with all of its covariance |
//! | `leader-split` | split covariance intersection, the leader's error dependent |
//! | `leader-cross` | the correlation with each leader's error is tracked; what becomes of that error it hears at every event |
//! | `leader-default` | the same of what is on its way to it only: of events that it missed, a datum tells the last eight; each leader errs by twice what it says |

pub(crate) mod event;
pub(crate) mod robot;
mod run;
mod score;
pub mod single;
pub mod team;
pub mod tracked;

use std::path::PathBuf;

/// How much of it is done.
#[derive(Clone, Debug, PartialEq)]
pub struct Form {
    /// Where all chance comes from.
    pub seed: u64,
    /// Runs of each case.
    pub runs: u16,
    /// How long each is \[s\].
    pub seconds: u32,
    /// The folder with recordings; `None`: without them.
    pub data: Option<PathBuf>,
}

/// As long as MR.CLAM 1 is.
const LONGEST_S: u32 = 1500;

impl Form {
    /// The thesis's: 20 runs of all there is.
    #[must_use]
    pub fn long(seed: u64, data: Option<PathBuf>) -> Self {
        Self {
            seed,
            runs: 20,
            seconds: LONGEST_S,
            data,
        }
    }

    /// What some seconds of one processor are enough for. Too little for the bars.
    #[must_use]
    pub fn short(seed: u64, data: Option<PathBuf>) -> Self {
        Self {
            runs: 4,
            seconds: 30,
            ..Self::long(seed, data)
        }
    }

    /// Whether bars can be held to it.
    fn is_long(&self) -> bool {
        self.seconds >= LONGEST_S && self.runs >= 20
    }

    /// How many steps of such a length, if no more than `most`.
    fn steps(&self, a_second: usize, most: usize) -> usize {
        usize::try_from(self.seconds).map_or(most, |it| most.min(it.saturating_mul(a_second)))
    }
}
