//! From a scan to the robots in it.

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use crate::associate::{Associator, Odds, Pair};
use crate::beams::{Beams, Ray, ScannerMotion};
use crate::fit::{
    End, Fit, Sample, cylinder, flatness, most_chi2, off_surface, rectangle, rectangle_starts,
};
use crate::marks::{self, Mark};
use crate::pieces::{Piece, cut};
use crate::shape::{Body, Look, cross};
use crate::view::{MOST_BEAMS, Met, View};

/// As many robots of a team are looked for.
pub const MOST_ROBOTS: usize = 64;
/// As many bodies of a scan are told apart.
const MOST_BODIES: usize = 64;
const MOST_PAIRS: usize = 256;
/// A robot is cut into no more pieces by what stands in front of it.
const MOST_PIECES_OF_ONE: usize = 8;
/// Beams between two pieces of one robot that met nothing.
const WIDEST_GAP: usize = 2;

/// How the scanner errs, and how far a robot differs from what is said of it.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Noise {
    /// Of each range \[m\].
    pub range_sigma_m: f64,
    /// Of each beam's angle \[rad\].
    pub angle_sigma_rad: f64,
    /// Of where a robot's surface or a mark is \[m\].
    pub shape_sigma_m: f64,
}

impl Default for Noise {
    /// A scanner of the middle class, and a robot that was measured by hand.
    fn default() -> Self {
        Self {
            range_sigma_m: 0.015,
            angle_sigma_rad: 0.001,
            shape_sigma_m: 0.005,
        }
    }
}

/// What is asked of a sighting.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// What robots look like; robots say which of these by its place.
    pub looks: Vec<Look>,
    /// The errors.
    pub noise: Noise,
    /// Beyond that nothing is looked for \[m\].
    pub farthest_m: f64,
    /// So many beams at least must meet a robot.
    pub least_beams: usize,
    /// So bright is a reflective mark.
    pub bright: f32,
    /// A position with a larger σ is not said \[m\].
    pub most_sigma_m: f64,
    /// A heading with a larger σ is not said \[rad\].
    pub most_heading_sigma_rad: f64,
    /// How often something that is none of the team looks like one \[1/m²\].
    pub clutter_per_m2: f64,
    /// That a robot whose place is known is not seen.
    pub missed: f64,
    /// So sure must it be that a robot is the one that was seen.
    pub least_own: f64,
    /// So unlikely must it be that what was seen is another robot.
    pub most_others: f64,
}

impl Settings {
    /// With these looks, all else as it is by default.
    #[must_use]
    pub fn of(looks: Vec<Look>) -> Self {
        Self {
            looks,
            noise: Noise::default(),
            farthest_m: 6.5,
            least_beams: 5,
            bright: f32::INFINITY,
            most_sigma_m: 0.15,
            most_heading_sigma_rad: 0.1,
            clutter_per_m2: 0.06,
            missed: 0.2,
            least_own: 0.9,
            most_others: 1e-5,
        }
    }
}

/// Where another robot is believed to be.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Prior {
    /// Its number.
    pub robot: u16,
    /// Place of its look.
    pub look: usize,
    /// Forward, left and heading in the scanner's frame \[m, m, rad\].
    pub pose: [f64; 3],
    /// Of `pose`, 3×3 \[m², m·rad, rad²\].
    pub covariance: [[f64; 3]; 3],
}

/// A robot that was seen.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Seen {
    /// Its number.
    pub robot: u16,
    /// When its middle was scanned, after the first beam \[s\].
    pub time_s: f64,
    /// So many beams met it.
    pub beams: usize,
    /// Forward, left and heading in the scanner's frame at that moment; no heading where none was seen \[m, m, rad\].
    pub pose: [f64; 3],
    /// Of `pose`, 3×3; zero where no heading was seen \[m², m·rad, rad²\].
    pub covariance: [[f64; 3]; 3],
    /// Whether its heading was seen.
    pub has_heading: bool,
}

/// Range and bearing alone.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct RangeBearing {
    /// \[m\]
    pub range_m: f64,
    /// From forward to the left \[rad\].
    pub bearing_rad: f64,
    /// Of both, 2×2 \[m², m·rad, rad²\].
    pub covariance: [[f64; 2]; 2],
}

impl Seen {
    /// What was seen of it, as range and bearing.
    #[must_use]
    pub fn range_bearing(&self) -> RangeBearing {
        let [x, y, _] = self.pose;
        let range = x.hypot(y);
        let (cos, sin) = (x / range, y / range);
        let slope = Matrix2::new(cos, sin, -sin / range, cos / range);
        let [[a, b, _], [c, d, _], _] = self.covariance;
        let covariance = slope * Matrix2::new(a, b, c, d) * slope.transpose();
        RangeBearing {
            range_m: range,
            bearing_rad: y.atan2(x),
            covariance: [0, 1].map(|row| [0, 1].map(|column| covariance[(row, column)])),
        }
    }
}

/// What came of all scans, counted.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Scans.
    pub scans: u64,
    /// Bodies that look like a robot, where one may be.
    pub bodies: u64,
    /// Of these: said to be a robot.
    pub seen: u64,
    /// They may be more than one robot.
    pub ambiguous: u64,
    /// They may be nobody of the team.
    pub nobody: u64,
    /// What there was no room for.
    pub left_out: u64,
}

/// So many ways to stand that differ may fit one body.
const MODES: usize = 4;

/// Something that looks like a robot.
#[derive(Copy, Clone, Debug)]
struct Candidate {
    look: usize,
    fits: [Option<Fit>; MODES],
    time_s: f64,
    beams: usize,
    score: f64,
    /// How often something else looks like that, over how often it does at best.
    clutter: f64,
}

impl Candidate {
    fn body(&self) -> Body {
        let fit = self.fits.iter().flatten().next();
        fit.map_or(
            Body::Round {
                centre: Vector2::zeros(),
                radius: 0.0,
            },
            |fit| fit.body,
        )
    }
}

/// Where a robot is looked for.
#[derive(Copy, Clone, Debug)]
struct Place {
    prior: Prior,
    mean: Vector3<f64>,
    covariance: Matrix3<f64>,
    /// Of a body that may be half of itself off.
    near: Matrix2<f64>,
}

/// A pair, and what the robot's pose is if they belong together.
#[derive(Copy, Clone, Debug)]
struct Reading {
    /// Place of the candidate that says so.
    candidate: usize,
    pose: Vector3<f64>,
    covariance: Matrix3<f64>,
    has_heading: bool,
    /// Whether it is the only one of its headings that can be meant.
    is_clear: bool,
}

/// χ² of two and three numbers that one of a million exceeds: who is farther off cannot be meant, not even by mistake.
const GATES: [f64; 2] = [27.631_021_115_928_547, 30.664_849_706_154_6];
/// Twice the logarithm of how much likelier one of two headings must be.
const HEADING_SURE: f64 = 12.0;
/// How often a heading is taken for another one, at most.
const MISTAKEN: f64 = 0.1;

/// Finds robots in scans.
#[derive(Debug)]
pub struct Finder {
    settings: Settings,
    beams: Beams,
    pieces: Vec<Piece>,
    samples: Vec<Sample>,
    marks: Vec<Mark>,
    places: Vec<Place>,
    candidates: Vec<Candidate>,
    pairs: Vec<Pair>,
    readings: Vec<Reading>,
    odds: Vec<Odds>,
    associator: Associator,
    seen: Vec<Seen>,
    counts: Counts,
}

impl Finder {
    /// Takes all the memory that it needs.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        Self {
            settings,
            beams: Beams::new(),
            pieces: Vec::with_capacity(MOST_BEAMS),
            samples: Vec::with_capacity(MOST_BEAMS),
            marks: Vec::with_capacity(marks::MOST_SEEN),
            places: Vec::with_capacity(MOST_ROBOTS),
            candidates: Vec::with_capacity(MOST_BODIES),
            pairs: Vec::with_capacity(MOST_PAIRS),
            readings: Vec::with_capacity(MOST_PAIRS),
            odds: Vec::with_capacity(MOST_PAIRS),
            associator: Associator::new(MOST_ROBOTS, MOST_PAIRS),
            seen: Vec::with_capacity(MOST_ROBOTS),
            counts: Counts::default(),
        }
    }

    /// What it was made for.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// What came of all scans.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Everything in the last scan that looks like a robot where one may be: its middle and how many beams met it.
    pub fn bodies(&self) -> impl Iterator<Item = ([f64; 2], usize)> {
        self.candidates.iter().map(|candidate| {
            let centre = candidate.body().centre();
            ([centre.x, centre.y], candidate.beams)
        })
    }

    /// The robots of `team` that are in a scan, while the scanner moves like that. Allocates nothing.
    pub fn find(&mut self, view: &View<'_>, motion: ScannerMotion, team: &[Prior]) -> &[Seen] {
        self.counts.scans += 1;
        self.seen.clear();
        self.candidates.clear();
        self.settle(team);
        self.beams.fill(view, motion);
        self.counts.left_out += cut(&self.beams, self.settings.farthest_m, &mut self.pieces);
        for look in 0..self.settings.looks.len() {
            if !self.places.iter().any(|place| place.prior.look == look) {
                continue;
            }
            match self.settings.looks[look] {
                Look::Marks(pattern) => self.look_for_marks(look, &pattern),
                _ => self.look_through(look),
            }
        }
        self.counts.bodies += self.candidates.len() as u64;
        self.pair();
        self.tell();
        &self.seen
    }

    /// Where robots are looked for: priors that can be computed with.
    fn settle(&mut self, team: &[Prior]) {
        self.places.clear();
        for prior in team {
            if self.places.len() == MOST_ROBOTS {
                self.counts.left_out += 1;
                continue;
            }
            let place = Place::of(prior, &self.settings.looks);
            self.places.extend(place);
        }
    }

    /// Whether a robot that looks so may be about there.
    fn may_be(&self, look: usize, point: Vector2<f64>) -> bool {
        self.places
            .iter()
            .filter(|it| it.prior.look == look)
            .any(|it| {
                let off = point - it.mean.xy();
                (off.transpose() * it.near * off)[0] <= GATES[0]
            })
    }

    /// All windows of a few pieces that are no larger than a robot.
    fn look_through(&mut self, look: usize) {
        let reach = self.settings.looks[look].reach_m();
        for first in 0..self.pieces.len() {
            let mut last = first;
            while last < self.pieces.len() && last < first + MOST_PIECES_OF_ONE {
                let (a, b) = (self.pieces[first], self.pieces[last]);
                if last > first {
                    let before = self.pieces[last - 1];
                    if b.first - (before.first + before.count) > WIDEST_GAP {
                        break;
                    }
                }
                let end = b.first + b.count;
                if !self.fits_in(a.first, end, reach) {
                    break;
                }
                if end - a.first >= self.settings.least_beams {
                    self.try_window(look, a.first, end);
                }
                last += 1;
            }
        }
    }

    /// Whether the beams from `first` to before `end` end no farther from each other than a robot is large.
    fn fits_in(&self, first: usize, end: usize, reach: f64) -> bool {
        let [a, b, middle] =
            [first, end - 1, usize::midpoint(first, end)].map(|it| self.beams.point(it));
        let most = 2.0 * reach + 0.1;
        match (a, b, middle) {
            (Some(a), Some(b), Some(middle)) => {
                (a - b).norm() <= most && (a - middle).norm() <= most && (b - middle).norm() <= most
            }
            (Some(a), Some(b), None) => (a - b).norm() <= most,
            _ => true,
        }
    }

    fn try_window(&mut self, look: usize, first: usize, end: usize) {
        let middle = usize::midpoint(first, end);
        let shape = self.settings.looks[look];
        let reach = shape.reach_m();
        let Some(near) = self.beams.point(middle).or(self.beams.point(first)) else {
            return;
        };
        if !self.may_be(look, near + near.normalize() * (0.5 * reach)) {
            return;
        }
        let time_s = self.beams.time_s(middle);
        self.gather(first, end, time_s);
        if self.samples.len() < self.settings.least_beams {
            return;
        }
        let mut candidate = Candidate {
            look,
            fits: [None; MODES],
            time_s,
            beams: 0,
            score: f64::NEG_INFINITY,
            clutter: 1.0,
        };
        match shape {
            Look::Cylinder { radius_m } => {
                let fit = cylinder(&self.samples, radius_m, &self.settings.noise);
                self.judge(&mut candidate, fit, middle);
            }
            Look::Rectangle {
                length_m, width_m, ..
            } => {
                let half = Vector2::new(0.5 * length_m, 0.5 * width_m);
                let ends = self.ends(first, end, time_s);
                let ends: &[End] = match &ends {
                    [Some(a), Some(b)] => &[*a, *b],
                    [Some(a), None] | [None, Some(a)] => &[*a],
                    _ => &[],
                };
                for start in rectangle_starts(&self.samples, half) {
                    let fit = rectangle(&self.samples, ends, half, start, &self.settings.noise);
                    self.judge(&mut candidate, fit, middle);
                }
            }
            Look::Marks(_) => {}
        }
        self.keep(&candidate);
    }

    fn gather(&mut self, first: usize, end: usize, time_s: f64) {
        self.samples.clear();
        for place in first..end {
            let ray = self.beams.ray(place, time_s);
            if let (Some(point), Met::Surface(range)) = (ray.point(), ray.met) {
                self.samples.push(Sample { ray, point, range });
            }
        }
    }

    /// The ends of a window that stand in front of something farther.
    fn ends(&self, first: usize, end: usize, time_s: f64) -> [Option<End>; 2] {
        [(first, -1), (end - 1, 1)].map(|(last, by)| {
            let beside = self.beams.beside(last, by)?;
            let (own, other) = (self.beams.ray(last, time_s), self.beams.ray(beside, time_s));
            let Met::Surface(range) = own.met else {
                return None;
            };
            let is_free = match other.met {
                Met::Surface(beyond) => beyond > range + ENDS_M,
                Met::Nothing => true,
                Met::Unknown => false,
            };
            let direction = (own.direction + other.direction).normalize();
            let step = self.beams.step_rad();
            let angle = self.settings.noise.angle_sigma_rad;
            is_free.then(|| End {
                ray: Ray {
                    origin: (own.origin + other.origin) * 0.5,
                    direction,
                    met: Met::Nothing,
                },
                side: cross(own.direction, direction).signum(),
                variance: step * step / 12.0 + angle * angle,
            })
        })
    }

    /// Whether it is less straight than a wall would be, of which no end or one is seen.
    fn is_no_wall(&self, fit: &Fit, ends: usize) -> bool {
        let bent = match fit.body {
            Body::Round { .. } => CURVED[ends],
            Body::Square { .. } if ends == 0 => CORNERED,
            Body::Square { .. } => return true,
        };
        flatness(&self.samples, fit, &self.settings.noise) > fit.chi2 + bent
    }

    /// Takes a fit into a candidate, if it stands up to every beam.
    fn judge(&self, candidate: &mut Candidate, fit: Option<Fit>, middle: usize) {
        let Some(fit) = fit else {
            return;
        };
        let is_good = fit.chi2 <= most_chi2(fit.freedom) && self.is_sharp(&fit);
        if !is_good {
            return;
        }
        let verdict = self.verdict(&fit, candidate.time_s, middle);
        // One that grazes the rim, or gives a range in between, is a beam that met it all the same.
        let is_one = verdict.hits + 1 >= self.settings.least_beams
            && verdict.through * 8 <= verdict.hits
            && !(verdict.beside[0] && verdict.beside[1])
            && self.is_no_wall(&fit, verdict.ends());
        if !is_one {
            return;
        }
        #[allow(clippy::cast_precision_loss)] // At most 2048.
        let score = 8.0 * verdict.hits as f64 - 16.0 * verdict.through as f64 - fit.chi2;
        if score > candidate.score + CLEARLY_BETTER {
            candidate.fits = [None; MODES];
        } else if score < candidate.score - CLEARLY_BETTER {
            return;
        }
        candidate.score = candidate.score.max(score);
        candidate.beams = candidate.beams.max(verdict.hits);
        candidate.clutter = CLUTTER[verdict.ends()] * if verdict.is_flat() { FLAT } else { 1.0 };
        let same = candidate
            .fits
            .iter()
            .flatten()
            .any(|other| fit.is_like(other));
        if let Some(free) = candidate
            .fits
            .iter_mut()
            .find(|it| it.is_none())
            .filter(|_| !same)
        {
            *free = Some(fit);
        }
    }

    fn is_sharp(&self, fit: &Fit) -> bool {
        let position: Matrix2<f64> = fit.covariance.fixed_view::<2, 2>(0, 0).into_owned();
        let worst = position.symmetric_eigenvalues().max();
        let is_covariance =
            fit.covariance.iter().all(|it| it.is_finite()) && position.cholesky().is_some();
        is_covariance && worst <= self.settings.most_sigma_m * self.settings.most_sigma_m
    }

    /// What all beams say that ought to meet a body, or pass it closely.
    fn verdict(&self, fit: &Fit, time_s: f64, middle: usize) -> Verdict {
        let body = &fit.body;
        let step = body.centre().norm() * self.beams.step_rad();
        let loose = Loose {
            ring: RING_M.max(step),
            rim: RIM_M + fit.covariance[(0, 0)].max(fit.covariance[(1, 1)]).sqrt(),
        };
        let half = self.beams.count().cast_signed() / 2;
        let mut verdict = Verdict::default();
        for (side, by) in [(0, -1), (1, 1)] {
            verdict.is_hidden = false;
            let mut off = isize::from(by > 0);
            while let Some(place) = self.beams.beside(middle, by * off).filter(|_| off <= half) {
                let ray = self.beams.ray(place, time_s);
                self.weigh(body, &ray, &loose, &mut verdict, side);
                if body.hit(&ray, loose.ring).is_none() {
                    break;
                }
                off += 1;
            }
        }
        verdict
    }

    fn weigh(&self, body: &Body, ray: &Ray, loose: &Loose, verdict: &mut Verdict, side: usize) {
        let range = match ray.met {
            Met::Surface(range) => range,
            Met::Nothing => f64::INFINITY,
            Met::Unknown => return,
        };
        let Some(hit) = body.hit(ray, 0.0) else {
            let is_clear = body.hit(ray, loose.rim.min(0.5 * loose.ring)).is_none();
            let goes_on = ray
                .point()
                .is_some_and(|point| body.contains(point, loose.ring));
            verdict.beside[side] |= goes_on && is_clear;
            verdict.free[side] |= !goes_on && !verdict.is_hidden && range > body.centre().norm();
            return;
        };
        let noise = &self.settings.noise;
        let off = (range - hit.range) * hit.normal.dot(&ray.direction).abs();
        let sigma = off_surface(noise, hit.range, ray.direction, hit.normal).sqrt();
        if off.abs() <= 5.0 * sigma.max(noise.range_sigma_m) {
            verdict.hits += 1;
            verdict.is_hidden = false;
            verdict.note(hit.normal);
        } else if range > hit.range && body.hit(ray, -loose.rim.min(0.3 * body.reach())).is_some() {
            verdict.through += 1;
        } else if range < hit.range {
            verdict.is_hidden = true;
            // Nothing stands so close in front of it.
            let is_close = ray
                .point()
                .is_some_and(|point| body.contains(point, loose.ring));
            verdict.through += usize::from(is_close);
        }
    }

    /// Where two overlap, the better stays.
    fn keep(&mut self, candidate: &Candidate) {
        if candidate.fits.iter().all(Option::is_none) {
            return;
        }
        // As what it looks like is for the odds to say.
        let overlaps =
            |other: &Candidate| other.look == candidate.look && overlap(other, candidate);
        let better = |other: &Candidate| overlaps(other) && other.score >= candidate.score;
        if self.candidates.iter().any(better) {
            return;
        }
        self.candidates.retain(|other| !overlaps(other));
        if self.candidates.len() == MOST_BODIES {
            self.counts.left_out += 1;
            return;
        }
        self.candidates.push(*candidate);
    }

    fn look_for_marks(&mut self, look: usize, pattern: &crate::shape::Pattern) {
        let Settings { bright, noise, .. } = self.settings;
        let reach = self.settings.looks[look].reach_m();
        let mut marks = std::mem::take(&mut self.marks);
        let left_out = marks::find(
            &self.beams,
            bright,
            pattern.radius_m(),
            &noise,
            &mut marks,
            |point| self.may_be_within(look, point, reach),
        );
        self.counts.left_out += left_out;
        while let Some(marks::Found {
            fit,
            middle,
            beams,
            of,
        }) = marks::fit(&marks, pattern, &noise)
        {
            let is_good = fit.chi2 <= most_chi2(fit.freedom) && self.is_sharp(&fit);
            if is_good {
                self.keep(&Candidate {
                    look,
                    fits: [Some(fit), None, None, None],
                    time_s: self.beams.time_s(middle),
                    beams,
                    score: 1000.0 - fit.chi2,
                    clutter: 0.1,
                });
            }
            let mut place = 0;
            marks.retain(|_| {
                place += 1;
                !of.contains(&Some(place - 1))
            });
        }
        self.marks = marks;
    }

    fn may_be_within(&self, look: usize, point: Vector2<f64>, reach: f64) -> bool {
        self.places
            .iter()
            .filter(|it| it.prior.look == look)
            .any(|it| {
                let off = point - it.mean.xy();
                let far = off.norm();
                // As if the mark were where the robot's middle may be that is nearest to the prior.
                let rest = off * ((far - reach).max(0.0) / far.max(1e-9));
                (rest.transpose() * it.near * rest)[0] <= GATES[0]
            })
    }

    /// Which candidate may be which robot.
    fn pair(&mut self) {
        self.pairs.clear();
        self.readings.clear();
        for robot in 0..self.places.len() {
            for seen in 0..self.candidates.len() {
                let (place, candidate) = (&self.places[robot], &self.candidates[seen]);
                let Some((mut reading, weight)) = self.read(place, candidate) else {
                    continue;
                };
                reading.candidate = seen;
                let (seen, worse) = self.thing(seen);
                let weight = weight * (-0.5 * worse).exp();
                if self.pairs.len() == MOST_PAIRS {
                    self.counts.left_out += 1;
                    continue;
                }
                self.pairs.push(Pair {
                    robot,
                    seen,
                    weight,
                });
                self.readings.push(reading);
            }
        }
    }

    /// The first of the candidates that are one thing with this one, and by how much this one fits worse than the best of them.
    fn thing(&self, seen: usize) -> (usize, f64) {
        let own = &self.candidates[seen];
        let mut same = self
            .candidates
            .iter()
            .enumerate()
            .filter(|(_, it)| overlap(it, own));
        let first = same.next().map_or(seen, |(place, _)| place);
        let scores = self
            .candidates
            .iter()
            .filter(|it| overlap(it, own))
            .map(|it| it.score);
        (first, scores.fold(own.score, f64::max) - own.score)
    }

    /// What a candidate says of a robot, if it may be that one: the likeliest of its headings.
    fn read(&self, place: &Place, candidate: &Candidate) -> Option<(Reading, f64)> {
        let look = self.settings.looks[candidate.look];
        let (turns, centre_m) = match look {
            Look::Rectangle { centre_m, .. } => (2, centre_m),
            Look::Cylinder { .. } | Look::Marks(_) => (1, [0.0; 2]),
        };
        let least = candidate
            .fits
            .iter()
            .flatten()
            .map(|fit| fit.chi2)
            .fold(f64::INFINITY, f64::min);
        let (mut best, mut second): (Option<(f64, f64, Reading)>, _) = (None, f64::INFINITY);
        let mut nearest: Option<(f64, Reading)> = None;
        for fit in candidate.fits.iter().flatten() {
            for turn in 0..turns {
                let reading = fit.reading(f64::from(turn) * PI, centre_m);
                let far = place.distance(&reading);
                let cost = far + fit.chi2 - least;
                let is_better = best.as_ref().is_none_or(|(best, ..)| cost < *best);
                second = second.min(if is_better {
                    best.map_or(f64::INFINITY, |it| it.0)
                } else {
                    cost
                });
                if is_better {
                    best = Some((cost, far, reading));
                }
                let flat = place.distance(&reading.flat());
                if nearest.is_none_or(|(near, _)| flat < near) {
                    nearest = Some((flat, reading.flat()));
                }
            }
        }
        let ((cost, far, mut reading), (flat, flat_reading)) = (best?, nearest?);
        let seen = 1.0 - self.settings.missed;
        let clutter = candidate.clutter * self.settings.clutter_per_m2;
        let mut weight = 0.0;
        if flat <= GATES[0] {
            // A heading may have been mistaken for another.
            let part = if reading.has_heading { MISTAKEN } else { 1.0 };
            weight += part * seen * place.likelihood(&flat_reading, flat) / clutter;
        }
        let is_clear = far <= GATES[1] && second - cost >= HEADING_SURE;
        if reading.has_heading && is_clear {
            weight += seen * place.likelihood(&reading, far) / (clutter * f64::from(turns) / TAU);
        }
        reading.is_clear = !reading.has_heading || is_clear;
        if place.prior.look != candidate.look {
            // So little of it was seen that it may look otherwise; that proves nobody, and keeps others from being sure.
            weight *= MISTAKEN;
            reading.is_clear = false;
        }
        if weight <= 0.0 {
            return None;
        }
        let is_centred = centre_m.iter().all(|it| it.abs() < 1e-9);
        let most = self.settings.most_heading_sigma_rad;
        if reading.covariance[(2, 2)] > most * most && is_centred {
            reading.has_heading = false;
        }
        Some((reading, weight))
    }

    /// Says what is sure.
    fn tell(&mut self) {
        self.associator.work_out(
            self.places.len(),
            &self.pairs,
            self.settings.missed,
            &mut self.odds,
        );
        let mut said = 0_u64;
        let mut doubted = 0_u64;
        for (place, odds) in self.odds.iter().enumerate() {
            let (pair, reading) = (self.pairs[place], &self.readings[place]);
            if !reading.is_clear
                || odds.own < self.settings.least_own
                || odds.others > self.settings.most_others
            {
                let is_doubted = odds.others > self.settings.most_others;
                doubted |= u64::from(is_doubted) << pair.seen;
                continue;
            }
            said |= 1 << pair.seen;
            let candidate = &self.candidates[reading.candidate];
            if self.seen.len() < MOST_ROBOTS {
                self.seen.push(Seen {
                    robot: self.places[pair.robot].prior.robot,
                    time_s: candidate.time_s,
                    beams: candidate.beams,
                    pose: reading.told_pose(),
                    covariance: reading.told_covariance(),
                    has_heading: reading.has_heading,
                });
            }
        }
        let ambiguous = (doubted & !said).count_ones();
        self.counts.seen += u64::from(said.count_ones());
        self.counts.ambiguous += u64::from(ambiguous);
        self.counts.nobody +=
            self.candidates.len() as u64 - u64::from(said.count_ones() + ambiguous);
    }
}

/// Fits that differ by less are one \[m, rad\].
const ALIKE_M: f64 = 0.03;
const ALIKE_RAD: f64 = 0.05;
/// What is farther than an end by that is behind it \[m\].
const ENDS_M: f64 = 0.15;
/// A straight line must fit worse than a circle by so much, where none, one or both of its ends are seen in front of something farther.
const CURVED: [f64; 3] = [12.0, 2.0, 0.0];
/// The same of a rectangle of which no end is seen: where along a face it stands is told by its other face alone.
const CORNERED: f64 = 25.0;
/// By so much more often does something else look like a robot of which that is seen.
const CLUTTER: [f64; 3] = [4.0, 2.0, 1.0];
/// Of two fits, one whose score is higher by that.
const CLEARLY_BETTER: f64 = 16.0;
/// And of which one face alone.
const FLAT: f64 = 5.0;
/// What ends so near to a body on both sides goes on there \[m\].
const RING_M: f64 = 0.08;
/// Within so much of a body's rim a ray may meet it or not \[m\].
const RIM_M: f64 = 0.02;

/// How far around a body's rim beams are looked at, and within what they prove nothing \[m\].
struct Loose {
    ring: f64,
    rim: f64,
}

/// What beams say of a body.
#[derive(Copy, Clone, Debug, Default)]
struct Verdict {
    /// They met its surface.
    hits: usize,
    /// They went through it.
    through: usize,
    /// Whether something begins right beside it, to the one side and to the other.
    beside: [bool; 2],
    /// Whether something farther is seen beside it.
    free: [bool; 2],
    /// Whether something stands in front of it at the last beam.
    is_hidden: bool,
    /// Normals of the first surface that was met, and whether there is another.
    face: Option<Vector2<f64>>,
    has_faces: bool,
}

impl Verdict {
    fn note(&mut self, normal: Vector2<f64>) {
        let face = *self.face.get_or_insert(normal);
        self.has_faces |= face.dot(&normal) < 0.999;
    }

    /// Whether only one face was met.
    fn is_flat(&self) -> bool {
        !self.has_faces
    }

    /// So many of its ends are seen in front of something farther.
    fn ends(&self) -> usize {
        self.free.iter().filter(|it| **it).count()
    }
}

fn overlap(one: &Candidate, other: &Candidate) -> bool {
    let [one, other] = [one, other].map(Candidate::body);
    let inner = 0.4 * (inner(&one) + inner(&other));
    one.contains(other.centre(), inner) || other.contains(one.centre(), inner)
}

fn inner(body: &Body) -> f64 {
    match *body {
        Body::Round { radius, .. } => radius,
        Body::Square { half, .. } => half.min(),
    }
}

fn wrapped(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}

impl Fit {
    /// Whether it stands as another one does.
    fn is_like(&self, other: &Self) -> bool {
        let apart = (self.body.centre() - other.body.centre()).norm();
        let turned = self.heading.zip(other.heading).map_or(0.0, |(a, b)| {
            let turned = 2.0 * (a - b);
            0.5 * wrapped(turned).abs()
        });
        apart < ALIKE_M && turned < ALIKE_RAD
    }

    /// The pose of a robot whose body is so, turned by `turn`, and has its middle at `centre_m`.
    fn reading(&self, turn: f64, centre_m: [f64; 2]) -> Reading {
        let centre = self.body.centre();
        let Some(heading) = self.heading else {
            return Reading {
                candidate: 0,
                pose: Vector3::new(centre.x, centre.y, 0.0),
                covariance: self.covariance,
                has_heading: false,
                is_clear: true,
            };
        };
        let heading = wrapped(heading + turn);
        let (sin, cos) = heading.sin_cos();
        let [x, y] = centre_m;
        let arm = Vector2::new(cos * x - sin * y, sin * x + cos * y);
        let slope = Matrix3::new(1.0, 0.0, arm.y, 0.0, 1.0, -arm.x, 0.0, 0.0, 1.0);
        Reading {
            candidate: 0,
            pose: Vector3::new(centre.x - arm.x, centre.y - arm.y, heading),
            covariance: slope * self.covariance * slope.transpose(),
            has_heading: true,
            is_clear: true,
        }
    }
}

impl Reading {
    /// The same without its heading.
    fn flat(&self) -> Self {
        Self {
            has_heading: false,
            ..*self
        }
    }

    fn told_pose(&self) -> [f64; 3] {
        let heading = if self.has_heading { self.pose.z } else { 0.0 };
        [self.pose.x, self.pose.y, heading]
    }

    fn told_covariance(&self) -> [[f64; 3]; 3] {
        let covariance = (self.covariance + self.covariance.transpose()) * 0.5;
        let is_told = |place: usize| place < 2 || self.has_heading;
        [0, 1, 2].map(|row| {
            [0, 1, 2].map(|column| {
                if is_told(row) && is_told(column) {
                    covariance[(row, column)]
                } else {
                    0.0
                }
            })
        })
    }
}

impl Place {
    /// None of a prior that cannot be computed with.
    fn of(prior: &Prior, looks: &[Look]) -> Option<Self> {
        let reach = looks.get(prior.look)?.reach_m();
        let mean = Vector3::from(prior.pose);
        let covariance = Matrix3::from_fn(|row, column| prior.covariance[row][column]);
        let is_finite = mean
            .iter()
            .chain(covariance.iter())
            .all(|it| it.is_finite());
        let spread = Matrix2::identity() * (0.25 * reach * reach + 0.01);
        let near = covariance.fixed_view::<2, 2>(0, 0) + spread;
        let near = near.cholesky().filter(|_| is_finite)?.inverse();
        covariance
            .cholesky()
            .or_else(|| (covariance + Matrix3::identity() * 1e-12).cholesky())?;
        Some(Self {
            prior: *prior,
            mean,
            covariance,
            near,
        })
    }

    /// Mahalanobis distance, squared.
    fn distance(&self, reading: &Reading) -> f64 {
        let sum = self.covariance + reading.covariance;
        let off = reading.pose - self.mean;
        if reading.has_heading {
            let off = Vector3::new(off.x, off.y, wrapped(off.z));
            let inverse = sum.try_inverse();
            return inverse.map_or(f64::INFINITY, |inverse| {
                (off.transpose() * inverse * off)[0]
            });
        }
        let sum: Matrix2<f64> = sum.fixed_view::<2, 2>(0, 0).into_owned();
        let off = off.xy();
        let inverse = sum.try_inverse();
        inverse.map_or(f64::INFINITY, |inverse| {
            (off.transpose() * inverse * off)[0]
        })
    }

    fn likelihood(&self, reading: &Reading, distance: f64) -> f64 {
        let sum = self.covariance + reading.covariance;
        let spread = if reading.has_heading {
            TAU * TAU * TAU * sum.determinant()
        } else {
            let sum: Matrix2<f64> = sum.fixed_view::<2, 2>(0, 0).into_owned();
            TAU * TAU * sum.determinant()
        };
        (-0.5 * distance).exp() / spread.sqrt()
    }
}
