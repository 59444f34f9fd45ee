//! What could be better than the exchange as it is: the camera's clock, its bearings, how long its errors stay, and the wheels.

use rayon::prelude::*;

use super::method::{AS_IT_IS, BOTH_WAYS, Idea, Method};
use super::team::{Draw, Sums, summed};
use crate::campaign::Finding;
use crate::honest::table::{Table, digits};
use crate::partial::Form;
use crate::partial::recorded::Recorded;
use crate::random::Noise;

/// Mean errors of the bearings of R1 to R5 against the truth, as the other recording has them: known of a camera beforehand.
const BY_THE_OTHER: [[f64; 5]; 2] = [
    [0.0012, 0.0006, -0.0021, -0.0127, -0.0023],
    [-0.0067, 0.0005, -0.0096, -0.0140, -0.0036],
];

const fn later(later_s: f64) -> Idea {
    Idea {
        later_s,
        ..AS_IT_IS
    }
}

const fn forgets(forgets_s: f64) -> Idea {
    Idea {
        forgets_s,
        ..AS_IT_IS
    }
}

const TURNED: Idea = Idea {
    turned_rad: BY_THE_OTHER,
    ..AS_IT_IS
};

/// True ways over those that the wheels said, of R1 to R5, as the other recording has them.
const WAYS_BY_THE_OTHER: [[f64; 5]; 2] = [
    [0.955, 0.934, 0.946, 0.907, 0.938],
    [0.932, 0.908, 0.923, 0.923, 0.941],
];

const fn wheels(turning: f64) -> Idea {
    Idea {
        ways: WAYS_BY_THE_OTHER,
        turning,
        ..AS_IT_IS
    }
}

const IDEAS: [(&str, Idea); 11] = [
    ("as it is: the camera is 0.04 s late", AS_IT_IS),
    ("not late", later(0.04)),
    ("0.02 s late", later(0.02)),
    ("0.06 s late", later(-0.02)),
    ("0.10 s late", later(-0.06)),
    ("each camera's mean bearing error taken off", TURNED),
    ("slow errors are forgotten in 30 s", forgets(30.0)),
    ("in 8 s, as they are", forgets(8.0)),
    ("wheels' scale known", wheels(1.0)),
    ("and a quarter of the noise in turns", wheels(0.25)),
    ("and a tenth of it", wheels(0.1)),
];

/// Runs all of them with two receivers and with one.
#[must_use]
pub fn find(form: &Form) -> Finding {
    let title = "Ideas for the exchange (MR.CLAM, the robots' own cameras)";
    let recordings = match form.recordings(title) {
        Ok(recordings) => recordings,
        Err(finding) => return finding,
    };
    let mut table = Table::new([
        "recording",
        "receivers",
        "idea",
        "position of those without a receiver, cm",
        "φ, rad",
        "outside at most, %",
    ]);
    for recorded in &recordings {
        for receivers in [2, 1] {
            for (name, idea) in IDEAS {
                let method = Method {
                    receivers,
                    idea,
                    ..BOTH_WAYS
                };
                table.row(row(recorded, (name, &method), form));
            }
        }
    }
    Finding {
        title: title.into(),
        text: table.text(),
        missed: Vec::new(),
    }
}

fn row(recorded: &Recorded, (name, method): (&str, &Method), form: &Form) -> [String; 6] {
    let draws: Vec<Vec<Sums>> = (0..form.draws)
        .into_par_iter()
        .map(|draw| {
            let draw = Draw {
                noise: Noise::new(form.seed, draw),
                steps: recorded.steps,
                done: &|_| (),
            };
            draw.run(recorded, method)
        })
        .collect();
    let sums = summed(&draws);
    let without = || sums.iter().skip(method.receivers).map(Sums::rms);
    let count = without().map(|_| 1.0).sum::<f64>();
    let mean = |of: &dyn Fn([f64; 3]) -> f64| (without().map(of).sum::<f64>() / count).sqrt();
    let position = mean(&|[x, y, _]| x * x + y * y);
    let heading = mean(&|[.., phi]| phi * phi);
    let outside = sums.iter().map(|it| it.outside / it.count);
    [
        recorded.title(),
        method.receivers.to_string(),
        name.into(),
        format!("{:.1}", 100.0 * position),
        digits(heading),
        format!("{:.1}", 100.0 * outside.fold(0.0, f64::max)),
    ]
}
