//! What a robot's counters and estimates say of a pose that it was told.

use coloc_shm_types::{BeliefState, Estimate, Input, Reject, RobotName, Status};

use crate::listen::belief;

/// The robot and this program do not look at the same moment, and it goes on driving \[m, rad\].
const MOMENT: [f64; 3] = [0.1, 0.1, 0.05];
/// So many σ of what was said are still the same pose.
const SAME: f64 = 4.0;

/// What was said, and how things were before.
pub(super) struct Asked {
    pub(super) stamp_ns: i64,
    pub(super) source: u16,
    pub(super) pose: [f64; 3],
    pub(super) sigma: [f64; 3],
    pub(super) before: Estimate,
    pub(super) counted: Status,
}

/// What the robot has counted it as.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) enum Taken {
    Valid,
    Refused(Reject),
}

impl Asked {
    /// `None`: not counted yet.
    pub(super) fn taken(&self, counted: &Status) -> Option<Taken> {
        let more = |reason: &Reject| {
            let of = |status: &Status| status.rejected_of(Input::Pose, *reason);
            of(counted) > of(&self.counted)
        };
        if let Some(reason) = Reject::ALL.iter().copied().find(more) {
            return Some(Taken::Refused(reason));
        }
        let mut rows = counted.sources();
        let own = rows.find(|(input, row)| *input == Input::Pose && row.source == self.source)?;
        (own.1.newest_boot_ns >= self.stamp_ns).then_some(Taken::Valid)
    }

    /// Whether it is where it was told, and where its wheels have taken it since. How sure it is does not count: the doubt of a robot that
    /// does not know where it is holds any pose.
    pub(super) fn is_there(&self, estimate: &Estimate) -> bool {
        let expected = moved(self.pose, self.before.odometry, estimate.odometry);
        let near = |axis: usize, apart: f64| apart.abs() <= SAME * self.sigma[axis] + MOMENT[axis];
        let [x, y, heading] = estimate.pose;
        estimate.boot_ns > self.stamp_ns
            && near(0, x - expected[0])
            && near(1, y - expected[1])
            && near(2, wrapped(heading - expected[2]))
    }

    /// `there`: when it believed it; `now`: what came of that.
    pub(super) fn sentence(&self, robot: &RobotName, there: &Estimate, now: &Estimate) -> String {
        let [x, y, heading] = there.pose;
        let degrees = heading.to_degrees();
        let [before_x, before_y, _] = self.before.pose;
        let before = if self.before.state() == BeliefState::Ok {
            let apart = (self.pose[0] - before_x).hypot(self.pose[1] - before_y);
            format!("it had believed itself {apart:.2} m away")
        } else {
            "it had not known where it was".into()
        };
        format!(
            "{robot} is at {x:.2} m, {y:.2} m, {degrees:.1}°; {before}; belief: {}",
            belief(now)
        )
    }
}

/// `pose` after the way from `from` to `to` in another frame.
fn moved(pose: [f64; 3], from: [f64; 3], to: [f64; 3]) -> [f64; 3] {
    let turn = pose[2] - from[2];
    let (sin, cos) = turn.sin_cos();
    let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
    [
        pose[0] + cos * dx - sin * dy,
        pose[1] + sin * dx + cos * dy,
        to[2] + turn,
    ]
}

fn wrapped(angle: f64) -> f64 {
    let (sin, cos) = angle.sin_cos();
    sin.atan2(cos)
}

#[cfg(test)]
mod tests {
    use coloc_shm_types::SourceHealth;

    use super::*;

    const STAMP: i64 = 5_000_000_000;

    fn estimate(pose: [f64; 3], odometry: [f64; 3]) -> Estimate {
        Estimate {
            boot_ns: STAMP + 1,
            pose,
            odometry,
            state: BeliefState::Ok as u8,
            dependent: [1e-4, 0.0, 0.0, 0.0, 1e-4, 0.0, 0.0, 0.0, 1e-4],
            ..Estimate::default()
        }
    }

    /// Its doubt holds the pose that it was told long before it believes it.
    #[test]
    fn who_does_not_know_where_it_is_is_not_there() {
        let asked = asked();
        let wide = Estimate {
            dependent: [1e4, 0.0, 0.0, 0.0, 1e4, 0.0, 0.0, 0.0, 4.0],
            ..estimate([0.0; 3], [1.0, 1.0, 0.0])
        };
        assert!(!asked.is_there(&wide), "it is 22 m away");
        let there = estimate(asked.pose, [1.0, 1.0, 0.0]);
        assert!(asked.is_there(&there));
    }

    fn asked() -> Asked {
        Asked {
            stamp_ns: STAMP,
            source: 0,
            pose: [10.0, 20.0, 3.0],
            sigma: [0.1, 0.1, 0.05],
            before: estimate([0.0; 3], [1.0, 1.0, 0.0]),
            counted: Status::default(),
        }
    }

    #[test]
    fn it_is_there_if_it_drove_on_from_there() {
        let asked = asked();
        let (sin, cos) = 3.0_f64.sin_cos();
        let drove = |pose| asked.is_there(&estimate(pose, [3.0, 1.0, 0.5]));
        let there = [
            10.0 + 2.0 * cos,
            20.0 + 2.0 * sin,
            3.5 - std::f64::consts::TAU,
        ];
        assert!(drove(there));
        assert!(!drove([10.0, 20.0, 3.0]), "it has driven");
        assert!(!drove([there[0], there[1], there[2] + 0.5]));
        let early = Estimate {
            boot_ns: STAMP,
            ..estimate(there, [3.0, 1.0, 0.5])
        };
        assert!(!asked.is_there(&early));
    }

    #[test]
    fn what_is_counted_tells_whether_it_was_taken() {
        let asked = asked();
        let mut counted = Status::default();
        assert_eq!(asked.taken(&counted), None);
        let row = |source, newest_boot_ns| SourceHealth {
            input: Input::Pose as u8,
            source,
            newest_boot_ns,
            ..SourceHealth::default()
        };
        counted.sources[0] = row(1, STAMP);
        counted.sources[1] = row(0, STAMP - 1);
        assert_eq!(asked.taken(&counted), None, "a map's, and an earlier one");
        counted.sources[1] = row(0, STAMP);
        assert_eq!(asked.taken(&counted), Some(Taken::Valid));
        counted.rejected[Input::Pose as usize][Reject::NotFinite as usize] = 1;
        assert_eq!(
            asked.taken(&counted),
            Some(Taken::Refused(Reject::NotFinite))
        );
    }
}
