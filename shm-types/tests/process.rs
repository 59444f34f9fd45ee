//! What opening a space does to the process as a whole; alone in its binary, so that nothing else has done it before.
use coloc_shm_types::{Estimate, RobotName, Space};
use iceoryx2::config::Config;

fn caught_signals() -> String {
    let status = std::fs::read_to_string("/proc/self/status").expect("procfs");
    status
        .lines()
        .find(|line| line.starts_with("SigCgt"))
        .expect("a mask")
        .to_owned()
}

#[test]
fn it_catches_no_signals_and_reads_no_configuration_file() {
    let root = tempfile::tempdir().unwrap();
    let before = caught_signals();
    let space = Space::open(root.path(), "t", "test").unwrap();
    let _publisher = space
        .publisher::<Estimate>(&RobotName::new("r1").unwrap())
        .unwrap();
    assert_eq!(caught_signals(), before);
    assert_eq!(
        Config::global_config().global.prefix.to_string(),
        space.middleware_prefix()
    );
}
