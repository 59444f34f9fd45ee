//! A line of a trajectory in the format of TUM's RGB-D benchmark: `timestamp x y z qx qy qz qw`.

use coloc_shm_types::Estimate;

pub(super) fn line(estimate: &Estimate) -> String {
    let [x, y, heading] = estimate.pose;
    let (qz, qw) = (heading / 2.0).sin_cos();
    let seconds = seconds(estimate.header.stamp_ns);
    format!("{seconds} {x} {y} 0 0 0 {qz} {qw}")
}

/// All digits: a floating-point number has none left for nanoseconds.
fn seconds(stamp_ns: i64) -> String {
    const NANOS: u64 = 1_000_000_000;
    let (whole, rest) = (
        stamp_ns.unsigned_abs() / NANOS,
        stamp_ns.unsigned_abs() % NANOS,
    );
    let sign = if stamp_ns < 0 { "-" } else { "" };
    format!("{sign}{whole}.{rest:09}")
}

#[cfg(test)]
mod tests {
    use super::super::reading::example;
    use super::*;

    #[test]
    fn a_pose_in_the_plane_is_one_in_space() {
        let line = line(&example());
        let (timestamp, rest) = line.split_once(' ').unwrap();
        assert_eq!(timestamp, "1700000000.020000001");
        let numbers: Vec<f64> = rest.split(' ').map(|word| word.parse().unwrap()).collect();
        assert_eq!(numbers[..5], [1.5, -2.25, 0.0, 0.0, 0.0]);
        assert!((2.0 * numbers[5].atan2(numbers[6]) - 0.5).abs() < 1e-12);
        assert!((numbers[5].hypot(numbers[6]) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn no_digit_of_a_stamp_is_lost_on_either_side_of_zero() {
        assert_eq!(seconds(0), "0.000000000");
        assert_eq!(seconds(1_000_000_020), "1.000000020");
        assert_eq!(seconds(-20), "-0.000000020");
        assert_eq!(seconds(i64::MIN), "-9223372036.854775808");
    }
}
