//! What really happens to a team, recorded or made up, on a regular grid of time.

use coloc_estimator::Pose;

/// A team of robots that drive: the truth, and what their wheels report of it.
///
/// Step `k` is the moment `k · dt`. The odometry of step `k` is the velocity over `(k, k + 1]`: held along an arc it
/// leads from where the robot is at `k` to where it is at `k + 1`.
pub trait World: Sync {
    /// Length of a step \[s\].
    fn dt_s(&self) -> f64;
    /// Moments on the grid.
    fn steps(&self) -> usize;
    /// Robots in the team, numbered from 0 here (robot 0 is R1 on paper).
    fn robots(&self) -> usize;
    /// Where the robot is; `None` where nobody knows (tracking lost, or outside of the grid).
    fn truth(&self, step: usize, robot: usize) -> Option<Pose>;
    /// `[v, ω]` \[m/s, rad/s\] that the wheels report over `(step, step + 1]`.
    fn odometry(&self, step: usize, robot: usize) -> [f64; 2];

    /// The first pose that is known of the robot, where its estimators begin.
    fn initial(&self, robot: usize) -> Option<Pose> {
        (0..self.steps()).find_map(|step| self.truth(step, robot))
    }
}
