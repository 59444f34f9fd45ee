//! What came of a scene.

use std::time::Duration;

use crate::fault::{Fault, Outcome};
use crate::stage::Stage;
use coloc_tests::output::print_line;

#[derive(Debug, Default)]
pub(crate) struct Tally {
    pub(crate) scene: &'static str,
    pub(crate) rounds: u32,
    pub(crate) failures: Vec<String>,
    /// Rounds that were played again because something came too late.
    pub(crate) late: u32,
    /// Why it did not run, or a part of it.
    pub(crate) skipped: Vec<String>,
    /// What was measured, for a person.
    pub(crate) figures: Vec<String>,
    /// From the start of a process until a subscriber had its first estimate.
    pub(crate) restarts: Vec<Duration>,
    /// From SIGTERM to the end of a process.
    pub(crate) ends: Vec<Duration>,
}

impl Tally {
    pub(crate) fn new(scene: &'static str) -> Self {
        Self {
            scene,
            ..Self::default()
        }
    }

    /// It does not run here.
    pub(crate) fn skip(&mut self, why: &str) {
        self.skipped.push(why.into());
    }

    /// A failure is said at once: a campaign takes long.
    pub(crate) fn note(&mut self, stage: &Stage, round: u32, outcome: Outcome) {
        if let Err(fault) = outcome {
            self.fail(stage, round, &fault);
        }
    }

    fn fail(&mut self, stage: &Stage, round: u32, fault: &Fault) {
        let words = format!(
            "FAILED {} round {round}: {fault}\n  again: cargo run -p coloc-tests --bin chaos -- --seed {} --only {} --round {round}",
            self.scene, stage.seed, self.scene
        );
        print_line(&words);
        self.failures.push(words);
    }

    /// What was said by those who did not start because something was missing.
    pub(crate) fn refusals(&mut self, words: &[String]) {
        self.figures.push(format!("refused {} times", words.len()));
        self.figures
            .extend(words.first().map(|words| format!("as in `{words}`")));
    }

    pub(crate) fn line(&self) -> String {
        let mut figures = Vec::new();
        figures.extend(distribution("restart", &self.restarts));
        figures.extend(distribution("SIGTERM", &self.ends));
        figures.extend(self.figures.iter().cloned());
        if self.late > 0 {
            figures.push(format!("{} played again", self.late));
        }
        figures.extend(self.skipped.iter().map(|why| format!("SKIPPED: {why}")));
        figures.join("; ")
    }
}

fn distribution(name: &str, times: &[Duration]) -> Option<String> {
    let mut sorted = times.to_vec();
    sorted.sort_unstable();
    let last = sorted.len().checked_sub(1)?;
    let ms = |share: usize| sorted[last * share / 100].as_millis();
    Some(format!(
        "{name} {} times, p50 {} p99 {} max {} ms",
        sorted.len(),
        ms(50),
        ms(99),
        ms(100)
    ))
}
