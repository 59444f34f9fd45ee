//! What this machine's kernel will do with a bus that has trouble.

use coloc_drivers::can::Controller;

use super::super::Config;
use super::super::finding::Finding;

pub(super) fn findings(config: &Config) -> Vec<Finding> {
    let buses = config.odometry.iter().flat_map(|it| &it.buses);
    buses
        .filter_map(Controller::of_bus)
        .flat_map(|(interface, controller)| controller.warnings(interface))
        .map(|it| Finding::new("odometry.buses", format!(": {it}")))
        .collect()
}
