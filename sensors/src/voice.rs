//! What a program says of itself: its status once a second, and its log.

use std::time::Instant;

use coloc_shm_types::{Claim, Health, RobotName, Space};

use crate::end::EndError;
use crate::run::Report;
use crate::status::{Line, Reporter};
use crate::teller::Teller;

/// A program's own voice.
#[derive(Debug)]
pub struct Voice<'a> {
    space: &'a Space,
    reporter: Reporter,
    teller: Teller,
    health: Option<Health>,
    /// Of what its status tells the health.
    heard: &'static str,
    /// Nobody else speaks so.
    _claim: Claim,
    /// What is known of its input.
    pub line: Line,
}

/// As whom a program speaks.
#[derive(Copy, Clone, Debug)]
pub struct As {
    /// The program, for people.
    pub program: &'static str,
    /// The driver in its status.
    pub driver: &'static str,
    /// The number of its sensor.
    pub source: u16,
    /// What its health is of, for people: `the scanner`.
    pub heard: &'static str,
}

impl<'a> Voice<'a> {
    /// Speaks for `robot`, as nobody else may then.
    ///
    /// # Errors
    /// If another process does, or the channel cannot be opened.
    pub fn open(space: &'a Space, robot: &RobotName, who: As) -> Result<Self, EndError> {
        let claim = space.claim_driver(robot, who.driver, who.source)?;
        Ok(Self {
            space,
            reporter: Reporter::open(space, robot, who.driver, who.source)?,
            teller: Teller::new(who.program),
            health: None,
            heard: who.heard,
            _claim: claim,
            line: Line::default(),
        })
    }

    /// Something for the log.
    pub fn remark(&mut self, text: impl Into<String>) {
        self.teller.remark(text);
    }

    /// Says how it is doing, if that is due.
    ///
    /// # Errors
    /// If the shared memory is not there any more.
    pub fn say(&mut self, report: &Report, remarks: Vec<String>) -> Result<(), EndError> {
        for remark in remarks {
            self.teller.remark(remark);
        }
        if let Some(health) = self.reporter.report(self.line, report) {
            if self.health.replace(health) != Some(health) {
                self.teller.remark(format!("{} is {health}", self.heard));
            }
            self.space.check()?;
        }
        self.teller.tell(Instant::now());
        Ok(())
    }

    /// Says what is left.
    pub fn finish(&mut self) {
        self.teller.finish();
    }
}
