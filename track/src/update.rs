//! What a reading says of a state.

use coloc_estimator::Pose;
use coloc_estimator::angle::wrap;
use core::f64::consts::PI;
use nalgebra::{Matrix1, Matrix2, SMatrix, SVector, Vector1, Vector2};

use crate::heading::direction_of;
use crate::plane::{azimuth, azimuth_slope, sight};
use crate::reading::Reading;
use crate::sensor::Sensors;
use crate::state::{Core, Covariance, SIZE, State, slow_at};
use crate::{CHI2_1_999, CHI2_2_999};

/// No reading is better than this across the line of sight: 1 mm \[m²\].
pub(crate) const FLOOR: f64 = 1e-6;

/// A range has no direction nearer than this \[m\].
const NEAREST_M: f64 = 1e-3;

/// Accept if d² is at most this.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Gates {
    /// Of one number.
    pub one: f64,
    /// Of two.
    pub two: f64,
}

impl Default for Gates {
    fn default() -> Self {
        Self {
            one: CHI2_1_999,
            two: CHI2_2_999,
        }
    }
}

impl Gates {
    /// Everything is accepted that means anything.
    pub const OPEN: Self = Self {
        one: f64::INFINITY,
        two: f64::INFINITY,
    };
}

/// What came of a reading.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Else nothing has changed.
    pub accepted: bool,
    /// Normalised innovation squared.
    pub d2: f64,
}

/// `ν = H δx + n`
#[derive(Copy, Clone, Debug)]
pub(crate) struct Linearised<const M: usize> {
    pub(crate) slopes: SMatrix<f64, M, SIZE>,
    pub(crate) innovation: SVector<f64, M>,
    pub(crate) noise: SMatrix<f64, M, M>,
}

/// How far a reading is from a state.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Distance {
    pub(crate) d2: f64,
    pub(crate) log_determinant: f64,
}

/// The place from which a sensor looks, and where its slow errors are.
#[derive(Copy, Clone, Debug)]
pub(crate) struct View {
    mount: Vector2<f64>,
    turned: f64,
    slow: Option<usize>,
}

impl View {
    /// Of sensor `index`; of one that is not there, from the middle.
    pub(crate) fn of(sensors: &Sensors, index: usize) -> Self {
        let Pose { x, y, phi } = sensors.get(index).map_or(Pose::default(), |it| it.mount);
        Self {
            mount: Vector2::new(x, y),
            turned: phi,
            slow: sensors.slow_place(index).map(slow_at),
        }
    }

    /// Range and bearing, as a position across and along the line of sight.
    pub(crate) fn position(
        &self,
        range_m: f64,
        bearing_rad: f64,
        white: [f64; 2],
    ) -> Linearised<2> {
        let rows = sight(bearing_rad + self.turned);
        let across = (range_m * range_m * white[1]).max(FLOOR);
        let mut slopes = SMatrix::<f64, 2, SIZE>::zeros();
        slopes.fixed_view_mut::<2, 2>(0, 0).copy_from(&rows);
        if let Some(place) = self.slow {
            slopes[(0, place)] = range_m;
            slopes[(1, place + 1)] = range_m;
        }
        Linearised {
            slopes,
            innovation: Vector2::new(range_m, 0.0) + rows * self.mount,
            noise: Matrix2::new(white[0], 0.0, 0.0, across),
        }
    }

    /// A range alone; `None` where it has no direction.
    fn range(&self, state: &State, range_m: f64, white: f64) -> Option<Linearised<1>> {
        let line = state.position() - self.mount;
        let range = line.norm();
        if range < NEAREST_M {
            return None;
        }
        let scale = self.slow.map_or(1.0, |place| 1.0 + state.mean[place]);
        let mut slopes = SMatrix::<f64, 1, SIZE>::zeros();
        slopes
            .fixed_view_mut::<1, 2>(0, 0)
            .copy_from(&(line.transpose() * (scale / range)));
        if let Some(place) = self.slow {
            slopes[(0, place)] = range;
        }
        Some(Linearised {
            slopes,
            innovation: Vector1::new(range_m - range * scale),
            noise: Matrix1::new(white),
        })
    }

    /// A bearing alone, and whether the state lies before the sensor and not behind it.
    fn bearing(&self, state: &State, bearing_rad: f64, white: f64) -> (Linearised<1>, bool) {
        let rows = sight(bearing_rad + self.turned);
        let line = state.position() - self.mount;
        let seen = rows * line;
        let range = line.norm();
        let mut slopes = SMatrix::<f64, 1, SIZE>::zeros();
        slopes.fixed_view_mut::<1, 2>(0, 0).copy_from(&rows.row(1));
        let slow = self.slow.map_or(0.0, |place| {
            slopes[(0, place + 1)] = range;
            state.mean[place + 1]
        });
        let linearised = Linearised {
            slopes,
            innovation: Vector1::new(-(seen.y + range * slow)),
            noise: Matrix1::new((range * range * white).max(FLOOR)),
        };
        (linearised, seen.x > 0.0)
    }
}

impl State {
    /// What sensor `index` of `sensors` measured.
    pub fn update(
        &mut self,
        reading: &Reading,
        sensors: &Sensors,
        index: usize,
        gates: &Gates,
    ) -> Outcome {
        let view = View::of(sensors, index);
        match *reading {
            Reading::RangeBearing {
                range_m,
                bearing_rad,
                white,
            } => self.apply(
                &self.expected(&view.position(range_m, bearing_rad, white)),
                gates.two,
            ),
            Reading::Range { range_m, white } => match view.range(self, range_m, white) {
                Some(linearised) => self.apply(&linearised, gates.one),
                None => Outcome {
                    accepted: false,
                    d2: f64::INFINITY,
                },
            },
            Reading::Bearing { bearing_rad, white } => {
                let (linearised, is_before) = view.bearing(self, bearing_rad, white);
                // What lies behind passes no gate.
                let gate = if is_before { gates.one } else { -1.0 };
                self.apply(&linearised, gate)
            }
        }
    }

    /// The neighbour's own bearing of the observer, in the neighbour's body frame; its variance is that of all its errors.
    pub fn update_reciprocal(&mut self, bearing_rad: f64, variance: f64, gates: &Gates) -> Outcome {
        let (position, seen_at) = (self.position(), azimuth(self.position()));
        let slope = azimuth_slope(position);
        match self.core {
            Core::Heading => {
                let mut slopes = SMatrix::<f64, 1, SIZE>::zeros();
                slopes
                    .fixed_view_mut::<1, 2>(0, 0)
                    .copy_from(&slope.transpose());
                slopes[2] = -1.0;
                let linearised = Linearised {
                    slopes,
                    innovation: Vector1::new(wrap(bearing_rad - seen_at - PI + self.mean[2])),
                    noise: Matrix1::new(variance),
                };
                self.apply(&linearised, gates.one)
            }
            Core::Linear => {
                let by_position = (slope.transpose() * self.position_covariance() * slope).x;
                let (direction, noise) =
                    direction_of(wrap(seen_at + PI - bearing_rad), variance + by_position);
                let mut slopes = SMatrix::<f64, 2, SIZE>::zeros();
                slopes.fixed_view_mut::<2, 2>(0, 2).fill_with_identity();
                let linearised = Linearised {
                    slopes,
                    innovation: direction - self.direction(),
                    noise,
                };
                self.apply(&linearised, gates.two)
            }
        }
    }

    /// The innovation of what was linearised at zero.
    pub(crate) fn expected<const M: usize>(&self, at_zero: &Linearised<M>) -> Linearised<M> {
        Linearised {
            innovation: at_zero.innovation - at_zero.slopes * self.mean,
            ..*at_zero
        }
    }

    /// d² and `ln det S` of range and bearing.
    pub(crate) fn distance(&self, linearised: &Linearised<2>) -> Distance {
        let spread = self.spread(linearised);
        Distance {
            d2: d2(&spread, &linearised.innovation),
            log_determinant: libm::log(spread.determinant()),
        }
    }

    fn spread<const M: usize>(&self, linearised: &Linearised<M>) -> SMatrix<f64, M, M> {
        linearised.slopes * self.covariance * linearised.slopes.transpose() + linearised.noise
    }

    /// Kalman's update in Joseph's form, if the gate accepts.
    pub(crate) fn apply<const M: usize>(
        &mut self,
        linearised: &Linearised<M>,
        gate: f64,
    ) -> Outcome {
        let Linearised {
            slopes,
            innovation,
            noise,
        } = linearised;
        let spread = self.spread(linearised);
        let d2 = d2(&spread, innovation);
        let inverse = spread.try_inverse().filter(|_| d2 <= gate);
        let Some(inverse) = inverse else {
            return Outcome {
                accepted: false,
                d2,
            };
        };
        let gain = self.covariance * slopes.transpose() * inverse;
        let left = Covariance::identity() - gain * slopes;
        self.mean += gain * innovation;
        if self.core == Core::Heading {
            self.mean[2] = wrap(self.mean[2]);
        }
        self.covariance =
            left * self.covariance * left.transpose() + gain * noise * gain.transpose();
        self.symmetrise();
        Outcome { accepted: true, d2 }
    }
}

/// `νᵀ S⁻¹ ν`; infinite where S has no inverse.
fn d2<const M: usize>(spread: &SMatrix<f64, M, M>, innovation: &SVector<f64, M>) -> f64 {
    spread.try_inverse().map_or(f64::INFINITY, |inverse| {
        innovation.dot(&(inverse * innovation))
    })
}
