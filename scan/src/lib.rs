//! Other robots in a laser scan: found by what they look like, told apart by where they are believed to be.
//!
//! [`view`] checks a scan once → [`Finder`]: pieces without a jump, windows of a few of them → a circle, a rectangle or a pattern of
//! marks is fitted ([`shape`]) → held against every beam that ought to meet it or to miss it → told apart ([`associate`]).
//!
//! * **No I/O, no clock, no allocation** after [`Finder::new`]: capacities are fixed, and what does not fit is counted.
//! * **Everything is seen from the scanner**, at the moment in which the middle of the robot was scanned: what the scanner moved
//!   meanwhile is taken out of every beam.
//! * **What was not seen is not said.** A cylinder has no heading. A rectangle has one once its faces say which way they look, and an
//!   identity is said once nobody else can be meant.
#![forbid(unsafe_code)]

pub mod associate;
pub mod beams;
pub mod carmen;
pub mod finder;
mod fit;
mod marks;
mod pieces;
pub mod shape;
pub mod view;

pub use finder::{Counts, Finder, Noise, Prior, Seen, Settings};
pub use shape::Look;
pub use view::{BadScan, MOST_BEAMS, Raw, View};
