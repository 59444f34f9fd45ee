//! How far it is, and how long it will take, on standard error if that is a terminal.

use coloc_sim::evaluate::Progress;
use indicatif::{ProgressBar, ProgressStyle};

/// The bar of one evaluation.
pub(crate) struct Bar(ProgressBar);

impl Bar {
    pub(crate) fn new(what: &str) -> Self {
        let bar = ProgressBar::new(0).with_message(what.to_owned());
        // The template is a constant; a wrong one would leave the usual bar.
        if let Ok(style) =
            ProgressStyle::with_template("{msg} {wide_bar} {percent:>3} %, {eta} left")
        {
            bar.set_style(style);
        }
        Self(bar)
    }

    pub(crate) fn show(&self, progress: Progress) {
        self.0.set_length(progress.total);
        self.0.set_position(progress.done);
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
