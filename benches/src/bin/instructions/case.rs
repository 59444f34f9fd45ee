//! The functions that are counted.

use std::error::Error;
use std::hint::black_box;
use std::io;

use coloc_benches::case;
use coloc_benches::child::Child;
use coloc_benches::hot::{self, Arrivals, Hot};
use coloc_benches::robot::{DEFAULT_SLOTS, Robot};
use coloc_daemon::config::GyroSource;
use coloc_estimator::heading::{self, HeadingNoise};
use coloc_estimator::settings::{Criterion, FusionSettings};
use coloc_estimator::{NotACovariance, Propagation, convert, fix, fusion, gate, propagate};
use coloc_tests::scene::own_group;

/// A hot function with its inputs.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) enum Case {
    Propagate,
    Convert,
    FuseTrace,
    FuseDeterminant,
    FuseDependent,
    Fix,
    Heading,
    Tick,
    TickUnjudged,
    TickInRounds,
    TickOfFour,
    TickOfFourUnjudged,
    Turning,
    LateByFifty,
    Sought,
    Crowded,
    Child,
    ChildWithout,
    DaemonFrames,
    DaemonGroup,
    DaemonNeighbours,
    DaemonSightings,
    DaemonSightingsInPart,
    DaemonParts,
    DaemonFramesTurning,
    DaemonNeighboursTurning,
    ColdFrames,
    ColdNeighbours,
    ColdApart,
    ColdRehearsed,
    ColdNeighboursApart,
    ColdNeighboursRehearsed,
}

impl Case {
    pub(crate) const ALL: [Self; 32] = [
        Self::Propagate,
        Self::Convert,
        Self::FuseTrace,
        Self::FuseDeterminant,
        Self::FuseDependent,
        Self::Fix,
        Self::Heading,
        Self::Tick,
        Self::TickUnjudged,
        Self::TickInRounds,
        Self::TickOfFour,
        Self::TickOfFourUnjudged,
        Self::Turning,
        Self::LateByFifty,
        Self::Sought,
        Self::Crowded,
        Self::Child,
        Self::ChildWithout,
        Self::DaemonFrames,
        Self::DaemonGroup,
        Self::DaemonNeighbours,
        Self::DaemonSightings,
        Self::DaemonSightingsInPart,
        Self::DaemonParts,
        Self::DaemonFramesTurning,
        Self::DaemonNeighboursTurning,
        Self::ColdFrames,
        Self::ColdNeighbours,
        Self::ColdApart,
        Self::ColdRehearsed,
        Self::ColdNeighboursApart,
        Self::ColdNeighboursRehearsed,
    ];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Propagate => "propagate",
            Self::Convert => "convert",
            Self::FuseTrace => "split-ci-trace",
            Self::FuseDeterminant => "split-ci-determinant",
            Self::FuseDependent => "split-ci-own-all-dependent",
            Self::Fix => "position-fix",
            Self::Heading => "heading",
            Self::Tick => "tick-alone",
            Self::TickUnjudged => "tick-alone-unjudged",
            Self::TickInRounds => "tick-alone-in-rounds",
            Self::TickOfFour => "tick-4-neighbours-and-fix",
            Self::TickOfFourUnjudged => "tick-4-neighbours-and-fix-unjudged",
            Self::Turning => "tick-with-gyro",
            Self::LateByFifty => "tick-late-by-50",
            Self::Sought => "tick-with-16-hypotheses",
            Self::Crowded => "tick-worst-of-1024",
            Self::Child => "tick-of-a-child-at-an-event",
            Self::ChildWithout => "tick-of-a-child-at-an-event-without",
            Self::DaemonFrames => "daemon-frames",
            Self::DaemonGroup => "daemon-frames-for-a-group",
            Self::DaemonNeighbours => "daemon-4-neighbours-and-fix",
            Self::DaemonSightings => "daemon-and-4-sightings",
            Self::DaemonSightingsInPart => "daemon-4-sightings-in-part-and-answers",
            Self::DaemonParts => "daemon-4-sightings-in-part-both-ways",
            Self::DaemonFramesTurning => "daemon-frames-gyro-heading",
            Self::DaemonNeighboursTurning => "daemon-4-neighbours-fix-gyro-heading",
            Self::ColdFrames => "cold-lines-frames",
            Self::ColdNeighbours => "cold-lines-4-neighbours-and-fix",
            Self::ColdApart => "cold-lines-last-frame",
            Self::ColdRehearsed => "cold-lines-last-frame-rehearsed",
            Self::ColdNeighboursApart => "cold-lines-last-frame-4-neighbours-and-fix",
            Self::ColdNeighboursRehearsed => "cold-lines-last-frame-4-neighbours-and-fix-rehearsed",
        }
    }

    /// How often it is called, few and many times: what takes a thousand times as long, a hundred times less often.
    pub(crate) fn counts(self) -> [u64; 2] {
        if self == Self::Crowded {
            [1, 11]
        } else if self.is_cold() {
            [20, 60] // With the first ones it is learned how much time there is for a rehearsal.
        } else {
            [100, 1100]
        }
    }

    /// Whether what is counted is not instructions, but the lines of memory that it has to fetch when nothing is in the caches.
    pub(crate) fn is_cold(self) -> bool {
        matches!(self, Self::ColdFrames | Self::ColdNeighbours) || self.is_apart()
    }

    /// Whether the frames come one after the other, and only what follows the last one is counted.
    fn is_apart(self) -> bool {
        matches!(
            self,
            Self::ColdApart
                | Self::ColdRehearsed
                | Self::ColdNeighboursApart
                | Self::ColdNeighboursRehearsed
        )
    }

    /// The only function that is counted, with all that it calls; everything where there is none.
    pub(crate) fn within(self) -> Option<&'static str> {
        if self.is_apart() {
            return Some("coloc_benches::hot::after_the_last_frame");
        }
        if matches!(self, Self::Child | Self::ChildWithout) {
            return Some("coloc_benches::child::Child::first_tick");
        }
        matches!(
            self,
            Self::DaemonFrames
                | Self::DaemonGroup
                | Self::DaemonNeighbours
                | Self::DaemonSightings
                | Self::DaemonSightingsInPart
                | Self::DaemonParts
                | Self::DaemonFramesTurning
                | Self::DaemonNeighboursTurning
                | Self::ColdFrames
                | Self::ColdNeighbours
        )
        .then_some("coloc_daemon::tick::Robot::wake")
    }

    /// What a call may take at most, whatever is committed: for the worst tick, a quarter of a period of 50 Hz on a
    /// processor that makes two instructions a nanosecond.
    pub(crate) fn bound(self) -> Option<u64> {
        (self == Self::Crowded).then_some(2 * 5_000_000)
    }

    /// What it may take at most in parts of another, whatever is committed: to doubt the belief is to cost next to nothing, a
    /// hypothesis no more than a robot, and who is carried has as much as three who are not.
    pub(crate) fn times(self) -> Option<(f64, Self)> {
        match self {
            Self::Tick => Some((1.05, Self::TickUnjudged)),
            Self::TickInRounds => Some((1.15, Self::Tick)),
            Self::TickOfFour => Some((1.07, Self::TickOfFourUnjudged)),
            Self::Sought => Some((16.0, Self::TickUnjudged)),
            Self::DaemonSightingsInPart => Some((1.3, Self::DaemonSightings)),
            Self::Child => Some((3.0, Self::ChildWithout)),
            _ => None,
        }
    }

    /// Growth beyond this part fails `--check`. Where the linker puts functions moves some across lines and sets: that alone changes
    /// how many are fetched by up to an eighth. How much is rehearsed is a matter of time, so that a busy machine rehearses less: such
    /// counts are for people.
    pub(crate) fn tolerance(self) -> f64 {
        match self {
            Self::ColdRehearsed | Self::ColdNeighboursRehearsed => f64::INFINITY,
            _ if self.is_cold() => 0.25,
            _ => 0.05,
        }
    }

    pub(crate) fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|case| case.name() == name)
    }

    /// Calls the function so many times.
    pub(crate) fn run(self, iterations: u64) -> Result<(), Box<dyn Error>> {
        match self {
            Self::Propagate => {
                let (belief, motion) = (case::belief()?, case::motion());
                repeat(iterations, || {
                    propagate(
                        black_box(&belief),
                        black_box(&motion),
                        0.02,
                        Propagation::Honest,
                    )
                });
            }
            Self::Convert => {
                let (belief, (relative, noise)) = (case::belief()?, case::sighting()?);
                repeat(iterations, || {
                    convert::to_global(
                        black_box(&belief),
                        black_box(&relative),
                        black_box(&noise),
                        Propagation::Honest,
                    )
                });
            }
            Self::FuseTrace => fuse(iterations, Criterion::Trace, false)?,
            Self::FuseDeterminant => fuse(iterations, Criterion::Determinant, false)?,
            Self::FuseDependent => fuse(iterations, Criterion::Trace, true)?,
            Self::Fix => {
                let (belief, (position, noise)) = (case::belief()?, case::fix()?);
                repeat(iterations, || {
                    fix::update(
                        black_box(&belief),
                        position,
                        black_box(&noise),
                        gate::CHI2_2_99,
                    )
                });
            }
            Self::Heading => {
                let (belief, noise) = (case::belief()?, HeadingNoise::white(1e-3));
                repeat(iterations, || {
                    heading::update(black_box(&belief), -2.18, &noise, gate::CHI2_1_99)
                });
            }
            Self::Tick => alone(iterations, Robot::warm(0)?),
            Self::TickUnjudged => alone(iterations, Robot::unjudged(0)?),
            Self::TickInRounds => alone(iterations, Robot::in_rounds()?),
            Self::TickOfFour => of_four(iterations, Robot::warm(4)?)?,
            Self::TickOfFourUnjudged => of_four(iterations, Robot::unjudged(4)?)?,
            Self::Turning => {
                let mut robot = Robot::with_gyro()?;
                repeat(iterations, || robot.tick_turning());
            }
            Self::LateByFifty => {
                let mut robot = Robot::warm(0)?;
                repeat(iterations, || robot.tick_late(50));
            }
            Self::Sought => alone(iterations, Robot::sought(16)?),
            Self::Crowded => {
                let robot = Robot::crowded(DEFAULT_SLOTS)?;
                repeat(iterations, || robot.clone().tick_crowded());
            }
            Self::Child => events(iterations, Child::warm(true)?)?,
            Self::ChildWithout => events(iterations, Child::warm(false)?)?,
            Self::DaemonFrames => whole_ticks(Hot::new()?, hot::frames, iterations),
            Self::DaemonGroup => whole_ticks(Hot::open_to(own_group())?, hot::frames, iterations),
            Self::DaemonNeighbours => whole_ticks(Hot::new()?, hot::neighbours, iterations),
            Self::DaemonSightings => whole_ticks(Hot::new()?, hot::sightings, iterations),
            Self::DaemonSightingsInPart => {
                whole_ticks(Hot::in_part()?, hot::sightings_in_part, iterations);
            }
            Self::DaemonParts => whole_ticks(Hot::in_part()?, hot::parts, iterations),
            Self::DaemonFramesTurning => turning_ticks(hot::turning_frames, iterations)?,
            Self::DaemonNeighboursTurning => turning_ticks(hot::turning_neighbours, iterations)?,
            Self::ColdFrames => cold_ticks(hot::frames, iterations)?,
            Self::ColdNeighbours => cold_ticks(hot::neighbours, iterations)?,
            Self::ColdApart => apart_ticks(hot::nothing, iterations, false)?,
            Self::ColdRehearsed => apart_ticks(hot::nothing, iterations, true)?,
            Self::ColdNeighboursApart => apart_ticks(hot::words, iterations, false)?,
            Self::ColdNeighboursRehearsed => apart_ticks(hot::words, iterations, true)?,
        }
        Ok(())
    }
}

fn alone(ticks: u64, mut robot: Robot) {
    repeat(ticks, || robot.tick_hearing(0));
}

fn events(events: u64, mut child: Child) -> Result<(), NotACovariance> {
    for _ in 0..events {
        black_box(child.event()?);
    }
    Ok(())
}

fn of_four(ticks: u64, mut robot: Robot) -> Result<(), NotACovariance> {
    let (_, noise) = case::fix()?;
    repeat(ticks, || robot.tick_with_fix(4, noise));
    Ok(())
}

fn whole_ticks(mut hot: Hot, arrive: Arrivals, ticks: u64) {
    hot.warm(arrive);
    hot.run(arrive, ticks);
}

fn cold_ticks(arrive: Arrivals, ticks: u64) -> io::Result<()> {
    let mut hot = Hot::new()?;
    hot.warm(arrive);
    hot.run_cold(arrive, ticks);
    Ok(())
}

fn apart_ticks(messages: Arrivals, ticks: u64, rehearsed: bool) -> io::Result<()> {
    let mut hot = Hot::new()?;
    hot.warm(hot::neighbours);
    hot.run_apart(messages, ticks, rehearsed);
    Ok(())
}

fn turning_ticks(arrive: Arrivals, ticks: u64) -> io::Result<()> {
    whole_ticks(Hot::with_gyro(GyroSource::Channel)?, arrive, ticks);
    Ok(())
}

fn fuse(iterations: u64, criterion: Criterion, dependent: bool) -> Result<(), NotACovariance> {
    let settings = FusionSettings {
        criterion,
        ..FusionSettings::default()
    };
    let (mut own, received) = (case::belief()?, case::received(0.5)?);
    if dependent {
        own.make_dependent();
    }
    repeat(iterations, || {
        fusion::fuse(black_box(&own), black_box(&received), &settings)
    });
    Ok(())
}

fn repeat<T>(iterations: u64, mut call: impl FnMut() -> T) {
    for _ in 0..iterations {
        black_box(call());
    }
}
