//! `coloc observable`: whether a team can know where it is at all, and if not, who has to move or needs a receiver.

use clap::{Args, ValueEnum};
use coloc_rounds::model::Kind;
use coloc_sim::dkf::observability::{Finding, Outfit};

use crate::output::{complain, print_line};
use crate::status::Status;

/// Says what a team of robots can know about itself: by who sees whom, who has a satellite receiver and who moves.
///
/// It is about what measurements can tell, not about how much: whoever is observable is not yet accurate.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  coloc observable --robots 3                           everybody sees everybody, nobody has a receiver
  coloc observable --robots 3 --fixes 1
  coloc observable --robots 4 --sees 1-2,2-3 --fixes 1 --still 1
  coloc observable --robots 3 --sees 1-2,1-3 --by range --fixes 1

A robot that stands still has a receiver and does not know its heading: it has to move, or another one needs a receiver too.
Who stands and has no receiver is no reference to a filter, but what the others know of it stays what it was.

Exit status: 0 every robot can know where it is, 1 one cannot, 2 the arguments were not understood, \
141 the reader of standard output went away.")]
pub(crate) struct ObservableArgs {
    /// How many robots
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u16).range(1..=32))]
    robots: u16,
    /// Who sees whom, observer first, with commas between [default: everybody sees everybody]
    #[arg(long, value_name = "A-B", value_delimiter = ',', value_parser = pair)]
    sees: Vec<(u16, u16)>,
    /// What of one another they see
    #[arg(long, value_name = "WHAT", value_enum, default_value_t = By::Pose)]
    by: By,
    /// Who has a satellite receiver
    #[arg(long, value_name = "N", value_delimiter = ',')]
    fixes: Vec<u16>,
    /// Whose pose is known, by whatever means
    #[arg(long, value_name = "N", value_delimiter = ',')]
    known: Vec<u16>,
    /// Who stands still
    #[arg(long, value_name = "N", value_delimiter = ',')]
    still: Vec<u16>,
}

/// What robots see of one another.
#[derive(Copy, Clone, Debug, PartialEq, Eq, ValueEnum)]
enum By {
    /// The whole relative pose
    Pose,
    /// Range and bearing
    RangeBearing,
    /// The bearing alone
    Bearing,
    /// The range alone
    Range,
}

fn pair(text: &str) -> Result<(u16, u16), String> {
    let numbers = text
        .split_once('-')
        .and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)));
    numbers.ok_or_else(|| "must be two robots, such as 1-2".into())
}

impl ObservableArgs {
    /// Robots from 0.
    fn outfit(&self) -> Result<Outfit, String> {
        let robot = |number: u16| match number {
            1.. if number <= self.robots => Ok(usize::from(number) - 1),
            _ => Err(format!(
                "there is no robot {number}: they are 1 to {}",
                self.robots
            )),
        };
        let all = |numbers: &[u16]| -> Result<Vec<usize>, String> {
            numbers.iter().map(|it| robot(*it)).collect()
        };
        let kind = match self.by {
            By::Pose => Kind::Pose,
            By::RangeBearing => Kind::RangeBearing,
            By::Bearing => Kind::Bearing,
            By::Range => Kind::Range,
        };
        let robots = usize::from(self.robots);
        let sights: Result<Vec<_>, String> = if self.sees.is_empty() {
            let pairs = (0..robots).flat_map(|a| (0..robots).map(move |b| (a, b)));
            Ok(pairs
                .filter(|(a, b)| a != b)
                .map(|(a, b)| (a, b, Some(kind)))
                .collect())
        } else {
            let mut pairs = self.sees.iter();
            if let Some((a, _)) = pairs.find(|(a, b)| a == b) {
                return Err(format!("robot {a} cannot see itself"));
            }
            let pairs = self.sees.iter();
            pairs
                .map(|(a, b)| Ok((robot(*a)?, robot(*b)?, Some(kind))))
                .collect()
        };
        Ok(Outfit {
            robots,
            sights: sights?,
            fixes: all(&self.fixes)?,
            known: all(&self.known)?,
            still: all(&self.still)?,
        })
    }
}

/// The whole command.
pub(crate) fn command(args: &ObservableArgs) -> Status {
    let outfit = match args.outfit() {
        Ok(outfit) => outfit,
        Err(why) => {
            complain(&format!("coloc: {why}"));
            return Status::NotUnderstood;
        }
    };
    let finding = outfit.judge();
    print_line(&told(&finding, outfit.robots));
    if finding.missing == 0 {
        Status::Done
    } else {
        Status::Failed
    }
}

fn told(finding: &Finding, robots: usize) -> String {
    let named = |robots: &[usize]| {
        let all: Vec<String> = robots.iter().map(|it| format!("R{}", it + 1)).collect();
        all.join(", ")
    };
    let all = 3 * robots;
    if finding.missing == 0 {
        return format!("every robot can know where it is: {all} of {all} numbers are observable");
    }
    let mut lines = vec![
        format!("{} of {all} numbers are observable", finding.rank),
        format!("cannot know where they are: {}", named(&finding.lost)),
    ];
    let mut say = |what: &str, who: &[usize]| {
        if !who.is_empty() {
            lines.push(format!("{what}: {}", named(who)));
        }
    };
    say("would help if it moved, each alone", &finding.should_move);
    say(
        "would help with a receiver, each alone",
        &finding.should_have_fixes,
    );
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use clap::{CommandFactory, FromArgMatches, Parser};

    use super::*;

    #[derive(Parser)]
    struct Only {
        #[command(flatten)]
        args: ObservableArgs,
    }

    fn args(line: &str) -> ObservableArgs {
        let words = std::iter::once("observable").chain(line.split_whitespace());
        let matches = Only::command().get_matches_from(words);
        Only::from_arg_matches(&matches).expect("arguments").args
    }

    #[test]
    fn who_has_to_move_and_who_needs_a_receiver_is_said() {
        let outfit = args("--robots 3 --fixes 1 --still 1,2")
            .outfit()
            .expect("robots");
        let text = told(&outfit.judge(), 3);
        assert!(text.contains("8 of 9"), "{text}");
        assert!(text.contains("moved, each alone: R1\n"), "{text}");
        assert!(text.ends_with("R2, R3"), "{text}");
        let moving = args("--robots 3 --fixes 1").outfit().expect("robots");
        assert!(told(&moving.judge(), 3).starts_with("every robot"));
    }

    #[test]
    fn robots_that_are_not_there_are_refused() {
        for line in [
            "--robots 2 --fixes 3",
            "--sees 1-3",
            "--still 0",
            "--sees 1-1",
        ] {
            assert!(args(line).outfit().is_err(), "{line}");
        }
        assert!(pair("1,2").is_err());
    }
}
