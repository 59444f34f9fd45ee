//! Configurations: what is accepted is the same again when it is written and read.

use std::path::Path;

use coloc_daemon::config::Config;
use coloc_daemon::config::understood::Understood;

use super::Target;

pub(super) const TARGET: Target = Target {
    name: "configuration",
    run,
    samples,
};

fn run(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let path = Path::new("/nowhere/robot.toml");
    match Config::parse(&text, path) {
        Ok(config) => {
            let written = toml::to_string(&config).expect("what was read can be written");
            let again = Config::parse(&written, path).expect("what was written can be read");
            assert_eq!(again, config);
            assert!(!Understood(&config).to_string().is_empty());
        }
        Err(problem) => assert!(!problem.to_string().is_empty()),
    }
}

fn samples() -> Vec<Vec<u8>> {
    let whole = "\
[robot]
name = \"robot1\"
id = 1
[[team]]
name = \"robot2\"
id = 2
[clock]
source = \"realtime\"
[tick]
rate_hz = 50.0
trigger = \"timer\"
[shm]
root = \"/run/coloc\"
prefix = \"coloc\"
[odometry]
buses = [\"socketcan:can0\", \"local:bus\"]
max_speed_mps = 2.0
[odometry.wheels]
track_m = 0.287
left = { message = \"WheelLeft\", signal = \"Ticks\", metres_per_tick = 1e-4 }
right = { bus = 1, message = \"WheelRight\", signal = \"Ticks\", metres_per_tick = 1e-4 }
[odometry.base]
track_m = 0.3
metres_per_count = [1e-4, 1e-4]
[initial]
pose = [0.0, 0.0, 1.5]
resume = true
[history]
length_s = 2.0
capacity = 1024
[telemetry]
state_hz = 1.0
";
    let small = "[robot]\nname = \"a\"\nid = 1\n";
    vec![whole.into(), small.into()]
}
