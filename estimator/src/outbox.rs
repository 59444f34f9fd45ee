//! Collects, during a tick, what the tick will hand back.

use crate::convert::GlobalPose;
use crate::kind::{Kind, Sighting};
use crate::list::FixedList;
use crate::output::{OutgoingPose, Report, Source, Verdict};
use crate::stamp::Stamp;

/// Poses that one tick can send.
const OUTGOING: usize = 128;
/// Reports that one tick can give.
const REPORTS: usize = 384;

#[derive(Copy, Clone, Debug)]
pub(crate) struct Outbox {
    outgoing: FixedList<OutgoingPose, OUTGOING>,
    reports: FixedList<Report, REPORTS>,
    overflowed: u32,
    folded_early: u32,
}

impl Outbox {
    pub(crate) fn new() -> Self {
        let filler = Report {
            source: Source::new(Kind::Odometry, 0),
            stamp: Stamp::default(),
            verdict: Verdict::TooOld,
        };
        Self {
            outgoing: FixedList::new(OutgoingPose::default()),
            reports: FixedList::new(filler),
            overflowed: 0,
            folded_early: 0,
        }
    }

    pub(crate) fn clear(&mut self) {
        self.outgoing.clear();
        self.reports.clear();
        self.overflowed = 0;
        self.folded_early = 0;
    }

    pub(crate) fn send(&mut self, sighting: &Sighting, seen: &GlobalPose) {
        let fitted = self.outgoing.push(OutgoingPose {
            to: sighting.observed,
            by: sighting.origin.source,
            stamp: sighting.stamp,
            pose: seen.pose,
            parts: seen.parts,
        });
        self.overflowed += u32::from(!fitted);
    }

    pub(crate) fn report(&mut self, source: Source, stamp: Stamp, verdict: Verdict) {
        let fitted = self.reports.push(Report {
            source,
            stamp,
            verdict,
        });
        self.overflowed += u32::from(!fitted);
    }

    pub(crate) fn count_folded_early(&mut self) {
        self.folded_early += 1;
    }

    pub(crate) fn outgoing(&self) -> &[OutgoingPose] {
        self.outgoing.as_slice()
    }

    pub(crate) fn reports(&self) -> &[Report] {
        self.reports.as_slice()
    }

    pub(crate) fn overflowed(&self) -> u32 {
        self.overflowed
    }

    pub(crate) fn folded_early(&self) -> u32 {
        self.folded_early
    }
}
