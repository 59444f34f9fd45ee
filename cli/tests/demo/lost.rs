//! The scene in which robots do not know where they are.

use crate::stage::Demo;

/// What is promised of it is tried without daemons in many worlds; here, that real ones play it.
#[test]
fn lost_robots_say_so_and_the_picture_shows_it() {
    let ended = Demo::start(&["--scene", "lost", "--seconds", "14"]).end();
    for number in 1..=4 {
        let robot = ended.robot(number);
        assert!(ended.estimates(number) > 100, "{robot}");
        assert!(
            robot["accepted"]["position"].as_u64().unwrap() > 10,
            "{robot}"
        );
        assert!(!robot["trials"].as_array().unwrap().is_empty(), "{robot}");
    }
    let refused = |number| ended.robot(number)["rejected"]["position"].is_object();
    assert!(!refused(1) && (2..=4).all(refused));
    let paths = std::fs::read_to_string(ended.folder.path().join("out/paths.svg")).unwrap();
    for text in [
        "robot1 starts from nowhere",
        "finding",
        "contradicted",
        "10 s: carried",
        "10 s: receiver jumps",
        "receiver that jumped",
    ] {
        assert!(paths.contains(text), "{text} is missing");
    }
    ended.assert_left_nothing();
}

#[test]
fn a_scene_has_no_more_robots_than_it_has_parts_for() {
    let ended = Demo::start(&["--scene", "lost", "--robots", "5"]).end();
    assert_eq!(ended.status.code(), Some(1));
    assert!(ended.said.contains("use --robots 1 to 4"), "{}", ended.said);
}
