//! Covariance matrices that have been checked once and are valid from then on.

use core::fmt;

use nalgebra::{Matrix2, Matrix3};

use crate::rotate::rotated;
use crate::symmetric::Symmetric3;

/// Why a matrix is not a covariance.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum NotACovariance {
    /// An entry is NaN or infinite, or so large that computing with it would overflow.
    NotFinite,
    /// Two entries across the diagonal differ by more than rounding.
    Asymmetric,
    /// An eigenvalue is below zero by more than rounding.
    NotPositiveSemidefinite,
}

impl fmt::Display for NotACovariance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotFinite => "an entry of the covariance is not a finite number",
            Self::Asymmetric => "the covariance is not symmetric",
            Self::NotPositiveSemidefinite => "the covariance has a negative eigenvalue",
        })
    }
}

impl core::error::Error for NotACovariance {}

/// What still counts as rounding, relative to the standard deviations of the two coordinates concerned:
/// whatever the units and however small or large, a correlation may be off by this much.
const ROUNDING: f64 = 1e-9;

/// Variances beyond this are refused, so that determinants of 3×3 matrices stay finite.
const LARGEST: f64 = 1e60;

/// A symmetric positive semidefinite 3×3 matrix over `[x, y, φ]` (or `[v_x, v_y, ω]`).
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Covariance3(Symmetric3);

/// A symmetric positive semidefinite 2×2 matrix over `[x, y]` (or `[v, ω]`).
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Covariance2 {
    xx: f64,
    xy: f64,
    yy: f64,
}

impl Covariance3 {
    /// No uncertainty at all.
    pub const ZERO: Self = Self(Symmetric3::ZERO);

    /// Checks `matrix`; what is stored is exactly symmetric.
    ///
    /// # Errors
    /// What is wrong with the matrix, in the order of [`NotACovariance`].
    pub fn new(matrix: Matrix3<f64>) -> Result<Self, NotACovariance> {
        checked(&matrix).map(Self)
    }

    /// [`Self::new`] of the nine entries, row by row.
    ///
    /// # Errors
    /// Those of [`Self::new`].
    pub fn from_row_major(entries: [f64; 9]) -> Result<Self, NotACovariance> {
        Self::new(Matrix3::from_row_slice(&entries))
    }

    /// A part beside `other`, of what may have been their sum's and its difference: its entries are judged by the sum's.
    ///
    /// # Errors
    /// Those of [`Self::new`].
    pub(crate) fn from_row_major_beside(
        entries: [f64; 9],
        other: &Self,
    ) -> Result<Self, NotACovariance> {
        let matrix = Matrix3::from_row_slice(&entries);
        let part = symmetrized(&matrix, &(matrix + other.matrix()))?;
        if is_semidefinite_beside(&part, &(part + other.symmetric())) {
            Ok(Self::trusted(&part))
        } else {
            Err(NotACovariance::NotPositiveSemidefinite)
        }
    }

    /// Uncorrelated coordinates with these variances.
    ///
    /// # Errors
    /// Those of [`Self::new`].
    pub fn diagonal(variances: [f64; 3]) -> Result<Self, NotACovariance> {
        Self::new(Matrix3::from_diagonal(&variances.into()))
    }

    /// Uncorrelated coordinates; a variance below zero counts as zero, one that is no number or too large as the largest.
    pub(crate) fn clamped_diagonal(variances: [f64; 3]) -> Self {
        let [xx, yy, pp] = variances.map(clamped);
        Self(Symmetric3 {
            xx,
            yy,
            pp,
            ..Symmetric3::ZERO
        })
    }

    /// What the algorithms computed: symmetric by its type, positive semidefinite by their construction.
    #[inline]
    pub(crate) fn trusted(s: &Symmetric3) -> Self {
        Self(*s)
    }

    /// The six numbers to compute with.
    #[inline]
    pub(crate) fn symmetric(&self) -> Symmetric3 {
        self.0
    }

    /// `factor · Σ`; a factor below zero counts as zero. Where the result is no covariance that can be computed with,
    /// nothing is known: every variance is the largest.
    #[must_use]
    #[inline]
    pub fn scaled(&self, factor: f64) -> Self {
        let scaled = self.0 * positive(factor);
        if (scaled.xx + scaled.yy) + scaled.pp <= LARGEST {
            return Self(scaled);
        }
        Self::clamped_diagonal([LARGEST; 3])
    }

    /// `Σ + other`, of errors that have nothing to do with each other; where that is too large to compute with, every variance is
    /// the largest.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        Self(self.0 + other.0).scaled(1.0)
    }

    /// Of a pose in a frame that is turned by `angle`, in the frame that is not \[rad\].
    #[must_use]
    pub fn turned(&self, angle: f64) -> Self {
        let (sin, cos) = libm::sincos(angle);
        Self::trusted(&rotated(&self.0, sin, cos))
    }

    /// With no variance below that of `floor`, whose variances are added where they are missing.
    #[must_use]
    pub fn with_floor(&self, floor: [f64; 3]) -> Self {
        let [xx, yy, pp] = floor.map(clamped);
        Self(Symmetric3 {
            xx: self.0.xx.max(xx),
            yy: self.0.yy.max(yy),
            pp: self.0.pp.max(pp),
            ..self.0
        })
    }

    /// Its diagonal.
    #[must_use]
    #[inline]
    pub fn variances(&self) -> [f64; 3] {
        [self.0.xx, self.0.yy, self.0.pp]
    }

    /// Whether `Σ − part` is positive semidefinite, to rounding: so that both are what they are called.
    #[must_use]
    #[inline]
    pub fn contains(&self, part: &Self) -> bool {
        let whole = self.symmetric();
        is_semidefinite_beside(&(whole - part.symmetric()), &whole)
    }

    /// The matrix.
    #[must_use]
    pub fn matrix(&self) -> Matrix3<f64> {
        Matrix3::from_row_slice(&self.to_row_major())
    }

    /// The nine entries, row by row.
    #[must_use]
    pub fn to_row_major(&self) -> [f64; 9] {
        let Symmetric3 {
            xx,
            xy,
            xp,
            yy,
            yp,
            pp,
        } = self.0;
        [xx, xy, xp, xy, yy, yp, xp, yp, pp]
    }
}

impl Covariance2 {
    /// With `variance` more in every direction; one that is not a positive finite number counts as zero.
    #[must_use]
    pub(crate) fn plus(&self, variance: f64) -> Self {
        let more = clamped(variance);
        Self {
            xx: self.xx + more,
            yy: self.yy + more,
            ..*self
        }
    }

    /// What the algorithms computed, as that of [`Covariance3`].
    #[inline]
    pub(crate) fn trusted(xx: f64, xy: f64, yy: f64) -> Self {
        Self { xx, xy, yy }
    }

    /// No uncertainty at all.
    pub const ZERO: Self = Self {
        xx: 0.0,
        xy: 0.0,
        yy: 0.0,
    };

    /// Checks `matrix`; what is stored is exactly symmetric.
    ///
    /// # Errors
    /// What is wrong with the matrix, in the order of [`NotACovariance`].
    pub fn new(matrix: Matrix2<f64>) -> Result<Self, NotACovariance> {
        let mut embedded = Matrix3::zeros();
        embedded.fixed_view_mut::<2, 2>(0, 0).copy_from(&matrix);
        let s = checked(&embedded)?;
        Ok(Self::trusted(s.xx, s.xy, s.yy))
    }

    /// [`Self::new`] of the four entries, row by row.
    ///
    /// # Errors
    /// Those of [`Self::new`].
    pub fn from_row_major(entries: [f64; 4]) -> Result<Self, NotACovariance> {
        Self::new(Matrix2::from_row_slice(&entries))
    }

    /// Uncorrelated coordinates with these variances.
    ///
    /// # Errors
    /// Those of [`Self::new`].
    pub fn diagonal(variances: [f64; 2]) -> Result<Self, NotACovariance> {
        Self::new(Matrix2::from_diagonal(&variances.into()))
    }

    /// Uncorrelated coordinates; a variance below zero counts as zero, one that is no number or too large as the largest.
    pub(crate) fn clamped_diagonal(variances: [f64; 2]) -> Self {
        let [xx, yy] = variances.map(clamped);
        Self::trusted(xx, 0.0, yy)
    }

    /// `factor · Σ`, as that of [`Covariance3`].
    #[must_use]
    #[inline]
    pub fn scaled(&self, factor: f64) -> Self {
        let factor = positive(factor);
        let scaled = Self::trusted(self.xx * factor, self.xy * factor, self.yy * factor);
        if scaled.xx + scaled.yy <= LARGEST {
            return scaled;
        }
        Self::clamped_diagonal([LARGEST; 2])
    }

    /// With no variance below that of `floor`, whose variances are added where they are missing.
    #[must_use]
    pub fn with_floor(&self, floor: [f64; 2]) -> Self {
        let [x, y] = floor.map(clamped);
        Self {
            xx: self.xx.max(x),
            yy: self.yy.max(y),
            ..*self
        }
    }

    /// Its diagonal.
    #[must_use]
    #[inline]
    pub fn variances(&self) -> [f64; 2] {
        [self.xx, self.yy]
    }

    /// The matrix.
    #[must_use]
    #[inline]
    pub fn matrix(&self) -> Matrix2<f64> {
        Matrix2::new(self.xx, self.xy, self.xy, self.yy)
    }

    /// The four entries, row by row.
    #[must_use]
    pub fn to_row_major(&self) -> [f64; 4] {
        [self.xx, self.xy, self.xy, self.yy]
    }
}

/// A variance: none is below zero, and one that is no number or too large says that nothing is known.
fn clamped(variance: f64) -> f64 {
    if variance <= LARGEST {
        positive(variance)
    } else {
        LARGEST
    }
}

/// What is no number stays none.
#[inline]
fn positive(a: f64) -> f64 {
    if a <= 0.0 { 0.0 } else { a }
}

/// The checks of [`Covariance3::new`], in the order of [`NotACovariance`].
fn checked(m: &Matrix3<f64>) -> Result<Symmetric3, NotACovariance> {
    let symmetric = symmetrized(m, m)?;
    if is_semidefinite(&symmetric) {
        Ok(symmetric)
    } else {
        Err(NotACovariance::NotPositiveSemidefinite)
    }
}

/// The first two of them; what counts as symmetric is judged by the variances of `whole`.
fn symmetrized(m: &Matrix3<f64>, whole: &Matrix3<f64>) -> Result<Symmetric3, NotACovariance> {
    if !m.iter().all(|entry| entry.abs() <= LARGEST) {
        return Err(NotACovariance::NotFinite);
    }
    Ok(Symmetric3 {
        xx: m.m11,
        xy: merged(m.m12, m.m21, whole.m11 * whole.m22)?,
        xp: merged(m.m13, m.m31, whole.m11 * whole.m33)?,
        yy: m.m22,
        yp: merged(m.m23, m.m32, whole.m22 * whole.m33)?,
        pp: m.m33,
    })
}

/// The mean of two entries across the diagonal, `scale` being the product of their variances; equal ones are returned
/// as they are.
fn merged(a: f64, b: f64, scale: f64) -> Result<f64, NotACovariance> {
    if a.to_bits() == b.to_bits() {
        return Ok(a);
    }
    if (a - b) * (a - b) > ROUNDING * ROUNDING * scale.max(f64::MIN_POSITIVE) {
        return Err(NotACovariance::Asymmetric);
    }
    Ok(0.5 * (a + b))
}

/// Whether the matrix, its diagonal raised by [`ROUNDING`], has positive pivots: so has the correlation matrix then.
fn is_semidefinite(s: &Symmetric3) -> bool {
    let is_possible = s.xx.min(s.yy).min(s.pp) >= 0.0 && !varies_without_variance(s);
    is_possible && is_semidefinite_beside(s, s)
}

/// The same, its diagonal raised by [`ROUNDING`] of another matrix's: what is left of that one's precision.
#[inline]
fn is_semidefinite_beside(s: &Symmetric3, scale: &Symmetric3) -> bool {
    let (xx, yy, pp) = (
        s.xx + raise(scale.xx),
        s.yy + raise(scale.yy),
        s.pp + raise(scale.pp),
    );
    let (l21, l31) = (s.xy / xx, s.xp / xx);
    let d2 = yy - l21 * s.xy;
    let rest = s.yp - l31 * s.xy;
    xx > 0.0 && d2 > 0.0 && pp - l31 * s.xp - rest / d2 * rest > 0.0
}

/// A coordinate without variance is correlated with nothing, to what a number can hold.
fn varies_without_variance(s: &Symmetric3) -> bool {
    let of = |one: f64, covariance: f64, other: f64| {
        one.min(other) == 0.0
            && covariance.abs() > largest_deviation(one) * largest_deviation(other)
    };
    of(s.xx, s.xy, s.yy) || of(s.xx, s.xp, s.pp) || of(s.yy, s.yp, s.pp)
}

/// A variance that is zero may have been too small for a number: its deviation, and a covariance with it, need not be.
fn largest_deviation(variance: f64) -> f64 {
    libm::sqrt(variance.max(ROUNDING * f64::MIN_POSITIVE))
}

/// Next to nothing where there is no variance: a pivot is to be divided by.
#[inline]
fn raise(variance: f64) -> f64 {
    variance * ROUNDING + f64::MIN_POSITIVE
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: [f64; 9] = [4.0, 1.0, -0.2, 1.0, 9.0, 0.3, -0.2, 0.3, 0.1];

    fn with(index: usize, value: f64) -> Result<Covariance3, NotACovariance> {
        let mut entries = GOOD;
        entries[index] = value;
        Covariance3::from_row_major(entries)
    }

    #[test]
    fn what_is_checked_is_kept_to_the_bit() {
        assert_eq!(
            Covariance3::from_row_major(GOOD).unwrap().to_row_major(),
            GOOD
        );
        assert_eq!(
            Covariance2::from_row_major([4.0, 1.0, 1.0, 9.0])
                .unwrap()
                .to_row_major(),
            [4.0, 1.0, 1.0, 9.0]
        );
    }

    #[test]
    fn each_fault_has_its_name() {
        assert_eq!(with(4, f64::NAN), Err(NotACovariance::NotFinite));
        assert_eq!(with(1, f64::INFINITY), Err(NotACovariance::NotFinite));
        assert_eq!(with(0, 1e61), Err(NotACovariance::NotFinite));
        assert_eq!(with(1, 1.000_001), Err(NotACovariance::Asymmetric));
        assert_eq!(with(8, -0.1), Err(NotACovariance::NotPositiveSemidefinite));
        assert_eq!(with(0, 0.1), Err(NotACovariance::NotPositiveSemidefinite));
        assert_eq!(
            Covariance2::from_row_major([1.0, 1.1, 1.1, 1.0]),
            Err(NotACovariance::NotPositiveSemidefinite)
        );
    }

    #[test]
    fn scale_does_not_matter() {
        for scale in [1e-90, 1e-20, 1.0, 1e50] {
            assert!(Covariance3::from_row_major(GOOD.map(|entry| entry * scale)).is_ok());
            assert!(
                Covariance3::from_row_major(
                    [4.0, 7.0, 0.0, 7.0, 9.0, 0.0, 0.0, 0.0, 1.0].map(|e| e * scale)
                )
                .is_err()
            );
        }
    }

    #[test]
    fn rounding_is_forgiven_and_removed() {
        let rounded = with(1, 1.0 + 1e-12).unwrap();
        assert_eq!(
            rounded.matrix().m12.to_bits(),
            rounded.matrix().m21.to_bits()
        );
        assert!(Covariance2::from_row_major([1.0, 1.0 + 1e-12, 1.0 + 1e-12, 1.0]).is_ok());
    }

    /// Of two entries across the diagonal, by the deviations of their own coordinates and no other's.
    #[test]
    fn rounding_is_what_is_small_beside_both_deviations() {
        let off_by = |(i, j): (usize, usize), deviations: [f64; 3], by: f64| {
            let mut m = Matrix3::from_diagonal(&deviations.map(|it| it * it).into());
            m[(i, j)] += by;
            Covariance3::new(m)
        };
        for (i, j) in [(0, 1), (0, 2), (1, 2), (1, 0), (2, 0), (2, 1)] {
            assert!(off_by((i, j), [1.0; 3], ROUNDING).is_ok());
            for axis in [i, j] {
                let mut deviations = [1.0; 3];
                deviations[axis] = 0.5;
                assert_eq!(
                    off_by((i, j), deviations, ROUNDING),
                    Err(NotACovariance::Asymmetric)
                );
            }
        }
    }

    #[test]
    fn a_part_is_judged_by_the_sum() {
        let mut part = Covariance3::diagonal([1e-20; 3]).unwrap().to_row_major();
        part[1] = 1e-12;
        assert!(Covariance3::from_row_major(part).is_err());
        let rest = Covariance3::diagonal([1.0; 3]).unwrap();
        assert!(Covariance3::from_row_major_beside(part, &rest).is_ok());
    }

    #[test]
    fn what_is_certain_contains_nothing_however_little() {
        for axis in 0..3 {
            let mut variances = [1.0; 3];
            variances[axis] = 0.0;
            let certain = Covariance3::diagonal(variances).unwrap();
            variances[axis] = f64::MIN_POSITIVE;
            assert!(!certain.contains(&Covariance3::diagonal(variances).unwrap()));
        }
    }

    #[test]
    fn singular_matrices_are_legal_but_nothing_correlates_with_certainty() {
        assert_eq!(Covariance3::from_row_major([0.0; 9]), Ok(Covariance3::ZERO));
        assert!(Covariance3::from_row_major([4.0, 2.0, 0.0, 2.0, 1.0, 0.0, 0.0, 0.0, 0.0]).is_ok());
        let certain = [0.0, 0.1, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0, 1.0];
        assert_eq!(
            Covariance3::from_row_major(certain),
            Err(NotACovariance::NotPositiveSemidefinite)
        );
    }

    #[test]
    fn a_variance_too_small_for_a_number_may_leave_a_covariance() {
        let (sin, cos) = libm::sincos(-1e-308);
        let along_a_beam = [
            cos * cos,
            sin * cos,
            0.0,
            sin * cos,
            sin * sin,
            0.0,
            0.0,
            0.0,
            0.0,
        ];
        assert_eq!((along_a_beam[1], along_a_beam[4]), (-1e-308, 0.0));
        assert!(Covariance3::from_row_major(along_a_beam).is_ok());
        let beyond = along_a_beam.map(|entry| if entry == -1e-308 { -1e-158 } else { entry });
        assert_eq!(
            Covariance3::from_row_major(beyond),
            Err(NotACovariance::NotPositiveSemidefinite)
        );
    }

    #[test]
    fn a_number_that_is_none_never_makes_anything_certain() {
        let [one, unknown] = [1.0, LARGEST].map(|v| Covariance3::diagonal([v; 3]).unwrap());
        let flat = Covariance2::diagonal([1.0; 2]).unwrap();
        assert_eq!(one.scaled(0.25), Covariance3::diagonal([0.25; 3]).unwrap());
        assert_eq!(
            (one.scaled(-1.0), one.scaled(0.0)),
            (Covariance3::ZERO, Covariance3::ZERO)
        );
        for factor in [f64::NAN, f64::INFINITY, 1e308, 1e61] {
            assert_eq!(one.scaled(factor), unknown);
            assert_eq!(
                flat.scaled(factor),
                Covariance2::diagonal([LARGEST; 2]).unwrap()
            );
        }
        let variances = Covariance3::clamped_diagonal([-1.0, f64::INFINITY, f64::NAN]);
        assert_eq!(
            variances,
            Covariance3::diagonal([0.0, LARGEST, LARGEST]).unwrap()
        );
        assert_eq!(
            Covariance2::clamped_diagonal([1e308, 2.0]),
            Covariance2::diagonal([LARGEST, 2.0]).unwrap()
        );
    }

    #[test]
    fn a_floor_raises_what_is_below_it_and_nothing_else() {
        let low = Covariance3::from_row_major([0.01, 0.01, 0.0, 0.01, 0.04, 0.0, 0.0, 0.0, 0.0]);
        let raised = low.unwrap().with_floor([0.02, 0.02, 0.003]).to_row_major();
        assert_eq!(raised, [0.02, 0.01, 0.0, 0.01, 0.04, 0.0, 0.0, 0.0, 0.003]);
        let flat = Covariance2::ZERO.with_floor([0.02, -1.0]).to_row_major();
        assert_eq!(flat, [0.02, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn a_part_is_contained_to_rounding_and_no_further() {
        let whole = Covariance3::from_row_major(GOOD).unwrap();
        for part in [0.0, 0.5, 1.0, 1.0 + 1e-12] {
            assert!(whole.contains(&whole.scaled(part)));
        }
        assert!(!whole.contains(&whole.scaled(1.0 + 1e-6)));
        assert!(!whole.contains(&Covariance3::diagonal([1.0, 8.5, 0.11]).unwrap()));
        assert!(Covariance3::ZERO.contains(&Covariance3::ZERO));
        assert!(!Covariance3::ZERO.contains(&Covariance3::diagonal([1e-9, 0.0, 0.0]).unwrap()));
    }
}
