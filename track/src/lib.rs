//! Where the neighbours are, seen from here: a filter for each, for control, identities and a heading where one becomes observable.
//!
//! Robot j sees its neighbour i in part: range and bearing, or one of them. A [`State`] holds i's pose in j's body frame, and the slow
//! errors of j's sensors. A first sighting says nothing of i's heading, so a track starts *linear*: `(c, s) = (cos φ, sin φ)` are two
//! free numbers, and the motion is exactly linear in them. A filter that begins with any heading and a large variance is linearised
//! at a heading that may be wrong by π, settles there and is sure of it. Once the heading is known the state is *converted*.
//!
//! * [`State`]: predict, update, start, convert, in the equations' own terms.
//! * [`Manager`]: which tracks there are, what a sighting is to them, and to which a sighting without identity belongs.
//! * [`publish()`]: what of a track may be told.
//! * [`feed()`](feed::feed): what of it takes the place of a sighting between robots.
//! * [`observability`]: what can be known at all.
//! * [`comparator`]: the filters of the thesis, for comparison: T. R. Wanasinghe, "Leader-Assisted Localization for a Heterogeneous
//!   Multi-Robot Team", chapter 5.
//!
//! For where a robot itself is, a track is poor: sightings used in both directions do better, [`coloc_estimator::partial`].
#![no_std]
#![forbid(unsafe_code)]
#![cfg_attr(test, allow(clippy::float_cmp))] // Where tests compare floats exactly, they mean it.

pub mod comparator;
pub mod feed;
mod heading;
mod increment;
pub mod manager;
pub mod observability;
mod plane;
mod predict;
pub mod publish;
mod reading;
mod rules;
mod sensor;
mod start;
mod state;
mod update;

pub use heading::Heading;
pub use increment::{Increment, Rate};
pub use manager::{Config, Manager, Seen, Sighting, Status, Track, Verdict};
pub use publish::{Published, publish};
pub use reading::Reading;
pub use rules::{Linear, Rules};
pub use sensor::{MOST_SENSORS, Sensor, Sensors, SlowErrors};
pub use state::{Core, SIZE, State};
pub use update::{Gates, Outcome};

/// χ² with one degree of freedom, 99.9 %: one number.
pub const CHI2_1_999: f64 = 10.827_566_170_662_733;

/// χ² with two degrees of freedom, 99.9 %: range and bearing.
pub const CHI2_2_999: f64 = 13.815_510_557_964_274;
