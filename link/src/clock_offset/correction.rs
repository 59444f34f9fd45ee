//! What is done to a peer's stamps, and what doubt that leaves.
use super::Offset;

/// A correction of a peer's stamps that stays the same for as long as it may, so that stamps which were equal stay equal and one that
/// is sent back is the one that was sent.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Correction {
    /// What is added to the peer's stamps (ns).
    pub by_ns: i64,
    /// Variance of what is still wrong with them then, the same error for all of them (s²).
    pub variance_s2: f64,
}

/// A newer offset is taken over once its bounds are so much narrower than those of the one in force.
const NARROWER: f64 = 0.5;

impl Correction {
    /// The correction for an offset.
    #[must_use]
    pub fn of(offset: &Offset) -> Self {
        #[expect(clippy::cast_possible_truncation, reason = "to whole nanoseconds")]
        let by_ns = (-offset.offset_s * 1e9).round() as i64;
        Self {
            by_ns,
            variance_s2: offset.variance_s2(),
        }
    }

    /// The correction after a newer measurement: this one, with the doubt that there is of it now, while the offset that it stands for
    /// may still be right, and no far sharper one is known.
    #[must_use]
    pub fn after(&self, offset: &Offset) -> Self {
        let own_s = super::seconds(self.by_ns);
        // The error of the stamps lies within [offset + own − within, offset + own + within].
        let middle_s = offset.offset_s + own_s;
        let newer = Self::of(offset);
        let still_right = middle_s.abs() <= offset.within_s;
        let variance_s2 = middle_s.mul_add(middle_s, offset.variance_s2());
        if still_right && newer.variance_s2 > NARROWER * variance_s2 {
            return Self {
                variance_s2,
                ..*self
            };
        }
        newer
    }
}

/// What an error of the stamp does to a pose that is told of a robot, 3×3, full row-major (m², m·rad, rad²): `velocity` is
/// `[v_x, v_y, ω]` of that robot in its body frame (m/s, m/s, rad/s), `heading_rad` where it looks, `variance_s2` that of the stamp.
///
/// A pose y was measured at t, and is said to be of t + δ. The robot was at y(t + δ) = y(t) + ẏ δ then, so the message errs by −ẏ δ:
/// speed times `σ_t` along the direction of motion, and `ω σ_t` in the heading. Its covariance is `σ_t² ẏ ẏᵀ`, of rank one, with
/// ẏ = [R(φ) v, ω].
///
/// δ is what the measurement of the offset has wrong, the same for every message of the peer until the correction changes, and so as
/// common to all of them as the peer's belief is. So it belongs to the dependent part: in the independent one it would be averaged
/// away by the next ten messages, and it is not.
#[must_use]
pub fn blur(velocity: [f64; 3], heading_rad: f64, variance_s2: f64) -> [f64; 9] {
    let [v_x, v_y, turn] = velocity;
    let (sin, cos) = heading_rad.sin_cos();
    let rate = [cos * v_x - sin * v_y, sin * v_x + cos * v_y, turn];
    let mut rows = [0.0; 9];
    for (place, entry) in rows.iter_mut().enumerate() {
        *entry = variance_s2 * rate[place / 3] * rate[place % 3];
    }
    rows
}
