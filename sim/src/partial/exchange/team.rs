//! A team in a draw: each robot with its estimator, as a daemon runs it, and what its camera saw.

use coloc_estimator::angle::wrap;
use coloc_estimator::partial::{Alone, BodySighting, Reading, ReadingNoise};
use coloc_estimator::{
    Belief, Covariance2, Covariance3, FindingState, FoundSettings, LandmarkSighting, Measurement,
    Motion, OdometrySample, Origin, PartialSighting, Pose, PositionFix, SeenPart, Settings,
    Sighting as FullSighting, SlowError, Span, Stamp, Start, TickInputs, TrackPose,
};
use coloc_track::State;
use nalgebra::{Matrix2, Matrix3, Vector3};

use super::super::recorded::{Recorded, Sighting, Subject};
use super::super::{CHI2_3_95, FORWARD, TURNING};
use super::feed::Feeds;
use super::method::{Camera, Method, Numbers, Ways};
use crate::fleet::{Fleet, Letter, Note, id};
use crate::random::{Noise, Purpose};
use crate::world::World;

/// How well the start is known \[m, rad\].
const START: [f64; 2] = [0.05, 2.0 * std::f64::consts::PI / 180.0];
/// Of a fix \[m\], and how many steps there are from one to the next.
const FIX_SIGMA_M: f64 = 0.1;
const FIX_EVERY: usize = 5;
/// Of a tube's place \[m\].
const LANDMARK_SIGMA_M: f64 = 0.01;

/// Sums of one robot.
#[derive(Copy, Clone, Debug, Default)]
pub(super) struct Sums {
    squares: [f64; 3],
    pub(super) outside: f64,
    pub(super) count: f64,
    /// Draws in which it never found its heading.
    pub(super) lost: f64,
    /// When it had found it in all others \[s\], and how far off it was then at most, in its own σ.
    pub(super) latest_s: f64,
    pub(super) farthest: f64,
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

    pub(super) fn plus(self, b: &Self) -> Self {
        Self {
            squares: std::array::from_fn(|i| self.squares[i] + b.squares[i]),
            outside: self.outside + b.outside,
            count: self.count + b.count,
            lost: self.lost + b.lost,
            latest_s: self.latest_s.max(b.latest_s),
            farthest: self.farthest.max(b.farthest),
        }
    }

    pub(super) fn rms(&self) -> [f64; 3] {
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
    /// What feeds the exchange in the place of sightings, if anything.
    feeds: Option<Feeds>,
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
            feeds: method.tracks.then(|| Feeds::new(starts.len(), method)),
            fleet: Fleet::starting(settings(), &starts, SLOTS),
        }
    }

    /// Everybody's tick at the end of `step`, which saw `image` on its way: what is told is there at the next one.
    fn step(&mut self, step: usize, image: &[Look], noise: &Noise) {
        let robots = self.mail.len();
        let delivered = std::mem::replace(&mut self.mail, vec![Vec::new(); robots]);
        for (robot, mut measurements) in delivered.into_iter().enumerate() {
            measurements.push(self.odometry(step, robot));
            measurements.extend(self.seen(step, robot, image));
            measurements.extend(self.fix(step, robot, noise));
            let inputs = TickInputs {
                stamp: stamp(self.recorded, step),
                measurements: &measurements,
            };
            let (mut poses, mut notes) = (Vec::new(), Vec::new());
            let (mut post, mut pass) = (|it| poses.push(it), |it| notes.push(it));
            self.fleet
                .tick_with(robot, &inputs, &mut post, &mut pass, &mut |_| ());
            for Note { to, word } in notes {
                self.mail[to].push(self.method.delivered(word));
            }
            for Letter { to, pose } in poses {
                self.mail[to].push(Measurement::Neighbour(pose));
            }
        }
    }

    /// What its own sensors say: sightings, or poses of tracks in their place.
    fn seen(&mut self, step: usize, robot: usize, image: &[Look]) -> Vec<Measurement> {
        let method = self.method;
        let own = image.iter().filter(|it| it.sighting.observer == robot);
        let Some(feeds) = &mut self.feeds else {
            return own.filter_map(|it| method.measured(it)).collect();
        };
        let poses = feeds.step(self.recorded, (step, robot), (method, image));
        let fed = own.zip(poses).filter_map(|(look, pose)| match pose {
            Some(state) => tracked(look, &state),
            None => method.measured(look),
        });
        fed.collect()
    }

    /// What drove it in the step before.
    fn odometry(&self, step: usize, robot: usize) -> Measurement {
        let [said, turn] = self.recorded.world.odometry(step - 1, robot);
        let v = said * of_recording(&self.method.idea.ways, self.recorded, robot).unwrap_or(1.0);
        let velocity = [v, turn];
        let turning = TURNING * self.method.idea.turning;
        let noise = Covariance2::diagonal([FORWARD * v * v, turning]);
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

/// Of a robot in a recording that is known.
fn of_recording(known: &[[f64; 5]; 2], recorded: &Recorded, robot: usize) -> Option<f64> {
    let recording = usize::from(recorded.number? != 1);
    known[recording].get(robot).copied()
}

pub(super) fn stamp(recorded: &Recorded, step: usize) -> Stamp {
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

/// When a sighting is of.
pub(super) fn stamp_of(look: &Look) -> Stamp {
    Stamp::default() + Span::from_seconds(look.sighting.time_s)
}

/// Where who was seen is by its track.
fn tracked(look: &Look, state: &State) -> Option<Measurement> {
    let Subject::Robot(seen) = look.sighting.subject else {
        return None;
    };
    let ([x, y, phi], covariance) = state.relative_pose();
    Some(Measurement::Track(TrackPose(FullSighting {
        stamp: stamp_of(look),
        origin: Origin::counted(look.number),
        observed: id(seen),
        relative: Pose::new(x, y, phi),
        covariance: Covariance3::new(covariance).ok()?,
    })))
}

/// As far off as a heading can be, and more.
const ANY_HEADING: f64 = 1e4;

/// Of a place, as that of a pose.
fn with_any_heading(place: Matrix2<f64>) -> Option<Covariance3> {
    let mut matrix = Matrix3::from_diagonal_element(ANY_HEADING);
    matrix.fixed_view_mut::<2, 2>(0, 0).copy_from(&place);
    Covariance3::new(matrix).ok()
}

impl Method {
    fn uses(&self, sighting: &Sighting) -> bool {
        match sighting.subject {
            Subject::Robot(_) => self.ways != Ways::None,
            Subject::Landmark(_) => self.landmarks,
        }
    }

    /// As the estimator takes it.
    fn measured(&self, look: &Look) -> Option<Measurement> {
        let sighting = &look.sighting;
        let stamp = stamp_of(look);
        let (origin, reading) = (Origin::counted(look.number), self.reading(look));
        match sighting.subject {
            Subject::Robot(seen) if self.ways == Ways::Poses => {
                let BodySighting { at, white, slow } = self.body(look);
                let pose = Pose::new(at[0], at[1], 0.0);
                let covariance = with_any_heading(white.matrix() + slow.matrix())?;
                Some(Measurement::Sighting(FullSighting {
                    stamp,
                    origin,
                    observed: id(seen),
                    relative: pose,
                    covariance,
                }))
            }
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

    fn reading(&self, look: &Look) -> Reading {
        match self.alone(&look.sighting) {
            Some(number) => Reading::Alone(number),
            None => Reading::Place(self.body(look)),
        }
    }

    /// Variances of range and bearing, white and slow.
    pub(super) fn variances(&self, range_m: f64) -> [[f64; 2]; 2] {
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

    fn body(&self, look: &Look) -> BodySighting {
        let sighting = &look.sighting;
        let new = 1.0 - look.kept * look.kept;
        let [[range, scale], [bearing, turn]] = self.variances(sighting.range_m);
        let noise = ReadingNoise {
            white: [range + new * scale, bearing + new * turn],
            slow: self.camera.slow.map(|it| look.kept * it),
        };
        BodySighting::of(
            sighting.range_m,
            sighting.bearing_rad,
            &Pose::default(),
            &noise,
        )
    }

    /// All that is used, in its order, with what the idea makes of it.
    fn looks(&self, recorded: &Recorded) -> Vec<Look> {
        let turned_rad =
            |observer| of_recording(&self.idea.turned_rad, recorded, observer).unwrap_or_default();
        let mut before_s = vec![f64::NEG_INFINITY; recorded.world.robots()];
        let numbered = (0..).zip(&recorded.sightings);
        let used = numbered.filter(|(_, it)| self.uses(it));
        used.filter_map(|(number, it)| {
            let before_s = &mut before_s[it.observer];
            let gap_s = it.time_s - *before_s;
            *before_s = it.time_s;
            let sighting = Sighting {
                time_s: it.time_s + self.idea.later_s,
                bearing_rad: it.bearing_rad - turned_rad(it.observer),
                ..*it
            };
            let look = Look {
                number,
                kept: self.kept(gap_s),
                sighting,
            };
            (sighting.time_s >= 0.0).then_some(look)
        })
        .collect()
    }

    /// The part of a slow error that is still there after so long.
    fn kept(&self, gap_s: f64) -> f64 {
        if self.idea.forgets_s.is_finite() {
            (-gap_s / self.idea.forgets_s).exp()
        } else {
            1.0
        }
    }
}

/// A sighting as it is used.
#[derive(Copy, Clone, Debug)]
pub(super) struct Look {
    pub(super) number: u64,
    /// Of the slow errors, what was in the camera's image before.
    kept: f64,
    pub(super) sighting: Sighting,
}

/// Steps after which somebody is told.
pub(super) const PROGRESS_EVERY: usize = 500;

/// All chance of a draw, how many steps it has, and who is told of every [`PROGRESS_EVERY`] that are done.
pub(super) struct Draw<'a> {
    pub(super) noise: Noise,
    pub(super) steps: usize,
    pub(super) done: &'a (dyn Fn(u64) + Sync),
}

impl Draw<'_> {
    /// Sums of each robot.
    pub(super) fn run(&self, recorded: &Recorded, method: &Method) -> Vec<Sums> {
        let mut team = Team::new(recorded, method, &self.noise);
        let mut sums = vec![Sums::default(); recorded.world.robots()];
        let looks = method.looks(recorded);
        let mut rest = looks.as_slice();
        team.account(0, &mut sums);
        for step in 1..self.steps {
            let now_s = recorded.world.time_s(step) - recorded.world.start_s();
            let come = rest
                .iter()
                .take_while(|it| it.sighting.time_s <= now_s)
                .count();
            let (image, later) = rest.split_at(come);
            team.step(step, image, &self.noise);
            team.account(step, &mut sums);
            rest = later;
            if step.is_multiple_of(PROGRESS_EVERY) {
                (self.done)(1);
            }
        }
        team.tell_found(&mut sums);
        sums
    }
}

/// The sums of all draws.
pub(super) fn summed(draws: &[Vec<Sums>]) -> Vec<Sums> {
    let mut all = vec![Sums::default(); draws.first().map_or(0, Vec::len)];
    for draw in draws {
        for (sum, it) in all.iter_mut().zip(draw) {
            *sum = sum.plus(it);
        }
    }
    all
}
