//! Robots whose cameras say range and bearing of whoever is in front of them.

use coloc_estimator::Pose;
use coloc_estimator::angle::wrap;
use coloc_sim::random::{Noise, Purpose};
use coloc_sim::sensors::relative;

use super::{Eyes, Scene, rings};
use crate::args::DemoArgs;
use crate::demo::DemoError;

/// Of a camera that sees tags: 3 cm and half a degree, new in every image.
const WHITE_SIGMAS: [f64; 2] = [0.03, 0.009];
/// What all images have: a scale that is off by 1 %, and a camera that is turned by half a degree.
const SLOW_SIGMAS: [f64; 2] = [0.01, 0.009];
/// For so long, as a robot believes \[s\].
const SLOW_S: f64 = 60.0;
/// It sees so far, and so far to each side.
const FARTHEST_M: f64 = 6.0;
const ASIDE_RAD: f64 = 1.0;

/// The cameras of all robots.
#[derive(Clone, Debug)]
pub(crate) struct Camera {
    noise: Noise,
}

/// What a camera says of one robot.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Glance {
    pub(crate) observer: usize,
    pub(crate) observed: usize,
    pub(crate) range_m: f64,
    pub(crate) bearing_rad: f64,
}

impl Camera {
    /// Of what is new in every image, and how long and how large what is slow is, as a message says it.
    pub(crate) const WHITE: [f64; 2] = [
        WHITE_SIGMAS[0] * WHITE_SIGMAS[0],
        WHITE_SIGMAS[1] * WHITE_SIGMAS[1],
    ];
    pub(crate) const SLOW: [f64; 4] = [SLOW_SIGMAS[0], SLOW_S, SLOW_SIGMAS[1], SLOW_S];

    /// From one image to the next \[s\].
    pub(crate) const EVERY_S: f64 = 0.1;

    /// What the camera of one robot says of another, if it is in the image.
    pub(crate) fn glance(
        &self,
        step: usize,
        (observer, from): (usize, &Pose),
        (observed, there): (usize, &Pose),
    ) -> Option<Glance> {
        let seen = relative(from, there);
        let (range_m, bearing_rad) = (seen.x.hypot(seen.y), seen.y.atan2(seen.x));
        let is_in_it =
            observer != observed && range_m <= FARTHEST_M && bearing_rad.abs() <= ASIDE_RAD;
        let new = self
            .noise
            .draws(Purpose::RelativePose, step, observer, observed)
            .normals::<2>();
        // As long as the demo lasts it is the same.
        let slow = self
            .noise
            .draws(Purpose::RelativeOutlier, 0, observer, observer)
            .normals::<2>();
        is_in_it.then(|| Glance {
            observer,
            observed,
            range_m: range_m * (1.0 + SLOW_SIGMAS[0] * slow[0]) + WHITE_SIGMAS[0] * new[0],
            bearing_rad: wrap(bearing_rad + SLOW_SIGMAS[1] * slow[1] + WHITE_SIGMAS[1] * new[1]),
        })
    }
}

pub(super) fn scene(args: &DemoArgs) -> Result<Scene, DemoError> {
    let camera = Camera {
        noise: Noise::new(args.seed, 0),
    };
    rings::scene(
        args,
        "camera",
        "by range and bearing alone",
        Eyes::Camera(camera),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_sees_who_is_in_front_of_it_and_near() {
        let camera = Camera {
            noise: Noise::new(1, 0),
        };
        let glance = |x, y| camera.glance(5, (0, &Pose::default()), (1, &Pose::new(x, y, 2.0)));
        let seen = glance(3.0, 1.0).unwrap();
        assert!((seen.range_m - 10.0_f64.sqrt()).abs() < 0.25, "{seen:?}");
        assert!(
            (seen.bearing_rad - (1.0_f64 / 3.0).atan()).abs() < 0.1,
            "{seen:?}"
        );
        assert_eq!(glance(-3.0, 1.0), None);
        assert_eq!(glance(7.0, 0.0), None);
    }
}
