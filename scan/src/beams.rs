//! A scan as rays.

use nalgebra::Vector2;

use crate::view::{MOST_BEAMS, Met, View};

/// How the scanner itself moves, in its own frame.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct ScannerMotion {
    /// Forward and left \[m/s\].
    pub velocity_m_s: [f64; 2],
    /// To the left \[rad/s\].
    pub turn_rad_s: f64,
}

/// A beam, seen from where the scanner was at some other moment.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Ray {
    /// Where it starts.
    pub(crate) origin: Vector2<f64>,
    /// Which way it goes, of length 1.
    pub(crate) direction: Vector2<f64>,
    /// What it met.
    pub(crate) met: Met,
}

impl Ray {
    /// Where it ended, if it met something.
    pub(crate) fn point(&self) -> Option<Vector2<f64>> {
        match self.met {
            Met::Surface(range) => Some(self.origin + self.direction * range),
            Met::Nothing | Met::Unknown => None,
        }
    }
}

#[derive(Copy, Clone, Debug)]
struct Beam {
    direction: Vector2<f64>,
    met: Met,
    time_s: f64,
    intensity: f32,
}

/// The beams of a scan, one after another.
#[derive(Debug)]
pub(crate) struct Beams {
    all: Vec<Beam>,
    angles: Option<(u32, u32, usize)>,
    motion: ScannerMotion,
    step_rad: f64,
    is_round: bool,
}

impl Beams {
    pub(crate) fn new() -> Self {
        Self {
            all: Vec::with_capacity(MOST_BEAMS),
            angles: None,
            motion: ScannerMotion::default(),
            step_rad: 0.0,
            is_round: false,
        }
    }

    /// Takes in a scan.
    pub(crate) fn fill(&mut self, view: &View<'_>, motion: ScannerMotion) {
        let raw = view.raw();
        let count = raw.ranges.len();
        let angles = Some((
            raw.angle_min_rad.to_bits(),
            raw.angle_increment_rad.to_bits(),
            count,
        ));
        if self.angles != angles {
            self.angles = angles;
            self.turn(view, count);
        }
        self.motion = motion;
        for (place, beam) in self.all.iter_mut().enumerate() {
            beam.met = view.met(place);
            beam.time_s = view.time(place);
            beam.intensity = view.intensity(place).unwrap_or(0.0);
        }
    }

    /// Which way its beams go, which is the same in nearly every scan.
    fn turn(&mut self, view: &View<'_>, count: usize) {
        self.step_rad = f64::from(view.raw().angle_increment_rad).abs();
        #[allow(clippy::cast_precision_loss)] // At most 2048.
        let round = count as f64 * self.step_rad;
        self.is_round = round > 2.0 * std::f64::consts::PI - 0.5 * self.step_rad;
        self.all.clear();
        self.all.extend((0..count).map(|place| {
            let (sin, cos) = view.angle(place).sin_cos();
            Beam {
                direction: Vector2::new(cos, sin),
                met: Met::Unknown,
                time_s: 0.0,
                intensity: 0.0,
            }
        }));
    }

    pub(crate) fn count(&self) -> usize {
        self.all.len()
    }

    /// From one beam to the next \[rad\].
    pub(crate) fn step_rad(&self) -> f64 {
        self.step_rad
    }

    /// Whether the beam after the last one is the first.
    pub(crate) fn is_round(&self) -> bool {
        self.is_round
    }

    /// The beam in that place; after the last one they begin again.
    fn at(&self, place: usize) -> &Beam {
        let count = self.all.len();
        &self.all[if place < count { place } else { place - count }]
    }

    pub(crate) fn met(&self, place: usize) -> Met {
        self.at(place).met
    }

    pub(crate) fn time_s(&self, place: usize) -> f64 {
        self.at(place).time_s
    }

    pub(crate) fn intensity(&self, place: usize) -> f32 {
        self.at(place).intensity
    }

    /// The place `by` beams further, round where the scanner sees all round.
    pub(crate) fn beside(&self, place: usize, by: isize) -> Option<usize> {
        let count = self.all.len().cast_signed();
        let beside = place.cast_signed() + by;
        if self.is_round {
            return Some(beside.rem_euclid(count).cast_unsigned());
        }
        (0..count)
            .contains(&beside)
            .then_some(beside.cast_unsigned())
    }

    /// Where the beam in that place ended, as the scanner saw it.
    pub(crate) fn point(&self, place: usize) -> Option<Vector2<f64>> {
        match self.at(place).met {
            Met::Surface(range) => Some(self.at(place).direction * range),
            Met::Nothing | Met::Unknown => None,
        }
    }

    /// The beam in that place, seen from where the scanner was at `time_s`.
    pub(crate) fn ray(&self, place: usize, time_s: f64) -> Ray {
        let beam = self.at(place);
        let later_s = beam.time_s - time_s;
        let turned = self.motion.turn_rad_s * later_s;
        let [forward, left] = self.motion.velocity_m_s;
        // The middle of the way it drove in between looks half as far round.
        let way = Vector2::new(forward - 0.5 * turned * left, left + 0.5 * turned * forward);
        let (sin, cos) = if turned.abs() < 1e-9 {
            (turned, 1.0)
        } else {
            turned.sin_cos()
        };
        let Vector2 { data, .. } = beam.direction;
        let [[x, y]] = data.0;
        Ray {
            origin: way * later_s,
            direction: Vector2::new(cos * x - sin * y, sin * x + cos * y),
            met: beam.met,
        }
    }
}
