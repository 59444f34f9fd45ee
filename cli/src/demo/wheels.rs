//! Where a robot would believe to be that has nothing but its wheels.

use coloc_estimator::Pose;
use coloc_shm_types::Estimate;
use coloc_sim::sensors::relative;

/// One robot's, from where it began.
#[derive(Clone, Debug, Default)]
pub(crate) struct WheelsAlone(Option<Laid>);

/// The odometry frame of one start of the daemon, laid into the common frame.
#[derive(Clone, Debug)]
struct Laid {
    session: u64,
    /// The same place in both.
    common: Pose,
    odometry: Pose,
    /// In the common frame.
    latest: Pose,
}

impl WheelsAlone {
    /// Where the wheels put the robot at `estimate`; where it really was, if that is the first one. A daemon that was started again
    /// goes on from where its predecessor ended.
    pub(crate) fn follow(&mut self, estimate: &Estimate, truth: &Pose) -> Pose {
        let [x, y, phi] = estimate.odometry;
        let odometry = Pose::new(x, y, phi);
        let session = estimate.header.session;
        let mut laid = match self.0.take() {
            Some(laid) if laid.session == session => laid,
            before => {
                let here = before.map_or(*truth, |laid| laid.latest);
                Laid {
                    session,
                    common: here,
                    odometry,
                    latest: here,
                }
            }
        };
        laid.latest = moved(&laid.common, &relative(&laid.odometry, &odometry));
        let latest = laid.latest;
        self.0 = Some(laid);
        latest
    }
}

/// `step`, in the body frame of `from`, after it.
pub(super) fn moved(from: &Pose, step: &Pose) -> Pose {
    let (sin, cos) = from.phi.sin_cos();
    Pose::new(
        from.x + cos * step.x - sin * step.y,
        from.y + sin * step.x + cos * step.y,
        from.phi + step.phi,
    )
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use coloc_shm_types::Header;

    use super::*;

    fn at(session: u64, odometry: [f64; 3]) -> Estimate {
        let header = Header {
            session,
            ..Header::default()
        };
        Estimate {
            header,
            odometry,
            ..Estimate::default()
        }
    }

    fn is(pose: Pose, expected: [f64; 3]) -> bool {
        let [x, y, phi] = expected;
        let off = [pose.x - x, pose.y - y, pose.phi - phi];
        off.into_iter().all(|off| off.abs() < 1e-12)
    }

    #[test]
    fn the_way_of_the_wheels_begins_where_the_robot_was_and_goes_on_after_a_restart() {
        let mut wheels = WheelsAlone::default();
        let north = Pose::new(2.0, 1.0, FRAC_PI_2);
        let elsewhere = Pose::new(50.0, 50.0, 0.0);
        assert!(is(
            wheels.follow(&at(1, [9.0, 9.0, 0.0]), &north),
            [2.0, 1.0, FRAC_PI_2]
        ));
        let ahead = wheels.follow(&at(1, [12.0, 9.0, -FRAC_PI_2]), &elsewhere);
        assert!(is(ahead, [2.0, 4.0, 0.0]), "three metres north: {ahead:?}");
        let again = wheels.follow(&at(2, [0.0; 3]), &elsewhere);
        assert!(is(again, [2.0, 4.0, 0.0]), "{again:?}");
        let east = wheels.follow(&at(2, [1.0, 0.0, 0.0]), &elsewhere);
        assert!(is(east, [3.0, 4.0, 0.0]), "{east:?}");
    }
}
