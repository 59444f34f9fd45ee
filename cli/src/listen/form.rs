//! How estimates are printed, and which of them.

use coloc_shm_types::{Estimate, Opinion, RobotName};

use super::args::ListenArgs;
use super::reading::{doubted, why_unfit};
use super::{csv, json, table, tum};

/// For people, five lines in a second.
const TABLE_EVERY_S: f64 = 0.2;

#[derive(Copy, Clone, Debug, PartialEq, Eq)]
enum Kind {
    Table,
    Json,
    Csv,
    Tum,
}

/// What was asked for, and how far it is.
#[derive(Debug)]
pub(super) struct Form {
    kind: Kind,
    robot: RobotName,
    every_ns: i64,
    /// Session and interval of the last one that was printed.
    last: Option<(u64, i64)>,
    count: Option<u64>,
    printed: u64,
    /// Why the robot is not fit, as it was last remarked.
    unfit: u8,
    /// What a second opinion was, as it was last remarked.
    opinion: Opinion,
}

impl Form {
    pub(super) fn new(args: &ListenArgs) -> Self {
        let kind = match args {
            ListenArgs { json: true, .. } => Kind::Json,
            ListenArgs { csv: true, .. } => Kind::Csv,
            ListenArgs { tum: true, .. } => Kind::Tum,
            _ => Kind::Table,
        };
        let usual = if kind == Kind::Table {
            TABLE_EVERY_S
        } else {
            0.0
        };
        Self {
            kind,
            robot: args.robot.clone(),
            every_ns: nanoseconds(args.every.unwrap_or(usual)),
            last: None,
            count: args.count,
            printed: 0,
            unfit: 0,
            opinion: Opinion::None,
        }
    }

    /// Before the first estimate.
    pub(super) fn beginning(&self) -> Option<&'static str> {
        (self.kind == Kind::Csv).then_some(csv::HEADING)
    }

    pub(super) fn is_enough(&self) -> bool {
        self.count.is_some_and(|count| self.printed >= count)
    }

    /// What is to be printed of it, if it is its turn.
    pub(super) fn text(&mut self, estimate: &Estimate, now_ns: i64) -> Option<String> {
        if self.is_enough() || !self.is_due(estimate) {
            return None;
        }
        let text = match self.kind {
            Kind::Table => table::heading(self.printed).to_owned() + &table::line(estimate, now_ns),
            Kind::Json => json::line(&self.robot, estimate),
            Kind::Csv => csv::line(estimate),
            Kind::Tum => tum::line(estimate),
        };
        self.printed += 1;
        Some(text)
    }

    /// What people should know of the estimate that they were shown, once: programs read it in every line.
    pub(super) fn remark(&mut self, estimate: &Estimate) -> Option<String> {
        if self.kind != Kind::Table {
            return None;
        }
        let why = why_unfit(estimate);
        let unfit = if why.is_some() { estimate.unfit } else { 0 };
        if std::mem::replace(&mut self.unfit, unfit) == unfit {
            return None;
        }
        let fit = || estimate.is_fit().then(|| "is fit to drive on".into());
        why.or_else(fit)
    }

    /// The same of a second opinion.
    pub(super) fn doubt(&mut self, estimate: &Estimate) -> Option<&'static str> {
        let opinion = estimate.opinion();
        if self.kind != Kind::Table || std::mem::replace(&mut self.opinion, opinion) == opinion {
            return None;
        }
        let is_well = || (opinion == Opinion::Possible).then(|| opinion.meaning());
        doubted(estimate).or_else(is_well)
    }

    /// The first of every interval by the robot's own clock, whatever delays it on its way here.
    fn is_due(&mut self, estimate: &Estimate) -> bool {
        if self.every_ns == 0 {
            return true;
        }
        let now = (
            estimate.header.session,
            estimate.boot_ns.div_euclid(self.every_ns),
        );
        self.last.replace(now) != Some(now)
    }
}

#[allow(clippy::cast_possible_truncation)] // At most a day.
fn nanoseconds(seconds: f64) -> i64 {
    (seconds * 1e9) as i64
}

#[cfg(test)]
mod tests {
    use super::super::reading::example;
    use super::*;
    use crate::place::PlaceArgs;

    fn form(json: bool, every: Option<f64>, count: Option<u64>) -> Form {
        Form::new(&ListenArgs {
            robot: RobotName::new("r1").unwrap(),
            json,
            csv: false,
            tum: false,
            every,
            count,
            place: PlaceArgs::default(),
        })
    }

    /// How many lines a second at 50 Hz makes.
    fn lines(mut form: Form) -> usize {
        let at = |tick: i64| Estimate {
            boot_ns: 1_000_000_000 + tick * 20_000_000,
            ..example()
        };
        (0..50)
            .filter(|tick| form.text(&at(*tick), 0).is_some())
            .count()
    }

    #[test]
    fn people_get_five_lines_a_second_and_programs_all() {
        assert_eq!(lines(form(false, None, None)), 5);
        assert_eq!(lines(form(true, None, None)), 50);
        assert_eq!(lines(form(true, Some(0.5), None)), 2);
        assert_eq!(lines(form(false, Some(0.0), None)), 50);
        assert_eq!(lines(form(true, None, Some(3))), 3);
    }

    #[test]
    fn a_second_opinion_is_remarked_to_people_when_it_changes() {
        let of = |opinion: Opinion| Estimate {
            opinion: opinion as u8,
            ..example()
        };
        let said = |form: &mut Form| {
            use Opinion::{BoundsViolated, EstimateOutside, None, Possible};
            [
                None,
                EstimateOutside,
                EstimateOutside,
                BoundsViolated,
                Possible,
            ]
            .map(|opinion| form.doubt(&of(opinion)))
        };
        let words = said(&mut form(false, None, None));
        let expected = [
            None,
            Some(Opinion::EstimateOutside.meaning()),
            None,
            Some(Opinion::BoundsViolated.meaning()),
            Some(Opinion::Possible.meaning()),
        ];
        assert_eq!(words, expected);
        assert_eq!(said(&mut form(true, None, None)), [None; 5]);
    }

    #[test]
    fn why_it_is_not_fit_is_remarked_to_people_when_it_changes() {
        let of = |unfit, state| Estimate {
            fit: u8::from(unfit == 0),
            unfit,
            state,
            ..example()
        };
        let said = |form: &mut Form| {
            [
                (0, 1),
                (2, 1),
                (2, 1),
                (3, 1),
                (1, 2),
                (2, 1),
                (0, 1),
                (0, 1),
            ]
            .map(|(unfit, state)| form.remark(&of(unfit, state)))
        };
        let mut people = form(false, None, None);
        let words = said(&mut people).map(|it| it.map(|text| text.contains("not fit")));
        let expected = [
            None,
            Some(true),
            None,
            Some(true),
            None,
            Some(true),
            Some(false),
            None,
        ];
        assert_eq!(words, expected);
        let mut programs = form(true, None, None);
        assert!(said(&mut programs).iter().all(Option::is_none));
    }

    #[test]
    fn a_robot_that_starts_again_is_seen_at_once() {
        let mut form = form(false, Some(3600.0), None);
        let mut again = example();
        assert!(form.text(&again, 0).is_some() && form.text(&again, 0).is_none());
        again.header.session += 1;
        assert!(form.text(&again, 0).is_some());
    }
}
