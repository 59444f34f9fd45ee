//! An estimate that is off by a constant, everything else honest.

use coloc_bounds::evidence::Area;
use coloc_bounds::monitor::{Contained, Judge, distance};
use rayon::prelude::*;

use super::Form;
use super::bar::{Bars, found, wilson};
use super::setting::Setting;
use super::slots::{Drive, direction};
use crate::campaign::Finding;
use crate::honest::table::{Table, percent};
use crate::method::Kind;
use crate::mrclam::GridWorld;
use crate::random::Noise;
use crate::world::World;

/// How far off \[m\].
const LIES_M: [f64; 5] = [0.5, 0.75, 1.0, 2.0, 3.0];
/// From here on it has to be found in time.
const BAR_M: f64 = 1.0;
/// The region of the start is larger than any later one: lies begin after that.
const SETTLED: usize = 4;

/// Of one size and robot.
#[derive(Copy, Clone, Debug, Default)]
struct Share {
    begun: usize,
    found: usize,
}

type Shares = Vec<[Share; LIES_M.len()]>;

fn run(form: &Form, world: &GridWorld, run: u16) -> Shares {
    let noise = Noise::new(form.seed, run);
    let seed = [form.seed, u64::from(run)];
    let drive = Drive::new(world, Setting::HARD, Kind::Coloc, seed, form.slots);
    let mut monitor = drive.monitor();
    let mut shares = vec![[Share::default(); LIES_M.len()]; world.robots()];
    let mut judges = vec![[Judge::new(2, 5); LIES_M.len()]; world.robots()];
    let every = form.every(drive.slots.len() - SETTLED);
    for number in 0..drive.slots.len() {
        let outcome = drive.close(&mut monitor, number, None);
        // A lie begins in a slot and has that and the next to be found.
        let phase = number % every;
        if number < SETTLED + phase || phase > 1 {
            continue;
        }
        for (robot, of_robot) in judges.iter_mut().enumerate() {
            // Where the recording has lost a robot nothing is measured of it.
            let first = &drive.slots[number - phase];
            if first.truth[robot].is_none() || drive.slots[number].truth[robot].is_none() {
                continue;
            }
            let psi = direction(&noise, number - phase, robot);
            for (size, judge) in of_robot.iter_mut().enumerate() {
                let [x, y] = drive.slots[number].estimates[robot];
                let lie = Area {
                    centre: [x + LIES_M[size] * psi.cos(), y + LIES_M[size] * psi.sin()],
                    half: [0.0; 2],
                };
                if phase == 0 {
                    *judge = Judge::new(2, 5);
                }
                let far = distance(&outcome.believed, robot, &lie).ok();
                let contained = judge.judge(far.map(|it| it.at_least > 0.0));
                if phase == 1 {
                    shares[robot][size].begun += 1;
                    shares[robot][size].found += usize::from(contained == Contained::No);
                }
            }
        }
    }
    shares
}

#[allow(clippy::needless_pass_by_value)] // As `reduce` wants it.
fn plus(mut all: Shares, more: Shares) -> Shares {
    for (all, more) in all.iter_mut().flatten().zip(more.iter().flatten()) {
        all.begun += more.begun;
        all.found += more.found;
    }
    all
}

/// What is found.
#[must_use]
pub fn find(form: &Form) -> Finding {
    found(
        "An estimate that lies by a constant: found within two slots",
        form,
        |worlds, bars| {
            let mut table = Table::new([
                "MR.CLAM", "robot", "lies", "0.5 m", "0.75 m", "1 m", "2 m", "3 m",
            ]);
            let mut lines = Bars::default();
            for (number, world) in worlds {
                let runs = 0..form.runs.min(2);
                let all: Vec<_> = runs
                    .into_par_iter()
                    .map(|it| run(form, world, it))
                    .collect();
                let shares = all.into_iter().reduce(plus).unwrap_or_default();
                for (robot, shares) in shares.iter().enumerate() {
                    let share = |size: usize| {
                        let Share { begun, found } = shares[size];
                        #[allow(clippy::cast_precision_loss)] // Thousands.
                        percent(found as f64 / begun.max(1) as f64)
                    };
                    table.row([
                        number.to_string(),
                        format!("R{}", robot + 1),
                        shares[0].begun.to_string(),
                        share(0),
                        share(1),
                        share(2),
                        share(3),
                        share(4),
                    ]);
                }
                for (size, metres) in LIES_M.iter().enumerate() {
                    if *metres < BAR_M {
                        continue;
                    }
                    let begun: usize = shares.iter().map(|it| it[size].begun).sum();
                    let found: usize = shares.iter().map(|it| it[size].found).sum();
                    let low = wilson(found, begun)[0];
                    lines.hold(
                        found == begun && begun > 0,
                        &format!(
                            "MR.CLAM {number}: {found} of {begun} lies of {metres} m in an estimate found within two slots (all; lower bound {:.2} %)",
                            100.0 * low
                        ),
                    );
                }
            }
            bars.table(&table.text());
            bars.append(lines);
        },
    )
}
