//! The scenes in which robots see one another by scanners and cameras.

use serde_json::Value;

use crate::stage::Demo;

fn accepted(robot: &Value, kind: &str) -> u64 {
    robot["accepted"][kind].as_u64().unwrap()
}

/// Far looser than the demo's own bars: a busy machine may make it miss those.
#[test]
fn robots_are_found_in_scans_and_learn_from_it() {
    let ended = Demo::start(&["--laser", "--robots", "4", "--seconds", "6"]).end();
    let mut all = [0; 4];
    for number in 1..=4 {
        let robot = ended.robot(number);
        assert!(ended.estimates(number) > 50, "{robot}");
        // The third is round: of it, range and bearing alone are seen.
        let kinds = if number == 3 {
            ["relative_pose", "seen"]
        } else {
            ["sighting", "neighbour"]
        };
        let first = if number == 3 { 0 } else { 2 };
        for (sum, kind) in all[first..].iter_mut().zip(kinds) {
            *sum += accepted(robot, kind);
        }
    }
    assert!(all.iter().all(|it| *it > 0), "{all:?}: {}", ended.summary);
    let log = ended.folder.path().join("out/logs/robot1.laser.log");
    let log = std::fs::read_to_string(log).unwrap();
    assert!(log.contains("scans are looked through"), "{log}");
    let paths = std::fs::read_to_string(ended.folder.path().join("out/paths.svg")).unwrap();
    assert!(paths.contains("what coloc-laser finds in their scans"));
    ended.assert_left_nothing();
}

#[test]
fn who_sees_range_and_bearing_is_answered() {
    let ended = Demo::start(&["--camera", "--seconds", "6"]).end();
    let all = |kind: &str| -> u64 { (1..=5).map(|it| accepted(ended.robot(it), kind)).sum() };
    for kind in ["sighting", "seen", "answer"] {
        assert!(all(kind) > 5, "{kind}: {}", ended.summary);
    }
    assert_eq!(all("relative_pose") + all("neighbour"), 0);
    ended.assert_left_nothing();
}
