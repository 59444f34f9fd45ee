//! Some episodes at the daemon's edge; the program `edge` plays them by the million.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

use coloc_tests::edge::{Tally, play};

#[test]
fn whatever_is_done_to_clocks_and_processes_the_way_comes_out_whole() {
    let mut total = Tally::default();
    // The last ones were seen to fail.
    let episodes = (0..300).chain([25_150, 110_986, 149_357, 156_187, 182_760]);
    for episode in episodes {
        let tally = play(episode, 500).map_err(|fault| format!("episode {episode}: {fault}"));
        total = total.and(tally.unwrap());
    }
    assert!(
        total.steps > 250 && total.dropped > 0 && total.samples > 100_000,
        "{total:?}"
    );
}
