//! coloc
