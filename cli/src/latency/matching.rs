//! Which estimate was the first to contain which frame.

use serde::{Deserialize, Serialize};

/// A pair of encoder frames, as the sender knows it \[ns of `CLOCK_MONOTONIC`\].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Sent {
    /// When the schedule wanted it to leave.
    pub(crate) due_ns: i64,
    /// Just before its second frame went to the kernel.
    pub(crate) sent_ns: i64,
}

/// An estimate, as the reader saw it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[allow(clippy::struct_field_names)] // The unit belongs to the name.
pub(crate) struct Seen {
    /// When the reader had it \[ns of `CLOCK_MONOTONIC`\].
    pub(crate) received_ns: i64,
    /// The tick's wake-up.
    pub(crate) stamp_ns: i64,
    /// Kernel's stamp of the newest frame in it.
    pub(crate) frame_stamp_ns: i64,
    /// Those of the message.
    pub(crate) latency_ns: u64,
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
    /// Frames that no estimate ever contained.
    pub(crate) lost: u64,
}

/// Accounts for every one of `frames`; both lists are in the order of time.
pub(crate) fn matched(frames: &[Sent], seen: &[Seen]) -> Matched {
    let mut result = Matched::default();
    let mut estimates = seen.iter().peekable();
    let mut newest = i64::MIN;
    for frame in frames {
        while estimates
            .next_if(|estimate| estimate.frame_stamp_ns < frame.sent_ns - TOLERANCE_NS)
            .is_some()
        {}
        let Some(first) = estimates.peek() else {
            result.lost += 1;
            continue;
        };
        result.from_due_ns.push(first.received_ns - frame.due_ns);
        if first.frame_stamp_ns > newest {
            newest = first.frame_stamp_ns;
            result.from_kernel_ns.push(first.received_ns - newest);
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
        );
        assert_eq!(result.from_due_ns, [MS, 2 * MS]);
        assert_eq!(result.from_kernel_ns, [MS - 6_000, 2 * MS - 6_000]);
    }

    #[test]
    fn a_stall_is_charged_to_every_frame_that_it_delayed() {
        let frames = [sent(20), sent(40), sent(60)];
        let result = matched(&frames, &[seen(60, 100)]);
        assert_eq!(result.from_due_ns, [80 * MS, 60 * MS, 40 * MS]);
        assert_eq!(result.from_kernel_ns.len(), 1);
    }

    #[test]
    fn a_frame_that_never_arrives_is_lost_not_forgotten() {
        let result = matched(&[sent(20), sent(40)], &[seen(20, 21)]);
        assert_eq!((result.from_due_ns.len(), result.lost), (1, 1));
    }
}
