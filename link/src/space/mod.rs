//! The link's ends in shared memory: ears for what its robot says to others, mouths for what others say.
//!
//! A channel is opened by its row in the table; which payload it carries is asked of nobody here.
mod ear;
mod mouth;

pub use ear::Ear;
pub use mouth::Mouth;
