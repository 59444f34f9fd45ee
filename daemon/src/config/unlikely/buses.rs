//! What this machine's kernel will do with a bus that has trouble.

use coloc_drivers::can::{BusSpec, Controller};

use super::super::Config;
use super::super::finding::Finding;

pub(super) fn findings(config: &Config) -> Vec<Finding> {
    let buses = config.odometry.iter().flat_map(|it| &it.buses);
    let warnings = buses.flat_map(|spec| match spec {
        BusSpec::SocketCan { interface } => warnings(interface),
        BusSpec::Local { .. } | BusSpec::Candump { .. } => Vec::new(),
    });
    warnings
        .map(|it| Finding::new("odometry.buses", format!(": {it}")))
        .collect()
}

/// An interface that is not here is no fault of a configuration that is read elsewhere.
fn warnings(interface: &str) -> Vec<String> {
    let here = Controller::of(interface).ok().flatten();
    here.map(|it| it.warnings(interface)).unwrap_or_default()
}
