//! A recorded log, played by `canplayer` onto a bus and read by coloc itself: the same estimates, to the last bit.

use std::fmt::Write;
use std::path::Path;
use std::process::{Child, Command};

use coloc_drivers::can::BusSpec;
use coloc_drivers::encoder::WheelFrames;
use coloc_shm_types::Estimate;
use coloc_tests::rig::{METRES_PER_TICK, follow};

use super::support::Interface;

const PAIRS: usize = 200;

/// Four seconds at 50 Hz, of a robot that drives a slalom while another node talks.
fn write_log(path: &Path) {
    let mut encoders = WheelFrames::new(METRES_PER_TICK);
    let (mut log, mut way_m) = (String::new(), [0.0; 2]);
    for pair in 0..PAIRS {
        #[expect(clippy::cast_precision_loss, reason = "a few hundred")]
        let turn = (pair as f64 / 20.0).sin();
        way_m = [
            way_m[0] + 0.01 - 0.002 * turn,
            way_m[1] + 0.01 + 0.002 * turn,
        ];
        let micros = 1_700_000_000_000_000 + 20_000 * pair;
        let mut line = |id: u16, data: &[u8]| {
            let hex = data
                .iter()
                .fold(String::new(), |hex, byte| format!("{hex}{byte:02X}"));
            let (seconds, fraction) = (micros / 1_000_000, micros % 1_000_000);
            writeln!(log, "({seconds}.{fraction:06}) vcan0 {id:03X}#{hex}").unwrap();
        };
        for (id, frame) in [0x100, 0x101]
            .into_iter()
            .zip(encoders.encode(way_m[0], way_m[1]))
        {
            line(id, frame.data());
        }
        line(0x200, &[0xFF; 8]);
    }
    std::fs::write(path, log).unwrap();
}

/// `canplayer`, which ends by itself, or with this.
struct Player(Option<Child>);

impl Drop for Player {
    fn drop(&mut self) {
        if let Some(player) = &mut self.0 {
            let _ = (player.kill(), player.wait()); // It may have ended.
        }
    }
}

fn estimates(bus: &BusSpec, play: impl FnOnce() -> Option<Child>) -> Vec<Estimate> {
    let mut player = Player(None);
    follow(bus, PAIRS, || player.0 = play())
}

/// Everything but the count of ticks: a machine that was busy elsewhere reads two pairs at once.
fn bits(estimate: &Estimate) -> Vec<u64> {
    let Estimate {
        pose,
        velocity,
        independent,
        dependent,
        ..
    } = estimate;
    let numbers = [&pose[..], velocity, independent, dependent].concat();
    numbers.into_iter().map(f64::to_bits).collect()
}

#[test]
fn canplayer_and_the_log_itself_give_the_same_estimates_bit_for_bit() {
    let (interface, directory) = (Interface::new("vcan0"), tempfile::tempdir().unwrap());
    let log = directory.path().join("slalom.log");
    write_log(&log);
    let canplayer = || {
        let player = Command::new("canplayer").arg("-I").arg(&log).spawn();
        Some(player.expect("canplayer, of the package can-utils"))
    };
    let played = estimates(&interface.spec().parse().unwrap(), canplayer);
    let read = estimates(
        &BusSpec::Candump {
            path: log.clone(),
            interface: Some("vcan0".into()),
        },
        || None,
    );
    let last = [&played, &read].map(|estimates| estimates.last().unwrap().header.stamp_ns);
    assert_eq!(last[0], last[1], "every pair was read");
    assert!(
        played.iter().any(|estimate| estimate.pose[1].abs() > 1e-3),
        "a slalom"
    );
    let mut compared = 0;
    for played in &played {
        let same_stamp = |read: &&Estimate| read.header.stamp_ns == played.header.stamp_ns;
        if let Some(read) = read.iter().find(same_stamp) {
            assert_eq!(bits(played), bits(read), "{played:?}\n{read:?}");
            compared += 1;
        }
    }
    assert!(compared >= PAIRS / 10, "{compared} stamps in common");
}
