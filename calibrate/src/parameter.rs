//! What can be found of a robot: where it stands in [`Robot`], how far off a configuration may be, and which drive shows it.

use std::f64::consts::{LN_2, LN_10};
use std::fmt;

use crate::drive::Drive;
use crate::robot::{Base, Robot};

/// A number of a [`Robot`].
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash)]
pub enum Parameter {
    /// Metres for a metre that the wheels read.
    Scale,
    /// How much larger the right wheel is than the left one.
    Difference,
    /// How far apart the wheels are.
    Track,
    /// Radians for a radian that the body read.
    TurnScale,
    /// Angle of the front wheels when zero is read.
    SteeringOffset,
    /// Radians of the front wheels for a radian that was read.
    SteeringRatio,
    /// A coefficient of the noise.
    Noise(Direction, Cause),
    /// What a second of standing adds.
    Standstill,
    /// Radians for a radian that the gyro read.
    GyroScale,
    /// What the gyro reads when nothing turns.
    GyroBias,
    /// What a second adds to the gyro's angle.
    GyroNoise,
    /// What is new in each fix of this receiver.
    FixSigma(usize),
    /// What is not.
    SlowSigma(usize),
    /// How long that lasts.
    SlowTime(usize),
    /// How far ahead the antenna is.
    LeverForward(usize),
    /// How far to the left it is.
    LeverLeft(usize),
    /// How late the stamps of the fixes are.
    Delay(usize),
    /// Where the robot looked at the begin.
    Heading,
}

/// Of a motion.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash)]
pub enum Direction {
    /// Ahead.
    Forward,
    /// To the side.
    Sideways,
    /// About itself.
    Turning,
}

/// Of noise.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash)]
pub enum Cause {
    /// Time.
    Second,
    /// Way.
    Metre,
    /// Turning.
    Radian,
}

/// How a parameter is counted while it is searched for.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) enum Counted {
    /// As it is.
    Plain,
    /// By its logarithm: it is above zero.
    Log,
}

impl Parameter {
    /// All that a robot and a drive have, whether or not the drive shows them.
    #[must_use]
    pub fn all(robot: &Robot, drive: &Drive) -> Vec<Self> {
        let mut all = vec![Self::Scale];
        all.extend_from_slice(match robot.wheels.base {
            Base::Axle => &[Self::Difference, Self::Track],
            Base::Body => &[Self::TurnScale],
            Base::Steered => &[Self::SteeringOffset, Self::SteeringRatio],
        });
        let directions = [Direction::Forward, Direction::Sideways, Direction::Turning];
        let causes = [Cause::Second, Cause::Metre, Cause::Radian];
        let noises = directions
            .into_iter()
            .flat_map(|it| causes.map(|by| Self::Noise(it, by)));
        all.extend(noises.filter(|it| it.of(robot) > 0.0));
        all.extend((robot.standing[0] > 0.0).then_some(Self::Standstill));
        if robot.gyro.is_some() && drive.has_gyro() {
            all.extend([Self::GyroScale, Self::GyroBias, Self::GyroNoise]);
        }
        for it in 0..robot.receivers.len() {
            all.push(Self::FixSigma(it));
            if robot.receivers[it].slow_sigma_m > 0.0 {
                all.extend([Self::SlowSigma(it), Self::SlowTime(it)]);
            }
            all.extend([Self::LeverForward(it), Self::LeverLeft(it), Self::Delay(it)]);
        }
        all.extend((!drive.fixes().is_empty()).then_some(Self::Heading));
        all
    }

    /// Its value.
    #[must_use]
    pub fn of(self, robot: &Robot) -> f64 {
        let mut robot = robot.clone();
        self.place(&mut robot).copied().unwrap_or(f64::NAN)
    }

    /// `robot` with this value of it.
    pub fn set(self, robot: &mut Robot, value: f64) {
        if self == Self::Standstill {
            let grown = value / robot.standing[0];
            robot.standing = [value, robot.standing[1] * grown, robot.standing[2]];
        } else if let Some(place) = self.place(robot) {
            *place = value;
        }
    }

    fn place(self, robot: &mut Robot) -> Option<&mut f64> {
        let wheels = &mut robot.wheels;
        Some(match self {
            Self::Scale => &mut wheels.scale,
            Self::Difference => &mut wheels.difference,
            Self::Track => &mut wheels.span_m,
            Self::TurnScale => &mut wheels.turn_scale,
            Self::SteeringOffset => &mut wheels.steering_offset_rad,
            Self::SteeringRatio => &mut wheels.steering_ratio,
            Self::Noise(direction, cause) => {
                let noise = &mut robot.noise[direction as usize];
                match cause {
                    Cause::Second => &mut noise.per_s,
                    Cause::Metre => &mut noise.per_m,
                    Cause::Radian => &mut noise.per_rad,
                }
            }
            Self::Standstill => &mut robot.standing[0],
            Self::GyroScale => &mut robot.gyro.as_mut()?.scale,
            Self::GyroBias => &mut robot.gyro.as_mut()?.bias_radps,
            Self::GyroNoise => &mut robot.gyro.as_mut()?.per_s,
            Self::FixSigma(it) => &mut robot.receivers.get_mut(it)?.sigma_m,
            Self::SlowSigma(it) => &mut robot.receivers.get_mut(it)?.slow_sigma_m,
            Self::SlowTime(it) => &mut robot.receivers.get_mut(it)?.slow_time_s,
            Self::LeverForward(it) => &mut robot.receivers.get_mut(it)?.lever_m[0],
            Self::LeverLeft(it) => &mut robot.receivers.get_mut(it)?.lever_m[1],
            Self::Delay(it) => &mut robot.receivers.get_mut(it)?.delay_s,
            Self::Heading => &mut robot.heading_rad,
        })
    }

    pub(crate) fn counted(self) -> Counted {
        match self {
            Self::Track
            | Self::Noise(..)
            | Self::Standstill
            | Self::GyroNoise
            | Self::FixSigma(_)
            | Self::SlowSigma(_)
            | Self::SlowTime(_) => Counted::Log,
            _ => Counted::Plain,
        }
    }

    /// How far a configuration may be off, one standard deviation: in the parameter's unit, or of its natural logarithm. What
    /// a drive does not tell three times as well it does not show.
    #[must_use]
    pub fn width(self) -> f64 {
        match self {
            Self::Scale | Self::GyroScale => 0.03,
            Self::Difference => 0.02,
            Self::Track
            | Self::TurnScale
            | Self::SteeringRatio
            | Self::SteeringOffset
            | Self::GyroBias => 0.05,
            Self::Noise(..) | Self::Standstill | Self::GyroNoise => LN_10,
            Self::FixSigma(_) => 2.0 * LN_2,
            Self::SlowSigma(_) | Self::SlowTime(_) => 3.0 * LN_2,
            Self::LeverForward(_) | Self::LeverLeft(_) => 0.5,
            Self::Delay(_) | Self::Heading => 0.3,
        }
    }

    /// It is of the drive, not of the robot: nothing is known before, and nobody is told.
    pub(crate) fn is_of_the_drive(self) -> bool {
        self == Self::Heading
    }

    /// The receiver that it is of.
    #[must_use]
    pub fn receiver(self) -> Option<usize> {
        match self {
            Self::FixSigma(it)
            | Self::SlowSigma(it)
            | Self::SlowTime(it)
            | Self::LeverForward(it)
            | Self::LeverLeft(it)
            | Self::Delay(it) => Some(it),
            _ => None,
        }
    }

    /// Its unit, empty where it has none.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::Scale
            | Self::Difference
            | Self::TurnScale
            | Self::SteeringRatio
            | Self::GyroScale => "",
            Self::Track
            | Self::FixSigma(_)
            | Self::SlowSigma(_)
            | Self::LeverForward(_)
            | Self::LeverLeft(_) => "m",
            Self::SteeringOffset | Self::Heading => "rad",
            Self::Noise(Direction::Turning, cause) => match cause {
                Cause::Second => "rad²/s",
                Cause::Metre => "rad²/m",
                Cause::Radian => "rad²/rad",
            },
            Self::Noise(_, cause) => match cause {
                Cause::Second => "m²/s",
                Cause::Metre => "m²/m",
                Cause::Radian => "m²/rad",
            },
            Self::Standstill => "m²/s",
            Self::GyroBias => "rad/s",
            Self::GyroNoise => "rad²/s",
            Self::SlowTime(_) | Self::Delay(_) => "s",
        }
    }

    /// The drive that shows it.
    #[must_use]
    pub fn manoeuvre(self) -> &'static str {
        match self {
            Self::Scale => "with fixes, drive 100 m",
            Self::Difference => "with fixes, drive 50 m straight and back",
            Self::Track | Self::TurnScale => {
                "with fixes, drive loops both ways, or turn on the spot ten times between two straight ways"
            }
            Self::SteeringOffset => "with fixes, drive 100 m straight and back",
            Self::SteeringRatio => "with fixes, drive loops both ways, wide and narrow ones",
            Self::Noise(_, Cause::Second) => {
                "with fixes of centimetres, drive some minutes slowly and some fast"
            }
            Self::Noise(_, Cause::Metre) => "with fixes of centimetres, drive several 100 m",
            Self::Noise(_, Cause::Radian) => {
                "with fixes of centimetres, drive loops for some minutes, then straight ahead"
            }
            Self::Standstill => "with fixes of centimetres, stand for some minutes",
            Self::GyroScale => "drive ten loops, half of them to either side",
            Self::GyroBias => "stand for 10 s",
            Self::GyroNoise => "stand for a minute",
            Self::FixSigma(_) => "stand for a minute, with fixes",
            Self::SlowSigma(_) | Self::SlowTime(_) => {
                "let fixes come for twenty times as long as their error lasts: half an hour for most receivers"
            }
            Self::LeverForward(_) | Self::LeverLeft(_) => {
                "with fixes, turn on the spot, or drive narrow loops both ways"
            }
            Self::Delay(_) => "with fixes, drive 100 m at changing speeds",
            Self::Heading => "with fixes, drive 10 m",
        }
    }
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scale => f.write_str("scale of the wheels"),
            Self::Difference => f.write_str("right wheel larger by"),
            Self::Track => f.write_str("track"),
            Self::TurnScale => f.write_str("scale of the turn"),
            Self::SteeringOffset => f.write_str("steering offset"),
            Self::SteeringRatio => f.write_str("steering ratio"),
            Self::Noise(direction, cause) => write!(f, "noise {direction} {cause}"),
            Self::Standstill => f.write_str("standing, per second"),
            Self::GyroScale => f.write_str("scale of the gyro"),
            Self::GyroBias => f.write_str("bias of the gyro"),
            Self::GyroNoise => f.write_str("noise of the gyro per second"),
            Self::FixSigma(_) => f.write_str("fixes: sigma"),
            Self::SlowSigma(_) => f.write_str("fixes: slow sigma"),
            Self::SlowTime(_) => f.write_str("fixes: slow time"),
            Self::LeverForward(_) => f.write_str("antenna ahead by"),
            Self::LeverLeft(_) => f.write_str("antenna to the left by"),
            Self::Delay(_) => f.write_str("fixes: late by"),
            Self::Heading => f.write_str("heading at the begin"),
        }
    }
}

impl fmt::Display for Direction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Forward => "forward",
            Self::Sideways => "sideways",
            Self::Turning => "turning",
        })
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Second => "per second",
            Self::Metre => "per metre",
            Self::Radian => "per radian",
        })
    }
}
