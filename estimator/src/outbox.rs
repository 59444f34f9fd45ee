//! Collects, during a tick, what the tick will hand back.

use crate::convert::GlobalPose;
use crate::kind::{Ask, Kind, PartialSighting, Sighting};
use crate::list::FixedList;
use crate::output::{OutgoingAnswer, OutgoingPose, OutgoingSeen, Report, Source, Verdict};
use crate::partial::SplitPosition;
use crate::stamp::Stamp;

/// Poses that one tick can send.
const OUTGOING: usize = 128;
/// The same of what is seen in part: told, and answered.
const IN_PART: usize = 64;
/// Reports that one tick can give.
const REPORTS: usize = 512;

#[derive(Copy, Clone, Debug)]
pub(crate) struct Outbox {
    outgoing: FixedList<OutgoingPose, OUTGOING>,
    seen: FixedList<OutgoingSeen, IN_PART>,
    answers: FixedList<OutgoingAnswer, IN_PART>,
    /// The latest stamp of which something was told.
    told: Option<Stamp>,
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
            seen: FixedList::new(OutgoingSeen::default()),
            answers: FixedList::new(OutgoingAnswer::default()),
            told: None,
            reports: FixedList::new(filler),
            overflowed: 0,
            folded_early: 0,
        }
    }

    pub(crate) fn clear(&mut self) {
        self.outgoing.clear();
        self.seen.clear();
        self.answers.clear();
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
        self.has_told(sighting.stamp);
    }

    /// What is told the robot of a sighting that says a part only.
    pub(crate) fn tell(&mut self, sighting: &PartialSighting, place: Option<SplitPosition>) {
        let fitted = self.seen.push(OutgoingSeen {
            stamp: sighting.stamp,
            sighting: sighting.id(),
            place,
        });
        self.overflowed += u32::from(!fitted);
        if place.is_some() {
            self.has_told(sighting.stamp);
        }
    }

    pub(crate) fn answer(&mut self, ask: &Ask, place: SplitPosition) {
        let fitted = self.answers.push(OutgoingAnswer {
            stamp: ask.stamp,
            sighting: ask.sighting,
            place,
        });
        self.overflowed += u32::from(!fitted);
        self.has_told(ask.stamp);
    }

    fn has_told(&mut self, stamp: Stamp) {
        self.told = self.told.max(Some(stamp));
    }

    /// Whether something of a later stamp was told: then what is independent of the belief at `stamp` was told with it.
    pub(crate) fn has_told_after(&self, stamp: Stamp) -> bool {
        self.told > Some(stamp)
    }

    pub(crate) fn count_overflow(&mut self) {
        self.overflowed += 1;
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

    pub(crate) fn seen(&self) -> &[OutgoingSeen] {
        self.seen.as_slice()
    }

    pub(crate) fn answers(&self) -> &[OutgoingAnswer] {
        self.answers.as_slice()
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
