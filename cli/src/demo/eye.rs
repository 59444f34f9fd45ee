//! What one robot's sensor of others says, and on which channel.

use coloc_shm_types::{
    Header, PortError, Publisher, RelativePose, RobotName, Scan, Sighting, Space,
};
use coloc_sim::laser::hall::{BEAMS, FARTHEST_M, FIRST_RAD, STEP_RAD, TURN_S};

use super::scene::{Camera, Eyes, Glance};

/// Its end of a channel.
pub(super) enum Eye {
    Poses(Publisher<RelativePose>),
    Parts(Publisher<Sighting>),
    Scans(Publisher<Scan>),
}

impl Eye {
    pub(super) fn open(space: &Space, robot: &RobotName, eyes: &Eyes) -> Result<Self, PortError> {
        Ok(match eyes {
            Eyes::Poses => Self::Poses(space.publisher(robot)?),
            Eyes::Camera(_) => Self::Parts(space.publisher(robot)?),
            Eyes::Scans(_) => Self::Scans(space.publisher(robot)?),
        })
    }

    // A message that did not reach everybody was for somebody who just died or was too slow: the others have it.

    pub(super) fn say_pose(&self, message: RelativePose) {
        if let Self::Poses(port) = self {
            let _ = port.send(message);
        }
    }

    pub(super) fn say_glance(&self, header: Header, glance: &Glance, observed: u16) {
        if let Self::Parts(port) = self {
            let _ = port.send(sighting(header, glance, observed));
        }
    }

    pub(super) fn say_scan(&self, header: Header, ranges: &[f32]) {
        if let Self::Scans(port) = self {
            let _ = port.send(scan(header, ranges));
        }
    }
}

fn sighting(header: Header, glance: &Glance, observed: u16) -> Sighting {
    Sighting {
        header,
        observed,
        has: Sighting::RANGE | Sighting::BEARING,
        who: Sighting::ROBOT,
        range: glance.range_m,
        bearing: glance.bearing_rad,
        white: Camera::WHITE,
        slow: Camera::SLOW,
        ..Sighting::default()
    }
}

/// Of the turn that begins at the header's stamp.
#[allow(clippy::cast_possible_truncation, clippy::cast_precision_loss)] // As a scanner says it.
fn scan(header: Header, ranges: &[f32]) -> Scan {
    let mut scan = Scan {
        header,
        angle_min: FIRST_RAD as f32,
        angle_max: (FIRST_RAD + (BEAMS - 1) as f64 * STEP_RAD) as f32,
        angle_increment: STEP_RAD as f32,
        time_increment: (TURN_S / BEAMS as f64) as f32,
        scan_time: TURN_S as f32,
        range_min: 0.05,
        range_max: FARTHEST_M as f32,
        ..Scan::default()
    };
    scan.fill(ranges, &[]);
    scan
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_and_a_glance_are_valid_messages() {
        let turn = scan(Header::default(), &[2.0; BEAMS]);
        let raw = coloc_laser::driver::raw(&turn);
        assert!(coloc_scan::View::check(raw).is_ok());
        let glance = Glance {
            observer: 0,
            observed: 1,
            range_m: 3.0,
            bearing_rad: 0.2,
        };
        let message = sighting(Header::default(), &glance, 2);
        assert!(message.has_range() && message.has_bearing() && message.observed == 2);
        assert!(message.white.iter().all(|it| *it > 0.0));
    }
}
