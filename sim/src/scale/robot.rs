//! One robot of many: where it is, what it measures, what it believes.

use std::collections::VecDeque;

use coloc_estimator::output::{Report, Verdict};
use coloc_estimator::{
    Belief, Covariance2, Covariance3, Estimator, FindingState, Kind, Measurement, Motion,
    OdometrySample, Origin, Pose, PositionFix, RobotId, Settings, Sighting, Slot, SlowError, Span,
    Stamp, TickInputs, TickOutputs, step,
};

use super::cells::Near;
use super::drive::{Driver, wheels};
use super::field::Field;
use super::network::Network;
use super::{Around, Desk, HEARD_AT_MOST, HERTZ, Mouth, RECEIVERS, SEEN_AT_MOST, TICKS};
use crate::fleet::{id, neighbour};
use crate::metrics::{NisTotals, Sample, Totals};
use crate::random::{Draws, Noise, Purpose};
use crate::sensors::relative;

/// A message is a tick under way, and no other measurement is late: a history of a tick takes all that comes.
const HISTORY: Span = Span::from_millis(20);
/// From exchange to exchange \[ns\].
const EXCHANGE_NS: i64 = 100_000_000;
/// A tick of everything: some sightings, as many words and more where many see one robot, a fix, odometry.
const SLOTS: usize = 32;
/// Beside it, for each exchange that a word may be late: five of odometry, and words to and fro.
const SLOTS_LATE: usize = 40;

/// Of a sighting \[m, m, rad\].
const SIGHTING: [f64; 3] = [0.1, 0.1, 0.0175];
/// Of a fix \[m\].
const FIX_M: f64 = 0.3;
/// Of the start \[m, m, rad\].
const START: [f64; 3] = [0.1, 0.1, 0.05];

/// A robot. Apart from the estimator, which is large, so that what of it is used each time lies together.
pub(super) struct Robot {
    number: usize,
    /// At the last exchanges, the newest first.
    in_range: VecDeque<InRange>,
    driver: Driver,
    /// Until the next exchange, as the wheels say.
    motion: Motion,
    eyes: Draws,
    receiver: Option<Box<Draws>>,
    estimator: Box<Estimator<Vec<Slot>>>,
}

/// Who was in range at the last exchange, by their numbers.
#[derive(Copy, Clone, Debug, Default)]
struct InRange {
    count: u16,
    robots: [RobotId; HEARD_AT_MOST],
}

/// What became of it all.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub(super) struct Tally {
    /// At the exchanges.
    pub(super) totals: Totals,
    /// Of all exchanges together.
    pub(super) in_range: u64,
    /// Robots.
    pub(super) seen: u64,
    /// Messages.
    pub(super) heard: u64,
    /// Messages.
    pub(super) lost: u64,
    pub(super) neighbours: NisTotals,
    pub(super) fixes: NisTotals,
    /// Neither fused nor gated, but as a robot does that is not sure of its place.
    pub(super) refused: u64,
    pub(super) folded_early: u64,
    /// Exchanges at which it did not say that it knows where it is.
    pub(super) unsure: u64,
}

impl Robot {
    pub(super) fn new(number: usize, field: Field, noise: &Noise, network: &Network) -> Self {
        let latest = network.latest();
        let mut driver = Driver::new(number, field, noise);
        let belief = start(
            driver.pose(),
            &mut noise.draws(Purpose::Start, 0, number, 0),
        );
        let settings = Settings {
            history: history(latest),
            ..Settings::default()
        };
        let storage = vec![Slot::default(); SLOTS + latest * SLOTS_LATE];
        let receives = number.is_multiple_of(RECEIVERS);
        Self {
            number,
            motion: driver.drive(&wheels()),
            driver,
            eyes: noise.draws(Purpose::RelativePose, 0, number, 0),
            receiver: receives.then(|| Box::new(noise.draws(Purpose::Fix, 0, number, 0))),
            in_range: vec![InRange::default(); latest + 1].into(),
            estimator: Box::new(Estimator::new(settings, stamp(0), belief, storage)),
        }
    }

    /// Where it is at the next exchange.
    pub(super) fn place(&self) -> Pose {
        self.driver.pose()
    }

    /// What its estimator takes.
    pub(super) fn estimator_bytes() -> usize {
        size_of::<Estimator<Vec<Slot>>>() + SLOTS * size_of::<Slot>()
    }

    /// What it believes after `tick`.
    pub(super) fn belief(&self, tick: usize) -> Belief {
        self.estimator.extrapolated(stamp(tick)).belief
    }

    /// All ticks to the exchange of that number; then it drives on to the next.
    pub(super) fn pass(
        &mut self,
        exchange: usize,
        around: Around<'_>,
        mut mouth: Mouth<'_>,
        desk: &mut Desk,
        tally: &mut Tally,
    ) {
        mouth.to.count = 0;
        let (before, last) = ((exchange - 1) * TICKS, exchange * TICKS);
        for tick in before + 1..=last {
            desk.measurements.clear();
            desk.measurements.push(self.odometry(tick));
            if tick == before + 1 {
                self.listen(exchange - 1, around, &mut desk.measurements, tally);
            }
            if tick == last {
                self.look(exchange, around, desk, tally);
                desk.measurements.extend(self.fix(exchange));
            }
            let inputs = TickInputs {
                stamp: stamp(tick),
                measurements: &desk.measurements,
            };
            let outputs = step(&mut self.estimator, &inputs);
            mouth.say(outputs.outgoing);
            tally.take(&outputs);
            if tick == last {
                tally.observe(&outputs, &self.driver.pose());
            }
        }
        self.motion = self.driver.drive(&wheels());
    }

    /// Over the tick that ends at `tick`.
    fn odometry(&self, tick: usize) -> Measurement {
        Measurement::Odometry(OdometrySample {
            source: 0,
            start: stamp(tick - 1),
            stamp: stamp(tick),
            motion: self.motion,
        })
    }

    /// What was said to this robot at the exchange of that number, by who was in range then.
    fn listen(
        &self,
        exchange: usize,
        around: Around<'_>,
        inputs: &mut Vec<Measurement>,
        tally: &mut Tally,
    ) {
        let (to, before) = (id(self.number), inputs.len());
        for (late, (said, in_range)) in around.said.iter().zip(&self.in_range).enumerate() {
            let Some(exchange) = exchange.checked_sub(late) else {
                break;
            };
            for speaker in in_range.list().iter().map(|it| usize::from(it.0)) {
                let Some(word) = said.to(to, speaker) else {
                    continue;
                };
                match around.way.late(exchange, speaker, self.number) {
                    Some(it) if it == late => {
                        let heard = neighbour(speaker, exchange as u64, word);
                        inputs.push(Measurement::Neighbour(heard));
                    }
                    None if late == 0 => tally.lost += 1,
                    _ => {}
                }
            }
        }
        tally.heard += (inputs.len() - before) as u64;
    }

    /// Who is in range now, and how the nearest look from here.
    fn look(&mut self, exchange: usize, around: Around<'_>, desk: &mut Desk, tally: &mut Tally) {
        let (here, near) = (self.place(), &mut desk.near);
        near.clear();
        near.extend(around.cells.near(self.number, here));
        tally.in_range += near.len() as u64;
        keep_nearest(near, HEARD_AT_MOST);
        self.in_range.rotate_right(1);
        self.in_range[0].fill(near);
        keep_nearest(near, SEEN_AT_MOST);
        tally.seen += near.len() as u64;
        for near in near {
            let seen = sighting(exchange, &here, near, &mut self.eyes);
            desk.measurements.push(seen);
        }
    }

    /// Once a second, each receiver at another exchange.
    fn fix(&mut self, exchange: usize) -> Option<Measurement> {
        let here = self.place();
        let draws = self.receiver.as_mut()?;
        let every = HERTZ / TICKS;
        if !(exchange + self.number / RECEIVERS).is_multiple_of(every) {
            return None;
        }
        let [x, y] = draws.normals();
        Some(Measurement::Fix(PositionFix {
            stamp: stamp(exchange * TICKS),
            origin: Origin::counted(exchange as u64),
            position: [here.x + FIX_M * x, here.y + FIX_M * y],
            covariance: Covariance2::diagonal([FIX_M * FIX_M; 2]).unwrap_or_default(),
            lever: [0.0; 2],
            slow: SlowError::default(),
        }))
    }
}

impl InRange {
    fn fill(&mut self, near: &[Near]) {
        self.count = 0;
        for (place, near) in self.robots.iter_mut().zip(near) {
            *place = id(near.member.number as usize);
            self.count += 1;
        }
    }

    fn list(&self) -> &[RobotId] {
        &self.robots[..usize::from(self.count)]
    }
}

impl Tally {
    fn take(&mut self, outputs: &TickOutputs<'_>) {
        self.folded_early += u64::from(outputs.folded_early);
        self.refused += u64::from(outputs.overflowed);
        for report in outputs.reports {
            self.verdict(report);
        }
    }

    fn verdict(&mut self, report: &Report) {
        let (accepted, d2) = match report.verdict {
            Verdict::Accepted { d2 } => (true, d2),
            Verdict::Gated { d2 } => (false, d2),
            Verdict::Heard => return,
            _ => {
                self.refused += 1;
                return;
            }
        };
        match report.source.kind {
            Kind::Neighbour => self.neighbours.add(accepted, d2),
            _ => self.fixes.add(accepted, d2),
        }
    }

    /// Holds what a robot believes against the truth.
    fn observe(&mut self, outputs: &TickOutputs<'_>, truth: &Pose) {
        let belief = &outputs.estimate.belief;
        let sample = Sample::new(&belief.pose, &belief.total().matrix(), truth);
        self.totals.add(&sample);
        self.unsure += u64::from(outputs.finding.state != FindingState::Ok);
    }
}

/// So far back that a word fits in that is late by so many exchanges.
#[allow(clippy::cast_possible_wrap)] // A few.
fn history(latest: usize) -> Span {
    Span::from_nanos(HISTORY.as_nanos() + latest as i64 * EXCHANGE_NS)
}

#[allow(clippy::cast_possible_wrap)] // A hundred years.
fn stamp(tick: usize) -> Stamp {
    const NANOS: i64 = 1_000_000_000 / HERTZ as i64;
    Stamp::from_nanos(tick as i64 * NANOS)
}

fn squares(sigma: [f64; 3]) -> Covariance3 {
    // Squares are never negative.
    Covariance3::diagonal(sigma.map(|sigma| sigma * sigma)).unwrap_or_default()
}

fn moved(pose: &Pose, sigma: [f64; 3], draws: &mut Draws) -> Pose {
    let [x, y, phi]: [f64; 3] = draws.normals();
    Pose::new(
        pose.x + sigma[0] * x,
        pose.y + sigma[1] * y,
        pose.phi + sigma[2] * phi,
    )
}

fn start(truth: Pose, draws: &mut Draws) -> Belief {
    Belief::independent(moved(&truth, START, draws), squares(START))
}

fn sighting(exchange: usize, here: &Pose, near: &Near, eyes: &mut Draws) -> Measurement {
    Measurement::Sighting(Sighting {
        stamp: stamp(exchange * TICKS),
        origin: Origin::counted(exchange as u64),
        observed: id(near.member.number as usize),
        relative: moved(&relative(here, &near.member.place), SIGHTING, eyes),
        covariance: squares(SIGHTING),
    })
}

/// So many at most, the nearest; in the order of their numbers.
fn keep_nearest(near: &mut Vec<Near>, most: usize) {
    if near.len() > most {
        near.sort_unstable_by(|a, b| {
            let distance = a.square_m2.total_cmp(&b.square_m2);
            distance.then(a.member.number.cmp(&b.member.number))
        });
        near.truncate(most);
    }
    near.sort_unstable_by_key(|near| near.member.number);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scale::cells::Member;

    #[test]
    fn of_a_crowd_the_nearest_are_seen() {
        let near = |number: u32| Near {
            member: Member {
                number,
                ..Member::default()
            },
            square_m2: f64::from((number * 7) % 12),
        };
        let mut seen: Vec<Near> = (0..12).map(near).collect();
        keep_nearest(&mut seen, SEEN_AT_MOST);
        assert!(seen.iter().all(|near| near.square_m2 < 8.0));
        let numbers: Vec<u32> = seen.iter().map(|near| near.member.number).collect();
        assert_eq!(numbers, [0, 1, 2, 4, 6, 7, 9, 11]);
    }

    #[test]
    fn one_robot_in_ten_has_a_receiver_that_speaks_once_a_second() {
        let (field, noise) = (Field::of(20, crate::scale::NEIGHBOURS), Noise::new(1, 0));
        let fixes = |number| {
            let mut robot = Robot::new(number, field, &noise, &Network::default());
            (1..=50).filter_map(|exchange| robot.fix(exchange)).count()
        };
        assert_eq!([0, 1, 9, 10, 20].map(fixes), [5, 0, 0, 5, 5]);
    }
}
