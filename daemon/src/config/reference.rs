//! The description of all settings for people: a commented `robot.toml`, and a table of each section.

mod annotated;
mod table;

pub use annotated::robot_toml;
pub use table::{configuration_md, section_md};
