//! Patterns of marks.

use super::Finder;
use super::candidate::{Candidate, modes};
use super::settings::Settings;
use crate::fit::most_chi2;
use crate::marks;
use crate::shape::Pattern;

impl Finder {
    pub(super) fn look_for_marks(&mut self, look: usize, pattern: &Pattern) {
        let Settings { bright, noise, .. } = self.settings;
        let reach = self.settings.looks[look].reach_m();
        let mut marks = std::mem::take(&mut self.marks);
        let left_out = marks::find(
            &self.beams,
            bright,
            pattern.radius_m(),
            &noise,
            &mut marks,
            |point| self.are_places(look, |it| it.may_be_within(point, reach)),
        );
        self.counts.left_out += left_out;
        while let Some(marks::Found {
            fit,
            middle,
            beams,
            of,
        }) = marks::fit(&marks, pattern, &noise)
        {
            let is_good = fit.chi2 <= most_chi2(fit.freedom) && self.is_sharp(&fit);
            if is_good {
                self.keep(&Candidate {
                    look,
                    modes: modes(fit, self.beams.time_s(middle)),
                    beams,
                    score: 1000.0 - fit.chi2,
                    clutter: 0.1,
                });
            }
            let mut place = 0;
            marks.retain(|_| {
                place += 1;
                !of.contains(&Some(place - 1))
            });
        }
        self.marks = marks;
    }
}
