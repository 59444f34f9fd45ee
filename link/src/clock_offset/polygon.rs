//! A convex polygon of offsets and drifts that may be.

/// The plane's half with `normal · point ≤ limit`.
#[derive(Copy, Clone, Debug)]
pub(super) struct HalfPlane {
    pub(super) normal: [f64; 2],
    pub(super) limit: f64,
}

impl HalfPlane {
    /// How far a point is outside.
    fn excess(&self, [a, b]: [f64; 2]) -> f64 {
        let [u, v] = self.normal;
        u.mul_add(a, v * b) - self.limit
    }
}

/// Corners in order; never empty.
#[derive(Clone, Debug)]
pub(super) struct Polygon(Vec<[f64; 2]>);

impl Polygon {
    /// |a| ≤ `offset`, |b| ≤ `drift`.
    pub(super) fn between(offset: f64, drift: f64) -> Self {
        Self(vec![
            [-offset, -drift],
            [offset, -drift],
            [offset, drift],
            [-offset, drift],
        ])
    }

    /// What of it lies in the half-plane (Sutherland and Hodgman, 1974); `None` if nothing does.
    pub(super) fn cut(&self, half: &HalfPlane) -> Option<Self> {
        let mut kept = Vec::with_capacity(self.0.len() + 1);
        let following = self.0.iter().cycle().skip(1);
        for (here, next) in self.0.iter().zip(following) {
            let [out, next_out] = [here, next].map(|corner| half.excess(*corner));
            if out <= 0.0 {
                kept.push(*here);
            }
            if (out <= 0.0) != (next_out <= 0.0) {
                let share = out / (out - next_out);
                kept.push([0, 1].map(|axis| share.mul_add(next[axis] - here[axis], here[axis])));
            }
        }
        (!kept.is_empty()).then_some(Self(kept))
    }

    /// The middle of what it spans along an axis, and half of how much that is.
    pub(super) fn extent(&self, axis: usize) -> (f64, f64) {
        let along = || self.0.iter().map(|corner| corner[axis]);
        let least = along().fold(f64::INFINITY, f64::min);
        let most = along().fold(f64::NEG_INFINITY, f64::max);
        (f64::midpoint(least, most), (most - least) / 2.0)
    }
}
