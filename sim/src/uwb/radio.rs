//! Five robots with radios that measure ranges to one another and to four anchors, a scale and an offset for every pair.
//!
//! Two of the robots reach no anchor: they know where they are by the other three alone. One reading in fifty came by a detour, and
//! is metres too long.

use coloc_estimator::partial::{Alone, Reading};
use coloc_estimator::{
    Belief, Covariance2, Covariance3, FindingState, LandmarkSighting, Measurement, OdometrySample,
    Origin, PartialSighting, Pose, Stamp, Start, TickInputs,
};
use coloc_uwb::{Corrected, Place, Ranging, Settings};
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use rayon::prelude::*;

use super::drive::{ROLLING, Sums, increment, noise, settings, stamp};
use super::{Form, MOST_OUTSIDE};
use crate::campaign::Finding;
use crate::fleet::{Fleet, Note, id};
use crate::honest::table::{Table, digits, percent};
use crate::random::{Noise, Purpose};
use crate::synthetic::{Synthetic, SyntheticConfig};
use crate::world::World;

const ROBOTS: usize = 5;
/// The others reach no anchor.
const REACHING: usize = 3;
const ANCHORS: [[f64; 2]; 4] = [[-22.0, -16.0], [22.0, -16.0], [22.0, 16.0], [-22.0, 16.0]];
/// An anchor's number is its place in the list and this.
const FIRST_ANCHOR: u16 = 100;
const ANCHOR_SIGMA_M: f64 = 0.01;

const SECONDS: f64 = 600.0;
const START: [f64; 2] = [0.1, 0.05];
/// Steps of 20 ms from one reading of a pair to the next.
const EVERY: usize = 50;
/// What is new in every reading \[m\].
const SIGMA_M: f64 = 0.1;
/// Of a pair's scale; its offset is between zero and this \[m\].
const SCALE_SIGMA: f64 = 0.02;
const MOST_OFFSET_M: f64 = 0.6;
/// How many readings came by a detour, and how long that is \[m\].
const DETOURS: f64 = 0.02;
const DETOUR_M: [f64; 2] = [1.0, 6.0];
/// A reading is judged at this range \[m\].
const JUDGED_AT_M: f64 = 15.0;
/// χ² with one degree of freedom, 95 %, and the share of pairs that may be beyond: of hundreds of pairs, by chance 5 % are.
const CHI2_1_95: f64 = 3.841_458_820_694_124;
const MOST_BEYOND: f64 = 0.10;

/// A pair's scale and offset, the same in both directions.
fn pair(chance: &Noise, a: usize, b: usize) -> [f64; 2] {
    let mut draws = chance.draws(Purpose::Radio, 0, a.min(b), a.max(b));
    [
        SCALE_SIGMA * draws.normal(),
        draws.uniform(0.0, MOST_OFFSET_M),
    ]
}

/// A member of the team: what its driver knows of radios, and what it did.
struct Member {
    ranging: Ranging,
    sequence: u64,
    sums: Sums,
}

struct Team<'a> {
    world: &'a Synthetic,
    chance: &'a Noise,
    corrects: bool,
    fleet: Fleet,
    mail: Vec<Vec<Measurement>>,
    members: Vec<Member>,
}

const SLOTS: usize = 512;

impl<'a> Team<'a> {
    fn new(world: &'a Synthetic, chance: &'a Noise, corrects: bool) -> Self {
        let [m, rad] = START;
        let variances = [m * m, m * m, rad * rad];
        let (mut starts, mut members) = (Vec::new(), Vec::new());
        for robot in 0..ROBOTS {
            let truth = world.initial(robot).unwrap_or_default();
            let [x, y, phi] = chance.draws(Purpose::Start, 0, robot, 0).normals();
            let pose = Pose::new(truth.x + m * x, truth.y + m * y, truth.phi + rad * phi);
            let covariance = Covariance3::diagonal(variances).unwrap_or_default();
            starts.push((
                stamp(0.0),
                Start::Known(Belief::independent(pose, covariance)),
            ));
            let radios = Settings {
                sigma_m: SIGMA_M,
                ..Settings::default()
            };
            members.push(Member {
                ranging: Ranging::new(
                    radios,
                    Vector3::new(pose.x, pose.y, pose.phi),
                    Matrix3::from_diagonal(&variances.into()),
                ),
                sequence: 0,
                sums: Sums::default(),
            });
        }
        Self {
            world,
            chance,
            corrects,
            mail: vec![Vec::new(); ROBOTS],
            members,
            fleet: Fleet::starting(settings(), &starts, SLOTS),
        }
    }

    fn step(&mut self, step: usize) {
        let delivered = std::mem::replace(&mut self.mail, vec![Vec::new(); ROBOTS]);
        let odometry = noise(&ROLLING);
        for (robot, mut measurements) in delivered.into_iter().enumerate() {
            let motion = odometry.nonholonomic(self.world.odometry(step - 1, robot));
            measurements.push(Measurement::Odometry(OdometrySample {
                source: 0,
                start: self.at(step - 1),
                stamp: self.at(step),
                motion,
            }));
            let leg = increment(&motion, self.world.dt_s());
            self.members[robot].ranging.drive(&leg);
            self.listen(step, robot, &mut measurements);
            let inputs = TickInputs {
                stamp: self.at(step),
                measurements: &measurements,
            };
            let mail = &mut self.mail;
            let mut pass = |note: Note| mail[note.to].push(note.word);
            self.fleet
                .tick_with(robot, &inputs, &mut |_| (), &mut pass, &mut |_| ());
        }
    }

    #[allow(clippy::cast_precision_loss)] // Thousands of steps.
    fn at(&self, step: usize) -> Stamp {
        stamp(step as f64 * self.world.dt_s())
    }

    /// All that a robot's radio says in this step.
    fn listen(&mut self, step: usize, robot: usize, into: &mut Vec<Measurement>) {
        for other in (0..ROBOTS).filter(|it| *it != robot) {
            if (step + 7 * robot + 3 * other).is_multiple_of(EVERY) {
                into.extend(self.range_to_robot(step, robot, other));
            }
        }
        for (index, position) in ANCHORS.iter().enumerate().filter(|_| robot < REACHING) {
            if (step + 7 * robot + 11 * index).is_multiple_of(EVERY) {
                into.extend(self.range_to_anchor(step, robot, (index, *position)));
            }
        }
    }

    /// What the radio says of a range to the one with that index, anchors counted after robots.
    fn said(&self, step: usize, robot: usize, other: usize, to: [f64; 2]) -> Option<f64> {
        let truth = self.world.truth(step, robot)?;
        let range = (to[0] - truth.x).hypot(to[1] - truth.y);
        let [scale, offset] = pair(self.chance, robot, other);
        let mut draws = self.chance.draws(Purpose::Radio, step, robot, other);
        let white = SIGMA_M * draws.normal();
        let [least, most] = DETOUR_M;
        let detour = draws.uniform(least, most);
        let is_detour = draws.happens(DETOURS);
        Some((1.0 + scale) * range + offset + white + if is_detour { detour } else { 0.0 })
    }

    fn range_to_robot(&mut self, step: usize, robot: usize, other: usize) -> Option<Measurement> {
        let truth = self.world.truth(step, other)?;
        let said = self.said(step, robot, other, [truth.x, truth.y])?;
        let belief = self.fleet.estimate(other)?.belief;
        let is_known = self.fleet.finding(other)?.state == FindingState::Ok;
        let block = belief
            .total()
            .matrix()
            .fixed_view::<2, 2>(0, 0)
            .into_owned();
        let place = Place {
            position: Vector2::new(belief.pose.x, belief.pose.y),
            covariance: block,
            moves: true,
        };
        let number = id(other).0;
        let (origin, reading) = self.reading(robot, number, said, is_known.then_some(place))?;
        Some(Measurement::Partial(PartialSighting {
            stamp: self.at(step),
            origin,
            observed: id(other),
            reading,
        }))
    }

    fn range_to_anchor(
        &mut self,
        step: usize,
        robot: usize,
        (index, position): (usize, [f64; 2]),
    ) -> Option<Measurement> {
        let said = self.said(step, robot, ROBOTS + index, position)?;
        let variance = ANCHOR_SIGMA_M * ANCHOR_SIGMA_M;
        let place = Place {
            position: position.into(),
            covariance: Matrix2::from_diagonal_element(variance),
            moves: false,
        };
        let number = anchor(index);
        let (origin, reading) = self.reading(robot, number, said, Some(place))?;
        Some(Measurement::Landmark(LandmarkSighting {
            stamp: self.at(step),
            origin,
            landmark: number,
            reading,
            position,
            covariance: Covariance2::diagonal([variance; 2]).ok()?,
        }))
    }

    /// As the driver publishes it; then it teaches.
    fn reading(
        &mut self,
        robot: usize,
        other: u16,
        said: f64,
        place: Option<Place>,
    ) -> Option<(Origin, Reading)> {
        let corrects = self.corrects;
        let member = &mut self.members[robot];
        let corrected = if corrects {
            member.ranging.corrected(other, said)?
        } else {
            Corrected {
                range_m: said,
                white: SIGMA_M * SIGMA_M,
                slow: 0.0,
            }
        };
        if let Some(place) = place {
            // What is refused teaches nothing; the estimator has a gate of its own.
            let _ = member.ranging.learn(other, said, Vector2::zeros(), &place);
        }
        member.sequence += 1;
        let slow = corrected.slow * corrected.range_m;
        let number = Alone::Range {
            range_m: corrected.range_m,
            variances: [corrected.white, slow * slow],
            mount: Pose::default(),
        };
        Some((Origin::counted(member.sequence), Reading::Alone(number)))
    }

    fn account(&mut self, step: usize) {
        for (robot, member) in self.members.iter_mut().enumerate() {
            let estimate = self.fleet.estimate(robot);
            let truth = self.world.truth(step, robot);
            if let Some((estimate, truth)) = estimate.zip(truth) {
                member.sums.push(&estimate.belief, &truth);
            }
        }
    }
}

fn anchor(index: usize) -> u16 {
    FIRST_ANCHOR + id(index).0
}

/// What came of a world.
#[derive(Clone, Debug, Default)]
struct Outcome {
    sums: [Sums; ROBOTS],
    /// Pairs with an anchor, pairs of robots.
    pairs: [Pairs; 2],
}

/// How well pairs were learned.
#[derive(Copy, Clone, Debug, Default)]
struct Pairs {
    squares: f64,
    beyond: f64,
    count: f64,
}

impl Pairs {
    fn push(&mut self, corrected: &Corrected) {
        let error = corrected.range_m - JUDGED_AT_M;
        let slow = corrected.slow * corrected.range_m;
        self.squares += error * error;
        self.beyond += f64::from(u8::from(error * error > CHI2_1_95 * slow * slow));
        self.count += 1.0;
    }

    fn plus(self, b: Self) -> Self {
        Self {
            squares: self.squares + b.squares,
            beyond: self.beyond + b.beyond,
            count: self.count + b.count,
        }
    }

    fn text(&self) -> String {
        let centimetres = 100.0 * (self.squares / self.count).sqrt();
        format!(
            "{centimetres:.1} cm, {} beyond",
            percent(self.beyond / self.count)
        )
    }
}

impl Outcome {
    fn plus(mut self, b: &Self) -> Self {
        for (sum, it) in self.sums.iter_mut().zip(&b.sums) {
            *sum = sum.plus(it);
        }
        for (pairs, it) in self.pairs.iter_mut().zip(&b.pairs) {
            *pairs = pairs.plus(*it);
        }
        self
    }
}

fn run(seed: u64, draw: u16, corrects: bool) -> Outcome {
    let chance = Noise::new(seed, draw);
    let world = Synthetic::new(&SyntheticConfig {
        robots: ROBOTS,
        seconds: SECONDS,
        seed,
        run: draw,
        floor_m: [40.0, 28.0],
        top_speed_mps: 0.8,
        noise: noise(&ROLLING),
        ..SyntheticConfig::default()
    });
    let mut team = Team::new(&world, &chance, corrects);
    for step in 1..world.steps() {
        team.step(step);
        team.account(step);
    }
    let mut outcome = Outcome::default();
    for (robot, member) in team.members.iter().enumerate() {
        outcome.sums[robot] = member.sums;
        let mut judge = |kind: usize, other: usize, number: u16| {
            let [scale, offset] = pair(&chance, robot, other);
            let said = offset + (1.0 + scale) * JUDGED_AT_M;
            if let Some(corrected) = member.ranging.corrected(number, said) {
                outcome.pairs[kind].push(&corrected);
            }
        };
        for index in (0..ANCHORS.len()).filter(|_| robot < REACHING) {
            judge(0, ROBOTS + index, anchor(index));
        }
        for other in (0..ROBOTS).filter(|it| *it != robot) {
            judge(1, other, id(other).0);
        }
    }
    outcome
}

/// Runs both rows.
#[must_use]
pub fn find(form: &Form) -> Finding {
    let mut table = Table::new([
        "ranges",
        "position RMS, m: three near anchors; two that reach none",
        "outside",
        "a range of 15 m at the end: anchors",
        "robots",
    ]);
    let mut missed = Vec::new();
    let rows = [
        ("as the radio says it, as if it were right", false),
        ("learned while they drive", true),
    ];
    for (name, corrects) in rows {
        let outcomes: Vec<Outcome> = (0..form.draws)
            .into_par_iter()
            .map(|draw| run(form.seed, draw, corrects))
            .collect();
        let all = outcomes.iter().fold(Outcome::default(), Outcome::plus);
        if corrects {
            judge(&all, &mut missed);
        }
        let near = all.sums[..REACHING]
            .iter()
            .fold(Sums::default(), Sums::plus);
        let far = all.sums[REACHING..]
            .iter()
            .fold(Sums::default(), Sums::plus);
        let outside = all.sums.iter().map(|it| percent(it.outside()));
        let pairs = all
            .pairs
            .map(|it| if corrects { it.text() } else { "–".into() });
        let [anchors, robots] = pairs;
        table.row([
            name.into(),
            format!("{}; {}", digits(near.rms_m()), digits(far.rms_m())),
            outside.collect::<Vec<_>>().join(", "),
            anchors,
            robots,
        ]);
    }
    Finding {
        title: "Five robots with two-way radios, each pair with a scale and an offset of its own"
            .into(),
        text: table.text(),
        missed,
    }
}

fn judge(all: &Outcome, missed: &mut Vec<String>) {
    for (robot, sums) in all.sums.iter().enumerate() {
        if sums.outside() > MOST_OUTSIDE {
            missed.push(format!(
                "R{}: {} outside",
                robot + 1,
                percent(sums.outside())
            ));
        }
    }
    for (pairs, name) in all.pairs.iter().zip(["anchors", "robots"]) {
        let beyond = pairs.beyond / pairs.count;
        if beyond > MOST_BEYOND {
            let share = percent(beyond);
            missed.push(format!("{share} of the pairs with {name} are beyond 95 %"));
        }
    }
}
