//! `tests/hil/README.md` shows the table that the tests are driven by.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

use coloc_tests::faults::filled_in;

#[test]
fn the_page_shows_the_table() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/hil/README.md");
    let page = std::fs::read_to_string(path).unwrap();
    let current = filled_in(&page);
    if std::env::var_os("COLOC_UPDATE").is_some() {
        std::fs::write(path, current).unwrap();
    } else {
        assert!(
            page == current,
            "{path} shows an older table: run this test with COLOC_UPDATE=1"
        );
    }
}
