//! `coloc-bounds`: where the robot must be if all errors are within their bounds, and whether its estimate can be right.
//!
//! Own wheels ([`wheels`]), own sightings, fixes and compass → the slot's evidence, for the others of the team; with theirs →
//! [`watch`], which is [`coloc_bounds`] on the slots of the common clock → the channel `integrity`.
//!
//! * **Raw data alone.** What `colocd` believes is judged and used for nothing: it may be what is wrong. So the wheels are read here again, by
//!   the same decoders from the same buses.
//! * **Nothing for `colocd`.** A belief is never changed from here.
//! * **Late is lost.** A slot is closed when its time has come, with the evidence that is there. Without evidence a region grows, and holds.
#![forbid(unsafe_code)]

pub mod program;
pub mod publish;
pub mod refusal;
pub mod section;
pub mod watch;
pub mod wheels;
