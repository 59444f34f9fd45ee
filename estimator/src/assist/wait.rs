//! When the thesis's child, that keeps what it needs for late poses, fuses what has come and forgets the rest.
//!
//! At the liberate point all poses are there that can come, at the max-delay point no more can come. What a child believes after the
//! last pose does not depend on either: they say when memory is free.

/// How many ticks a pose can take.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub enum Bound {
    /// `|C| − 1`: no way goes through more children.
    #[default]
    Team,
    /// `|C| − n_ch`, the thesis's: of several leaders' ways some are longer, and their poses are lost.
    Own,
}

/// What a child knows at an event of who will hear of it.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Around {
    /// n: all that it sees, leaders too.
    pub seen: usize,
    /// `n_ch`: the children among them.
    pub seen_children: usize,
    /// `|L|`
    pub leaders: usize,
    /// `|C|`
    pub children: usize,
}

/// One event's wait, in ticks from the event on.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Wait {
    most: usize,
    max_delay: u32,
    fused: Option<u32>,
}

impl Wait {
    /// `None` for a child that sees nobody: by the thesis nobody sees it. Where robots see one way only that is not so, and `most` is
    /// all leaders ([`Self::of`]).
    #[must_use]
    pub fn new(around: &Around, bound: Bound) -> Option<Self> {
        let Around {
            seen,
            seen_children,
            leaders,
            children,
        } = *around;
        let ticks = match bound {
            _ if seen_children == 0 => 0,
            Bound::Team => children.saturating_sub(1),
            Bound::Own => children.saturating_sub(seen_children),
        };
        let max_delay = u32::try_from(ticks).unwrap_or(u32::MAX);
        (seen > 0).then_some(Self::of(seen.min(leaders), max_delay))
    }

    /// For so many poses, so long.
    #[must_use]
    pub fn of(most: usize, max_delay: u32) -> Self {
        Self {
            most,
            max_delay,
            fused: None,
        }
    }

    /// n̄: more poses do not come.
    #[must_use]
    pub fn most(&self) -> usize {
        self.most
    }

    /// Later none comes.
    #[must_use]
    pub fn max_delay(&self) -> u32 {
        self.max_delay
    }

    /// Whether the poses that have come, `count` of them, are to be fused in this tick: true once.
    pub fn is_due(&mut self, tick: u32, count: usize) -> bool {
        let is_due = self.fused.is_none() && (count >= self.most || tick >= self.max_delay);
        if is_due {
            self.fused = Some(tick);
        }
        is_due
    }

    /// When they were.
    #[must_use]
    pub fn fused(&self) -> Option<u32> {
        self.fused
    }

    /// From this tick on readings are not needed: what came in the tick of the fusion is handed on one later.
    #[must_use]
    pub fn closes(&self) -> Option<u32> {
        self.fused.map(|tick| tick.saturating_add(1))
    }
}
