//! Five robots that tell one another what their cameras saw: who is seen, where it must be, and who sees, where the other believes to be.

mod method;

use coloc_estimator::angle::wrap;
use coloc_estimator::partial::{Alone, BodySighting, Reading, ReadingNoise};
use coloc_estimator::{
    Belief, Covariance2, Covariance3, FindingState, FoundSettings, LandmarkSighting, Measurement,
    Motion, OdometrySample, Origin, PartialSighting, Pose, PositionFix, SeenPart, Settings,
    SlowError, Span, Stamp, Start, TickInputs,
};
use nalgebra::Vector3;
use rayon::prelude::*;

use method::{Camera, METHODS, Method, Numbers, Ways};

use super::recorded::{Recorded, Sighting, Subject};
use super::{CHI2_3_95, FORWARD, Form, TURNING};
use crate::campaign::Finding;
use crate::fleet::{Fleet, Note, id};
use crate::honest::table::{Table, digits, percent};
use crate::random::{Noise, Purpose};
use crate::world::World;

/// How well the start is known \[m, rad\].
const START: [f64; 2] = [0.05, 2.0 * std::f64::consts::PI / 180.0];
/// Of a fix \[m\], and how many steps there are from one to the next.
const FIX_SIGMA_M: f64 = 0.1;
const FIX_EVERY: usize = 5;
/// Of a tube's place \[m\].
const LANDMARK_SIGMA_M: f64 = 0.01;

/// More than a row has of x and y is missed: of ten draws, and of fewer, which are up to 15 % off.
const ALLOWED: f64 = 1.10;
const ALLOWED_OF_FEW: f64 = 1.25;
const MANY: u16 = 10;
/// A robot is outside of its 95 % for no more of the time.
const MOST_OUTSIDE: f64 = 0.05;
/// Who finds its heading is not farther off than this, in its own σ.
const FARTHEST: f64 = 4.0;

/// Sums of one robot.
#[derive(Copy, Clone, Debug, Default)]
struct Sums {
    squares: [f64; 3],
    outside: f64,
    count: f64,
    /// Draws in which it never found its heading.
    lost: f64,
    /// When it had found it in all others \[s\], and how far off it was then at most, in its own σ.
    latest_s: f64,
    farthest: f64,
}

impl Sums {
    fn push(&mut self, belief: &Belief, truth: &Pose) {
        let Pose { x, y, phi } = belief.pose;
        let error = Vector3::new(x - truth.x, y - truth.y, wrap(phi - truth.phi));
        for (sum, error) in self.squares.iter_mut().zip(error.iter()) {
            *sum += error * error;
        }
        let nees = belief
            .total()
            .matrix()
            .cholesky()
            .map_or(f64::INFINITY, |root| error.dot(&root.solve(&error)));
        self.outside += f64::from(u8::from(nees > CHI2_3_95));
        self.count += 1.0;
    }

    fn plus(self, b: &Self) -> Self {
        Self {
            squares: std::array::from_fn(|i| self.squares[i] + b.squares[i]),
            outside: self.outside + b.outside,
            count: self.count + b.count,
            lost: self.lost + b.lost,
            latest_s: self.latest_s.max(b.latest_s),
            farthest: self.farthest.max(b.farthest),
        }
    }

    fn rms(&self) -> [f64; 3] {
        self.squares.map(|it| (it / self.count).sqrt())
    }
}

/// When a heading was found, and how far off that was, in its own σ.
#[derive(Copy, Clone, Debug)]
struct Found {
    time_s: f64,
    off: f64,
}

/// All of them in one draw: each with its estimator, as a daemon runs it.
struct Team<'a> {
    recorded: &'a Recorded,
    method: &'a Method,
    fleet: Fleet,
    /// What was told and answered in the step before.
    mail: Vec<Vec<Measurement>>,
    found: Vec<Option<Found>>,
}

/// History slots of a robot: a second of everything.
const SLOTS: usize = 512;

impl<'a> Team<'a> {
    fn new(recorded: &'a Recorded, method: &'a Method, noise: &Noise) -> Self {
        let world = &recorded.world;
        let [m, rad] = START;
        let starts = (0..world.robots()).map(|robot| {
            let truth = world.initial(robot).unwrap_or_default();
            let [x, y, phi] = noise.draws(Purpose::Start, 0, robot, 0).normals();
            let pose = Pose::new(truth.x + m * x, truth.y + m * y, truth.phi + rad * phi);
            let covariance = Covariance3::diagonal([m * m, m * m, rad * rad]).unwrap_or_default();
            if method.lost && robot >= method.receivers {
                let covariance = Covariance2::diagonal([m * m; 2]).unwrap_or_default();
                return (
                    Stamp::default(),
                    Start::Position([pose.x, pose.y], covariance),
                );
            }
            let belief = Belief::independent(pose, covariance);
            (Stamp::default(), Start::Known(belief))
        });
        let starts: Vec<_> = starts.collect();
        Self {
            recorded,
            method,
            mail: vec![Vec::new(); starts.len()],
            found: vec![None; starts.len()],
            fleet: Fleet::starting(settings(), &starts, SLOTS),
        }
    }

    /// Everybody's tick at the end of `step`, which saw `image` on its way: what is told is there at the next one.
    fn step(&mut self, step: usize, image: &[(u64, Sighting)], noise: &Noise) {
        let robots = self.mail.len();
        let delivered = std::mem::replace(&mut self.mail, vec![Vec::new(); robots]);
        for (robot, mut measurements) in delivered.into_iter().enumerate() {
            measurements.push(self.odometry(step, robot));
            let own = image.iter().filter(|(_, it)| it.observer == robot);
            measurements.extend(own.filter_map(|(number, it)| self.method.measured(*number, it)));
            measurements.extend(self.fix(step, robot, noise));
            let inputs = TickInputs {
                stamp: stamp(self.recorded, step),
                measurements: &measurements,
            };
            let (mail, method) = (&mut self.mail, self.method);
            let mut pass = |note: Note| {
                mail[note.to].push(method.delivered(note.word));
            };
            self.fleet
                .tick_with(robot, &inputs, &mut |_| (), &mut pass, &mut |_| ());
        }
    }

    /// What drove it in the step before.
    fn odometry(&self, step: usize, robot: usize) -> Measurement {
        let velocity = self.recorded.world.odometry(step - 1, robot);
        let [v, _] = velocity;
        let noise = Covariance2::diagonal([FORWARD * v * v, TURNING]);
        Measurement::Odometry(OdometrySample {
            source: 0,
            start: stamp(self.recorded, step - 1),
            stamp: stamp(self.recorded, step),
            motion: Motion::Nonholonomic {
                velocity,
                noise: noise.unwrap_or_default(),
            },
        })
    }

    fn fix(&self, step: usize, robot: usize, noise: &Noise) -> Option<Measurement> {
        let is_due = robot < self.method.receivers && step.is_multiple_of(FIX_EVERY);
        let truth = self.recorded.world.truth(step, robot).filter(|_| is_due)?;
        let [x, y] = noise.draws(Purpose::Fix, step, robot, 0).normals();
        let variance = FIX_SIGMA_M * FIX_SIGMA_M;
        Some(Measurement::Fix(PositionFix {
            stamp: stamp(self.recorded, step),
            origin: Origin::counted(step as u64),
            position: [truth.x + FIX_SIGMA_M * x, truth.y + FIX_SIGMA_M * y],
            covariance: Covariance2::diagonal([variance; 2]).unwrap_or_default(),
            lever: [0.0; 2],
            slow: SlowError::default(),
        }))
    }

    /// The errors of the step, of those that know where they are.
    fn account(&mut self, step: usize, sums: &mut [Sums]) {
        for (robot, sum) in sums.iter_mut().enumerate() {
            let (Some(estimate), Some(finding)) =
                (self.fleet.estimate(robot), self.fleet.finding(robot))
            else {
                continue;
            };
            let Some(truth) = self.recorded.world.truth(step, robot) else {
                continue;
            };
            let is_found = finding.state == FindingState::Ok;
            if is_found && self.found[robot].is_none() {
                self.found[robot] = Some(found(self.recorded, step, &estimate.belief, &truth));
            }
            if self.found[robot].is_some() {
                sum.push(&estimate.belief, &truth);
            }
        }
    }

    /// Who found its heading, and when.
    fn tell_found(&self, sums: &mut [Sums]) {
        for (found, sum) in self.found.iter().zip(sums) {
            sum.lost = f64::from(u8::from(found.is_none()));
            if let Some(Found { time_s, off }) = found {
                (sum.latest_s, sum.farthest) = (*time_s, *off);
            }
        }
    }
}

/// Of robots that take part, all others as by default.
fn settings() -> Settings {
    Settings {
        found: FoundSettings::default().among_others(),
        ..Settings::default()
    }
}

fn stamp(recorded: &Recorded, step: usize) -> Stamp {
    let world = &recorded.world;
    Stamp::default() + Span::from_seconds(world.time_s(step) - world.start_s())
}

fn found(recorded: &Recorded, step: usize, belief: &Belief, truth: &Pose) -> Found {
    let sigma = belief.total().variances()[2].sqrt();
    Found {
        time_s: (stamp(recorded, step) - Stamp::default()).as_seconds(),
        off: wrap(belief.pose.phi - truth.phi).abs() / sigma,
    }
}

impl Method {
    fn uses(&self, sighting: &Sighting) -> bool {
        match sighting.subject {
            Subject::Robot(_) => self.ways != Ways::None,
            Subject::Landmark(_) => self.landmarks,
        }
    }

    /// As the estimator takes it.
    fn measured(&self, number: u64, sighting: &Sighting) -> Option<Measurement> {
        let stamp = Stamp::default() + Span::from_seconds(sighting.time_s);
        let (origin, reading) = (Origin::counted(number), self.reading(sighting));
        match sighting.subject {
            Subject::Robot(seen) => Some(Measurement::Partial(PartialSighting {
                stamp,
                origin,
                observed: id(seen),
                reading,
            })),
            Subject::Landmark(position) => {
                let variance = LANDMARK_SIGMA_M * LANDMARK_SIGMA_M;
                Some(Measurement::Landmark(LandmarkSighting {
                    stamp,
                    origin,
                    landmark: 0,
                    reading,
                    position,
                    covariance: Covariance2::diagonal([variance; 2]).ok()?,
                }))
            }
        }
    }

    /// What reaches the other robot.
    fn delivered(&self, word: Measurement) -> Measurement {
        match word {
            Measurement::Seen(seen) => Measurement::Seen(SeenPart {
                asks: self.ways == Ways::Both,
                ..seen
            }),
            other => other,
        }
    }

    fn reading(&self, sighting: &Sighting) -> Reading {
        match self.alone(sighting) {
            Some(number) => Reading::Alone(number),
            None => Reading::Place(self.body(sighting)),
        }
    }

    /// Variances of range and bearing, white and slow.
    fn variances(&self, range_m: f64) -> [[f64; 2]; 2] {
        let Camera {
            relative,
            beside_m,
            bearing,
            slow: [scale, turn],
        } = self.camera;
        let (along, slow) = (relative * range_m, scale * range_m);
        [
            [along * along + beside_m * beside_m, slow * slow],
            [bearing * bearing, turn * turn],
        ]
    }

    /// The number that is used alone, if one is.
    fn alone(&self, sighting: &Sighting) -> Option<Alone> {
        let [range, bearing] = self.variances(sighting.range_m);
        let mount = Pose::default();
        match self.numbers {
            Numbers::Both => None,
            Numbers::Bearing => Some(Alone::Bearing {
                bearing_rad: sighting.bearing_rad,
                variances: bearing,
                mount,
            }),
            Numbers::Range => Some(Alone::Range {
                range_m: sighting.range_m,
                variances: range,
                mount,
            }),
        }
    }

    fn body(&self, sighting: &Sighting) -> BodySighting {
        let [[range, _], [bearing, _]] = self.variances(sighting.range_m);
        let noise = ReadingNoise {
            white: [range, bearing],
            slow: self.camera.slow,
        };
        BodySighting::of(
            sighting.range_m,
            sighting.bearing_rad,
            &Pose::default(),
            &noise,
        )
    }
}

/// A whole draw: sums of each robot.
fn run(recorded: &Recorded, method: &Method, seed: u64, draw: u16) -> Vec<Sums> {
    let noise = Noise::new(seed, draw);
    let mut team = Team::new(recorded, method, &noise);
    let mut sums = vec![Sums::default(); recorded.world.robots()];
    let numbered = (0..).zip(recorded.sightings.iter().copied());
    let used: Vec<(u64, Sighting)> = numbered.filter(|(_, it)| method.uses(it)).collect();
    let mut rest = used.as_slice();
    team.account(0, &mut sums);
    for step in 1..recorded.steps {
        let now_s = recorded.world.time_s(step) - recorded.world.start_s();
        let come = rest.iter().take_while(|(_, it)| it.time_s <= now_s).count();
        let (image, later) = rest.split_at(come);
        team.step(step, image, &noise);
        team.account(step, &mut sums);
        rest = later;
    }
    team.tell_found(&mut sums);
    sums
}

/// Runs all rows.
#[must_use]
pub fn find(form: &Form) -> Finding {
    let title = "Sightings of one another, used both ways (MR.CLAM, the robots' own cameras)";
    let recordings = match form.recordings(title) {
        Ok(recordings) => recordings,
        Err(finding) => return finding,
    };
    let mut table = Table::new([
        "recording",
        "method",
        "x/y of those without a receiver, cm",
        "φ, rad",
        "outside, R1…R5",
        "all found by, s",
    ]);
    let mut missed = Vec::new();
    let allowed = if form.draws < MANY {
        ALLOWED_OF_FEW
    } else {
        ALLOWED
    };
    for (index, recorded) in recordings.iter().enumerate() {
        for method in &METHODS {
            let draws: Vec<Vec<Sums>> = (0..form.draws)
                .into_par_iter()
                .map(|draw| run(recorded, method, form.seed, draw))
                .collect();
            let sums = summed(&draws);
            judge(recorded, method, (index, allowed), &sums, &mut missed);
            table.row(row(recorded, method, &sums));
        }
    }
    Finding {
        title: title.into(),
        text: table.text(),
        missed,
    }
}

fn summed(draws: &[Vec<Sums>]) -> Vec<Sums> {
    let mut all = vec![Sums::default(); draws.first().map_or(0, Vec::len)];
    for draw in draws {
        for (sum, it) in all.iter_mut().zip(draw) {
            *sum = sum.plus(it);
        }
    }
    all
}

fn judge(
    recorded: &Recorded,
    method: &Method,
    (index, allowed): (usize, f64),
    sums: &[Sums],
    missed: &mut Vec<String>,
) {
    let reference = method.reference[index];
    if reference.is_empty() {
        return;
    }
    for (robot, sum) in sums.iter().enumerate() {
        let outside = sum.outside / sum.count;
        let name = format!(
            "recording {}, {}, R{}",
            recorded.number,
            method.name,
            robot + 1
        );
        if sum.lost > 0.0 || sum.farthest > FARTHEST {
            let (lost, off) = (sum.lost, sum.farthest);
            missed.push(format!(
                "{name}: lost in {lost} draws, found {off:.1} σ off at most"
            ));
        }
        if outside > MOST_OUTSIDE {
            missed.push(format!("{name}: outside {}", percent(outside)));
        }
    }
    for (robot, (sum, known)) in sums
        .iter()
        .skip(method.receivers)
        .zip(reference)
        .enumerate()
    {
        let [x, y, _] = sum.rms().map(|it| 100.0 * it);
        if x > allowed * known[0] || y > allowed * known[1] {
            let robot = method.receivers + robot + 1;
            let name = format!("recording {}, {}, R{robot}", recorded.number, method.name);
            missed.push(format!(
                "{name}: {x:.1}/{y:.1} cm for {}/{}",
                known[0], known[1]
            ));
        }
    }
}

fn row(recorded: &Recorded, method: &Method, sums: &[Sums]) -> [String; 6] {
    let (mut positions, mut headings, mut outside) = (Vec::new(), Vec::new(), Vec::new());
    for sum in sums.iter().skip(method.receivers) {
        let [x, y, phi] = sum.rms();
        positions.push(format!("{:.1}/{:.1}", 100.0 * x, 100.0 * y));
        headings.push(digits(phi));
    }
    for sum in sums {
        outside.push(format!("{:.1}", 100.0 * sum.outside / sum.count));
    }
    let latest_s = sums.iter().fold(0.0, |latest, it| it.latest_s.max(latest));
    let found = if method.lost {
        format!("{latest_s:.0}")
    } else {
        "–".into()
    };
    [
        recorded.number.to_string(),
        method.name.into(),
        positions.join(", "),
        headings.join(" "),
        outside.join(" "),
        found,
    ]
}
