//! How uncertain the wheels are: variances of an odometry sample as a function of its velocity.

/// `σ² = a + b v² + c ω²`, v in m/s, ω in rad/s, per reference period.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Variance {
    /// At standstill.
    pub a: f64,
    /// Per (m/s)².
    pub b: f64,
    /// Per (rad/s)².
    pub c: f64,
}

/// Odometry noise of the forward, sideways and turning velocity.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct OdometryNoise {
    /// Of v (or `v_x`) \[m²/s²\].
    pub forward: Variance,
    /// Of `v_y` \[m²/s²\]; unused by nonholonomic robots.
    pub sideways: Variance,
    /// Of ω \[rad²/s²\].
    pub turning: Variance,
}
