//! Vectors in the plane: two numbers that undergo the same, so that the compiler makes one instruction of each pair.

use core::ops::{Add, Mul, Sub};

/// `(x, y)`
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Plane {
    pub(crate) x: f64,
    pub(crate) y: f64,
}

impl Plane {
    #[inline]
    pub(crate) fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// `J v`: turned to the left by a right angle.
    #[inline]
    pub(crate) fn left(self) -> Self {
        Self::new(-self.y, self.x)
    }

    /// `(y, x)`
    #[inline]
    pub(crate) fn swapped(self) -> Self {
        Self::new(self.y, self.x)
    }

    /// Coordinate by coordinate.
    #[inline]
    pub(crate) fn times(self, b: Self) -> Self {
        Self::new(self.x * b.x, self.y * b.y)
    }
}

impl Add for Plane {
    type Output = Self;
    #[inline]
    fn add(self, b: Self) -> Self {
        Self::new(self.x + b.x, self.y + b.y)
    }
}

impl Sub for Plane {
    type Output = Self;
    #[inline]
    fn sub(self, b: Self) -> Self {
        Self::new(self.x - b.x, self.y - b.y)
    }
}

impl Mul<Plane> for f64 {
    type Output = Plane;
    #[inline]
    fn mul(self, b: Plane) -> Plane {
        Plane::new(self * b.x, self * b.y)
    }
}
