//! How a driver of a sensor is doing.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use crate::Health;
use crate::layout::layout;

/// `coloc/<robot>/driver`: what a driver has heard, said and refused, once a second. `source` in the header is that of its
/// sensor; `driver` tells the drivers of a robot apart that have the same.
#[derive(Copy, Clone, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.DriverStatus.v1")]
pub struct DriverStatus {
    /// When it was so, by which clock, and of which sensor.
    pub header: Header,
    /// Name of the driver in ASCII, such as `gnss`; the rest is zero.
    pub driver: [u8; 16],
    /// [`Health`] of its sensor; read it with [`Self::health`].
    pub health: u8,
    /// 1 while its device, connection or file is open.
    pub open: u8,
    /// Zero.
    pub reserved: [u8; 6],
    /// How often the device was opened.
    pub opened: u64,
    /// Bytes that came.
    pub bytes: u64,
    /// Messages that were whole and right.
    pub whole: u64,
    /// Messages that were broken, cut or mixed up.
    pub broken: u64,
    /// What was said on the robot's channels.
    pub said: u64,
    /// When the last of it was measured (ns of the header's clock), 0 if nothing was.
    pub said_ns: i64,
    /// What was refused, by the reasons of the driver.
    pub refused: [u64; 16],
    /// Some numbers of the driver's own. NaN: not known.
    pub figures: [f64; 8],
}

layout!(DriverStatus, 304;
    header: 0, driver: 40, health: 56, open: 57, reserved: 58, opened: 64, bytes: 72, whole: 80, broken: 88, said: 96,
    said_ns: 104, refused: 112, figures: 240,
);

impl DriverStatus {
    /// A driver's name, as `driver` has it; what is longer is cut.
    #[must_use]
    pub fn named(name: &str) -> [u8; 16] {
        let mut driver = [0; 16];
        for (place, byte) in driver.iter_mut().zip(name.bytes()) {
            *place = byte;
        }
        driver
    }

    /// Its name; what is no ASCII is left out.
    #[must_use]
    pub fn name(&self) -> String {
        let bytes = self.driver.iter().take_while(|byte| **byte != 0);
        let ascii = bytes.filter(|byte| byte.is_ascii_graphic());
        ascii.copied().map(char::from).collect()
    }

    /// How its sensor is doing.
    #[must_use]
    pub const fn health(&self) -> Health {
        Health::from_byte(self.health)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_travels_as_it_is() {
        for (name, read) in [
            ("gnss", "gnss"),
            ("", ""),
            ("0123456789abcdefgh", "0123456789abcdef"),
        ] {
            let status = DriverStatus {
                driver: DriverStatus::named(name),
                ..DriverStatus::default()
            };
            assert_eq!(status.name(), read);
        }
        assert_eq!(DriverStatus::default().health(), Health::NeverSeen);
    }
}
