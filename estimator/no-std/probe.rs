//! Everything of the estimator, called from a program that has nothing but `core`: no `std`, no allocator.
//!
//! Built by `check` beside it. That this compiles is most of the proof: a crate below that used `std` would bring a
//! second panic handler, one that used `alloc` would ask for a global allocator; both are errors.
#![no_std]

use coloc_estimator::{Belief, Estimator, Settings, Slot, Stamp, TickInputs, step};

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}

/// A tick of a new estimator; the length of the belief's y axis keeps the compiler from leaving anything out.
#[unsafe(no_mangle)]
pub extern "C" fn coloc_probe(inputs: &TickInputs<'_>) -> f64 {
    let storage = [Slot::default(); 64];
    let mut estimator = Estimator::new(Settings::default(), Stamp::default(), Belief::default(), storage);
    step(&mut estimator, inputs).estimate.belief.pose.y
}
