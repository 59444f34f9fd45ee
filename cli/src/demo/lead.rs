//! Leaders and children: who leads, who sees whom, and what happens to the first leader.

use std::ops::Range;

use coloc_daemon::config::{Assist, AssistMode};

use super::DemoError;
use super::bars::{Bar, Expectation};
use super::robot_file::name;
use super::scene::{Help, Part};
use super::summary::RobotSummary;
use crate::args::DemoArgs;

/// Of the time in which children are told something. It came to 86 to 97 %.
const TOLD: f64 = 0.2;
/// One event in so long \[s\]; robots see one another as often.
const PERIOD_S: f64 = 0.2;
/// So often they see one another \[Hz\].
pub(super) const SIGHTINGS_HZ: f64 = 5.0;
/// Noise of a leader's compass \[rad\].
pub(super) const COMPASS_SIGMA_RAD: f64 = 0.02;
/// The first leader is gone for this part of the time.
const GONE: Range<f64> = 1.0 / 3.0..0.5;
/// It takes one that is seen by a leader and one that is not.
const FEWEST_CHILDREN: usize = 2;

/// A team of leaders, who are the first robots, and children.
#[derive(Clone, Debug)]
pub(crate) struct Lead {
    leaders: usize,
    robots: usize,
    mode: AssistMode,
    /// When the first leader is killed and when it is started again \[s\].
    pub(super) gone_s: Range<f64>,
}

impl Lead {
    /// As `args` ask for; `None` where nobody leads.
    pub(super) fn new(args: &DemoArgs, robots: usize) -> Result<Option<Self>, DemoError> {
        let Some(leaders) = args.leaders.map(usize::from) else {
            return Ok(None);
        };
        if robots < leaders + FEWEST_CHILDREN {
            let reason = format!(
                "with --leaders {leaders} it takes {} robots or more",
                leaders + FEWEST_CHILDREN
            );
            return Err(DemoError::World(reason));
        }
        let length_s = args.length_s();
        Ok(Some(Self {
            leaders,
            robots,
            mode: args.mode,
            gone_s: GONE.start * length_s..GONE.end * length_s,
        }))
    }

    /// Who leads.
    pub(super) fn leaders(&self) -> Range<usize> {
        0..self.leaders
    }

    /// Whether the one looks at the other, where nothing else decides it: the last child never meets a leader's eye, and leaders do
    /// not look at one another. Children do not look at leaders: nothing would come of it.
    pub(super) fn looks_at(&self, observer: usize, observed: usize) -> bool {
        let is_child = |robot| robot >= self.leaders;
        is_child(observed) && (is_child(observer) || observed + 1 < self.robots)
    }

    pub(super) fn part(&self, robot: usize) -> Part {
        let (help, whose) = if robot < self.leaders {
            (Help::Leader, "leaders")
        } else {
            (Help::Child, "children")
        };
        Part {
            help,
            expected: Some(Expectation {
                whose,
                error: None,
                inside: 0.99,
                told: TOLD,
            }),
            tale: None,
        }
    }

    pub(super) fn parts(&self) -> Vec<Part> {
        (0..self.robots).map(|robot| self.part(robot)).collect()
    }

    /// `[assist]` of every robot.
    pub(super) fn section(&self) -> Result<Assist, String> {
        let numbers = |robots: Range<usize>| {
            let id = |robot: usize| u16::try_from(robot + 1).map_err(|error| error.to_string());
            robots.map(id).collect::<Result<Vec<_>, _>>()
        };
        Ok(Assist {
            leaders: numbers(self.leaders())?,
            children: numbers(self.leaders..self.robots)?,
            period_s: PERIOD_S,
            mode: self.mode,
            ..Assist::default()
        })
    }

    /// What it is about.
    pub(super) fn story(&self) -> String {
        let leaders: Vec<_> = self.leaders().map(|robot| name(robot + 1)).collect();
        let Range { start, end } = self.gone_s;
        format!(
            "Leaders, who find themselves first: {}. {} is never seen by one. {} is killed at {start:.1} s and started again at {end:.1} s.",
            leaders.join(", "),
            name(self.robots),
            name(1)
        )
    }

    /// What is promised of the first leader.
    pub(super) fn bar(&self, robots: &[RobotSummary]) -> Bar {
        let Range { start, end } = self.gone_s;
        let first = robots.first();
        let starts = first.map_or(0, |it| it.starts);
        let wrong = (starts < 2).then(|| format!("{}: started {starts} times", name(1)));
        Bar {
            promise: format!(
                "killed at {start:.1} s, started again at {end:.1} s: {}",
                name(1)
            ),
            seen: String::new(),
            broken_by: wrong.into_iter().collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_child_is_out_of_every_leaders_sight_and_others_are_not() {
        let lead = Lead {
            leaders: 2,
            robots: 5,
            mode: AssistMode::Full,
            gone_s: 1.0..2.0,
        };
        let seen_by =
            |robot| -> Vec<usize> { (0..5).filter(|by| lead.looks_at(*by, robot)).collect() };
        assert_eq!(seen_by(2), [0, 1, 2, 3, 4]);
        assert_eq!(seen_by(4), [2, 3, 4]);
        assert!(seen_by(0).is_empty());
        let section = lead.section().unwrap();
        assert_eq!(
            (section.leaders, section.children),
            (vec![1, 2], vec![3, 4, 5])
        );
    }
}
