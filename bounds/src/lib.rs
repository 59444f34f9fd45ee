//! The region in which a robot must be, if every error is within its bound: polytopes and linear programs instead of statistics.
//!
//! After J. Spletzer and C. J. Taylor, "A bounded uncertainty approach to multi-robot localization", IROS 2003. A measurement whose error
//! is in an interval says some linear inequalities of the robots' positions. All of them together are a polytope that holds the truth.
//! What is asked for is its shadow: where one robot can be, or one robot seen from another. Each linear program gives one straight line that the shadow
//! touches, so that it lies between two polygons, and every further program is spent where the two differ most.
//!
//! * [`AngleInterval`], [`RangeInterval`]; [`heading`]: how well headings are known.
//! * [`Measurement`] and its half-planes.
//! * [`Polytope`]: all inequalities, in a frame that is fixed by a [`Gauge`]; [`Region`]: a polytope that is not empty, and its shadows.
//! * [`Program`] and [`Simplex`]: the linear programs, with a value that rounding cannot make too small.
//! * [`Sandwich`]: the inner and the outer polygon.
//! * [`Team`]: regions that go on from epoch to epoch while robots move.
//! * [`slot`]: what the measurements of a slot bring, and who is suspected if they exclude one another.
//! * [`evidence`]: what a robot tells the others of a slot; [`monitor`]: what all of that leaves, slot by slot, and whether an estimate can be right.
//! * [`diagnosis`]: what does not fit, and how far an estimate is outside.
//!
//! Positions are the only unknowns. Headings come in as intervals. The same inputs give the same bits on any machine: sines are `libm`'s.
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::float_cmp))] // Where tests compare floats exactly, they mean it.

pub mod diagnosis;
pub mod evidence;
pub mod heading;
mod interval;
pub mod mean;
mod measurement;
pub mod monitor;
pub mod polygon;
mod polytope;
mod program;
mod sandwich;
pub mod simplex;
pub mod slot;
pub mod team;

pub use interval::{AngleInterval, RangeInterval, wrap};
pub use measurement::{HalfPlane, Measurement, Place, Refused, Seen, over_approximation};
pub use polytope::{
    Arena, BadFrame, Gauge, Objective, Polytope, Projection, Region, Row, Source, Support,
};
pub use program::Program;
pub use sandwich::{Limits, Sandwich, Shape, Side, Tolerance};
pub use simplex::Simplex;
pub use team::Team;
