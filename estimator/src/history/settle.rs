//! What leaves the history is judged ([`crate::found`]), and the base is what comes of it.

use super::History;
use super::entry::Checkpoint;
use super::storage::{Samples, Slots};
use crate::assist::ties::Tied;
use crate::belief::Belief;
use crate::found::{Found, Looking, Ruling, Word};
use crate::kind::{HeadingFix, Measured, Measurement, PoseSaid};
use crate::outbox::Outbox;
use crate::rounds::Lates;
use crate::settings::Settings;
use crate::stamp::Stamp;
use crate::terms::Terms;

/// Who judges, by which rules, and who writes it down.
pub(crate) struct Court<'a> {
    pub(crate) found: &'a mut Found,
    pub(crate) settings: &'a Settings,
    pub(crate) outbox: &'a mut Outbox,
    pub(crate) ties: Tied<'a>,
    pub(crate) lates: &'a Lates,
}

impl<S: Slots, G: Samples> History<S, G> {
    /// The oldest entry leaves, and is judged. Where that changes the base, or who is trusted, all that is left is out of date.
    pub(super) fn settle_oldest(&mut self, court: &mut Court<'_>) {
        if self.evaluated == 0 {
            let (suspended, tells) = (court.found.suspended(), court.found.is_ok());
            let terms = Terms::new(court.settings, suspended, tells, court.lates);
            self.apply_oldest(&terms, court.outbox, &mut court.ties);
        }
        let Some(entry) = self.entries.get(0) else {
            return;
        };
        let measurement = &entry.measurement;
        if let Measurement::Pose(said) = measurement
            && said.set
        {
            let said = *said;
            self.set_pose(&said, court);
            return;
        }
        let is_judged = court.settings.found.enabled;
        let says_nothing = measurement.as_odometry().is_some() && !court.found.is_driven();
        if !is_judged || says_nothing {
            self.fold_oldest(&mut court.ties);
            return;
        }
        let word = Word::of(entry.stamp(), measurement, entry.gauge);
        match word.and_then(|word| court.found.hear_plain(&word)) {
            Some(()) => self.fold_oldest(&mut court.ties),
            None => self.judge_oldest(court),
        }
    }

    /// It moves what there is besides the belief, or is judged by it.
    #[inline(never)]
    fn judge_oldest(&mut self, court: &mut Court<'_>) {
        let Some(entry) = self.entries.get(0) else {
            return;
        };
        let stamp = entry.stamp();
        let word = Word::of(stamp, &entry.measurement, entry.gauge);
        self.drive_hypotheses(stamp, court);
        match word {
            Some(word) => self.judge(&word, court),
            None => self.turn_or_fold_oldest(court),
        }
    }

    pub(super) fn drive_hypotheses(&self, to: Stamp, court: &mut Court<'_>) {
        if court.found.is_driven() {
            self.each_leg(self.base.stamp, to, court.settings, |motion, dt_s| {
                court.found.drive(motion, dt_s);
            });
        }
    }

    fn judge(&mut self, word: &Word, court: &mut Court<'_>) {
        let mut prior = self.base;
        self.predict(&mut prior, word.stamp, court.settings);
        self.fold_oldest(&mut court.ties);
        let prior = prior.filter.belief();
        let (ruling, suspicions_changed) = court.found.hear(word, prior, court.settings);
        self.rule(&ruling, court);
        if suspicions_changed || ruling != Ruling::Stands {
            self.mark_from(0);
        }
    }

    /// A heading turns whoever does not know where the robot looks.
    fn turn_or_fold_oldest(&mut self, court: &mut Court<'_>) {
        let heading = self.oldest_heading().copied();
        let Some(fix) = heading.filter(|_| court.found.is_driven()) else {
            self.fold_oldest(&mut court.ties);
            return;
        };
        let mut prior = self.base;
        self.predict(&mut prior, fix.stamp, court.settings);
        self.fold_oldest(&mut court.ties);
        let Some(heading) = prior.filter.looking(&fix) else {
            return;
        };
        let said = Looking {
            stamp: fix.stamp,
            heading,
            variance: fix.variance,
            slow: fix.slow,
        };
        let ruling = court.found.turn(&said, fix.source(), prior.filter.belief());
        self.rule(&ruling, court);
        if ruling != Ruling::Stands {
            self.mark_from(0);
        }
    }

    fn oldest_heading(&self) -> Option<&HeadingFix> {
        match &self.entries.get(0)?.measurement {
            Measurement::Heading(heading) => Some(heading),
            _ => None,
        }
    }

    /// It is believed, whether the belief may be doubted or not.
    fn set_pose(&mut self, said: &PoseSaid, court: &mut Court<'_>) {
        let mut prior = self.base;
        self.predict(&mut prior, said.stamp, court.settings);
        self.fold_oldest(&mut court.ties);
        let ruling = court.found.set(said, prior.filter.belief());
        self.rule(&ruling, court);
        self.mark_from(0);
    }

    fn rule(&mut self, ruling: &Ruling, court: &mut Court<'_>) {
        self.base.rule(ruling);
        if *ruling != Ruling::Stands {
            court.ties.lose_track();
        }
    }

    /// The belief where the history begins.
    pub(crate) fn base_belief(&self) -> &Belief {
        self.base.filter.belief()
    }
}

impl Checkpoint {
    /// What a ruling makes of it.
    fn rule(&mut self, ruling: &Ruling) {
        match ruling {
            Ruling::Stands => {}
            Ruling::Dropped => self.filter.lose(),
            Ruling::Replaced(belief) => self.filter.find(belief),
        }
    }
}
