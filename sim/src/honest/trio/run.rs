//! One run of one team with one filter.

use std::f64::consts::TAU;

use coloc_estimator::angle::wrap;
use coloc_estimator::noise::{OdometryNoise, Variance};
use coloc_estimator::{Belief, Covariance2, Covariance3, Pose, Propagation, Settings};

use super::life::Life;
use crate::honest::increment::{Increment, Place};
use crate::honest::score::{Score, nees};
use crate::honest::turning::{FASTEST, STRETCH_S, Turning};
use crate::method::rule::Rule;
use crate::method::team::Team;
use crate::method::{FilterSettings, Method};
use crate::random::{Noise, Purpose};
use crate::sensors::{Fix, Sighting, StepInputs, relative};

const ROBOTS: usize = 3;
pub(super) const RATE_HZ: u32 = 10;
pub(super) const SECONDS: u32 = 600;
const APART_M: f64 = 5.0;

/// Of x and y at the start \[m\].
const START_M: f64 = 0.1;

/// Of a sighting \[m, m, rad\], and of a fix \[m\].
const SIGHTING: [f64; 3] = [0.1, 0.1, 0.017_453_292_519_943_295];
const FIX_M: f64 = 0.1;

/// What came of it.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub(super) struct Outcome {
    pub(super) score: Score,
    pub(super) squares: f64,
    pub(super) count: f64,
}

impl Outcome {
    pub(super) fn merge(&mut self, other: &Self) {
        self.score.merge(&other.score);
        self.squares += other.squares;
        self.count += other.count;
    }

    pub(super) fn rms_m(&self) -> f64 {
        (self.squares / self.count).sqrt()
    }
}

/// One run of one team with one filter.
pub(super) struct Run {
    life: Life,
    noise: Noise,
    places: [Place; ROBOTS],
    team: Team,
}

impl Run {
    pub(super) fn new(life: Life, noise: Noise, propagation: Propagation) -> Self {
        let sigma = [START_M, START_M, life.heading];
        let covariance = Covariance3::diagonal(sigma.map(|it| it * it)).unwrap_or_default();
        let beginnings = [0, 1, 2].map(|robot| beginning(&noise, robot, sigma));
        let beliefs = beginnings.map(|(believed, _)| Belief::independent(believed, covariance));
        let settings = settings(life, propagation);
        let rule = Rule::Split(settings.product.fusion);
        Self {
            life,
            noise,
            places: beginnings.map(|(_, place)| place),
            team: Team::new(rule, settings, &beliefs),
        }
    }

    pub(super) fn live(mut self) -> Outcome {
        let mut outcome = Outcome::default();
        let mut wanted = [0.0; ROBOTS];
        for tick in 1..=SECONDS * RATE_HZ {
            if (tick - 1).is_multiple_of(STRETCH_S * RATE_HZ) {
                let stretch = (tick - 1) / (STRETCH_S * RATE_HZ);
                wanted =
                    [0, 1, 2].map(|it| Turning::Random.rate(&self.noise, stretch as usize, it));
            }
            let rates = self.steered(wanted);
            self.drive(tick, &rates);
            let inputs = self.inputs(tick, &rates);
            self.team.step(&inputs, &mut |_| ());
            if tick.is_multiple_of(RATE_HZ) {
                self.look(&mut outcome);
            }
        }
        outcome
    }

    /// What a robot does that is not to leave.
    fn steered(&self, wanted: [f64; ROBOTS]) -> [f64; ROBOTS] {
        std::array::from_fn(|robot| steered(wanted[robot], &self.places[robot], self.life.floor_m))
    }

    fn drive(&mut self, tick: u32, rates: &[f64; ROBOTS]) {
        let dt_s = 1.0 / f64::from(RATE_HZ);
        let variances = self.life.sort.per_second().map(|it| it * dt_s);
        for (robot, (place, rate)) in self.places.iter_mut().zip(rates).enumerate() {
            let mut draws = self.noise.draws(Purpose::TrueWay, tick as usize, robot, 0);
            Increment::new([dt_s, 0.0, rate * dt_s], variances).drive(place, &mut draws);
        }
    }

    fn inputs(&self, tick: u32, rates: &[f64; ROBOTS]) -> StepInputs {
        let step = tick as usize;
        let mut inputs = StepInputs {
            step,
            odometry: rates.iter().map(|&rate| Some([1.0, rate])).collect(),
            ..StepInputs::default()
        };
        if tick.is_multiple_of(self.life.exchange) {
            inputs.sightings = self.sightings(step);
        }
        if self
            .life
            .fixes
            .is_some_and(|every| tick.is_multiple_of(every))
        {
            inputs.fixes.push(self.fix(step));
        }
        inputs
    }

    fn sightings(&self, step: usize) -> Vec<Sighting> {
        let pairs = (0..ROBOTS).flat_map(|a| (0..ROBOTS).map(move |b| (a, b)));
        pairs
            .filter(|(observer, observed)| observer != observed)
            .map(|(observer, observed)| Sighting {
                observer,
                observed,
                relative: self.seen(step, observer, observed),
                arrives: Some(step),
            })
            .collect()
    }

    fn seen(&self, step: usize, observer: usize, observed: usize) -> Pose {
        let truth = [observer, observed].map(|robot| true_pose(&self.places[robot]));
        let exact = relative(&truth[0], &truth[1]);
        let mut draws = self
            .noise
            .draws(Purpose::RelativePose, step, observer, observed);
        let [a, b, c] = draws.normals();
        let [x, y, phi] = SIGHTING;
        Pose::new(exact.x + x * a, exact.y + y * b, exact.phi + phi * c)
    }

    fn fix(&self, step: usize) -> Fix {
        let [x, y] = self.places[0].position;
        let [a, b] = self.noise.draws(Purpose::Fix, step, 0, 0).normals();
        Fix {
            robot: 0,
            position: [x + FIX_M * a, y + FIX_M * b],
        }
    }

    fn look(&self, outcome: &mut Outcome) {
        for (robot, place) in self.places.iter().enumerate() {
            let Some(belief) = self.team.belief(robot) else {
                continue;
            };
            let [x, y] = place.position;
            let error = [belief.pose.x - x, belief.pose.y - y];
            outcome.score.add(nees(error, &belief.total()));
            outcome.squares += error[0] * error[0] + error[1] * error[1];
            outcome.count += 1.0;
        }
    }
}

/// Outside of the floor it turns towards the middle.
fn steered(wanted: f64, place: &Place, floor_m: f64) -> f64 {
    let [x, y] = place.position;
    if libm::hypot(x, y) < floor_m {
        return wanted;
    }
    let back = wrap(libm::atan2(-y, -x) - place.heading);
    back.clamp(-FASTEST, FASTEST)
}

fn true_pose(place: &Place) -> Pose {
    let [x, y] = place.position;
    Pose::new(x, y, place.heading)
}

/// What a robot believes at the start, and where it is.
fn beginning(noise: &Noise, robot: usize, [x, y, phi]: [f64; 3]) -> (Pose, Place) {
    let mut draws = noise.draws(Purpose::Start, 0, robot, 0);
    let (number, heading) = ([0.0, 1.0, 2.0][robot], draws.uniform(0.0, TAU));
    let [a, b, c] = draws.normals();
    let place = Place {
        position: [APART_M * number + x * a, y * b],
        heading: heading + phi * c,
    };
    (Pose::new(APART_M * number, 0.0, heading), place)
}

fn settings(life: Life, propagation: Propagation) -> FilterSettings {
    let [forward, _, turning] = life.sort.per_second().map(|it| it * f64::from(RATE_HZ));
    let variance = |a, b| Variance {
        a,
        b,
        ..Variance::default()
    };
    FilterSettings {
        dt_s: 1.0 / f64::from(RATE_HZ),
        odometry: OdometryNoise {
            forward: variance(0.0, forward),
            sideways: Variance::default(),
            turning: variance(turning, 0.0),
        },
        relative: Covariance3::diagonal(SIGHTING.map(|it| it * it)).unwrap_or_default(),
        fix: Covariance2::diagonal([FIX_M * FIX_M; 2]).unwrap_or_default(),
        product: Settings {
            propagation,
            ..Settings::default()
        },
        longest_delay: 0,
        receivers: Vec::new(),
    }
}
