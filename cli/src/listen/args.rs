//! The command line of `coloc listen`.

use clap::Args;
use coloc_shm_types::RobotName;

use crate::place::PlaceArgs;

/// Prints the estimates of a robot whose daemon runs on this computer, as this user, or as one who lets a group of this user's
/// read (`[shm] group` of its robot.toml; docs/channels.md). One that does not run is waited for, and
/// one that goes is followed when it comes back; what happens to it is said on standard error. Ctrl-C ends it.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  coloc listen robot1
  coloc listen robot1 --json | jq .x_m
  coloc listen robot1 --tum > robot1.tum
  coloc listen robot1 --csv --count 1       # where is it now?

The table: age when it was printed; pose in the common frame; ± one standard deviation; forward velocity and turn rate;
belief (finding, ok, contradicted, lost; unfit: ok, and yet not good enough to drive on, for the reason on standard error);
odometry (never_seen, ok, stale, faulty, refused).

--json, an object a line, and --csv, a heading and then a row each. Without a unit in their name:
  robot            its name (JSON alone)
  session          hexadecimal: another one after every start of the daemon
  sequence, tick   estimates and ticks since that start
  clock            which clock stamp_ns is of: realtime, tai or boottime; boot_ns is the same moment by boottime
  covariance, velocity_covariance
                   3×3, row by row, of x_m, y_m, heading_rad and of vx_mps, vy_mps, omega_radps (JSON alone)
  state            finding, ok, contradicted or lost
  fit, unfit       whether it is good enough to drive on, and why not: \"position 1.24 m > 0.50 m\" (σ and [health]); empty: it is
  odometry_health, relative_pose_health, position_health, neighbour_health, pose_health, heading_health,
  gyro_health
                   how these inputs do: never_seen, ok, stale, faulty or refused
  opinion          what coloc-bounds says of it, with [integrity] action = \"health\": possible, estimate_outside,
                   bounds_violated, not_observable, stale or starting; else none
  odometry_x_m, odometry_y_m, odometry_heading_rad
                   the second pose: where the wheels alone have taken the robot since its daemon started; it jumps only
                   by what a late frame of the wheels corrects
What is not a number is null in JSON and NaN elsewhere.
--tum, for evaluation tools: timestamp x y z qx qy qz qw, in seconds of `clock` and metres.

Exit status: 0 --count were printed; 1 it could not be listened to, or not be written, 2 the arguments were not understood, \
130 it was interrupted (128 + the signal's number), 141 the reader of standard output went away.")]
pub(crate) struct ListenArgs {
    /// Its name; `coloc list` shows who runs
    pub(crate) robot: RobotName,
    /// A JSON object for every estimate
    #[arg(long, group = "form")]
    pub(crate) json: bool,
    /// A row of comma-separated values for every estimate
    #[arg(long, group = "form")]
    pub(crate) csv: bool,
    /// A line of a TUM trajectory for every estimate
    #[arg(long, group = "form")]
    pub(crate) tum: bool,
    /// At most one estimate in so many seconds, 0 for all [default: 0.2 for the table, else 0]
    #[arg(long, value_name = "S", value_parser = interval)]
    pub(crate) every: Option<f64>,
    /// End after so many estimates
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) count: Option<u64>,
    #[command(flatten)]
    pub(crate) place: PlaceArgs,
}

fn interval(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|seconds| (0.0..=86_400.0).contains(seconds))
        .ok_or_else(|| "must be a number of seconds, 0 to 86400".into())
}
