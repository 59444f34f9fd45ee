//! An overconfident estimate: from a moment on it believes its wheels alone, and drifts away from where everybody else has the robot.

use coloc_bounds::evidence::Area;
use coloc_bounds::monitor::{Contained, Judge, Monitor, Outcome, distance};
use coloc_estimator::Pose;

use super::Form;
use super::bar::{Bars, found, quantile};
use super::contain::runs;
use super::setting::{SLOT_S, Setting};
use super::slots::{Drive, margin};
use crate::campaign::Finding;
use crate::honest::table::{Table, percent};
use crate::method::Kind;
use crate::mrclam::GridWorld;

/// Of these: with a receiver and without.
const ROBOTS: [usize; 2] = [0, 2];
/// It is looked for that long \[slots\].
const PATIENCE: usize = 240;

/// One that has begun.
struct Alone {
    robot: usize,
    first: usize,
    pose: Pose,
    judge: Judge,
}

/// What came of one: after so many slots, and how far off it was \[m\].
#[derive(Copy, Clone, Debug)]
struct End {
    robot: usize,
    alarm: Option<(usize, f64)>,
}

impl Alone {
    /// Goes on by slot `number`; whether an alarm begins.
    fn is_found(
        &mut self,
        drive: &Drive,
        number: usize,
        (monitor, outcome): (&Monitor, &Outcome),
    ) -> bool {
        self.pose = drive.driven(number, self.robot, self.pose);
        let at = [self.pose.x, self.pose.y];
        let here = Area {
            centre: at,
            half: [0.0; 2],
        };
        let is_outside = margin(monitor, self.robot, at) < 0.0
            || distance(&outcome.believed, self.robot, &here).is_ok_and(|it| it.at_least > 0.0);
        self.judge.judge(Some(is_outside)) == Contained::No
    }

    fn off_m(&self, drive: &Drive, number: usize) -> Option<f64> {
        let truth = drive.slots[number].truth[self.robot]?;
        Some((self.pose.x - truth.x).hypot(self.pose.y - truth.y))
    }
}

fn run(form: &Form, world: &GridWorld) -> Vec<End> {
    let drive = Drive::new(
        world,
        Setting::FORGETFUL,
        Kind::Sl,
        [form.seed, 0],
        form.slots,
    );
    let mut monitor = drive.monitor();
    let last = drive.slots.len().saturating_sub(PATIENCE);
    let every = form.every(last);
    let (mut all, mut ends): (Vec<Alone>, Vec<End>) = (Vec::new(), Vec::new());
    for number in 0..drive.slots.len() {
        let outcome = drive.close(&mut monitor, number, None);
        all.retain_mut(|it| {
            // Where the recording has lost it nothing can be said of it.
            let Some(off_m) = it.off_m(&drive, number) else {
                return false;
            };
            let since = number - it.first;
            let is_found = it.is_found(&drive, number, (&monitor, &outcome));
            let is_over = is_found || since >= PATIENCE;
            if is_over {
                ends.push(End {
                    robot: it.robot,
                    alarm: is_found.then_some((since, off_m)),
                });
            }
            !is_over
        });
        if number < last && number % every == every / 2 {
            let truth = &drive.slots[number].truth;
            all.extend(ROBOTS.into_iter().filter_map(|robot| {
                Some(Alone {
                    robot,
                    first: number,
                    pose: truth[robot]?,
                    judge: Judge::new(2, 5),
                })
            }));
        }
    }
    ends
}

/// What is found.
#[must_use]
#[allow(clippy::cast_precision_loss)] // Hundreds.
pub fn find(form: &Form) -> Finding {
    found(
        "An estimate that is overconfident: no promise",
        form,
        |worlds, bars| {
            let mut table = Table::new([
                "MR.CLAM",
                "believes its wheels alone",
                "times",
                "found within 120 s",
                "time to the alarm, s (median / 90 %)",
                "off by then, m (median / 90 %)",
            ]);
            for (number, world) in worlds {
                let ends = run(form, world);
                for robot in ROBOTS {
                    let of = || ends.iter().filter(|it| it.robot == robot);
                    let alarms = || of().filter_map(|it| it.alarm);
                    let mut times: Vec<_> = alarms().map(|it| it.0 as f64 * SLOT_S).collect();
                    let mut off: Vec<_> = alarms().map(|it| it.1).collect();
                    table.row([
                        number.to_string(),
                        format!("R{}", robot + 1),
                        of().count().to_string(),
                        percent(times.len() as f64 / of().count().max(1) as f64),
                        format!(
                            "{:.1} / {:.1}",
                            quantile(&mut times, 0.5),
                            quantile(&mut times, 0.9)
                        ),
                        format!(
                            "{:.2} / {:.2}",
                            quantile(&mut off, 0.5),
                            quantile(&mut off, 0.9)
                        ),
                    ]);
                }
            }
            bars.table(&table.text());
            naive(form, worlds, bars);
        },
    )
}

/// The filter that counts everything twice.
fn naive(form: &Form, worlds: &[(u32, GridWorld)], bars: &mut Bars) {
    for (number, world) in worlds {
        let tally = runs(
            form,
            world,
            (Setting::FORGETFUL, Kind::Nb),
            form.runs.min(1),
        );
        bars.table(&format!(
            "MR.CLAM {number}: the filter that counts what it is told twice (`nb`) is outside in {} of {} slots of a robot, {} alarms.",
            tally.single,
            tally.slots * tally.areas.len(),
            tally.alarms
        ));
    }
}
