//! What is tried, as data: how a robot starts, moves and hears, what happens to it, and what must come of it.

use coloc_estimator::TrustJump;

use super::bar::Bar;

/// Robots that differ in their chance alone: a row of a table.
#[derive(Clone, Debug)]
pub struct Experiment {
    /// For people; all of its chance comes from it and the seed.
    pub name: String,
    /// How many in the whole campaign.
    pub robots: usize,
    /// What they know at the start.
    pub start: Start,
    /// What decides between a lone source and the wheels.
    pub trust: TrustJump,
    /// The noise of their way.
    pub wheels: Wheels,
    /// How they move.
    pub drive: Drive,
    /// Whom they hear; a source's number is its place here, from 1.
    pub sensors: Vec<Sensor>,
    /// Nobody says anything from the first until before the second \[s\].
    pub silence_s: [f64; 2],
    /// When something happens, from which times are counted \[s\].
    pub event_s: f64,
    /// What happens then.
    pub event: Event,
    /// How long a robot is watched after the event, at most \[s\].
    pub watched_s: f64,
    /// Whether it is watched to the end, or until a minute after it was found.
    pub to_the_end: bool,
    /// It shows what cannot be known, or more than was promised: its NEES counts for this row alone.
    pub beyond: bool,
    /// What must come of it.
    pub bars: Vec<Bar>,
    /// What the prototype's table says of it.
    pub document: String,
}

/// What is known at the start.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Start {
    /// The pose, to 0.1 m and 0.05 rad.
    Pose,
    /// The position, to so much \[m\].
    Position(f64),
    /// Nothing.
    Nothing,
    /// A pose, to 0.1 m and 0.05 rad, and the robot is so far from it \[m\] and looks anywhere.
    Wrong(f64),
}

/// The noise of the way.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Wheels {
    /// 2 cm along and 0.5 cm across after a metre, 3° after a minute at 1 m/s, 1.1° after a radian.
    Sane,
    /// Table 2 of the paper.
    Paper,
}

/// How a robot moves; where it turns, at another rate every five seconds.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Drive {
    /// At this speed, turning at random \[m/s\].
    Wander(f64),
    /// At this speed \[m/s\].
    Straight(f64),
    /// Five seconds of 1 m/s, five of standing.
    StopAndGo,
    /// Ten seconds of turning on the spot at 0.5 rad/s, then as [`Self::Wander`] at 1 m/s.
    SpinFirst,
    /// As [`Self::Wander`] at 1 m/s, but it stands from the first to the second \[s\].
    Pausing([f64; 2]),
    /// Not at all.
    Parked,
}

/// Who speaks.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Sensor {
    /// A receiver of fixes, or a neighbour.
    pub kind: Speaks,
    /// σ of the white noise in each coordinate, as it is claimed \[m\].
    pub white_m: f64,
    /// σ of the slow error in each coordinate \[m\], and how long it lasts \[s\].
    pub slow_m: f64,
    /// See `slow_m`.
    pub memory_s: f64,
    /// From word to word, in ticks of 50 Hz; a multiple of five.
    pub every: u32,
    /// What the white noise really is like.
    pub tail: Tail,
}

/// What a word is.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Speaks {
    /// A position.
    Fix,
    /// A pose, its heading known to so much \[rad\].
    Neighbour(f64),
}

/// White noise.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Tail {
    /// As claimed.
    Gaussian,
    /// With the first probability so many times as large.
    Mixed(f64, f64),
    /// Student's t with four degrees of freedom, of the claimed variance.
    Student,
}

/// What happens.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Event {
    /// Nothing: the start, or the end of a silence.
    Nothing,
    /// It is carried so far, by chance evenly in its logarithm, in any direction, and looks anywhere afterwards \[m\].
    Carried([f64; 2]),
    /// The source of this number lies.
    Lie(usize, Lie),
}

/// A lie. Any direction is equally likely.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Lie {
    /// It is off by so much \[m\].
    Shift(f64),
    /// As [`Self::Shift`], for so many words.
    ShiftFor(f64, u32),
    /// It is near a place so far away \[m\], for so many words.
    PlaceFor(f64, u32),
    /// Its frame is turned by so much about where the robot is then \[rad\].
    Turn(f64),
    /// It drifts away at this speed \[m/s\].
    Drift(f64),
}

impl Experiment {
    /// A wandering robot that knows its pose and gets fixes of 0.3 m at 5 Hz, watched for 80 s; nothing happens.
    #[must_use]
    pub fn new(name: impl Into<String>, robots: usize) -> Self {
        Self {
            name: name.into(),
            robots,
            start: Start::Pose,
            trust: TrustJump::Robot,
            wheels: Wheels::Sane,
            drive: Drive::Wander(1.0),
            sensors: vec![Sensor::fix(0.3)],
            silence_s: [0.0; 2],
            event_s: 0.0,
            event: Event::Nothing,
            watched_s: 81.0,
            to_the_end: false,
            beyond: false,
            bars: Vec::new(),
            document: String::new(),
        }
    }
}

impl Sensor {
    /// A receiver, 5 Hz.
    #[must_use]
    pub const fn fix(white_m: f64) -> Self {
        Self {
            kind: Speaks::Fix,
            white_m,
            slow_m: 0.0,
            memory_s: 60.0,
            every: 10,
            tail: Tail::Gaussian,
        }
    }

    /// A neighbour that sees this robot, 5 Hz.
    #[must_use]
    pub const fn neighbour() -> Self {
        Self {
            kind: Speaks::Neighbour(0.0175),
            white_m: 0.1,
            slow_m: 0.05,
            memory_s: 30.0,
            every: 10,
            tail: Tail::Gaussian,
        }
    }

    /// A receiver with a slow error of 1 m that lasts for a minute.
    #[must_use]
    pub const fn slow() -> Self {
        Self {
            slow_m: 1.0,
            ..Self::fix(0.3)
        }
    }

    /// The same, so many times a second.
    #[must_use]
    pub const fn at_hz(self, hz: u32) -> Self {
        Self {
            every: 50 / hz,
            ..self
        }
    }

    /// The same with another noise.
    #[must_use]
    pub const fn with(self, tail: Tail) -> Self {
        Self { tail, ..self }
    }
}
