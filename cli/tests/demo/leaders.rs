//! Leaders, children that see only one another, and a leader that is killed.

use crate::stage::Demo;

fn number(text: &str, before: &str) -> usize {
    let count = text.split_once(before).unwrap().0;
    let digits = count.rsplit(|it: char| !it.is_ascii_digit()).next();
    digits.unwrap().parse().unwrap()
}

/// How accurate and honest they are is the demo's own verdict, on a machine that has time for it.
#[test]
fn children_are_carried_while_a_leader_is_gone_and_all_of_it_comes_out_the_same() {
    let ended = Demo::start(&["--leaders", "2", "--seconds", "26"]).end();
    for leader in 1..=2 {
        assert_eq!(ended.robot(leader)["help"], "leader");
        assert!(ended.robot(leader)["accepted"]["heading"].as_u64().unwrap() > 50);
    }
    assert_eq!(ended.robot(1)["starts"], 2);
    assert!(ended.robot(1)["up_at_the_end"].as_bool().unwrap());
    for child in 3..=5 {
        let robot = ended.robot(child);
        assert_eq!(
            (&robot["help"], &robot["starts"]),
            (&"child".into(), &1.into())
        );
        assert!(
            robot["accepted"]["assist"].as_u64().unwrap() > 50,
            "{robot}"
        );
    }
    let bars = ended.summary["bars"].as_array().unwrap();
    let anew = |what: &str| {
        let bar = bars
            .iter()
            .find(|bar| bar["promise"].as_str().unwrap().contains(what));
        let bar = bar.unwrap();
        assert_eq!(bar["broken_by"], serde_json::json!([]));
        bar["seen"].as_str().unwrap().to_owned()
    };
    assert!(number(&anew("every belief"), " ticks") > 4000);
    assert!(number(&anew("all that was told"), " data") > 500);
    let picture = std::fs::read_to_string(ended.folder.path().join("out/paths.svg")).unwrap();
    for text in ["robot5 is never seen by one", "carried by leaders"] {
        assert!(picture.contains(text), "{text} is missing");
    }
    ended.assert_left_nothing();
}

#[test]
fn it_takes_a_child_that_is_seen_and_one_that_is_not() {
    let ended = Demo::start(&["--leaders", "2", "--robots", "3"]).end();
    assert_eq!(ended.status.code(), Some(1));
    assert!(ended.said.contains("five robots"), "{}", ended.said);
}
