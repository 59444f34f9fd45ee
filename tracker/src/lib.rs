//! `coloc-track`: where the neighbours are, from the channel `sighting` to the channel `tracked`.
//!
//! What this robot's sensors see of others in part, how it moves ([`way`], from `estimate`), and what others say of their own motion
//! and of the bearing at which they saw it (`increment`) → [`tracker`], which is [`coloc_track`] on the time line of this computer →
//! [`publish`].
//!
//! * **A little behind.** All is taken in in the order in which it was, not in which it came, so tracks are as late as
//!   [`section::Track::delay_s`]. What comes later still is refused.
//! * **Nothing for `colocd`, unless it asks.** A track is made of sightings that `colocd` uses itself, and no worse; so nothing of it goes
//!   to a channel that `colocd` hears. With `sighting.through_track` `colocd` hears no sighting of a robot but by way of the tracks
//!   ([`feed`]): the pose of a track, of which nothing is independent, or the sighting as it came. Never both.
#![forbid(unsafe_code)]

pub mod feed;
pub mod program;
pub mod publish;
pub mod refusal;
pub mod section;
pub mod tracker;
pub mod way;
