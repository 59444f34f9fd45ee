//! Both filters with a height: four degrees of freedom, `[x, y, z, φ]`. Nothing of coloc flies; they are here to be compared with.

use coloc_estimator::angle::wrap;
use nalgebra::{Matrix3, Matrix3x4, Matrix4, Vector3, Vector4};

use crate::update::{FLOOR, Outcome};

/// The neighbour in the observer's frame.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct FourState {
    /// `[x, y, z, φ]`
    pub mean: Vector4<f64>,
    /// P
    pub covariance: Matrix4<f64>,
}

/// Range, azimuth and elevation, with their variances.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct SpatialReading {
    /// r \[m\]
    pub range_m: f64,
    /// θ \[rad\]
    pub azimuth_rad: f64,
    /// α \[rad\]
    pub elevation_rad: f64,
    /// Of the three \[m², rad², rad²\].
    pub variances: [f64; 3],
}

impl FourState {
    /// Euler's step, (5.7).
    pub fn euler(
        &mut self,
        observer: &Vector4<f64>,
        seen: &Vector4<f64>,
        noise: &Matrix4<f64>,
        seconds: f64,
    ) {
        let [x, y, _, phi] = self.mean.into();
        let (sin, cos) = libm::sincos(phi);
        let (along, across) = (seen.x * cos - seen.y * sin, seen.y * cos + seen.x * sin);
        let velocity = Vector4::new(
            along - observer.x + y * observer.w,
            across - observer.y - x * observer.w,
            seen.z - observer.z,
            seen.w - observer.w,
        );
        let mut slope = Matrix4::zeros();
        (slope.m12, slope.m21) = (observer.w, -observer.w);
        (slope.m14, slope.m24) = (-across, along);
        let map = Matrix4::identity() + slope * seconds;
        self.mean += velocity * seconds;
        self.mean.w = wrap(self.mean.w);
        self.covariance = map * self.covariance * map.transpose() + noise;
    }

    /// The pseudo-linear update, (5.3) to (5.8); `from_estimate`: R of the estimate, as printed, else of what was measured.
    pub fn pseudo_linear(&mut self, reading: &SpatialReading, from_estimate: bool) -> Outcome {
        let (st, ct) = libm::sincos(reading.azimuth_rad);
        let (sa, ca) = libm::sincos(reading.elevation_rad);
        #[rustfmt::skip]
        let slopes = Matrix3x4::new(
            ct * ca, st * ca, sa, 0.0,
            -st, ct, 0.0, 0.0,
            -ct * sa, -st * sa, ca, 0.0,
        );
        let (range, flat) = if from_estimate {
            let position = self.mean.xyz();
            (position.norm(), position.xy().norm())
        } else {
            (reading.range_m, reading.range_m * ca)
        };
        let [vr, vt, va] = reading.variances;
        let noise = [
            vr,
            (flat * flat * vt).max(FLOOR),
            (range * range * va).max(FLOOR),
        ];
        let innovation = Vector3::new(reading.range_m, 0.0, 0.0) - slopes * self.mean;
        self.learn(&slopes, &innovation, noise)
    }

    /// The traditional update: range and angles linearised at the estimate.
    pub fn traditional(&mut self, reading: &SpatialReading) -> Outcome {
        let [x, y, z, _] = self.mean.into();
        let (flat2, flat) = (x * x + y * y, libm::hypot(x, y));
        let range2 = flat2 + z * z;
        let range = libm::sqrt(range2);
        #[rustfmt::skip]
        let slopes = Matrix3x4::new(
            x / range, y / range, z / range, 0.0,
            -y / flat2, x / flat2, 0.0, 0.0,
            -x * z / (range2 * flat), -y * z / (range2 * flat), flat / range2, 0.0,
        );
        let innovation = Vector3::new(
            reading.range_m - range,
            wrap(reading.azimuth_rad - libm::atan2(y, x)),
            wrap(reading.elevation_rad - libm::atan2(z, flat)),
        );
        self.learn(&slopes, &innovation, reading.variances)
    }

    fn learn(
        &mut self,
        slopes: &Matrix3x4<f64>,
        innovation: &Vector3<f64>,
        noise: [f64; 3],
    ) -> Outcome {
        let noise = Matrix3::from_diagonal(&noise.into());
        let spread = slopes * self.covariance * slopes.transpose() + noise;
        let Some(inverse) = spread.try_inverse() else {
            return Outcome {
                accepted: false,
                d2: f64::INFINITY,
            };
        };
        let gain = self.covariance * slopes.transpose() * inverse;
        self.mean += gain * innovation;
        self.mean.w = wrap(self.mean.w);
        let left = Matrix4::identity() - gain * slopes;
        self.covariance =
            left * self.covariance * left.transpose() + gain * noise * gain.transpose();
        Outcome {
            accepted: true,
            d2: innovation.dot(&(inverse * innovation)),
        }
    }
}
