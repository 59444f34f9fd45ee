//! What is held to bars.

use std::fmt::Write as _;

use crate::campaign::Finding;
use crate::mrclam::GridWorld;

use super::{Form, worlds};

/// What a part found so far.
#[derive(Debug, Default)]
pub(super) struct Bars {
    pub(super) text: String,
    pub(super) missed: Vec<String>,
}

impl Bars {
    /// A bar and what was measured. What is missed is told by the campaign.
    pub(super) fn hold(&mut self, is_held: bool, what: &str) {
        if is_held {
            let _ = writeln!(self.text, "* PASS: {what}"); // A string takes all.
        } else {
            self.missed.push(what.into());
        }
    }

    pub(super) fn append(&mut self, other: Self) {
        self.text.push_str(&other.text);
        self.missed.extend(other.missed);
    }

    pub(super) fn table(&mut self, table: &str) {
        let _ = writeln!(self.text, "{table}");
    }
}

/// What `find` finds in the recordings, if they are there.
pub(super) fn found(
    title: &str,
    form: &Form,
    find: impl FnOnce(&[(u32, GridWorld)], &mut Bars),
) -> Finding {
    let title = title.into();
    match worlds(form) {
        Ok(worlds) => {
            let mut bars = Bars::default();
            find(&worlds, &mut bars);
            let Bars { text, missed } = bars;
            Finding {
                title,
                text,
                missed,
            }
        }
        Err(why) => Finding {
            title,
            text: format!("SKIPPED: {why}\n"),
            missed: Vec::new(),
        },
    }
}

/// 95 % of a share, by Wilson.
#[allow(clippy::cast_precision_loss)] // Far below 2^53.
pub(super) fn wilson(hits: usize, of: usize) -> [f64; 2] {
    const Z: f64 = 1.959_963_984_540_054;
    let n = of.max(1) as f64;
    let share = hits as f64 / n;
    let middle = share + Z * Z / (2.0 * n);
    let off = Z * (share * (1.0 - share) / n + Z * Z / (4.0 * n * n)).sqrt();
    [middle - off, middle + off].map(|it| it / (1.0 + Z * Z / n))
}

/// The value that so much of `values` is below; not a number if there is none.
#[allow(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss
)] // Counts.
pub(super) fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let place = (share * values.len() as f64) as usize;
    let last = values.len().saturating_sub(1);
    values.get(place.min(last)).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wilsons_interval_is_the_published_one() {
        let [low, high] = wilson(9, 10);
        assert!((low - 0.5958).abs() < 1e-3 && (high - 0.9821).abs() < 1e-3);
        assert!(wilson(200, 200)[0] > 0.98);
        assert!(wilson(0, 0)[0].abs() < 1e-12);
    }

    #[test]
    fn what_is_held_is_told_and_what_is_missed_kept() {
        let mut bars = Bars::default();
        bars.hold(true, "one");
        bars.hold(false, "two");
        assert_eq!(bars.text, "* PASS: one\n");
        assert_eq!(bars.missed, ["two"]);
    }

    #[test]
    fn without_recordings_a_part_says_so() {
        let form = Form::short(1, None);
        let finding = found("title", &form, |_, _| unreachable!());
        assert!(finding.text.starts_with("SKIPPED: ") && finding.missed.is_empty());
    }
}
