//! A recorded clock that jumps, made to run on.

use std::collections::HashMap;

use super::frame::{Frame, raw_id};

/// Places the stamps of a log on one time that does not jump.
///
/// A logger's clock is set while it records, and some loggers start without knowing the date. Where the stamps of an
/// interface jump, its next frame is placed where its identifier was due; from there on its stamps keep their distances.
#[derive(Debug, Default)]
pub(super) struct Timeline {
    interfaces: Vec<Interface>,
    /// The one that was heard last: a new one starts on its clock.
    latest: usize,
}

/// A jump of the stamps \[ns\]: how far the stamp lies from the one before.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) struct Jump(pub(super) i64);

#[derive(Debug)]
struct Interface {
    name: String,
    /// Stamp as written \[ns\].
    last_raw_ns: i64,
    /// Stamp as placed \[ns\].
    last_ns: i64,
    /// From written to placed \[ns\].
    offset_ns: i64,
    seen: HashMap<Option<u32>, Seen>,
}

/// When frames of one identifier come.
#[derive(Copy, Clone, Debug)]
struct Seen {
    last_ns: i64,
    period_ns: i64,
}

/// Frames of one interface get into disorder by so much \[ns\]; more is a clock that was set back.
const DISORDER_NS: i64 = 5_000_000;

/// A longer pause is a clock that was set ahead, or a logger that was off: nobody wants to wait for it \[ns\].
pub(super) const LONGEST_PAUSE_NS: i64 = 10_000_000_000;

impl Timeline {
    /// Where the frame belongs \[ns\], and the jump before it, if there is one.
    pub(super) fn place(
        &mut self,
        interface: &str,
        frame: &Frame,
        raw_ns: i64,
    ) -> (i64, Option<Jump>) {
        self.latest = self.index(interface, raw_ns);
        let Some(interface) = self.interfaces.get_mut(self.latest) else {
            return (raw_ns, None);
        };
        let id = frame.id().map(raw_id);
        let step_ns = raw_ns.saturating_sub(interface.last_raw_ns);
        let jump = (!(-DISORDER_NS..=LONGEST_PAUSE_NS).contains(&step_ns)).then_some(Jump(step_ns));
        if jump.is_some() {
            interface.offset_ns = interface.due_ns(id).saturating_sub(raw_ns);
        }
        (interface.take(id, raw_ns), jump)
    }

    fn index(&mut self, name: &str, raw_ns: i64) -> usize {
        let known = self.interfaces.iter().position(|known| known.name == name);
        known.unwrap_or_else(|| {
            let clock = self.interfaces.get(self.latest);
            self.interfaces.push(Interface {
                name: name.to_owned(),
                last_raw_ns: clock.map_or(raw_ns, |clock| clock.last_raw_ns),
                last_ns: clock.map_or(raw_ns, |clock| clock.last_ns),
                offset_ns: clock.map_or(0, |clock| clock.offset_ns),
                seen: HashMap::new(),
            });
            self.interfaces.len() - 1
        })
    }
}

impl Interface {
    /// When a frame of that identifier comes next, by what was seen of it; not before what came last.
    fn due_ns(&self, id: Option<u32>) -> i64 {
        let due_ns = |seen: &Seen| seen.last_ns.saturating_add(seen.period_ns);
        self.seen
            .get(&id)
            .map_or(self.last_ns, due_ns)
            .max(self.last_ns)
    }

    fn take(&mut self, id: Option<u32>, raw_ns: i64) -> i64 {
        let placed_ns = raw_ns.saturating_add(self.offset_ns);
        let period_ns = self
            .seen
            .get(&id)
            .map_or(0, |seen| placed_ns.saturating_sub(seen.last_ns).max(0));
        let last_ns = placed_ns;
        self.seen.insert(id, Seen { last_ns, period_ns });
        self.last_ns = self.last_ns.max(placed_ns);
        self.last_raw_ns = raw_ns;
        placed_ns
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::StandardId;
    use super::*;

    const MS: i64 = 1_000_000;

    fn frame(id: u16) -> Frame {
        Frame::data_frame(StandardId::new(id).unwrap(), &[]).unwrap()
    }

    /// Places pairs of frames that come every 20 ms, written by a clock that is off by `error_ns`.
    fn pairs(timeline: &mut Timeline, pairs: std::ops::Range<i64>, error_ns: i64) -> Vec<i64> {
        let place = |(pair, id): (i64, u16)| {
            let (placed_ns, _) = timeline.place("can0", &frame(id), 20 * MS * pair + error_ns);
            placed_ns
        };
        pairs
            .flat_map(|pair| [(pair, 1), (pair, 2)])
            .map(place)
            .collect()
    }

    #[test]
    fn stamps_that_do_not_jump_stay() {
        let placed = pairs(&mut Timeline::default(), 0..50, 5);
        let expected: Vec<_> = (0..50).flat_map(|pair| [20 * MS * pair + 5; 2]).collect();
        assert_eq!(placed, expected);
    }

    #[test]
    fn a_clock_that_is_set_leaves_the_distances() {
        for error_ns in [
            -3_600_000 * MS,
            -500 * MS,
            -30 * MS,
            11_000 * MS,
            1_700_000_000_000 * MS,
        ] {
            let mut timeline = Timeline::default();
            let mut placed = pairs(&mut timeline, 0..25, 0);
            placed.extend(pairs(&mut timeline, 25..50, error_ns));
            let expected: Vec<_> = (0..50).flat_map(|pair| [20 * MS * pair; 2]).collect();
            assert_eq!(placed, expected, "off by {error_ns} ns");
        }
    }

    #[test]
    fn interfaces_with_clocks_of_their_own_jump_once() {
        let mut timeline = Timeline::default();
        let mut jumps = 0;
        for ms in 0..100 {
            for (interface, epoch_ns) in [("can0", 0), ("can1", 1_700_000_000_000 * MS)] {
                let raw_ns = epoch_ns + 20 * MS * ms;
                let (placed_ns, jump) = timeline.place(interface, &frame(1), raw_ns);
                assert_eq!(placed_ns, 20 * MS * ms);
                jumps += i32::from(jump.is_some());
            }
        }
        assert_eq!(jumps, 1);
    }

    proptest! {
        #[test]
        fn whatever_is_written_time_runs_on(stamps in proptest::collection::vec((any::<i64>(), 0_u16..3, any::<bool>()), 1..50)) {
            let mut timeline = Timeline::default();
            let mut latest_ns = None;
            for (raw_ns, id, second) in stamps {
                let (raw_ns, interface) = (raw_ns & i64::MAX, if second { "can1" } else { "can0" });
                let (placed_ns, _) = timeline.place(interface, &frame(id), raw_ns);
                let step_ns = latest_ns.map_or(0, |latest_ns| placed_ns.saturating_sub(latest_ns));
                // Two clocks of their own drift apart by no more than what one of them may do at once.
                let bound_ns = 50 * LONGEST_PAUSE_NS;
                prop_assert!((-bound_ns..=bound_ns).contains(&step_ns), "{step_ns}");
                latest_ns = Some(placed_ns);
            }
        }
    }
}
