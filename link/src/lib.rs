//! `coloc-link`: carries what robots say to one another between computers.
