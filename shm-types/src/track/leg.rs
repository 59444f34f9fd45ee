//! From one estimate to the next: what the wheels did, and what was learnt at its end.
use super::wrapped;
use crate::matrix::Matrix;
use crate::{BeliefState, Estimate, PastPose};

/// A mean that is this far from where the wheels take it has learnt \[m, rad\]. Rounding and a late frame stay below.
const LEARNT: f64 = 1e-7;

/// A variance that has shrunk by no more than this part of itself may be rounded.
const ROUNDING: f64 = 1e-9;

/// A way that is too short to compare another with \[m\].
const NO_WAY_M: f64 = 1e-9;

/// Of what grows, how much may change from one leg to the next to be taken for a trend.
const STEADY: f64 = 0.1;

/// Two estimates, one after the other.
#[derive(Copy, Clone, Debug)]
pub(super) struct Leg<'a> {
    pub(super) from: &'a Estimate,
    pub(super) to: &'a Estimate,
}

/// What driving makes of a belief beside what an uncertain heading makes of the way.
#[derive(Copy, Clone, Debug)]
pub(super) struct Growth {
    /// `L`, what grows with the time, seen from the heading at the beginning \[per s\].
    linear: [f64; 9],
    /// How the mean goes along.
    mean: Mean,
}

/// What the mean does of what the wheels do.
#[derive(Copy, Clone, Debug)]
pub(super) struct Mean {
    /// `κ`: its way as a part of the way driven.
    shortened: f64,
    /// Whether it turns. The guess of a robot that has no idea of its heading does not.
    turns: bool,
}

impl Growth {
    /// As much again as since the leg before, if that is little: the robot speeds up or turns, the distribution bends further.
    pub(super) fn after(self, before: &Self) -> Self {
        let change: [f64; 9] =
            core::array::from_fn(|place| self.linear[place] - before.linear[place]);
        let size = |linear: &[f64; 9]| [linear[0], linear[4], linear[8]].map(f64::abs);
        let (change_size, own_size) = (size(&change), size(&self.linear));
        let is_little = change_size
            .into_iter()
            .zip(own_size)
            .all(|(change, own)| change <= STEADY * own);
        if !is_little {
            return self;
        }
        Self {
            linear: core::array::from_fn(|place| self.linear[place] + change[place]),
            ..self
        }
    }

    /// With the mean of another.
    pub(super) fn with_mean_of(self, other: &Self) -> Self {
        Self {
            mean: other.mean,
            ..self
        }
    }
}

impl Leg<'_> {
    /// What grew, if nothing was learnt at its end.
    pub(super) fn growth(&self) -> Option<Growth> {
        let mean = self.mean()?;
        let curved = self.curved(1.0, mean.shortened);
        let (before, after) = (self.from.total(), self.to.total());
        let grown = core::array::from_fn(|place| after[place] - before[place] - curved[place]);
        self.is_growth(&grown).then(|| Growth {
            linear: turned(&scaled(&grown, 1.0 / self.seconds()), -self.from.pose[2]),
            mean,
        })
    }

    /// Whether it is one of a robot that looks for itself, whose guess moves as its best hypothesis does: as far as the wheels drive, but
    /// not where its heading has it.
    pub(super) fn is_guess(&self) -> bool {
        let knows = |estimate: &Estimate| estimate.state() == BeliefState::Ok;
        let far = |[x, y]: [f64; 2]| x.hypot(y);
        !knows(self.from)
            && !knows(self.to)
            && far(self.moved()) <= far(self.way(1.0)) + LEARNT
            && self.turned().abs() <= self.turn().abs() + LEARNT
    }

    /// Between two guesses.
    pub(super) fn mixed(&self, part: f64) -> PastPose {
        let (before, after) = (self.from.total(), self.to.total());
        let turned = self.turned();
        let growth = self.growth_of_velocity();
        let mix = |place: usize| before[place] + part * (after[place] - before[place]);
        PastPose {
            pose: moved(
                self.from.pose,
                along_the_arc(self.moved(), turned, part),
                part * turned,
            ),
            ..self.pose_at(part, &growth, core::array::from_fn(mix))
        }
    }

    /// What grows by the velocity's covariance alone: its reference period is taken to be that of the estimates.
    pub(super) fn growth_of_velocity(&self) -> Growth {
        let noise = scaled(&self.to.velocity_covariance, self.seconds());
        Growth {
            linear: at_any_heading(&noise, self.heading_variance()),
            mean: Mean {
                shortened: self.mean_direction(),
                turns: true,
            },
        }
    }

    /// The belief when `part` of the time has passed; nothing where `growth` leads to no covariance.
    pub(super) fn at(&self, part: f64, growth: &Growth) -> Option<PastPose> {
        let grown = turned(&growth.linear, self.from.pose[2]);
        let (before, passed_s) = (self.from.total(), part * self.seconds());
        let curved = self.curved(part, growth.mean.shortened);
        let covariance =
            core::array::from_fn(|place| before[place] + passed_s * grown[place] + curved[place]);
        let is_one = Matrix::<3>::from_row_major(covariance).check_covariance();
        is_one
            .is_ok()
            .then(|| self.pose_at(part, growth, covariance))
    }

    fn pose_at(&self, part: f64, growth: &Growth, covariance: [f64; 9]) -> PastPose {
        let way = self.way(part);
        let turned = part * self.turn();
        let odometry_way = rotated(way, self.from.odometry[2] - self.from.pose[2]);
        let Mean { shortened, turns } = growth.mean;
        let mean_turned = if turns { turned } else { 0.0 };
        PastPose {
            pose: moved(self.from.pose, way.map(|it| shortened * it), mean_turned),
            odometry: moved(self.from.odometry, odometry_way, turned),
            covariance,
        }
    }

    /// Nothing where the mean is not where the wheels take it.
    fn mean(&self) -> Option<Mean> {
        let [x, y] = self.moved();
        let [dx, dy] = self.way(1.0);
        let (square, certain) = (dx * dx + dy * dy, self.mean_direction());
        let shortened = if square > NO_WAY_M * NO_WAY_M {
            (x * dx + y * dy) / square
        } else {
            certain
        };
        let length = square.sqrt();
        let is_part = (certain * length - LEARNT..=length + LEARNT).contains(&(shortened * length));
        let off = (x - shortened * dx).hypot(y - shortened * dy);
        let turned = self.turned();
        let turns = wrapped(turned - self.turn()).abs() <= LEARNT;
        let as_driven = is_part && off <= LEARNT && (turns || turned.abs() <= LEARNT);
        as_driven.then_some(Mean { shortened, turns })
    }

    /// Driving makes no heading more certain, and a position only as far as the way undoes what it has bent.
    fn is_growth(&self, grown: &[f64; 9]) -> bool {
        let total = self.from.total();
        let (position, [x, y]) = (total[0] + total[4], self.way(1.0));
        let bent = 4.0 * x.hypot(y) * position.sqrt() * total[8].min(1.0);
        grown[8] >= -ROUNDING * total[8] && grown[0] + grown[4] >= -ROUNDING * position - bent
    }

    /// `S(λ)`, row by row.
    fn curved(&self, part: f64, shortened: f64) -> [f64; 9] {
        let total = self.from.total();
        let (with_heading, s) = ([total[2], total[5]], self.heading_variance());
        let way = self.way(part);
        let [dx, dy] = [-shortened * way[1], shortened * way[0]];
        let [hxx, hxy, _, _, hyy, ..] = outer(moments(s), way);
        let xx = 2.0 * with_heading[0] * dx + hxx;
        let yy = 2.0 * with_heading[1] * dy + hyy;
        let xy = with_heading[0] * dy + with_heading[1] * dx + hxy;
        [xx, xy, s * dx, xy, yy, s * dy, s * dx, s * dy, 0.0]
    }

    /// `r(λ)`: the way that the wheels drove in `part` of the time, from the heading that was believed.
    fn way(&self, part: f64) -> [f64; 2] {
        let (from, to) = (self.from.odometry, self.to.odometry);
        let driven = along_the_arc([to[0] - from[0], to[1] - from[1]], self.turn(), part);
        rotated(driven, self.from.pose[2] - from[2])
    }

    /// What the mean did.
    fn moved(&self) -> [f64; 2] {
        let (from, to) = (self.from.pose, self.to.pose);
        [to[0] - from[0], to[1] - from[1]]
    }

    fn turned(&self) -> f64 {
        wrapped(self.to.pose[2] - self.from.pose[2])
    }

    fn turn(&self) -> f64 {
        wrapped(self.to.odometry[2] - self.from.odometry[2])
    }

    fn heading_variance(&self) -> f64 {
        self.from.total()[8]
    }

    /// `e`
    fn mean_direction(&self) -> f64 {
        (-0.5 * self.heading_variance()).exp()
    }

    #[expect(clippy::cast_precision_loss, reason = "a fifth of a second at most")]
    fn seconds(&self) -> f64 {
        1e-9 * (self.to.boot_ns - self.from.boot_ns) as f64
    }
}

fn moved(pose: [f64; 3], [x, y]: [f64; 2], turn: f64) -> [f64; 3] {
    [pose[0] + x, pose[1] + y, wrapped(pose[2] + turn)]
}

/// Of a way to the end of an arc that turns by `turn`, that to a `part` of it: chords, each seen from the arc's beginning.
fn along_the_arc(way: [f64; 2], turn: f64, part: f64) -> [f64; 2] {
    let (whole, here) = (0.5 * turn, 0.5 * part * turn);
    let length = part * sinc(here) / sinc(whole);
    rotated(way, here - whole).map(|it| length * it)
}

fn rotated([x, y]: [f64; 2], angle: f64) -> [f64; 2] {
    let (sin, cos) = angle.sin_cos();
    [cos * x - sin * y, sin * x + cos * y]
}

fn sinc(half: f64) -> f64 {
    if half.abs() < 1e-4 {
        1.0 - half * half / 6.0
    } else {
        half.sin() / half
    }
}

/// `½ (1 − e²)²` and `½ (1 − e⁴)` of a heading's variance `s`: of its direction along the mean one and across it.
fn moments(s: f64) -> [f64; 2] {
    let loss = -(-s).exp_m1();
    [0.5 * loss * loss, 0.5 * loss * (2.0 - loss)]
}

/// `along r rᵀ + across (J r)(J r)ᵀ`, of a position.
fn outer([along, across]: [f64; 2], [x, y]: [f64; 2]) -> [f64; 9] {
    let xx = along * x * x + across * y * y;
    let (xy, yy) = ((along - across) * x * y, along * y * y + across * x * x);
    [xx, xy, 0.0, xy, yy, 0.0, 0.0, 0.0, 0.0]
}

fn scaled(matrix: &[f64; 9], factor: f64) -> [f64; 9] {
    matrix.map(|it| factor * it)
}

/// Of a pose's covariance, seen from a frame that is turned by `−angle`.
fn turned(covariance: &[f64; 9], angle: f64) -> [f64; 9] {
    let (sin, cos) = angle.sin_cos();
    let [xx, xy, xp, _, yy, yp, _, _, pp] = *covariance;
    let [xp, yp] = [cos * xp - sin * yp, sin * xp + cos * yp];
    let crossed = 2.0 * sin * cos * xy;
    let [ax, ay] = [
        cos * cos * xx + sin * sin * yy - crossed,
        sin * sin * xx + cos * cos * yy + crossed,
    ];
    let xy = sin * cos * (xx - yy) + (cos * cos - sin * sin) * xy;
    [ax, xy, xp, xy, ay, yp, xp, yp, pp]
}

/// The mean of noise in a body frame whose heading has the variance `s`.
fn at_any_heading(noise: &[f64; 9], s: f64) -> [f64; 9] {
    let [xx, xy, xp, _, yy, yp, _, _, pp] = *noise;
    let (e, half, kept) = ((-0.5 * s).exp(), 0.5 * (xx + yy), (-2.0 * s).exp());
    let (xx, yy, xy) = (
        half + kept * (xx - half),
        half + kept * (yy - half),
        kept * xy,
    );
    [xx, xy, e * xp, xy, yy, e * yp, e * xp, e * yp, pp]
}
