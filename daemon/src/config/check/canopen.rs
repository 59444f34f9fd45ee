//! CANopen drives on a bus that there is, and that can be sent to.

use coloc_drivers::can::BusSpec;

use super::super::Config;
use super::super::finding::Finding;

pub(super) fn refusal(config: &Config) -> Option<Finding> {
    let canopen = config.canopen.as_ref()?;
    let buses = config.odometry.as_ref().map(|it| it.buses.as_slice());
    let buses = buses.unwrap_or_default();
    let Some(bus) = buses.get(usize::from(canopen.bus)) else {
        let (number, count) = (canopen.bus, buses.len());
        let problem = format!(
            " = {number}: there is no such bus; odometry.buses has {count}, counted from 0"
        );
        return Some(Finding::new("canopen.bus", problem));
    };
    let sends = canopen.start || canopen.sync_period_s.is_some();
    if sends && matches!(bus, BusSpec::Candump { .. }) {
        let problem = format!(
            " = {}: {bus} is a recorded log, to which nothing can be sent",
            canopen.bus
        );
        return Some(Finding::new("canopen.bus", problem));
    }
    let period_s = canopen.sync_period_s?;
    let tick_s = 1.0 / config.tick.rate_hz;
    let problem =
        format!(" = {period_s}: SYNC is sent at ticks, of which there is one every {tick_s} s");
    // Rounding is no reason to refuse.
    (period_s < tick_s * (1.0 - 1e-9)).then(|| Finding::new("canopen.sync_period_s", problem))
}
