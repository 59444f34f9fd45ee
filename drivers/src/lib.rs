//! The sensors of coloc: CAN wheel encoders.
//!
//! * A frame keeps the kernel's receive stamp; when it was read does not matter.
//! * What comes from outside is checked once, here, and refused with a reason that is counted. No bytes panic.
//! * After start-up nothing allocates or blocks, also not when a bus is lost and found again.
//! * A bus that is gone is not an error but a state: say so in its health, keep trying, never spin.

mod broken;
pub mod can;
pub mod canopen;
mod config_error;
pub mod crc;
mod database;
mod dbc_text;
pub mod encoder;
pub mod signal;

pub use broken::is_broken;
pub use database::{COLOC_DBC, Database, DbcMessage};
