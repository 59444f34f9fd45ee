//! What a link does once a second, and what it says of itself then and at its end.
use std::time::Instant;

use coloc_sensors::EndError;
use coloc_sensors::status::Line as InputLine;
use coloc_shm_types::Space;

use super::office::Office;
use crate::engine::Vitals;

impl Office {
    /// The last words: a line for each member, for whoever reads the log.
    pub(super) fn finish(&mut self) {
        self.teller.finish();
        self.teller
            .remark(self.counts.words(self.admission.counts()));
        self.teller.finish();
        for (name, words) in &self.last {
            self.teller.remark(format!("{name}: {words}"));
            self.teller.finish();
        }
    }

    /// What is known of each member that is connected.
    fn note_members(&mut self) {
        for (id, member) in &self.members {
            let vitals = member.line.vitals();
            let offset = self
                .admission
                .peer(*id)
                .and_then(crate::admission::Peer::offset);
            let offset = offset.map_or_else(
                || "unknown".into(),
                |it| format!("{:+.3} ± {:.3} ms", 1e3 * it.offset_s, 1e3 * it.within_s),
            );
            let words = format!(
                "round trip {:.1} ms, lost {:.1} % of {}, clock {offset}",
                1e3 * vitals.round_trip_s,
                vitals.lost_percent(),
                vitals.sent
            );
            self.last.insert(member.name.to_string(), words);
        }
    }

    /// What is done once a second.
    pub(super) fn second(&mut self) -> Result<(), EndError> {
        self.look_at_the_file();
        self.dismiss();
        self.give_up_idle();
        self.note_members();
        let running = Space::running(&self.root).unwrap_or_default();
        self.local = running.into_iter().map(|it| it.robot.to_string()).collect();
        self.space.tidy();
        let line = InputLine {
            is_open: !self.members.is_empty(),
            opened: self.opened,
            bytes: self.vitals().heard_bytes,
        };
        let mut report = self.counts.report();
        report.figures = self.figures();
        if self.reporter.report(line, &report).is_some() {
            self.space.check()?;
        }
        self.teller.tell(Instant::now());
        Ok(())
    }

    /// Of all connections there ever were.
    fn vitals(&self) -> Vitals {
        let mut all = self.past;
        for member in self.members.values() {
            all.add(&member.line.vitals());
        }
        all
    }

    #[expect(clippy::cast_precision_loss, reason = "counts, for people")]
    fn figures(&self) -> [f64; 8] {
        let (all, knocks) = (self.vitals(), self.door.knocks());
        let offsets = self.admission.offsets();
        let worst_s = offsets
            .iter()
            .map(|(_, it)| it.offset_s.abs())
            .fold(f64::NAN, f64::max);
        let members = self.book.roster().member.len().saturating_sub(1);
        [
            members as f64,
            self.members.len() as f64,
            all.sent_bytes as f64,
            all.heard_bytes as f64,
            (knocks.strangers + knocks.silent) as f64,
            knocks.unheard as f64,
            all.round_trip_s,
            worst_s,
        ]
    }
}
