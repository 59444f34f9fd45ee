//! Which estimate was the first to contain which frame.

use serde::{Deserialize, Serialize};

/// A pair of encoder frames, as the sender knows it \[ns of `CLOCK_BOOTTIME`\].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Sent {
    /// When the schedule wanted its second frame to leave.
    pub(crate) due_ns: i64,
    /// Just before its second frame went to the kernel.
    pub(crate) sent_ns: i64,
}

/// An estimate, as the reader saw it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[allow(clippy::struct_field_names)] // The unit belongs to the name.
pub(crate) struct Seen {
    /// When the reader had it \[ns of `CLOCK_BOOTTIME`\].
    pub(crate) received_ns: i64,
    /// The tick's wake-up.
    pub(crate) stamp_ns: i64,
    pub(crate) tick: u64,
    /// Kernel's stamp of the newest frame in it; 0 if that was not told, like what follows.
    pub(crate) frame_stamp_ns: i64,
    /// Those of the tick, as it told them.
    pub(crate) since_tick_ns: u64,
    pub(crate) lateness_ns: u64,
    pub(crate) collect_ns: u32,
    pub(crate) estimate_ns: u32,
    pub(crate) publish_ns: u32,
    pub(crate) account_ns: u32,
}

/// The kernel's stamps come over from another clock: that much may they be off.
const TOLERANCE_NS: i64 = 20_000;

/// What became of the frames.
#[derive(Clone, Debug, Default)]
pub(crate) struct Matched {
    /// Of every frame, from when it was due until an estimate with it was received \[ns\].
    pub(crate) from_due_ns: Vec<i64>,
    /// Of every frame that was the newest of an estimate, from its kernel stamp \[ns\].
    pub(crate) from_kernel_ns: Vec<i64>,
    pub(crate) account: Account,
}

/// Every frame that was sent is in one of the others.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub(crate) struct Account {
    pub(crate) sent: u64,
    /// In an estimate, as its newest.
    pub(crate) newest: u64,
    /// In an estimate together with a newer one: the tick came late, or the bus lost the frame and the next one made it good.
    pub(crate) with_newer: u64,
    /// In no estimate that was received.
    pub(crate) never_estimated: u64,
    /// Before the measured time.
    pub(crate) warm_up: u64,
}

impl Account {
    /// Counts those of `more` as well.
    pub(crate) fn add(&mut self, more: &Self) {
        self.sent += more.sent;
        self.newest += more.newest;
        self.with_newer += more.with_newer;
        self.never_estimated += more.never_estimated;
        self.warm_up += more.warm_up;
    }
}

/// Accounts for every one of `frames`, of which those due before `from_ns` are not measured; both lists are in the order of
/// time.
pub(crate) fn matched(frames: &[Sent], seen: &[Seen], from_ns: i64) -> Matched {
    let mut result = Matched::default();
    let mut estimates = seen.iter().peekable();
    let mut newest = i64::MIN;
    for frame in frames {
        result.account.sent += 1;
        if frame.due_ns < from_ns {
            result.account.warm_up += 1;
            continue;
        }
        while estimates
            .next_if(|estimate| estimate.frame_stamp_ns < frame.sent_ns - TOLERANCE_NS)
            .is_some()
        {}
        let Some(first) = estimates.peek() else {
            result.account.never_estimated += 1;
            continue;
        };
        result.from_due_ns.push(first.received_ns - frame.due_ns);
        if first.frame_stamp_ns > newest {
            newest = first.frame_stamp_ns;
            result.from_kernel_ns.push(first.received_ns - newest);
            result.account.newest += 1;
        } else {
            result.account.with_newer += 1;
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;

    fn sent(due_ms: i64) -> Sent {
        Sent {
            due_ns: due_ms * MS,
            sent_ns: due_ms * MS + 5_000,
        }
    }

    fn seen(frame_ms: i64, received_ms: i64) -> Seen {
        Seen {
            frame_stamp_ns: frame_ms * MS + 6_000,
            received_ns: received_ms * MS,
            ..Seen::default()
        }
    }

    #[test]
    fn every_frame_waits_for_the_first_estimate_with_it() {
        let frames = [sent(20), sent(40)];
        let result = matched(
            &frames,
            &[seen(0, 1), seen(20, 21), seen(20, 31), seen(40, 42)],
            0,
        );
        assert_eq!(result.from_due_ns, [MS, 2 * MS]);
        assert_eq!(result.from_kernel_ns, [MS - 6_000, 2 * MS - 6_000]);
    }

    #[test]
    fn a_stall_is_charged_to_every_frame_that_it_delayed() {
        let frames = [sent(20), sent(40), sent(60)];
        let result = matched(&frames, &[seen(60, 100)], 0);
        assert_eq!(result.from_due_ns, [80 * MS, 60 * MS, 40 * MS]);
        assert_eq!(result.from_kernel_ns.len(), 1);
    }

    #[test]
    fn a_frame_that_never_arrives_is_lost_not_forgotten() {
        let result = matched(&[sent(20), sent(40)], &[seen(20, 21)], 0);
        assert_eq!(result.from_due_ns.len(), 1);
        assert_eq!(result.account.never_estimated, 1);
    }

    #[test]
    fn the_account_adds_up() {
        let frames: Vec<Sent> = (1..=10).map(|k| sent(20 * k)).collect();
        let estimates = [seen(40, 41), seen(60, 61), seen(120, 125), seen(140, 141)];
        let account = matched(&frames, &estimates, 60 * MS).account;
        let wanted = Account {
            sent: 10,
            warm_up: 2,
            newest: 3,
            with_newer: 2,
            never_estimated: 3,
        };
        assert_eq!(account, wanted);
    }
}
