//! Recorded logs: whatever is in one, the time of an interface runs on, and the beginning is the beginning of the whole.

use coloc_drivers::can::{Filter, Log};

use super::{Target, scratch};

pub(super) const TARGET: Target = Target {
    name: "candump",
    run,
    samples,
};

const BEGINNING: usize = 3;
/// Frames may be that much in disorder \[ns\]: a kernel does not sort them.
const DISORDER_NS: i64 = 5_000_000;

fn run(bytes: &[u8]) {
    let path = scratch::file("log", bytes);
    let interface = ["can0", "can1"][usize::from(bytes.len() % 2 == 1)];
    let Ok(log) = Log::read(&path, Some(interface), &Filter::All) else {
        return;
    };
    let frames = log.frames();
    assert!(!frames.is_empty(), "a log without frames is refused");
    let mut steps = frames
        .windows(2)
        .map(|it| it[1].stamp_ns.saturating_sub(it[0].stamp_ns));
    let runs_on = steps.all(|step_ns| step_ns >= -DISORDER_NS);
    assert!(runs_on, "time runs backwards");
    let beginning = Log::read_beginning(&path, Some(interface), BEGINNING).unwrap();
    assert_eq!(
        beginning.frames(),
        &frames[..BEGINNING.min(frames.len())],
        "the beginning"
    );
}

fn samples() -> Vec<Vec<u8>> {
    let log = "\
(1533226488.434433) can0 0AA#1F2A1F2A1F161F29
(1533226488.434533123) can0 0000018F#0011223344556677 R
(1533226488.454433) can1 123##1AABBCCDDEEFF00112233
(1533226488.464433) can0 124#R8
(1533226488.474433) can0 20000008#0000000000000000
(1533226489.474433) can0 0AA#1F2A1F2A1F161F29 T
(1533222888.494433) can0 0AA#1F2B_E
* a comment
(1733222888.494433) can0 0AA#";
    vec![log.into()]
}
