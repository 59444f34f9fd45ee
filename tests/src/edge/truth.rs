//! What came out, held against what really happened.

use coloc_drivers::encoder::{OdometryCounters, WheelOdometry};

use super::encoders::{MAX_SPEED_MPS, TRACK_M};
use super::world::World;
use super::{Fault, PERIOD_NS, demand};

/// What rounding may do to a wheel's way of some hundred metres \[m\].
const ROUNDING_M: f64 = 1e-8;

/// A frame's stamp is as good as the reading of the clocks \[ns\].
const STAMP_NS: i64 = 400_000;

#[derive(Debug, Default)]
pub(super) struct Truth {
    /// Sums over all samples: of each wheel \[m\].
    ways_m: [f64; 2],
    last_ns: Option<i64>,
    pub(super) samples: u64,
}

impl Truth {
    pub(super) fn take(&mut self, sample: &WheelOdometry, world: &mut World) -> Result<(), Fault> {
        let [v, sideways, omega] = sample.velocity;
        let wheels = [v - omega * TRACK_M / 2.0, v + omega * TRACK_M / 2.0];
        let dt_s = (sample.stamp_ns - sample.start_ns) as f64 * 1e-9;
        demand(dt_s > 0.0, || format!("{sample:?} goes back"))?;
        demand(sideways == 0.0 && dt_s.is_finite(), || {
            format!("{sample:?}")
        })?;
        let counted_once = self
            .last_ns
            .is_none_or(|last_ns| last_ns == sample.start_ns);
        demand(counted_once, || {
            format!(
                "{sample:?} does not begin at {:?}, where the last ended",
                self.last_ns
            )
        })?;
        let fastest = wheels[0].abs().max(wheels[1].abs());
        demand(fastest <= MAX_SPEED_MPS * (1.0 + 1e-6), || {
            format!("{sample:?} at {fastest} m/s")
        })?;
        for (way_m, speed) in self.ways_m.iter_mut().zip(wheels) {
            *way_m += speed * dt_s;
        }
        (self.last_ns, self.samples) = (Some(sample.stamp_ns), self.samples + 1);
        check_stamp(sample.stamp_ns, world)
    }

    /// All is over, and the robot has stood for a while.
    pub(super) fn close(&self, world: &World, counters: &OdometryCounters) -> Result<(), Fault> {
        let truth = world.ways_m();
        let off = [0, 1].map(|wheel| (self.ways_m[wheel] - truth[wheel]).abs());
        demand(off.iter().all(|off| *off <= ROUNDING_M), || {
            format!(
                "the wheels came {truth:?} m, and {:?} came out",
                self.ways_m
            )
        })?;
        let refused: u64 = counters.rejected.iter().sum();
        let known = world.received() == counters.accepted + refused;
        demand(known, || format!("frames are missing in {counters:?}"))?;
        demand(counters.resynchronised == 0 && counters.gaps == 0, || {
            format!("a way was given up: {counters:?}")
        })
    }
}

/// A sample ends when a frame came, as well as the clock of the stamps can be read; next to a step, by no more than that off.
fn check_stamp(stamp_ns: i64, world: &mut World) -> Result<(), Fault> {
    let off_ns = world.off_ns(stamp_ns);
    let allowed_ns = STAMP_NS + world.doubt_ns(stamp_ns);
    demand(off_ns <= allowed_ns, || {
        format!("a sample at {stamp_ns} is {off_ns} ns off any frame; {allowed_ns} are allowed")
    })?;
    let late_ns = stamp_ns - world.now_ns;
    demand(late_ns <= PERIOD_NS / 20, || {
        format!("a sample at {stamp_ns} is {late_ns} ns ahead of its tick")
    })
}
