//! Enters a space and leaves it: whoever does so alone cleans up after the dead.

use std::error::Error;

use coloc_shm_types::Space;

use super::Place;
use coloc_tests::output::print_line;

pub(crate) fn visit(place: &Place) -> Result<(), Box<dyn Error>> {
    let space = Space::open(&place.root, &place.prefix, "visitor")?;
    print_line(&format!("prefix {}", space.full_prefix()));
    Ok(())
}
