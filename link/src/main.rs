//! `coloc-link`.

fn main() {}
