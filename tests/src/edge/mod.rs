//! A model of the daemon's edge: frames and messages with true times, clocks that somebody sets, a process that is stopped, a
//! computer that sleeps.
//!
//! What it drives is the daemon's own code between the kernel and the estimator, without sockets, shared memory and threads: so
//! fast that a million episodes can be played. What comes out of each is held against what really happened.

#![allow(clippy::cast_precision_loss, clippy::cast_possible_truncation)] // Times of an episode are below 2^53 ns.

mod encoders;
mod speakers;
mod truth;
mod world;

use std::fmt;

use coloc_daemon::clock::{Drain, Timeline};
use coloc_daemon::collect::frames::Frames;
use coloc_drivers::can::{FRAMES_PER_CALL, StampClock};
use coloc_drivers::encoder::OdometryDecoder;

use speakers::Speakers;
use truth::Truth;
use world::World;

/// From one tick to the next \[ns\].
pub(crate) const PERIOD_NS: i64 = 20_000_000;

/// Full drains of a tick, as the daemon's.
const DRAINS: usize = 8;

/// What an episode has tried.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Ticks.
    pub ticks: u64,
    /// Frames that were sent.
    pub frames: u64,
    /// Frames that the kernel had no room for while the process stood still, or that came while the computer slept.
    pub dropped: u64,
    /// Samples of odometry.
    pub samples: u64,
    /// Times that the clock was set.
    pub steps: u64,
    /// Messages that were heard, of three sources.
    pub messages: u64,
}

/// What was not as it must be.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault(pub String);

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl Tally {
    /// Both together.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            ticks: self.ticks + other.ticks,
            frames: self.frames + other.frames,
            dropped: self.dropped + other.dropped,
            samples: self.samples + other.samples,
            steps: self.steps + other.steps,
            messages: self.messages + other.messages,
        }
    }
}

/// Plays the episode of this number: so many ticks, a stop and a clock that is set.
///
/// # Errors
/// The first thing that was not as it must be.
pub fn play(episode: u64, ticks: u32) -> Result<Tally, Fault> {
    let mut world = World::new(episode, ticks);
    let mut timeline = Timeline::new(&world.read());
    let decoder =
        OdometryDecoder::new(&encoders::config()).map_err(|problem| Fault(problem.to_string()))?;
    let mut frames = Frames::new(decoder, [StampClock::Realtime]);
    let mut truth = Truth::default();
    let mut speakers = Speakers::new(episode, world.now_ns);
    let mut messages = Tally::default();
    for _ in 0..ticks + world::LAST_TICKS {
        world.wait();
        for _ in 0..DRAINS {
            let not_before_ns = world.now_ns;
            let more = drain(&mut world, &mut frames);
            let drain = Drain {
                emptied: !more,
                not_before_ns,
            };
            let moment = timeline.advance(&world.read(), drain);
            while let Some(made) = frames.next(&moment) {
                if let Ok(Some(sample)) = made {
                    truth.take(&sample, &mut world)?;
                }
            }
            if !more {
                speakers.speak(&world);
                speakers.hear(&moment, &world, &mut messages)?;
                break;
            }
        }
    }
    truth.close(&world, frames.decoder().counters())?;
    speakers.close(world.now_ns)?;
    Ok(Tally {
        ticks: u64::from(ticks),
        samples: truth.samples,
        messages: messages.messages,
        ..world.tally()
    })
}

/// As many frames as one call brings; whether there are more.
fn drain(world: &mut World, frames: &mut Frames) -> bool {
    let mut taken = 0;
    while taken < FRAMES_PER_CALL {
        let Some(received) = world.receive() else {
            break;
        };
        frames.take(&received);
        taken += 1;
    }
    let more = taken == FRAMES_PER_CALL;
    frames.drained(0, more);
    more
}

fn demand(holds: bool, text: impl FnOnce() -> String) -> Result<(), Fault> {
    if holds { Ok(()) } else { Err(Fault(text())) }
}
