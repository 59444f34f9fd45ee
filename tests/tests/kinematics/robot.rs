//! The robots: how they are configured, and, told apart from that, how their wheels roll when the body moves.

use std::path::Path;

use coloc_daemon::config::Config;

/// What is tried.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) enum Robot {
    /// Two tracks that skid.
    Tracks,
    /// Four wheels that skid.
    FourWheels,
    /// A car whose speed is measured in the middle of the rear axle.
    Car,
    /// By the left rear wheel.
    CarByWheel,
    Mecanum,
    OmniOfThree,
    OmniOfFour,
}

pub(crate) const ROBOTS: [Robot; 7] = [
    Robot::Tracks,
    Robot::FourWheels,
    Robot::Car,
    Robot::CarByWheel,
    Robot::Mecanum,
    Robot::OmniOfThree,
    Robot::OmniOfFour,
];

/// What the wheels' signals are.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) enum Says {
    Counts,
    Speeds,
}

/// As fine as this the counts are \[m\].
pub(crate) const COUNT_M: f64 = 1e-6;

/// Part of the turn that skidding wheels make.
const SKID: f64 = 0.7;
const TRACK_M: f64 = 0.5;
const HALF_LENGTH_M: f64 = 0.25;
const HALF_WIDTH_M: f64 = 0.2;
pub(crate) const WHEEL_BASE_M: f64 = 1.2;
const LATERAL_M: f64 = 0.4;
/// Angle and distance of each \[°, m\].
const OMNI: [[f64; 2]; 4] = [[40.0, 0.2], [130.0, 0.22], [235.0, 0.2], [320.0, 0.18]];
const OMNI_OF_THREE: [[f64; 2]; 3] = [[60.0, 0.2], [180.0, 0.2], [300.0, 0.25]];

/// Noise, where there is some: of a wheel's way for each metre, of the angle in a frame, of the body for each metre.
pub(crate) const WHEEL_PER_M: f64 = 2e-5;
pub(crate) const SIGMA_RAD: f64 = 0.01;
pub(crate) const FORWARD_PER_M: f64 = 2e-5;
pub(crate) const SIDEWAYS_PER_M: f64 = 1e-5;
pub(crate) const TURNING_PER_M: f64 = 4e-5;

impl Robot {
    /// How many wheels speak.
    pub(crate) fn channels(self) -> usize {
        match self {
            Self::Tracks => 2,
            Self::Car | Self::CarByWheel => 1,
            Self::OmniOfThree => 3,
            Self::FourWheels | Self::Mecanum | Self::OmniOfFour => 4,
        }
    }

    pub(crate) fn is_steered(self) -> bool {
        matches!(self, Self::Car | Self::CarByWheel)
    }

    pub(crate) fn moves_sideways(self) -> bool {
        matches!(self, Self::Mecanum | Self::OmniOfThree | Self::OmniOfFour)
    }

    /// Whether its wheels have noise of their own.
    pub(crate) fn has_noisy_wheels(self) -> bool {
        self == Self::FourWheels || self.moves_sideways()
    }

    /// Speeds of the wheels when the body moves with `[v_x, v_y, ω]`: the velocity of the place where each touches the ground,
    /// along what it cannot roll off sideways, as a speed forward.
    pub(crate) fn wheels(self, twist: [f64; 3]) -> [f64; 4] {
        let [vx, vy, omega] = twist;
        let at = |x: f64, y: f64, omega: f64| [vx - omega * y, vy + omega * x];
        let forward = |y: f64, omega: f64| at(0.0, y, omega)[0];
        let diagonal = |x: f64, y: f64, side: f64| {
            let [along, across] = at(x, y, omega);
            // The roller's axis is [1, side] / √2.
            along + side * across
        };
        let tangential = |[degrees, d]: [f64; 2]| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let [along, across] = at(d * cos, d * sin, omega);
            across * cos - along * sin
        };
        let (l, w, half) = (HALF_LENGTH_M, HALF_WIDTH_M, TRACK_M / 2.0);
        let skidding = omega / SKID;
        match self {
            Self::Tracks => [forward(half, skidding), forward(-half, skidding), 0.0, 0.0],
            Self::FourWheels => [half, -half, half, -half].map(|y| forward(y, skidding)),
            Self::Car => [vx, 0.0, 0.0, 0.0],
            Self::CarByWheel => [forward(LATERAL_M, omega), 0.0, 0.0, 0.0],
            Self::Mecanum => [
                diagonal(l, w, -1.0),
                diagonal(l, -w, 1.0),
                diagonal(-l, w, 1.0),
                diagonal(-l, -w, -1.0),
            ],
            Self::OmniOfThree => {
                let [a, b, c] = OMNI_OF_THREE.map(tangential);
                [a, b, c, 0.0]
            }
            Self::OmniOfFour => OMNI.map(tangential),
        }
    }

    /// The whole configuration; `dbc` is where the messages are described.
    pub(crate) fn config(self, says: Says, is_noisy: bool, dbc: &Path) -> Config {
        let per_m = |value: f64| if is_noisy { value } else { 0.0 };
        let text = format!(
            "[robot]\nname = \"a\"\nid = 1\n[motion]\nreference_period_s = 0.02\n\
             forward = {{ per_m = {} }}\nsideways = {{ per_m = {} }}\nturning = {{ per_m = {} }}\n\
             [odometry]\nbuses = [\"local:bus\"]\ndbc = \"{}\"\nmax_speed_mps = 20.0\n{}",
            per_m(FORWARD_PER_M),
            per_m(SIDEWAYS_PER_M),
            per_m(TURNING_PER_M),
            dbc.display(),
            self.kinematics(says, is_noisy)
        );
        Config::parse(&text, Path::new("robot.toml"))
            .unwrap_or_else(|error| panic!("{error}\n{text}"))
    }

    fn kinematics(self, says: Says, is_noisy: bool) -> String {
        let wheel = |place: usize| {
            let (message, quantity) = match says {
                Says::Counts => ("Counts", format!("metres_per_tick = {COUNT_M}")),
                Says::Speeds => ("Speeds", "quantity = \"metres_per_second\"".into()),
            };
            let (pair, signal) = (place / 2, ["A", "B"][place % 2]);
            format!("{{ message = \"{message}{pair}\", signal = \"{signal}\", {quantity} }}")
        };
        let corners = ["front_left", "front_right", "rear_left", "rear_right"];
        let corners = corners.into_iter().enumerate();
        let corners: Vec<String> = corners
            .map(|(place, name)| format!("{name} = {}\n", wheel(place)))
            .collect();
        let corners = corners.concat();
        let wheel_per_m = if is_noisy { WHEEL_PER_M } else { 0.0 };
        let sigma_rad = if is_noisy { SIGMA_RAD } else { 0.0 };
        let omni = |places: &[[f64; 2]]| {
            let one = |(place, [angle, d]): (usize, &[f64; 2])| {
                format!(
                    "[[odometry.omni.wheels]]\nangle_deg = {angle:?}\ndistance_m = {d:?}\nwheel = {}\n",
                    wheel(place)
                )
            };
            let wheels: String = places.iter().enumerate().map(one).collect();
            format!("[odometry.omni]\nwheel_per_m = {wheel_per_m:?}\n{wheels}")
        };
        let bicycle = |lateral_m: f64| {
            format!(
                "[odometry.bicycle]\nwheel_base_m = {WHEEL_BASE_M}\nlateral_m = {lateral_m:?}\nwheel = {}\n\
                 steering = {{ message = \"Steering\", signal = \"Angle\", unit = \"degrees\", straight = 3.0, ratio = 15.0, reversed = true, sigma_rad = {sigma_rad:?} }}\n",
                wheel(0)
            )
        };
        match self {
            Self::Tracks => format!(
                "[odometry.wheels]\ntrack_m = {TRACK_M}\nturning_scale = {SKID}\nleft = {}\nright = {}\n",
                wheel(0),
                wheel(1)
            ),
            Self::FourWheels => format!(
                "[odometry.four_wheels]\ntrack_m = {TRACK_M}\nturning_scale = {SKID}\nwheel_per_m = {wheel_per_m:?}\n{corners}"
            ),
            Self::Car => bicycle(0.0),
            Self::CarByWheel => bicycle(LATERAL_M),
            Self::Mecanum => format!(
                "[odometry.mecanum]\nhalf_length_m = {HALF_LENGTH_M}\nhalf_width_m = {HALF_WIDTH_M}\nwheel_per_m = {wheel_per_m:?}\n{corners}"
            ),
            Self::OmniOfThree => omni(&OMNI_OF_THREE),
            Self::OmniOfFour => omni(&OMNI),
        }
    }
}

/// What the steering wheel of a car says for an angle of its road wheels.
pub(crate) fn steering_deg(angle_rad: f64) -> f64 {
    3.0 - 15.0 * angle_rad.to_degrees()
}

/// Two signals of 32 bits in each message: counts, or floats.
pub(crate) const DBC: &str = r#"VERSION ""

NS_ :

BS_:

BU_: Ecu

BO_ 16 Counts0: 8 Ecu
 SG_ A : 0|32@1+ (1,0) [0|0] "" Ecu
 SG_ B : 32|32@1+ (1,0) [0|0] "" Ecu

BO_ 17 Counts1: 8 Ecu
 SG_ A : 0|32@1+ (1,0) [0|0] "" Ecu
 SG_ B : 32|32@1+ (1,0) [0|0] "" Ecu

BO_ 32 Speeds0: 8 Ecu
 SG_ A : 0|32@1- (1,0) [0|0] "m/s" Ecu
 SG_ B : 32|32@1- (1,0) [0|0] "m/s" Ecu

BO_ 33 Speeds1: 8 Ecu
 SG_ A : 0|32@1- (1,0) [0|0] "m/s" Ecu
 SG_ B : 32|32@1- (1,0) [0|0] "m/s" Ecu

BO_ 48 Steering: 4 Ecu
 SG_ Angle : 0|32@1- (1,0) [0|0] "deg" Ecu

SIG_VALTYPE_ 32 A : 1;
SIG_VALTYPE_ 32 B : 1;
SIG_VALTYPE_ 33 A : 1;
SIG_VALTYPE_ 33 B : 1;
SIG_VALTYPE_ 48 Angle : 1;
"#;
