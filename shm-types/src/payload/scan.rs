//! What a laser scanner sees.
use iceoryx2::prelude::ZeroCopySend;

use super::Header;
use crate::layout::layout;

/// `coloc/<robot>/scan`: one turn of a laser scanner, with the fields of a ROS `LaserScan`.
#[derive(Copy, Clone, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("coloc.Scan.v1")]
pub struct Scan {
    /// When its first beam was measured, by which clock, and which scanner it is.
    pub header: Header,
    /// Of the first beam, from forward to the left (rad).
    pub angle_min: f32,
    /// Of the last one (rad). For people: the increment is what counts.
    pub angle_max: f32,
    /// From one beam to the next; below zero for a scanner that turns to the right (rad).
    pub angle_increment: f32,
    /// From one beam to the next (s).
    pub time_increment: f32,
    /// From one scan to the next (s).
    pub scan_time: f32,
    /// What is nearer was not measured (m).
    pub range_min: f32,
    /// What is at least so far was not hit (m).
    pub range_max: f32,
    /// So many ranges count, at most [`Self::MOST`].
    pub count: u16,
    /// So many intensities count: none, or as many as ranges.
    pub intensity_count: u16,
    /// Of each beam; not a number where it is not known (m).
    pub ranges: [f32; Self::MOST],
    /// How bright each was, in the scanner's own measure.
    pub intensities: [f32; Self::MOST],
}

layout!(Scan, 16456;
    header: 0, angle_min: 40, angle_max: 44, angle_increment: 48, time_increment: 52, scan_time: 56, range_min: 60,
    range_max: 64, count: 68, intensity_count: 70, ranges: 72, intensities: 8264,
);

impl Default for Scan {
    /// Of no beam.
    fn default() -> Self {
        Self {
            header: Header::default(),
            angle_min: 0.0,
            angle_max: 0.0,
            angle_increment: 0.0,
            time_increment: 0.0,
            scan_time: 0.0,
            range_min: 0.0,
            range_max: 0.0,
            count: 0,
            intensity_count: 0,
            ranges: [0.0; Self::MOST],
            intensities: [0.0; Self::MOST],
        }
    }
}

impl Scan {
    /// As many beams as fit.
    pub const MOST: usize = 2048;

    /// The ranges that count; what `count` says beyond [`Self::MOST`] is not there.
    #[must_use]
    pub fn ranges(&self) -> &[f32] {
        &self.ranges[..usize::from(self.count).min(Self::MOST)]
    }

    /// The intensities that count, likewise.
    #[must_use]
    pub fn intensities(&self) -> &[f32] {
        &self.intensities[..usize::from(self.intensity_count).min(Self::MOST)]
    }

    /// Takes in ranges and intensities; what does not fit is left out.
    pub fn fill(&mut self, ranges: &[f32], intensities: &[f32]) {
        self.count = copied(&mut self.ranges, ranges);
        self.intensity_count = copied(&mut self.intensities, intensities);
    }
}

#[allow(clippy::cast_possible_truncation)] // At most 2048.
fn copied(to: &mut [f32], from: &[f32]) -> u16 {
    let count = from.len().min(to.len());
    to[..count].copy_from_slice(&from[..count]);
    count as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_counts_is_never_more_than_there_is() {
        let mut scan = Scan::default();
        scan.fill(&[1.0, 2.0], &[0.5; 3000]);
        assert_eq!(
            (scan.ranges(), scan.intensities().len()),
            (&[1.0, 2.0][..], Scan::MOST)
        );
        scan.count = u16::MAX;
        assert_eq!(scan.ranges().len(), Scan::MOST);
    }
}
