//! The shared memory of each robot: one for all, or with `--fleet` one each.

use std::path::PathBuf;

use coloc_shm_types::Space;

use super::{DemoError, PREFIX};

/// Enters each robot's space under `name`, one that several share once.
pub(crate) fn enter(roots: &[PathBuf], name: &str) -> Result<Vec<Space>, DemoError> {
    let mut spaces: Vec<Space> = Vec::with_capacity(roots.len());
    for (place, root) in roots.iter().enumerate() {
        let before = place.checked_sub(1);
        let same = before.filter(|before| roots.get(*before) == Some(root));
        let known = same.and_then(|before| spaces.get(before)).cloned();
        let space = match known {
            Some(space) => space,
            None => Space::open(root, PREFIX, name).map_err(DemoError::shm)?,
        };
        spaces.push(space);
    }
    Ok(spaces)
}
