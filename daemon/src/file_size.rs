//! A limit on the size of files (`ulimit -f`, `LimitFSIZE=`): to whoever writes, it is a disk that is full.

use std::sync::Arc;

use signal_hook::consts::SIGXFSZ;

/// From now on, a write beyond the limit is an error (`EFBIG`), which its writer handles. Else the kernel ends the process
/// without a word. For the very beginning of a program.
pub fn let_writers_see_the_limit() {
    // Nobody asks whether the signal came: that it is handled is enough. The kernel refuses that for no signal that exists.
    let _ = signal_hook::flag::register(SIGXFSZ, Arc::default());
}
