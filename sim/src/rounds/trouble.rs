//! Whatever goes wrong, a robot believes what the joint filter believes in which the same robots were left out.

use nalgebra::Matrix3;
use rayon::prelude::*;

use super::reference::{Distance, distance};
use super::{Counts, Crew, Form, Plan, Trouble};
use crate::campaign::Finding;
use crate::dkf::{Dkf, Traffic};
use crate::honest::table::{Table, digits, percent};
use crate::method::joint::Joint;
use crate::method::{FilterSettings, Method, Sent};
use crate::metrics::{Sample, Totals};
use crate::mrclam::GridWorld;
use crate::random::Noise;
use crate::scenario::{Radio, Scenario};
use crate::sensors::{Sensors, StepInputs};
use crate::world::World;
use coloc_estimator::{Belief, Covariance3, Pose};

/// Of a belief from the joint filter's \[m, m, rad\], and of P in units of the standard deviations.
const FARTHEST: f64 = 1e-9;
/// NEES of every robot.
pub(super) const MOST_NEES: f64 = 3.2;

/// A row.
#[derive(Copy, Clone, Debug)]
struct Case {
    name: &'static str,
    plan: Plan,
    loss: f64,
}

#[allow(clippy::cast_precision_loss)]
fn cases(seconds: f64) -> Vec<Case> {
    let logged = |rate_hz, trouble| Plan {
        trouble,
        keeps_log: true,
        ..Plan::at(rate_hz)
    };
    let none = Trouble::default();
    let absent = Trouble {
        absent: 0.4,
        ..none
    };
    let killed = Trouble {
        kills_leaders: true,
        ..none
    };
    let begin_s = 0.4 * seconds;
    let split = Trouble {
        split: Some((3, [begin_s, begin_s + 60.0])),
        ..none
    };
    let restart = Trouble {
        restart: Some((2, begin_s)),
        ..none
    };
    let all = Trouble {
        absent: 0.2,
        kills_leaders: true,
        ..split
    };
    let case = |name, rate_hz, trouble, loss| Case {
        name,
        plan: logged(rate_hz, trouble),
        loss,
    };
    vec![
        case("nothing, 10 Hz", 10.0, none, 0.0),
        case("nothing, 5 Hz", 5.0, none, 0.0),
        case("nothing, 2 Hz", 2.0, none, 0.0),
        case("40 % of robots absent in a slot, 5 Hz", 5.0, absent, 0.0),
        case("40 % of robots absent in a slot, 2 Hz", 2.0, absent, 0.0),
        case("30 % of messages lost, 5 Hz", 5.0, none, 0.3),
        case("30 % of messages lost, 2 Hz", 2.0, none, 0.3),
        case("leader killed in every slot, 5 Hz", 5.0, killed, 0.0),
        case("R4 and R5 cut off for 60 s, 5 Hz", 5.0, split, 0.0),
        case("R3 forgets what it shares, 5 Hz", 5.0, restart, 0.0),
        case("20 % absent and lost, killed, cut, 5 Hz", 5.0, all, 0.2),
    ]
}

/// What came of a row.
struct Outcome {
    distance: Distance,
    counts: Counts,
    totals: Vec<Totals>,
}

/// Every row.
#[must_use]
pub fn find(form: &Form) -> Finding {
    let mut finding = Finding {
        title: format!("What goes wrong, {} s of MR.CLAM 1", form.seconds),
        ..Finding::default()
    };
    let Some((_, world)) = form.worlds().into_iter().find(|(number, _)| *number == 1) else {
        finding.text = "SKIPPED: no recordings of MR.CLAM; set COLOC_DATA\n".into();
        return finding;
    };
    let mut table = Table::new([
        "what",
        "rounds",
        "beliefs compared, apart",
        "farthest [m, rad]",
        "P",
        "corrections late by the history",
        "refused, taken back, joined again",
        "NEES",
        "outside",
    ]);
    let central = against_ccl(&world, form);
    for (name, off) in [
        ("rounds at 10 Hz with the fixes in them", central.rounds),
        ("dkf", central.dkf),
    ] {
        if off.is_nan() || off > FARTHEST {
            finding.missed.push(format!("{name}: {off:.1e} from ccl"));
        }
    }
    let cases = cases(form.seconds);
    let outcomes: Vec<Outcome> = cases
        .par_iter()
        .map(|case| run(&world, form, case))
        .collect();
    for (case, outcome) in cases.iter().zip(&outcomes) {
        table.row(row(case, outcome));
        judge(case, outcome, &mut finding.missed);
    }
    finding.text = format!("{}\n{}", central.text(form.seconds), table.text());
    finding
}

/// How far from the centralized filter, in metres, radians and parts of the standard deviations, and what was sent.
struct Central {
    rounds: f64,
    dkf: f64,
    counts: Counts,
    sent: Sent,
    traffic: Traffic,
}

impl Central {
    #[allow(clippy::cast_precision_loss)] // Counts are far below 2^53.
    fn text(&self, seconds: f64) -> String {
        let Traffic {
            messages,
            numbers,
            pi_numbers,
            updates,
        } = self.traffic;
        let rate = |bytes: f64| format!("{:.0} kB/s", bytes / seconds / 1e3);
        let [faithful, replicated] = [numbers, pi_numbers].map(|it| rate(8.0 * it as f64));
        let of_rounds = rate(self.sent.bytes as f64);
        format!(
            "`dkf` is {:.1e} from `ccl` at most, in {updates} updates and {messages} messages: {faithful}, {replicated} with replicated \
             blocks. Rounds at 10 Hz with every fix in the round are {:.1e} from it with an open gate, in {} messages: {of_rounds}{}.\n",
            self.dkf,
            self.rounds,
            self.sent.messages,
            why(&self.counts),
        )
    }
}

pub(super) fn beginning(world: &GridWorld) -> Vec<Belief> {
    let sigma = 2.0_f64.to_radians();
    let p0 = Covariance3::diagonal([0.0025, 0.0025, sigma * sigma]).unwrap_or_default();
    (0..world.robots())
        .map(|robot| Belief::independent(world.initial(robot).unwrap_or_default(), p0))
        .collect()
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // Minutes.
pub(super) fn steps(world: &GridWorld, seconds: f64) -> usize {
    world.steps().min((seconds / world.dt_s()).round() as usize)
}

pub(super) fn settings(world: &GridWorld, form: &Form, loss: f64) -> FilterSettings {
    let scenario = Scenario::named("slip").unwrap_or_default();
    FilterSettings {
        radio: Radio {
            loss,
            ..Radio::default()
        },
        noise: Noise::new(form.seed, 0),
        ..FilterSettings::new(&scenario, world.dt_s())
    }
}

/// The last reason.
fn why(counts: &Counts) -> String {
    let reason = |it| format!(" ({it})");
    counts.last_refusal.map_or_else(String::new, reason)
}

/// Rounds at the sightings' rate, with every fix in them, and the distributed filter beside the centralized one.
fn against_ccl(world: &GridWorld, form: &Form) -> Central {
    let settings = settings(world, form, 0.0);
    let initial = beginning(world);
    let plan = Plan {
        fixes_in_rounds: true,
        // What the filter computes is looked at, not what a robot believes of it.
        correction_gate: f64::INFINITY,
        ..Plan::at(10.0)
    };
    let mut crew = Crew::new(settings.clone(), &initial, plan);
    let mut dkf = Dkf::new(settings.clone(), &initial);
    let mut joint = Joint::new(settings, &initial);
    let scenario = Scenario::named("slip").unwrap_or_default();
    let sensors = Sensors::new(world, &scenario, form.seed, 0);
    let (mut inputs, mut farthest) = (StepInputs::default(), [0.0_f64; 2]);
    for step in 1..steps(world, form.seconds) {
        sensors.fill(step, &mut inputs);
        crew.step(&inputs, &mut |_| ());
        dkf.step(&inputs, &mut |_| ());
        joint.step(&inputs, &mut |_| ());
        for robot in 0..world.robots() {
            let found = [crew.estimate(robot), dkf.estimate(robot)];
            for (most, found) in farthest.iter_mut().zip(found) {
                let off = apart(found, joint.estimate(robot));
                *most = if off.is_nan() { off } else { most.max(off) };
            }
        }
    }
    Central {
        rounds: farthest[0],
        dkf: farthest[1],
        counts: crew.counts(),
        sent: crew.sent().unwrap_or_default(),
        traffic: dkf.traffic(),
    }
}

/// How far two poses are from one another \[m, rad\], or their P in units of the standard deviations; the larger of it.
fn apart((a, p): (Pose, Matrix3<f64>), (b, q): (Pose, Matrix3<f64>)) -> f64 {
    let turn = coloc_estimator::angle::wrap(a.phi - b.phi);
    let sigma = q.diagonal().map(f64::sqrt);
    let relative = (p - q).component_div(&(sigma * sigma.transpose()));
    [a.x - b.x, a.y - b.y, turn]
        .iter()
        .chain(relative.iter())
        .fold(0.0, |most, it| {
            if it.is_nan() {
                f64::NAN
            } else {
                it.abs().max(most)
            }
        })
}

fn run(world: &GridWorld, form: &Form, case: &Case) -> Outcome {
    let settings = settings(world, form, case.loss);
    let initial = beginning(world);
    let mut crew = Crew::new(settings.clone(), &initial, case.plan);
    let scenario = Scenario::named("slip").unwrap_or_default();
    let sensors = Sensors::new(world, &scenario, form.seed, 0);
    let mut inputs = StepInputs::default();
    let mut totals = vec![Totals::default(); world.robots()];
    for step in 1..steps(world, form.seconds) {
        sensors.fill(step, &mut inputs);
        crew.step(&inputs, &mut |_| ());
        for (robot, totals) in totals.iter_mut().enumerate() {
            if let Some(truth) = world.truth(step, robot) {
                let (pose, covariance) = crew.estimate(robot);
                totals.add(&Sample::new(&pose, &covariance, &truth));
            }
        }
    }
    let beliefs: Vec<_> = initial
        .iter()
        .map(|it| (it.pose, it.total().matrix()))
        .collect();
    Outcome {
        distance: distance(&crew, &settings, &beliefs, crew.gates()),
        counts: crew.counts(),
        totals,
    }
}

fn row(case: &Case, outcome: &Outcome) -> [String; 9] {
    let Outcome {
        distance: it,
        counts,
        totals,
    } = outcome;
    let [x, y, phi] = it.farthest;
    let all = |of: &dyn Fn(&Totals) -> String| totals.iter().map(of).collect::<Vec<_>>().join(" ");
    [
        case.name.into(),
        it.rounds.to_string(),
        format!("{}, {}", it.compared, it.apart),
        format!("{:.1e}, {phi:.1e}", x.max(y)),
        format!("{:.1e}", it.covariance),
        format!(
            "{} of {}",
            counts.first_order,
            counts.exact + counts.first_order
        ),
        format!(
            "{}{}, {}, {}",
            counts.refused,
            why(counts),
            counts.undone,
            counts.joined
        ),
        all(&|it| digits(it.nees())),
        all(&|it| percent(it.nees_outside())),
    ]
}

fn judge(case: &Case, outcome: &Outcome, missed: &mut Vec<String>) {
    let it = &outcome.distance;
    let farthest = it.farthest.iter().fold(it.covariance, |a, b| a.max(*b));
    // Corrections of first order are not the joint filter's.
    let is_exact = outcome.counts.first_order > 0 || farthest <= FARTHEST;
    if it.compared == 0 || !is_exact {
        missed.push(format!(
            "{}: {farthest:.1e} from the joint filter",
            case.name
        ));
    }
    for (robot, totals) in outcome.totals.iter().enumerate() {
        let nees = totals.nees();
        if nees.is_nan() || nees > MOST_NEES {
            missed.push(format!("{}, R{}: NEES {nees:.2}", case.name, robot + 1));
        }
    }
}
