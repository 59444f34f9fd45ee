//! Five robots that tell one another what their cameras saw: who is seen, where it must be, and who sees, where the other believes to be.

mod method;

use coloc_estimator::angle::wrap;
use coloc_estimator::partial::{
    Alone, BodySighting, Innovation, PositionSettings, ReadingNoise, SplitPosition, fuse, observed,
    observed_alone, tell, tell_alone, told,
};
use coloc_estimator::{
    Belief, Covariance2, Covariance3, Motion, Pace, Pose, Propagation, Span, Stamp, fix, gate,
    propagate,
};
use nalgebra::Vector3;
use rayon::prelude::*;

use method::{Camera, METHODS, Method, Numbers, Ways};

use super::lost::Lost;
use super::recorded::{Recorded, Sighting, Subject};
use super::tracks::rate;
use super::{CHI2_3_95, FORWARD, Form, REFERENCE_S, TURNING};
use crate::campaign::Finding;
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

/// One robot as it believes to be, up to a moment.
#[derive(Clone)]
struct Robot {
    belief: Belief,
    /// Who does not know which way it looks has no belief.
    lost: Option<Lost>,
    found: Option<Found>,
    pace: Pace,
    time_s: f64,
}

/// All of them in one draw.
struct Team<'a> {
    recorded: &'a Recorded,
    method: &'a Method,
    robots: Vec<Robot>,
}

impl<'a> Team<'a> {
    fn new(recorded: &'a Recorded, method: &'a Method, noise: &Noise) -> Self {
        let world = &recorded.world;
        let [m, rad] = START;
        let robots = (0..world.robots()).map(|robot| {
            let truth = world.initial(robot).unwrap_or_default();
            let [x, y, phi] = noise.draws(Purpose::Start, 0, robot, 0).normals();
            let pose = Pose::new(truth.x + m * x, truth.y + m * y, truth.phi + rad * phi);
            let covariance = Covariance3::diagonal([m * m, m * m, rad * rad]).unwrap_or_default();
            let is_lost = method.lost && robot >= method.receivers;
            Robot {
                belief: Belief::independent(pose, covariance),
                lost: is_lost.then(|| Lost::near(&pose, m * m)),
                found: None,
                pace: Pace::beginning(Stamp::default()).met(),
                time_s: 0.0,
            }
        });
        Self {
            recorded,
            method,
            robots: robots.collect(),
        }
    }

    /// All of them are predicted to this moment, in the step that leads there.
    fn pass(&mut self, time_s: f64, step: usize) {
        for (number, robot) in self.robots.iter_mut().enumerate() {
            let dt_s = time_s - robot.time_s;
            if dt_s <= 0.0 {
                continue;
            }
            let velocity = self.recorded.world.odometry(step, number);
            let [v, _] = velocity;
            let share = REFERENCE_S / dt_s;
            let noise = Covariance2::diagonal([FORWARD * v * v * share, TURNING * share]);
            let motion = Motion::Nonholonomic {
                velocity,
                noise: noise.unwrap_or_default(),
            };
            robot.belief = propagate(&robot.belief, &motion, dt_s, Propagation::Honest);
            if let Some(lost) = &mut robot.lost {
                lost.pass(&rate(velocity).over(dt_s));
            }
            robot.time_s = time_s;
        }
    }

    /// Of one moment: all that is sent is of before it.
    fn exchange(&mut self, image: &[Sighting], step: usize) {
        let before = self.robots.clone();
        for (number, robot) in self.robots.iter_mut().enumerate() {
            let seen = |it: &&Sighting| it.subject == Subject::Robot(number);
            let mut heard = false;
            for sighting in in_order(image.iter().filter(seen).filter(|_| self.method.is_told())) {
                self.method
                    .tell(robot, sighting, &before[sighting.observer]);
                heard = true;
            }
            let own = |it: &&Sighting| it.observer == number;
            for sighting in in_order(image.iter().filter(own)) {
                if let Some(answer) = self.method.answer(sighting, &before) {
                    self.method.answered(robot, sighting, &answer);
                    heard = true;
                }
            }
            let sent = image
                .iter()
                .any(|it| self.method.uses(it) && it.involves(number));
            if heard || sent {
                robot.belief.make_dependent();
            }
            let truth = self.recorded.world.truth(step, number);
            robot.look(truth.map(|it| it.phi));
        }
    }

    /// Fixes of the step's moment, and the errors.
    fn account(&mut self, step: usize, noise: &Noise, sums: &mut [Sums]) {
        for (number, robot) in self.robots.iter_mut().enumerate() {
            let Some(truth) = self.recorded.world.truth(step, number) else {
                continue;
            };
            if number < self.method.receivers && step.is_multiple_of(FIX_EVERY) {
                let [x, y] = noise.draws(Purpose::Fix, step, number, 0).normals();
                let at = [truth.x + FIX_SIGMA_M * x, truth.y + FIX_SIGMA_M * y];
                let variance = FIX_SIGMA_M * FIX_SIGMA_M;
                let covariance = Covariance2::diagonal([variance; 2]).unwrap_or_default();
                robot.belief = fix::update(&robot.belief, at, &covariance, gate::CHI2_2_99).belief;
            }
            if robot.lost.is_none() {
                sums[number].push(&robot.belief, &truth);
            }
        }
    }
}

impl Team<'_> {
    /// Who found its heading, and when.
    fn tell_found(&self, sums: &mut [Sums]) {
        for (robot, sum) in self.robots.iter().zip(sums) {
            sum.lost = f64::from(u8::from(robot.lost.is_some()));
            if let Some(Found { time_s, off }) = robot.found {
                (sum.latest_s, sum.farthest) = (time_s, off);
            }
        }
    }
}

impl Sighting {
    fn involves(&self, robot: usize) -> bool {
        self.observer == robot || self.subject == Subject::Robot(robot)
    }

    /// In which order those of one moment act.
    fn rank(&self) -> (usize, usize) {
        let seen = match self.subject {
            Subject::Robot(number) => number,
            Subject::Landmark(_) => usize::MAX,
        };
        (self.observer, seen)
    }
}

fn in_order<'a>(sightings: impl Iterator<Item = &'a Sighting>) -> Vec<&'a Sighting> {
    let mut all: Vec<_> = sightings.collect();
    all.sort_by_key(|it| it.rank());
    all
}

impl Method {
    fn is_told(&self) -> bool {
        self.ways != Ways::None
    }

    fn uses(&self, sighting: &Sighting) -> bool {
        match sighting.subject {
            Subject::Robot(_) => self.is_told(),
            Subject::Landmark(_) => self.landmarks,
        }
    }

    fn tell(&self, robot: &mut Robot, sighting: &Sighting, observer: &Robot) {
        match self.alone(sighting) {
            Some(number) => {
                if let Some(innovation) = tell_alone(&observer.belief, &number, &robot.belief) {
                    robot.hear(&innovation);
                }
            }
            None => robot.hear_told(&observer.tells(&self.body(sighting))),
        }
    }

    fn answered(&self, robot: &mut Robot, sighting: &Sighting, answer: &SplitPosition) {
        match self.alone(sighting) {
            Some(number) => {
                if let Some(innovation) = observed_alone(&robot.belief, &number, answer) {
                    robot.hear(&innovation);
                }
            }
            None => robot.hear_answer(&self.body(sighting), answer),
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

    fn answer(&self, sighting: &Sighting, before: &[Robot]) -> Option<SplitPosition> {
        match sighting.subject {
            Subject::Robot(number) => (self.ways == Ways::Both).then(|| before[number].answers()),
            Subject::Landmark(position) => {
                let variance = LANDMARK_SIGMA_M * LANDMARK_SIGMA_M;
                let covariance = Covariance2::diagonal([variance; 2]).ok()?;
                self.landmarks
                    .then(|| SplitPosition::known(position, covariance))
            }
        }
    }
}

impl Robot {
    fn tells(&self, body: &BodySighting) -> SplitPosition {
        match &self.lost {
            Some(lost) => lost.tell(body),
            None => tell(&self.belief, body),
        }
    }

    fn answers(&self) -> SplitPosition {
        match &self.lost {
            Some(lost) => lost.answer(),
            None => SplitPosition::of(&self.belief),
        }
    }

    fn hear_told(&mut self, said: &SplitPosition) {
        match &mut self.lost {
            Some(lost) => lost.told(said),
            None => self.hear(&told(&self.belief, said)),
        }
    }

    fn hear_answer(&mut self, body: &BodySighting, answer: &SplitPosition) {
        match &mut self.lost {
            Some(lost) => lost.answered(body, answer),
            None => self.hear(&observed(&self.belief, body, answer)),
        }
    }

    /// Whether it knows by now which way it looks, which is truly `heading`.
    fn look(&mut self, heading: Option<f64>) {
        let Some(belief) = self.lost.as_ref().and_then(Lost::found) else {
            return;
        };
        (self.belief, self.lost) = (belief, None);
        let sigma = belief.total().variances()[2].sqrt();
        let off = heading.map_or(0.0, |it| wrap(belief.pose.phi - it).abs() / sigma);
        let time_s = self.time_s;
        self.found = Some(Found { time_s, off });
    }

    fn hear(&mut self, innovation: &Innovation) {
        self.pace = self
            .pace
            .heard(Stamp::default() + Span::from_seconds(self.time_s));
        let settings = PositionSettings::default().damped(&self.pace);
        self.belief = fuse(&self.belief, innovation, &settings).belief;
    }
}

/// A whole draw: sums of each robot.
fn run(recorded: &Recorded, method: &Method, seed: u64, draw: u16) -> Vec<Sums> {
    let noise = Noise::new(seed, draw);
    let mut team = Team::new(recorded, method, &noise);
    let mut sums = vec![Sums::default(); team.robots.len()];
    let mut rest: Vec<Sighting> = recorded.sightings.clone();
    rest.retain(|it| method.uses(it));
    let mut rest = rest.as_slice();
    team.account(0, &noise, &mut sums);
    for step in 1..recorded.steps {
        let world = &recorded.world;
        let now_s = world.time_s(step) - world.start_s();
        while let Some(first) = rest.first().filter(|it| it.time_s <= now_s) {
            let same = rest
                .iter()
                .take_while(|it| it.time_s.total_cmp(&first.time_s).is_eq())
                .count();
            let (image, later) = rest.split_at(same);
            team.pass(first.time_s, step - 1);
            team.exchange(image, step);
            rest = later;
        }
        team.pass(now_s, step - 1);
        team.account(step, &noise, &mut sums);
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
