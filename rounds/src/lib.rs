//! A team's joint Kalman filter (Roumeliotis and Bekey, "Distributed multirobot localization", IEEE Trans. Robotics and Automation 18(5),
//! 2002) in rounds, a form that tolerates robots and messages that are missing.
//!
//! Between rounds a robot is alone: it keeps `x̂`, P, and Ψ, by which its cross-covariances have changed since its last round. At a slot
//! of the common clock a leader collects that and what robots see of one another, updates all of it jointly and tells everybody. What comes of
//! it is the joint filter's estimate, exactly, with the robots that were absent left out.
//!
//! * [`Member`]: a robot's own part, for the thread that ticks; a correction is an entry of its history.
//! * [`Round`]: what the team knows together, and the leader's update.
//! * [`Party`]: who leads, who takes part, how a missed round is fetched.
//! * [`Seat`](seat::Seat): a robot's place among them: its party, what it sees, and what `colocd` is to do.
//! * [`gate`]: what of a round a robot believes: it is no master key.
//! * [`model`], [`Joint`]: measurements and the filter itself.
//!
//! Robots are numbered from 0 in their team. Nothing here does I/O or has a clock.
#![forbid(unsafe_code)]

pub mod joint;
pub mod member;
pub mod model;
pub mod party;
pub mod round;
pub mod seat;

pub use coloc_estimator::rounds::{Correction, Refusal, Shared, Standing, gate};
pub use joint::{Joint, Outcome};
pub use member::{Member, Taken};
pub use party::{Message, Party, Post, Rules};
pub use round::{Going, Round, Share, Sighting};
