//! Gyros beside wheels: whether the heading is better by them, whether its claim is honest, whether the bias is found, and slip seen.
//!
//! Robots at 50 Hz whose wheels are sane (2 % of a metre, 3° in a minute, 1.1° after a radian) drive at 1 m/s and turn at random for ten
//! minutes. Their gyros, at 200 Hz, have a bias of up to ± 0.05 rad/s that walks, white noise, and a scale that is off by 0.1 % (σ),
//! of which the filter knows no more than a noise for each turn. One sample of a hundred is lost, another comes twice.
//!
//! *Outside*: the heading's error is beyond 1.96 of its own σ, of all robots every ten seconds. A wheel that slips reports 1.3 times the
//! way and 0.4 rad/s that are no turn.

mod run;
mod world;

use rayon::prelude::*;

use crate::campaign::Finding;
use crate::honest::table::{Table, percent};
use run::Outcome;

/// How much of it is done.
#[derive(Clone, Debug, PartialEq)]
pub struct Form {
    /// Where all chance comes from.
    pub seed: u64,
    /// Of each row.
    pub robots: u16,
    /// Shares may be missed by so many σ of chance.
    pub chance: f64,
}

/// Robots that differ in their chance alone.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Row {
    name: &'static str,
    /// They stand for so long at the start \[s\].
    stands_first_s: u32,
    /// And for five seconds after every forty.
    stops: bool,
    /// What is wrong with their wheels.
    wheels: Wheels,
    /// A fix of 0.3 m every so many seconds.
    fixes_s: Option<u32>,
    /// Three that see each other every second; the first gets fixes.
    team: bool,
    /// The heading is to be so much better than that of the wheels.
    ratio: Option<f64>,
}

/// What is wrong with wheels, now and then.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
enum Wheels {
    /// Nothing.
    Hold,
    /// They slip for five seconds in every minute.
    Slip,
    /// They are silent for five seconds in every hundred.
    FallSilent,
}

const ALONE: Row = Row {
    name: "",
    stands_first_s: 5,
    stops: true,
    wheels: Wheels::Hold,
    fixes_s: None,
    team: false,
    ratio: Some(0.2),
};

const ROWS: [Row; 7] = [
    Row {
        name: "stand 5 s, drive, stop every 40 s",
        ..ALONE
    },
    Row {
        name: "and whose wheels slip for 5 s every minute",
        wheels: Wheels::Slip,
        ..ALONE
    },
    Row {
        name: "and whose wheels are silent for 5 s every 100 s",
        wheels: Wheels::FallSilent,
        ..ALONE
    },
    Row {
        name: "stand 5 s, then never stop",
        stops: false,
        ratio: None,
        ..ALONE
    },
    Row {
        name: "never stand",
        stands_first_s: 0,
        stops: false,
        ratio: None,
        ..ALONE
    },
    Row {
        name: "never stand, fixes every 5 s",
        stands_first_s: 0,
        stops: false,
        fixes_s: Some(5),
        ratio: None,
        ..ALONE
    },
    Row {
        name: "are three that see each other every second, one with fixes every 10 s",
        fixes_s: Some(10),
        team: true,
        ratio: None,
        ..ALONE
    },
];

impl Form {
    /// The whole campaign.
    #[must_use]
    pub fn long(seed: u64) -> Self {
        Self {
            seed,
            robots: 500,
            chance: 0.0,
        }
    }

    /// What some seconds of one processor are enough for.
    #[must_use]
    pub fn short(seed: u64) -> Self {
        Self {
            robots: 24,
            chance: 3.0,
            ..Self::long(seed)
        }
    }
}

/// Runs it and holds it to its bars.
#[must_use]
pub fn find(form: &Form) -> Finding {
    let mut table = Table::new([
        "robots that",
        "heading after 600 s",
        "wheels alone",
        "ratio",
        "outside of 95 %",
        "bias inside of 3 σ: after 5 s, 30 s, at the end",
        "its σ at the end",
        "slips named, median",
        "false alarms",
    ]);
    let mut missed = Vec::new();
    for (row, number) in ROWS.iter().zip(0..) {
        let outcome = outcome(row, number, form);
        table.row(told(row, &outcome));
        missed.extend(misses(row, &outcome, form.chance));
    }
    Finding {
        title: format!("{} robots of each row", form.robots),
        text: table.text(),
        missed,
    }
}

fn outcome(row: &Row, number: u16, form: &Form) -> Outcome {
    let robots: Vec<_> = (0..form.robots)
        .into_par_iter()
        .map(|robot| run::live(row, form.seed, number * 1000 + robot))
        .collect();
    robots.iter().fold(Outcome::default(), Outcome::and)
}

fn told(row: &Row, it: &Outcome) -> [String; 9] {
    let degrees = |rad: f64| format!("{:.2}°", rad.to_degrees());
    let inside = it.bias.map(|share| percent(1.0 - share.value()));
    [
        row.name.into(),
        degrees(it.with_gyro.rms()),
        degrees(it.wheels.rms()),
        format!("{:.3}", it.ratio()),
        format!(
            "{} (wheels: {})",
            percent(it.outside.value()),
            percent(it.wheels_outside.value())
        ),
        inside.join(", "),
        format!("{:.4}°/s", it.bias_sigma.rms().to_degrees()),
        slips(it),
        it.false_alarms.to_string(),
    ]
}

fn slips(it: &Outcome) -> String {
    if it.slips == 0 {
        return "none there".into();
    }
    format!("{} of {}, {:.2} s", it.named, it.slips, it.delay_s())
}

fn misses(row: &Row, it: &Outcome, chance: f64) -> Vec<String> {
    let mut missed = Vec::new();
    let mut hold = |holds: bool, what: String| {
        if !holds {
            missed.push(format!("{}: {what}", row.name));
        }
    };
    // Moments of a robot follow each other.
    let outside = it.outside.beyond(0.07, 8.0, chance);
    hold(!outside, format!("outside {}", percent(it.outside.value())));
    for (share, when) in it.bias.iter().zip(["5 s", "30 s", "600 s"]) {
        let off = share.beyond(0.0027, 1.0, chance.max(3.0));
        hold(
            !off,
            format!("bias beyond 3 σ after {when}: {}", percent(share.value())),
        );
    }
    if let Some(most) = row.ratio {
        hold(it.ratio() <= most, format!("ratio {:.3}", it.ratio()));
    }
    hold(
        it.named == it.slips,
        format!("{} of {} slips named", it.named, it.slips),
    );
    hold(
        it.false_alarms <= it.hours() / 2 + 1,
        format!("{} false alarms", it.false_alarms),
    );
    missed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_robot_is_a_pure_function_of_its_seed() {
        let form = Form {
            robots: 1,
            ..Form::short(3)
        };
        let one = outcome(&ROWS[1], 1, &form);
        assert_eq!(one, outcome(&ROWS[1], 1, &form));
        assert!(one.slips > 5 && one.outside.value() < 0.5);
    }
}
