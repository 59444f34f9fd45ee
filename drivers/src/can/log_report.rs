//! What was found in a log beside the frames that are wanted.

use std::fmt;

use super::candump_line::LineFault;
use super::timeline::Jump;

/// What a reader of a log has to say about it: counted while reading, so it is complete before the first frame is played.
///
/// Its `Display` is the sentence for whoever started to play the log.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LogReport {
    /// Frames that will be played.
    pub frames: u64,
    /// Lines that are whole and something else: comments, and frames of CAN XL.
    pub foreign: u64,
    /// Lines that are cut or garbled.
    pub damaged: u64,
    /// The first of those, counted from 1, and what is wrong with it.
    pub first_damaged: Option<(usize, LineFault)>,
    /// The compressed data end in the middle, or are garbled from somewhere on: what came before is played.
    pub cut: bool,
    /// Times that the stamps jump back, or ahead by more than ten seconds. Playing goes on as if they had not.
    pub jumps: u64,
    /// The first of those: its line, counted from 1, and how far \[ns\].
    pub first_jump: Option<(usize, i64)>,
}

impl LogReport {
    /// Whether there is nothing to say: every line was a frame or a comment, in the order of one clock.
    #[must_use]
    pub fn is_clean(&self) -> bool {
        self.damaged == 0 && self.jumps == 0 && !self.cut
    }

    pub(super) fn note_damage(&mut self, line: usize, fault: LineFault) {
        self.damaged += 1;
        self.first_damaged.get_or_insert((line, fault));
    }

    pub(super) fn note_jump(&mut self, line: usize, Jump(step_ns): Jump) {
        self.jumps += 1;
        self.first_jump.get_or_insert((line, step_ns));
    }
}

impl fmt::Display for LogReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} frames", self.frames)?;
        if self.foreign > 0 {
            write!(f, "; other lines skipped: {}", self.foreign)?;
        }
        if let Some((line, fault)) = &self.first_damaged {
            let lines = self.damaged;
            write!(
                f,
                "; damaged lines skipped: {lines}, the first is line {line}: {fault}"
            )?;
        }
        if self.cut {
            write!(f, "; the compressed data end too early")?;
        }
        self.jumps(f)
    }
}

impl LogReport {
    #[expect(clippy::cast_precision_loss, reason = "shown to the millisecond")]
    fn jumps(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some((line, step_ns)) = self.first_jump else {
            return Ok(());
        };
        let (times, step_s) = (self.jumps, step_ns as f64 * 1e-9);
        write!(
            f,
            "; jumps of the stamps: {times}, the first at line {line} by {step_s:+.3} s; played as if there were none"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sentence_names_line_and_value() {
        let mut report = LogReport {
            frames: 100,
            ..LogReport::default()
        };
        assert_eq!(
            (report.is_clean(), report.to_string()),
            (true, "100 frames".into())
        );
        report.note_damage(101, LineFault::Short);
        report.note_damage(103, LineFault::Text);
        report.note_jump(51, Jump(-3_600_000_000_000));
        report.cut = true;
        assert_eq!(
            (report.is_clean(), report.to_string()),
            (
                false,
                "100 frames; damaged lines skipped: 2, the first is line 101: it ends too early; \
                 the compressed data end too early; jumps of the stamps: 1, the first at line 51 by -3600.000 s; \
                 played as if there were none"
                    .into()
            )
        );
    }
}
