//! `coloc-laser`: laser scanners, from the channel `scan` to the channels `relative_pose` and `sighting`.
//!
//! A scan, from the channel or a CARMEN log ([`lines`]) → [`driver`], which asks [`beliefs`] where the others are believed to be and
//! [`coloc_scan`] which of them it shows → [`publish`].
//!
//! * **What was not seen is not said.** Where a heading was seen, a whole relative pose is published. Where not, there are
//!   range and bearing, with their white and their slow errors: [`driver::Outlet::range_bearing`].
//! * **What is not published has a reason**, and each reason is counted.

pub mod beliefs;
pub mod driver;
pub mod lines;
mod past;
pub mod player;
pub mod program;
pub mod publish;
pub mod refusal;
pub mod section;
