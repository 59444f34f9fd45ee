//! Whole teams over 20 s, in each of the ways in which poses are handed on.

mod modes;
mod radio;
mod world;
