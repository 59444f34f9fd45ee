//! Who speaks: what a sender writes into its headers, who may speak to a robot, and whether a message was here before.

mod member;
mod sender;
mod sessions;

pub use sender::Sender;
pub use sessions::{Sessions, SourceState};
