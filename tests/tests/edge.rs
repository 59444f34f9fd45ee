//! Some episodes at the daemon's edge; the program `edge` plays them by the million.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

use coloc_tests::edge::{Tally, play};

#[test]
fn whatever_is_done_to_clocks_and_processes_the_way_comes_out_whole() {
    let mut total = Tally::default();
    for episode in 0..300 {
        let tally = play(episode, 500).map_err(|fault| format!("episode {episode}: {fault}"));
        total = total.and(tally.unwrap());
    }
    assert!(
        total.steps > 250 && total.dropped > 0 && total.samples > 100_000,
        "{total:?}"
    );
}
