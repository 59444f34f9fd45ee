//! When a frame came, by the kernel's stamp.

/// What the kernel's stamp of a frame says about the inner clock \[ns\].
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum FrameTime {
    /// The only moment at which the frame can have come.
    At(i64),
    /// The clock was set since the last read, and by so little that both are possible: the clock after the step, then before it.
    Either(i64, i64),
    /// The stamp cannot be true: it is of a clock that is set between the stamp and its first reading, or of none.
    Unbelievable,
}

impl FrameTime {
    /// The moments that were possible, of two readings of a stamp.
    pub(super) fn of(readings: [Option<i64>; 2], possible: impl Fn(&i64) -> bool) -> Self {
        match readings.map(|reading| reading.filter(&possible)) {
            [Some(newest), Some(older)] => Self::Either(newest, older),
            [Some(only), None] | [None, Some(only)] => Self::At(only),
            [None, None] => Self::Unbelievable,
        }
    }

    /// The moment, where `due_ns` says when such a frame was to be expected and `now_ns` is that of the read.
    #[must_use]
    pub fn settle(self, due_ns: impl FnOnce() -> Option<i64>, now_ns: i64) -> i64 {
        match self {
            Self::At(ns) => ns,
            // Where nothing is known, the earlier: what comes behind it on the bus still finds its place.
            Self::Either(newest, older) => due_ns().map_or(newest.min(older), |due_ns| {
                std::cmp::min_by_key(newest, older, |ns| ns.abs_diff(due_ns))
            }),
            Self::Unbelievable => now_ns,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_two_moments_the_one_that_was_due() {
        let either = FrameTime::Either(105, 115);
        assert_eq!(either.settle(|| Some(104), 200), 105);
        assert_eq!(either.settle(|| Some(116), 200), 115);
        assert_eq!(either.settle(|| None, 200), 105);
        assert_eq!(FrameTime::Either(115, 105).settle(|| None, 200), 105);
        assert_eq!(FrameTime::Unbelievable.settle(|| Some(116), 200), 200);
    }
}
