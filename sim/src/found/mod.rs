//! Robots that do not know where they are, that are carried, that hear nothing for long, that are lied to, by the thousand.
//!
//! Each is a [`coloc_estimator::Estimator`] at 50 Hz in a world whose truth is known. The odometry noise is in the truth: what the
//! wheels measure is exactly what was commanded. An [`Experiment`] is data, a row of a table; [`PARTS`] are lists of them.
//!
//! *Wrong* is `ok` with a NEES of the pose above 30.66 (χ² with three degrees of freedom, 1e-6). *Found* is `ok` and not wrong; who
//! leaves `ok` within 20 s of the event was not found before, but had not noticed. The NEES is taken 0, 1, 2, 5, 10, 20, 30 and
//! 60 s after a robot was found, while it is `ok`.

mod aloud;
mod bar;
mod exact;
mod experiment;
mod outages;
mod outcome;
mod report;
mod robot;
mod rows;
mod world;

pub use bar::{Bar, Honesty};
pub use coloc_estimator::TrustJump;
pub use experiment::{Drive, Event, Experiment, Lie, Sensor, Speaks, Start, Tail, Wheels};
pub use outcome::Outcome;
pub use report::Found;

/// How much of it is done.
#[derive(Clone, Debug, PartialEq)]
pub struct Form {
    /// Where all chance comes from.
    pub seed: u64,
    /// What part of the campaign's robots.
    pub share: f64,
    /// Of a row never fewer, and never more.
    pub at_least: usize,
    /// See `at_least`.
    pub at_most: usize,
    /// Ticks of 20 ms to a step.
    pub stride: u32,
    /// Shares may be missed by so many σ of chance.
    pub chance: f64,
    /// Rows whose names contain this alone.
    pub row: Option<String>,
    /// That robot alone, and what is decided is told.
    pub robot: Option<usize>,
}

impl Form {
    /// The whole campaign.
    #[must_use]
    pub fn long(seed: u64) -> Self {
        Self {
            seed,
            share: 1.0,
            at_least: 1,
            at_most: usize::MAX,
            stride: 1,
            chance: 0.0,
            row: None,
            robot: None,
        }
    }

    /// What a minute of one processor is enough for: fewer robots, at 10 Hz.
    #[must_use]
    pub fn short(seed: u64) -> Self {
        Self {
            share: 0.03,
            at_least: 60,
            stride: robot::COARSE,
            chance: 3.0,
            ..Self::long(seed)
        }
    }

    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_precision_loss,
        clippy::cast_sign_loss
    )] // Some thousand robots.
    fn robots(&self, of: usize) -> usize {
        let share = (self.share * of as f64).round() as usize;
        share.clamp(self.at_least.min(of), of).min(self.at_most)
    }

    fn wants(&self, name: &str) -> bool {
        self.row.as_ref().is_none_or(|row| name.contains(row))
    }
}

/// Rows that belong together.
#[derive(Copy, Clone, Debug)]
pub struct Part {
    /// On the command line.
    pub name: &'static str,
    /// For people.
    pub title: &'static str,
    rows: fn(&Form) -> Vec<report::Row>,
    /// What must come of all rows together.
    pooled: &'static [Bar],
}

/// All of them.
pub const PARTS: [Part; 7] = [
    Part {
        name: "start",
        title: "Unknown starts",
        rows: |form| run(&rows::starts(), form),
        pooled: &[Bar::NeesAtMost],
    },
    Part {
        name: "carried",
        title: "Kidnapped while driving, and carried while standing",
        rows: |form| run(&rows::carried(), form),
        pooled: &[Bar::Nees],
    },
    Part {
        name: "outage",
        title: "Outages, then fixes of 0.05 and 1 m at 1 and 5 Hz",
        rows: outages::rows,
        pooled: &[Bar::RightAt20, Bar::Nees],
    },
    Part {
        name: "liar",
        title: "One liar among two that are honest",
        rows: |form| run(&rows::liars(), form),
        pooled: &[Bar::NeesAtMost],
    },
    Part {
        name: "alone",
        title: "A lone receiver that lies, and silence",
        rows: |form| run(&rows::alone(), form),
        pooled: &[],
    },
    Part {
        name: "honest",
        title: "All are honest",
        rows: |form| run(&rows::honest(), form),
        pooled: &[Bar::NeesAtMost],
    },
    Part {
        name: "exact",
        title: "What can be known: a filter that is as good as exact",
        rows: exact::rows,
        pooled: &[],
    },
];

impl Part {
    /// Runs it and holds it to its bars.
    #[must_use]
    pub fn run(&self, form: &Form) -> Found {
        report::report(self.title, &(self.rows)(form), self.pooled, form.chance)
    }
}

fn run(experiments: &[Experiment], form: &Form) -> Vec<report::Row> {
    let wanted = experiments.iter().filter(|it| form.wants(&it.name));
    wanted.map(|it| report::row(it, form)).collect()
}
