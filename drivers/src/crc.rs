//! The checksum of automotive frames.

/// CRC-8 SAE J1850: polynomial 0x1D, start 0xFF, result inverted.
#[must_use]
pub fn crc8_j1850(bytes: impl IntoIterator<Item = u8>) -> u8 {
    !bytes.into_iter().fold(0xFF, |crc, byte| {
        (0..8).fold(crc ^ byte, |crc, _| shift(crc))
    })
}

const fn shift(crc: u8) -> u8 {
    if crc & 0x80 == 0 {
        crc << 1
    } else {
        (crc << 1) ^ 0x1D
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_catalogues_check_value() {
        assert_eq!(crc8_j1850(*b"123456789"), 0x4B);
    }

    #[test]
    fn autosars_example_values() {
        // AUTOSAR, Specification of CRC Routines, CRC8 (SAE J1850).
        assert_eq!(crc8_j1850([0, 0, 0, 0]), 0x59);
        assert_eq!(crc8_j1850([0xF2, 0x01, 0x83]), 0x37);
        assert_eq!(
            crc8_j1850([0x33, 0x22, 0x55, 0xAA, 0xBB, 0xCC, 0xDD, 0xEE, 0xFF]),
            0xCB
        );
    }
}
