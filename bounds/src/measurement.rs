//! Measurements with bounds, and the half-planes that they leave.

use core::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::interval::{AngleInterval, RangeInterval, wrap};

/// Directions in which a sector wider than a half circle is supported.
const SECTOR_DIRECTIONS: usize = 16;

/// More directions than anybody needs.
const MOST_DIRECTIONS: usize = 256;

/// A robot, from 0, or a place that is known.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Place {
    /// By its number.
    Robot(usize),
    /// A landmark \[m\].
    At([f64; 2]),
}

/// What is known of `x_to − x_from`. Angles are in the common frame.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Seen {
    /// Where it points. Of half-width over π/2 it says nothing.
    Bearing(AngleInterval),
    /// Where it points, and its length.
    RangeBearing(AngleInterval, RangeInterval),
    /// It is in a box that is turned by a heading.
    Box {
        /// In the body frame \[m\].
        centre: [f64; 2],
        /// \[m\]
        half: [f64; 2],
        /// Of the body.
        heading: AngleInterval,
        /// How many directions the box is supported in, beside its own four.
        directions: usize,
    },
    /// Its length at most.
    RangeMax {
        /// \[m\]
        most: f64,
        /// How many sides the polygon around the circle has.
        directions: usize,
    },
}

/// Something that was measured, with bounds that hold.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Measurement {
    /// One place seen from another.
    Between {
        /// Who sees.
        from: Place,
        /// Who is seen.
        to: Place,
        /// What.
        seen: Seen,
    },
    /// Where a robot is.
    Fix {
        /// Which, from 0.
        robot: usize,
        /// \[m\]
        centre: [f64; 2],
        /// \[m\]
        half: [f64; 2],
    },
}

/// Why a measurement was not taken.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Refused {
    /// NaN, or infinite where that means nothing.
    NotFinite,
    /// A bound below zero.
    NegativeBound,
    /// A least range above the largest.
    ReversedRange,
    /// A robot that is not there.
    UnknownRobot,
    /// Nobody seen by itself.
    Itself,
    /// Fewer than three directions, or very many.
    Directions,
    /// It excludes what was known, so one of the two is wrong.
    Excluded,
}

/// `normal · d ≤ rhs`
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct HalfPlane {
    /// A unit vector.
    pub normal: [f64; 2],
    /// \[m\]
    pub rhs: f64,
}

/// `(cos ψ, sin ψ)`
pub(crate) fn unit(angle: f64) -> [f64; 2] {
    [libm::cos(angle), libm::sin(angle)]
}

/// Direction `index` of `count` that are equally spaced.
#[allow(clippy::cast_precision_loss)] // A few hundred.
pub(crate) fn spaced(index: usize, count: usize) -> f64 {
    TAU * index as f64 / count as f64
}

impl Measurement {
    /// Whether it can be used in a team of `robots`.
    ///
    /// # Errors
    /// Says why not.
    pub fn check(&self, robots: usize) -> Result<(), Refused> {
        match *self {
            Self::Between { from, to, seen } => {
                check_place(from, robots)?;
                check_place(to, robots)?;
                if from == to {
                    return Err(Refused::Itself);
                }
                seen.check()
            }
            Self::Fix {
                robot,
                centre,
                half,
            } => {
                check_place(Place::Robot(robot), robots)?;
                check_box(centre, half)
            }
        }
    }

    /// Calls `take` with each half-plane of `x_to − x_from`, or of the robot's position if it is a fix.
    pub fn half_planes(&self, take: &mut impl FnMut(HalfPlane)) {
        match *self {
            Self::Between { seen, .. } => seen.half_planes(take),
            Self::Fix { centre, half, .. } => {
                for (normal, rhs) in [
                    ([1.0, 0.0], centre[0] + half[0]),
                    ([-1.0, 0.0], half[0] - centre[0]),
                    ([0.0, 1.0], centre[1] + half[1]),
                    ([0.0, -1.0], half[1] - centre[1]),
                ] {
                    take(HalfPlane { normal, rhs });
                }
            }
        }
    }

    /// Who sees and who is seen; a fix is the robot seen from zero.
    #[must_use]
    pub fn ends(&self) -> (Place, Place) {
        match *self {
            Self::Between { from, to, .. } => (from, to),
            Self::Fix { robot, .. } => (Place::At([0.0; 2]), Place::Robot(robot)),
        }
    }
}

fn check_place(place: Place, robots: usize) -> Result<(), Refused> {
    match place {
        Place::Robot(robot) if robot >= robots => Err(Refused::UnknownRobot),
        Place::At(at) if !at.iter().all(|it| it.is_finite()) => Err(Refused::NotFinite),
        Place::Robot(_) | Place::At(_) => Ok(()),
    }
}

fn check_box(centre: [f64; 2], half: [f64; 2]) -> Result<(), Refused> {
    if !centre.iter().chain(&half).all(|it| it.is_finite()) {
        return Err(Refused::NotFinite);
    }
    if half.iter().any(|it| *it < 0.0) {
        return Err(Refused::NegativeBound);
    }
    Ok(())
}

fn check_angle(angle: AngleInterval) -> Result<(), Refused> {
    if !angle.centre.is_finite() || !angle.half.is_finite() {
        return Err(Refused::NotFinite);
    }
    if angle.half < 0.0 {
        return Err(Refused::NegativeBound);
    }
    Ok(())
}

fn check_range(range: RangeInterval) -> Result<(), Refused> {
    if range.least.is_nan() || range.most.is_nan() || range.least.is_infinite() {
        return Err(Refused::NotFinite);
    }
    if range.least < 0.0 {
        return Err(Refused::NegativeBound);
    }
    if range.most < range.least {
        return Err(Refused::ReversedRange);
    }
    Ok(())
}

fn check_directions(directions: usize, least: usize) -> Result<(), Refused> {
    if (least..=MOST_DIRECTIONS).contains(&directions) {
        Ok(())
    } else {
        Err(Refused::Directions)
    }
}

impl Seen {
    /// Whether it means anything.
    ///
    /// # Errors
    /// Says why not.
    pub fn check(&self) -> Result<(), Refused> {
        match *self {
            Self::Bearing(bearing) => check_angle(bearing),
            Self::RangeBearing(bearing, range) => {
                check_angle(bearing)?;
                check_range(range)
            }
            Self::Box {
                centre,
                half,
                heading,
                directions,
            } => {
                check_box(centre, half)?;
                check_angle(heading)?;
                check_directions(directions, 0)
            }
            Self::RangeMax { most, directions } => {
                check_range(RangeInterval { least: 0.0, most })?;
                check_directions(directions, 3)
            }
        }
    }

    fn half_planes(&self, take: &mut impl FnMut(HalfPlane)) {
        match *self {
            Self::Bearing(bearing) => cone(bearing, take),
            Self::RangeBearing(bearing, range) if bearing.half <= FRAC_PI_2 => {
                cone(bearing, take);
                trapezoid(bearing, range, take);
            }
            Self::RangeBearing(bearing, range) => wide_sector(bearing, range, take),
            Self::Box {
                centre,
                half,
                heading,
                directions,
            } => {
                let spaced = (0..directions).map(|k| spaced(k, directions));
                let own = [0.0, FRAC_PI_2, PI, 3.0 * FRAC_PI_2].map(|it| heading.centre + it);
                for psi in spaced.chain(own) {
                    let rhs = support_of_box(psi, centre, half, heading);
                    take(HalfPlane {
                        normal: unit(psi),
                        rhs,
                    });
                }
            }
            Self::RangeMax { most, directions } => {
                for k in 0..directions {
                    let normal = unit(spaced(k, directions));
                    take(HalfPlane { normal, rhs: most });
                }
            }
        }
    }
}

/// Two lines through zero. For more than a half circle they would cut the truth off, so there are none.
fn cone(bearing: AngleInterval, take: &mut impl FnMut(HalfPlane)) {
    if bearing.half > FRAC_PI_2 {
        return;
    }
    let [low_cos, low_sin] = unit(bearing.centre - bearing.half);
    let [high_cos, high_sin] = unit(bearing.centre + bearing.half);
    for normal in [[low_sin, -low_cos], [-high_sin, high_cos]] {
        take(HalfPlane { normal, rhs: 0.0 });
    }
}

/// The two lines across the line of sight.
fn trapezoid(bearing: AngleInterval, range: RangeInterval, take: &mut impl FnMut(HalfPlane)) {
    let [cos, sin] = unit(bearing.centre);
    if range.most.is_finite() {
        take(HalfPlane {
            normal: [cos, sin],
            rhs: range.most,
        });
    }
    take(HalfPlane {
        normal: [-cos, -sin],
        rhs: -range.least * libm::cos(bearing.half),
    });
}

fn wide_sector(bearing: AngleInterval, range: RangeInterval, take: &mut impl FnMut(HalfPlane)) {
    let own = [bearing.centre, bearing.centre + PI];
    let spaced = (0..SECTOR_DIRECTIONS).map(|k| spaced(k, SECTOR_DIRECTIONS));
    for psi in own.into_iter().chain(spaced) {
        let rhs = support_of_sector(psi, bearing, range);
        if rhs.is_finite() {
            take(HalfPlane {
                normal: unit(psi),
                rhs,
            });
        }
    }
}

/// How far a sector of a ring reaches in direction `psi`.
fn support_of_sector(psi: f64, bearing: AngleInterval, range: RangeInterval) -> f64 {
    let off = wrap(psi - bearing.centre).abs();
    let cosine = libm::cos((off - bearing.half).max(0.0));
    if cosine >= 0.0 {
        range.most * cosine
    } else {
        range.least * cosine
    }
}

/// How far a box of the body frame reaches in direction `psi`, at any heading of the interval.
#[must_use]
pub(crate) fn support_of_box(
    psi: f64,
    centre: [f64; 2],
    half: [f64; 2],
    heading: AngleInterval,
) -> f64 {
    let mut most = f64::NEG_INFINITY;
    for (a, b) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        let [x, y] = [centre[0] + a * half[0], centre[1] + b * half[1]];
        let off = wrap(psi - heading.centre - libm::atan2(y, x)).abs();
        let reach = libm::hypot(x, y) * libm::cos((off - heading.half).clamp(0.0, PI));
        most = most.max(reach);
    }
    most
}

/// By how much the trapezoid of a range and bearing is larger than their sector. Half-widths below π/2.
#[must_use]
pub fn over_approximation(half: f64, range: RangeInterval) -> f64 {
    let (least, most) = (range.least * range.least, range.most * range.most);
    let trapezoid = most * libm::tan(half) - least * libm::sin(half) * libm::cos(half);
    trapezoid / ((most - least) * half)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beyond_a_half_circle_a_bearing_says_nothing() {
        let count = |half: f64| {
            let mut count = 0;
            Seen::Bearing(AngleInterval::new(0.3, half)).half_planes(&mut |_| count += 1);
            count
        };
        assert_eq!(count(FRAC_PI_2), 2);
        assert_eq!(count(FRAC_PI_2 + 1e-9), 0);
    }

    #[test]
    fn bad_input_is_refused_by_its_reason() {
        let angle = AngleInterval::new(0.0, 0.1);
        let between = |from, to, seen| Measurement::Between { from, to, seen };
        let (a, b) = (Place::Robot(0), Place::Robot(1));
        let range = |least, most| Seen::RangeBearing(angle, RangeInterval { least, most });
        for (measurement, reason) in [
            (between(a, b, range(2.0, 1.0)), Refused::ReversedRange),
            (between(a, b, range(-1.0, 1.0)), Refused::NegativeBound),
            (between(a, b, range(f64::NAN, 1.0)), Refused::NotFinite),
            (
                between(a, Place::Robot(2), range(1.0, 2.0)),
                Refused::UnknownRobot,
            ),
            (between(a, a, range(1.0, 2.0)), Refused::Itself),
            (
                between(
                    a,
                    b,
                    Seen::RangeMax {
                        most: 1.0,
                        directions: 2,
                    },
                ),
                Refused::Directions,
            ),
            (
                Measurement::Fix {
                    robot: 0,
                    centre: [0.0; 2],
                    half: [-1.0, 0.0],
                },
                Refused::NegativeBound,
            ),
        ] {
            assert_eq!(measurement.check(2), Err(reason), "{measurement:?}");
        }
        assert_eq!(between(a, b, range(0.0, f64::INFINITY)).check(2), Ok(()));
    }
}
