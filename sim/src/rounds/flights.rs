//! What goes wrong, of what flies: is it as accurate as the library's own robots, which remember for ten seconds, and is it honest?

use rayon::prelude::*;

use super::trouble::{MOST_NEES, beginning, settings, steps};
use super::{Crew, Flight, Form, Plan, Tally, Trouble};
use crate::campaign::Finding;
use crate::honest::table::{Table, digits, percent};
use crate::method::Method;
use crate::metrics::{Sample, Totals};
use crate::mrclam::GridWorld;
use crate::scenario::Scenario;
use crate::sensors::{Sensors, StepInputs};
use crate::world::World;

/// So much of the recording is enough \[s\].
const MOST_S: f64 = 600.0;
/// Share of time outside of 95 %.
const MOST_OUTSIDE: f64 = 0.05;

struct Case {
    name: &'static str,
    rate_hz: f64,
    trouble: Trouble,
    loss: f64,
}

fn cases(seconds: f64) -> Vec<Case> {
    let none = Trouble::default();
    let begin_s = 0.4 * seconds;
    let case = |name, rate_hz, trouble, loss| Case {
        name,
        rate_hz,
        trouble,
        loss,
    };
    let absent = Trouble {
        absent: 0.4,
        ..none
    };
    let killed = Trouble {
        kills_leaders: true,
        ..none
    };
    let split = Trouble {
        split: Some((3, [begin_s, begin_s + 60.0])),
        ..none
    };
    vec![
        case("nothing, 5 Hz", 5.0, none, 0.0),
        case("40 % of robots absent in a slot, 5 Hz", 5.0, absent, 0.0),
        case("40 % of robots absent in a slot, 2 Hz", 2.0, absent, 0.0),
        case("30 % of messages lost, 5 Hz", 5.0, none, 0.3),
        case("30 % of messages lost, 2 Hz", 2.0, none, 0.3),
        case("leader killed in every slot, 5 Hz", 5.0, killed, 0.0),
        case("R4 and R5 cut off for 60 s, 5 Hz", 5.0, split, 0.0),
        case("R4 and R5 cut off for 60 s, 2 Hz", 2.0, split, 0.0),
    ]
}

struct Outcome {
    tally: Tally,
    library: Vec<Totals>,
    flown: Vec<Totals>,
}

fn run(world: &GridWorld, form: &Form, case: &Case) -> Outcome {
    let settings = settings(world, form, case.loss);
    let initial = beginning(world);
    let plan = Plan {
        trouble: case.trouble,
        ..Plan::at(case.rate_hz)
    };
    let mut crew = Crew::new(settings.clone(), &initial, plan);
    let mut flight = Flight::new(settings, &initial, plan);
    let scenario = Scenario::named("slip").unwrap_or_default();
    let sensors = Sensors::new(world, &scenario, form.seed, 0);
    let mut inputs = StepInputs::default();
    let mut totals = [(); 2].map(|()| vec![Totals::default(); world.robots()]);
    for step in 1..steps(world, form.seconds.min(MOST_S)) {
        sensors.fill(step, &mut inputs);
        crew.step(&inputs, &mut |_| ());
        flight.step(&inputs, &mut |_| ());
        let methods: [&dyn Method; 2] = [&crew, &flight];
        for (totals, method) in totals.iter_mut().zip(methods) {
            for (robot, totals) in totals.iter_mut().enumerate() {
                if let Some(truth) = world.truth(step, robot) {
                    let (pose, covariance) = method.estimate(robot);
                    totals.add(&Sample::new(&pose, &covariance, &truth));
                }
            }
        }
    }
    let [library, flown] = totals;
    Outcome {
        tally: flight.tally(),
        library,
        flown,
    }
}

fn all(totals: &[Totals], of: impl Fn(&Totals) -> String) -> String {
    totals.iter().map(of).collect::<Vec<_>>().join(" ")
}

fn row(case: &Case, outcome: &Outcome) -> [String; 7] {
    let Tally {
        rounds,
        corrections,
        late,
        refused,
        undone,
        joined,
    } = outcome.tally;
    let centimetres = |it: &Totals| format!("{:.1}", 100.0 * it.rms_position());
    [
        case.name.into(),
        rounds.to_string(),
        format!("{corrections}, {late}, {refused}, {undone}, {joined}"),
        all(&outcome.library, centimetres),
        all(&outcome.flown, centimetres),
        all(&outcome.flown, |it| digits(it.nees())),
        all(&outcome.flown, |it| percent(it.nees_outside())),
    ]
}

/// Every row.
#[must_use]
pub fn find(form: &Form) -> Finding {
    let seconds = form.seconds.min(MOST_S);
    let mut finding = Finding {
        title: format!("As it flies, what goes wrong, {seconds} s of MR.CLAM 1"),
        ..Finding::default()
    };
    let Some((_, world)) = form.worlds().into_iter().find(|(number, _)| *number == 1) else {
        finding.text = "SKIPPED: no recordings of MR.CLAM; set COLOC_DATA\n".into();
        return finding;
    };
    let mut table = Table::new([
        "what",
        "rounds",
        "corrections, after the history, refused, taken back, joined",
        "library: position RMS of R1 … R5 [cm]",
        "as it flies",
        "NEES",
        "outside",
    ]);
    let cases = cases(seconds);
    let outcomes: Vec<Outcome> = cases.par_iter().map(|it| run(&world, form, it)).collect();
    for (case, outcome) in cases.iter().zip(&outcomes) {
        table.row(row(case, outcome));
        for (robot, totals) in outcome.flown.iter().enumerate() {
            let (nees, outside) = (totals.nees(), totals.nees_outside());
            if nees.is_nan() || nees > MOST_NEES || outside > MOST_OUTSIDE {
                let outside = percent(outside);
                let name = case.name;
                let robot = robot + 1;
                finding.missed.push(format!(
                    "{name}, R{robot}: NEES {nees:.2}, outside {outside}"
                ));
            }
        }
    }
    finding.text = table.text();
    finding
}
