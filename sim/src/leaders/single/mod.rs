//! A leader carries children that it does not see: the thesis's simulation with one leader, §3.6.1, cases 1 to 4.
//!
//! One leader stands, four children drive in circles; the fourth is never within sight of the leader. All know all readings, as in
//! chapter 3. The geometry is not the thesis's, which gives none: the figures are held to those of an independent implementation of the
//! same geometry.

pub(super) mod world;

use rayon::prelude::*;

use super::Form;
use super::robot::Method;
use super::run;
use super::score::Score;
use crate::campaign::Finding;
use crate::honest::table::{Table, digits, percent};
use world::{Case, Sensors, World};

/// Every child hears of its leader at nearly every event: data tell all there is.
const METHODS: [Method; 3] = [Method::Kalman, Method::Split, Method::Cross];

const CHILDREN: [usize; 4] = [0, 1, 2, 3];

/// What an independent implementation came to with [`Method::Kalman`], 20 runs.
struct Stated {
    /// Of the fourth child: RMSE \[cm, cm, rad\].
    rmse: [f64; 3],
    /// Of all children: share of NEES beyond the 95 % bound, in per cent.
    outside: [f64; 4],
}

const STATED: [Stated; 4] = [
    Stated {
        rmse: [1.08, 0.68, 0.0074],
        outside: [14.0, 13.3, 11.8, 9.6],
    },
    Stated {
        rmse: [2.35, 1.76, 0.0134],
        outside: [5.7, 5.6, 5.8, 5.0],
    },
    Stated {
        rmse: [2.16, 1.62, 0.0127],
        outside: [6.7, 5.6, 6.0, 5.0],
    },
    Stated {
        rmse: [5.39, 4.22, 0.0233],
        outside: [5.5, 5.8, 6.0, 4.6],
    },
];

/// All runs of a case.
fn score(case: &Case, form: &Form, world: &World) -> Score {
    let runs = (0..form.runs).into_par_iter();
    let scores = runs.map(|it| {
        let sensors = Sensors::new(world, form.seed, it, case);
        run::score(&sensors, &METHODS)
    });
    scores.reduce(Score::default, Score::merged)
}

/// All cases.
#[must_use]
pub fn find(form: &Form) -> Finding {
    let (mut accuracy, mut honesty) = (
        Table::new(["case", "method", "x cm", "y cm", "φ rad"]),
        Table::new(["case", "method", "c1", "c2", "c3", "c4", "mean NEES"]),
    );
    let mut missed = Vec::new();
    let steps = form.steps(100, world::STEPS);
    let world = World::new(steps);
    for (case, stated) in world::CASES.iter().zip(&STATED) {
        let score = score(case, form, &world);
        for method in METHODS {
            let [x, y, phi] = score.accuracy(method, 3, |_| true);
            accuracy.row([
                case.number.to_string(),
                method.name().into(),
                spread(x, 100.0),
                spread(y, 100.0),
                format!("{:.4} ± {:.4}", phi[0], phi[1]),
            ]);
            let outside = CHILDREN.map(|child| percent(score.outside(method, child)));
            let [c1, c2, c3, c4] = outside;
            let nees = CHILDREN.map(|child| digits(score.nees(method, child)));
            let (number, name) = (case.number.to_string(), method.name().into());
            honesty.row([number, name, c1, c2, c3, c4, nees.join(", ")]);
        }
        if form.is_long() {
            missed.extend(missed_by(case, &score, stated));
        }
    }
    let bars = if form.is_long() {
        ""
    } else {
        "\nToo little for the bars.\n"
    };
    let text = format!(
        "{} runs of {} s each. RMSE over runs at each step, its mean and deviation over time, of the child that the leader never \
         sees:\n\n{}\nShare of NEES beyond the 95 % bound, and mean NEES (3 is honest):\n\n{}{bars}",
        form.runs,
        steps / 100,
        accuracy.text(),
        honesty.text()
    );
    Finding {
        title: "One leader, four children".into(),
        text,
        missed,
    }
}

fn spread([mean, deviation]: [f64; 2], unit: f64) -> String {
    format!("{:.2} ± {:.2}", unit * mean, unit * deviation)
}

/// In which unit they are stated \[m, m, rad\].
const COORDINATES: [(&str, f64); 3] = [("x", 0.01), ("y", 0.01), ("φ", 1.0)];

/// The bars.
fn missed_by(case: &Case, score: &Score, stated: &Stated) -> Vec<String> {
    let mut missed = Vec::new();
    let mut hold = |holds: bool, what: String| {
        if !holds {
            missed.push(format!("case {}: {what}", case.number));
        }
    };
    let rmse = |method| score.accuracy(method, 3, |_| true).map(|it| it[0]);
    let (kalman, cross) = (rmse(Method::Kalman), rmse(Method::Cross));
    for (i, (name, unit)) in COORDINATES.into_iter().enumerate() {
        let ratio = kalman[i] / (stated.rmse[i] * unit);
        hold(
            (ratio - 1.0).abs() <= 0.05,
            format!("leader-kf, {name}: {ratio:.3} of what is stated"),
        );
        let ratio = cross[i] / kalman[i];
        hold(
            (ratio - 1.0).abs() <= 0.05,
            format!("leader-cross, {name}: {ratio:.3} of leader-kf's"),
        );
    }
    for child in CHILDREN {
        let [low, high] = score.interval(Method::Kalman, child);
        let outside = 0.01 * stated.outside[child];
        let text = format!(
            "leader-kf, c{}: {} outside stated",
            child + 1,
            percent(outside)
        );
        hold(
            (low..=high).contains(&outside),
            format!("{text}, {} to {} here", percent(low), percent(high)),
        );
        let outside = score.outside(Method::Cross, child);
        hold(
            outside <= 0.07,
            format!("leader-cross, c{}: {}", child + 1, percent(outside)),
        );
        let nees = score.nees(Method::Cross, child);
        hold(
            nees <= 3.3,
            format!("leader-cross, c{}: mean NEES {nees:.2}", child + 1),
        );
        let outside = score.outside(Method::Split, child);
        hold(
            outside <= 0.03,
            format!("leader-split, c{}: {}", child + 1, percent(outside)),
        );
    }
    missed
}

#[cfg(test)]
mod tests {
    use super::*;

    fn form() -> Form {
        Form {
            runs: 4,
            seconds: 90,
            ..Form::long(1, None)
        }
    }

    /// Case 1 is where it matters most: the leader's error is all that a child has.
    #[test]
    fn who_tracks_what_is_in_common_is_as_accurate_and_honest() {
        let score = score(&world::CASES[0], &form(), &World::new(9_000));
        for child in 0..4 {
            let nees = METHODS.map(|method| score.nees(method, child));
            let [kalman, split, cross] = nees;
            assert!(kalman > cross + 0.5, "c{}: {nees:?}", child + 1);
            assert!(cross < 3.6 && split < cross, "c{}: {nees:?}", child + 1);
            let of = |method| score.accuracy(method, child, |_| true).map(|it| it[0]);
            let (plain, tracked) = (of(Method::Kalman), of(Method::Cross));
            for i in 0..3 {
                assert!(tracked[i] < 1.1 * plain[i], "c{}, {i}", child + 1);
            }
        }
    }

    #[test]
    fn the_same_seed_comes_to_the_same() {
        let form = Form {
            runs: 2,
            seconds: 5,
            ..form()
        };
        assert_eq!(find(&form), find(&form));
        let other = Form {
            seed: 2,
            ..form.clone()
        };
        assert_ne!(find(&form).text, find(&other).text);
    }
}
