//! What was read on a drive: wheels, a gyro, fixes. Times in seconds since the drive's begin.

/// What the wheels did over an interval.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Way {
    /// Where the interval begins \[s\].
    pub start_s: f64,
    /// Where it ends \[s\].
    pub end_s: f64,
    /// As the [`crate::Base`] reads: the ways of the left and the right wheel \[m, m\]; way and turn \[m, rad\]; way and steering
    /// angle \[m, rad\].
    pub read: [f64; 2],
    /// What kind of interval it is.
    pub state: State,
    /// The integral of the gyro's readings over it \[rad\].
    pub gyro: Option<f64>,
}

/// What an interval was.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub enum State {
    /// The wheels rolled.
    #[default]
    Rolling,
    /// The robot stood, and its wheels said so.
    Standing,
    /// Nothing came of the wheels.
    Missing,
}

/// A position that a receiver said.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Fix {
    /// Which of the robot's receivers, by its place among them.
    pub receiver: usize,
    /// Its stamp \[s\].
    pub stamp_s: f64,
    /// \[m\]
    pub position: [f64; 2],
}

/// A drive: ways that follow each other without a gap, and fixes between their ends, by stamp.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drive {
    ways: Vec<Way>,
    fixes: Vec<Fix>,
}

/// A fix so near an end may lie beyond it once its delay is known \[s\].
const MARGIN_S: f64 = 1.0;

impl Drive {
    /// Of ways and fixes in any order. Ways that begin before the last one ended are left out, gaps are filled with
    /// [`State::Missing`], and fixes within a second of either end, or outside, are left out.
    #[must_use]
    pub fn new(mut ways: Vec<Way>, mut fixes: Vec<Fix>) -> Self {
        ways.retain(|way| way.end_s > way.start_s);
        ways.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
        let mut whole: Vec<Way> = Vec::with_capacity(ways.len());
        for way in ways {
            let end_s = whole.last().map_or(way.start_s, |last| last.end_s);
            if way.start_s < end_s - OVERLAP_S {
                continue;
            }
            if way.start_s > end_s + OVERLAP_S {
                whole.push(missing(end_s, way.start_s));
            }
            let start_s = whole.last().map_or(way.start_s, |last| last.end_s);
            whole.push(Way { start_s, ..way });
        }
        fixes.sort_by(|a, b| a.stamp_s.total_cmp(&b.stamp_s));
        let mut drive = Self { ways: whole, fixes };
        let (begin, end) = (drive.begin_s() + MARGIN_S, drive.end_s() - MARGIN_S);
        let inside = |fix: &Fix| fix.stamp_s >= begin && fix.stamp_s <= end;
        drive.fixes.retain(inside);
        drive
    }

    /// Of the wheels.
    #[must_use]
    pub fn ways(&self) -> &[Way] {
        &self.ways
    }

    /// Of the receivers.
    #[must_use]
    pub fn fixes(&self) -> &[Fix] {
        &self.fixes
    }

    /// Whether a gyro was read.
    #[must_use]
    pub fn has_gyro(&self) -> bool {
        self.ways.iter().any(|way| way.gyro.is_some())
    }

    /// When it begins \[s\].
    #[must_use]
    pub fn begin_s(&self) -> f64 {
        self.ways.first().map_or(0.0, |way| way.start_s)
    }

    /// When it ends \[s\].
    #[must_use]
    pub fn end_s(&self) -> f64 {
        self.ways.last().map_or(0.0, |way| way.end_s)
    }

    /// How long the robot stood \[s\].
    #[must_use]
    pub fn stood_s(&self) -> f64 {
        let standing = self.ways.iter().filter(|way| way.state == State::Standing);
        standing.map(|way| way.end_s - way.start_s).sum()
    }

    /// The part of it before `end_s`.
    #[must_use]
    pub fn until(&self, end_s: f64) -> Self {
        let ways = self.ways.iter().filter(|way| way.end_s <= end_s);
        Self::new(ways.copied().collect(), self.fixes.clone())
    }
}

/// Stamps of frames that are read as floating point meet to this \[s\].
const OVERLAP_S: f64 = 1e-6;

fn missing(start_s: f64, end_s: f64) -> Way {
    Way {
        start_s,
        end_s,
        read: [0.0; 2],
        state: State::Missing,
        gyro: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn way(start_s: f64, end_s: f64) -> Way {
        Way {
            state: State::Rolling,
            read: [1.0; 2],
            ..missing(start_s, end_s)
        }
    }

    fn fix(stamp_s: f64) -> Fix {
        Fix {
            receiver: 0,
            stamp_s,
            position: [0.0; 2],
        }
    }

    #[test]
    fn ways_are_put_in_order_gaps_filled_and_doubles_left_out() {
        let ways = vec![way(2.0, 3.0), way(0.0, 1.0), way(0.5, 1.5), way(3.0, 4.0)];
        let drive = Drive::new(ways, Vec::new());
        let expected = [
            way(0.0, 1.0),
            missing(1.0, 2.0),
            way(2.0, 3.0),
            way(3.0, 4.0),
        ];
        assert_eq!(drive.ways(), expected);
    }

    #[test]
    fn a_fix_near_an_end_is_left_out() {
        let ways = (0_u8..5).map(|it| way(f64::from(it), f64::from(it) + 1.0));
        let fixes = [4.5, 0.5, 1.0, 3.0].map(fix);
        let drive = Drive::new(ways.collect(), fixes.into());
        assert_eq!(drive.fixes(), [1.0, 3.0].map(fix));
        assert_eq!(drive.until(3.0).fixes(), [fix(1.0)]);
    }
}
