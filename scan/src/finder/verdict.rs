//! What all beams say of a body that was fitted.

use nalgebra::Vector2;

use super::settings::Noise;
use crate::beams::{Beams, Ray};
use crate::fit::{Fit, off_surface};
use crate::shape::Body;
use crate::view::Met;

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
pub(super) struct Verdict {
    /// They met its surface.
    pub(super) hits: usize,
    /// They went through it.
    pub(super) through: usize,
    /// From the first to the last of these, in beams from the middle.
    met: Option<[isize; 2]>,
    /// Whether something begins right beside it, to the one side and to the other.
    pub(super) beside: [bool; 2],
    /// Whether something farther is seen beside it.
    free: [bool; 2],
    /// Whether something stands in front of it at the last beam.
    is_hidden: bool,
    /// Normals of the first surface that was met, and whether there is another.
    face: Option<Vector2<f64>>,
    has_faces: bool,
}

impl Verdict {
    fn note(&mut self, beam: isize, normal: Vector2<f64>) {
        let [first, last] = self.met.unwrap_or([beam; 2]);
        self.met = Some([first.min(beam), last.max(beam)]);
        let face = *self.face.get_or_insert(normal);
        self.has_faces |= face.dot(&normal) < 0.999;
    }

    /// From the first beam that met it to behind the last one, if the middle is there.
    pub(super) fn window(&self, middle: usize, beams: &Beams) -> Option<[usize; 2]> {
        let [first, last] = self.met?;
        let middle = middle.cast_signed();
        let round = if middle + first < 0 {
            beams.count().cast_signed()
        } else {
            0
        };
        let window = [middle + first + round, middle + last + round + 1];
        Some(window.map(isize::cast_unsigned))
    }

    /// Whether only one face was met.
    pub(super) fn is_flat(&self) -> bool {
        !self.has_faces
    }

    /// So many of its ends are seen in front of something farther.
    pub(super) fn ends(&self) -> usize {
        self.free.iter().filter(|it| **it).count()
    }

    /// What all beams say that ought to meet a body, or pass it closely.
    pub(super) fn of(beams: &Beams, noise: &Noise, fit: &Fit, time_s: f64, middle: usize) -> Self {
        let body = &fit.body;
        let step = body.centre().norm() * beams.step_rad();
        let loose = Loose {
            ring: RING_M.max(step),
            rim: RIM_M + fit.covariance[(0, 0)].max(fit.covariance[(1, 1)]).sqrt(),
        };
        let half = beams.count().cast_signed() / 2;
        let mut verdict = Self::default();
        for (side, by) in [(0, -1), (1, 1)] {
            verdict.is_hidden = false;
            let mut off = isize::from(by > 0);
            while let Some(place) = beams.beside(middle, by * off).filter(|_| off <= half) {
                let ray = beams.ray(place, time_s);
                verdict.weigh(body, &ray, &loose, noise, (side, by * off));
                if body.hit(&ray, loose.ring).is_none() {
                    break;
                }
                off += 1;
            }
        }
        verdict
    }

    fn weigh(
        &mut self,
        body: &Body,
        ray: &Ray,
        loose: &Loose,
        noise: &Noise,
        (side, beam): (usize, isize),
    ) {
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
            self.beside[side] |= goes_on && is_clear;
            self.free[side] |= !goes_on && !self.is_hidden && range > body.centre().norm();
            return;
        };
        let off = (range - hit.range) * hit.normal.dot(&ray.direction).abs();
        let sigma = off_surface(noise, hit.range, ray.direction, hit.normal).sqrt();
        if off.abs() <= 5.0 * sigma.max(noise.range_sigma_m) {
            self.hits += 1;
            self.is_hidden = false;
            self.note(beam, hit.normal);
        } else if range > hit.range && body.hit(ray, -loose.rim.min(0.3 * body.reach())).is_some() {
            self.through += 1;
        } else if range < hit.range {
            self.is_hidden = true;
            // Nothing stands so close in front of it.
            let is_close = ray
                .point()
                .is_some_and(|point| body.contains(point, loose.ring));
            self.through += usize::from(is_close);
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;
    use crate::beams::ScannerMotion;
    use crate::view::{Raw, View};

    const STEP: f64 = 0.02;

    /// What eleven beams that look at a circle 2 m ahead say of it, where those in between meet `range`.
    fn verdict(range: impl Fn(f64, f64) -> f64) -> Verdict {
        let (centre, radius) = (Vector2::new(2.0, 0.0), 0.1);
        let beam = |place: i32| {
            let (sin, cos) = (f64::from(place - 5) * STEP).sin_cos();
            let inside = radius * radius - 4.0 * sin * sin;
            let own = if inside > 0.0 {
                2.0 * cos - inside.sqrt()
            } else {
                5.0
            };
            #[allow(clippy::cast_possible_truncation)]
            let range = range(f64::from(place - 5) * STEP, own) as f32;
            range
        };
        let ranges: Vec<f32> = (0..11).map(beam).collect();
        #[allow(clippy::cast_possible_truncation)]
        let raw = Raw {
            angle_min_rad: (-5.0 * STEP) as f32,
            angle_increment_rad: STEP as f32,
            range_max_m: 10.0,
            ranges: &ranges,
            ..Raw::default()
        };
        let mut beams = Beams::new();
        beams.fill(&View::check(raw).unwrap(), ScannerMotion::default());
        let fit = Fit {
            body: Body::Round { centre, radius },
            covariance: Matrix3::identity() * 1e-6,
            heading: None,
            chi2: 0.0,
            freedom: 1.0,
            lone: None,
        };
        Verdict::of(&beams, &Noise::default(), &fit, 0.0, 5)
    }

    #[test]
    fn beams_that_meet_it_are_hits_and_it_is_free_on_both_sides() {
        let verdict = verdict(|_, own| own);
        assert_eq!((verdict.hits, verdict.through, verdict.ends()), (5, 0, 2));
        assert_eq!(verdict.beside, [false; 2]);
    }

    #[test]
    fn a_beam_that_goes_through_it_speaks_against_it() {
        let verdict = verdict(|angle, own| if angle == 0.0 { 3.0 } else { own });
        assert_eq!((verdict.hits, verdict.through), (4, 1));
    }

    #[test]
    fn what_goes_on_beside_it_is_no_end() {
        let verdict = verdict(|_, own| own.min(2.0));
        assert_eq!(verdict.beside, [true; 2]);
        assert_eq!(verdict.ends(), 0);
    }

    #[test]
    fn what_stands_in_front_of_it_hides_an_end() {
        let verdict = verdict(|angle, own| if angle > 0.03 { 1.0 } else { own });
        assert_eq!((verdict.hits, verdict.through, verdict.ends()), (4, 0, 1));
    }
}
