//! Handlings that can be broken on purpose, to show that the tests notice.

use std::sync::LazyLock;

static BROKEN: LazyLock<String> =
    LazyLock::new(|| std::env::var("COLOC_BREAK").unwrap_or_default());

/// Whether this handling is broken: by `COLOC_BREAK`, in the build of `tests/hil/prove`; in every other build never.
#[inline]
#[must_use]
pub fn is_broken(handling: &str) -> bool {
    cfg!(coloc_break) && *BROKEN == handling
}
