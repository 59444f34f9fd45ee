//! What the kernel keeps of the wheels' frames while the tick does not come: a stopped process loses no way.

use std::time::Duration;

use coloc_drivers::can::{Bus, BusSpec, Shortage};
use coloc_drivers::encoder::OdometryDecoder;
use tracing::warn;

/// So long nobody may take frames. Longer than any stall that a robot survives, and a few megabytes.
pub(crate) const KEPT: Duration = Duration::from_secs(60);

/// Asks for room on every bus. What cannot be had is said, in one line for each limit of the kernel that is in the way.
pub(super) fn reserve(buses: &mut [Bus], specs: &[BusSpec], decoder: Option<&OdometryDecoder>) {
    let Some(decoder) = decoder else { return };
    let short = buses.iter_mut().zip(specs).filter_map(|(bus, spec)| {
        let frames = decoder.frames_in(bus.number(), KEPT);
        bus.keep(frames).map(|shortage| (spec, shortage))
    });
    for (spec, shortage) in worst(short.collect()) {
        warn!("{spec}: {shortage}");
    }
}

/// Of each limit the bus that needs the most: what helps it helps the others.
fn worst<S>(mut short: Vec<(S, Shortage)>) -> Vec<(S, Shortage)> {
    short.sort_by_key(|(_, shortage)| (shortage.setting(), std::cmp::Reverse(shortage.wanted)));
    short.dedup_by_key(|(_, shortage)| shortage.setting());
    short
}
