//! The MR.CLAM recordings: five robots on an indoor floor, wheel odometry, sightings, Vicon truth.
//!
//! K. Y. K. Leung, Y. Halpern, T. D. Barfoot, H. H. T. Liu, "The UTIAS Multi-Robot Cooperative Localization
//! and Mapping Dataset", International Journal of Robotics Research 30(8):969–974, 2011.
//!
//! | file (plain or `.gz`) | columns |
//! | --- | --- |
//! | `RobotN_Odometry.dat` | time \[s\], forward velocity \[m/s\], angular velocity \[rad/s\], irregular |
//! | `RobotN_Odometry_50Hz.dat` | the same on a 50 Hz grid; optional, made from the file above where it is missing |
//! | `RobotN_Groundtruth.dat` | time \[s\], x \[m\], y \[m\], heading \[rad\], irregular or 50 Hz |
//! | `RobotN_Measurement.dat` | time \[s\], barcode, range \[m\], bearing \[rad\] |
//! | `Barcodes.dat` | subject, barcode |
//! | `Landmark_Groundtruth.dat` | subject, x \[m\], y \[m\], standard deviations \[m\] |
//!
//! [`Recording::load`] reads the rows as they are, [`Recording::resample`] puts them on a 50 Hz grid
//! ([`GridWorld`], a [`crate::World`]).

mod grid;
mod recording;
mod table;

pub use grid::GridWorld;
pub use recording::{Landmark, Measurement, OdometryRow, Recording, RobotRecord, TruthRow};
pub use table::{ReadError, ReadErrorKind};
