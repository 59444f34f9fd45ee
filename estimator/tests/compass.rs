//! What a heading does for a robot that does not know where it looks, and for one that drives: found at once, never found by it alone,
//! not fooled for long.
#![allow(clippy::unwrap_used)] // A test may panic.

use std::cell::RefCell;
use std::f64::consts::PI;

use coloc_estimator::{
    Belief, Covariance2, Covariance3, Decision, Estimator, FindingState, HeadingFix, HeadingOf,
    Kind, Measurement, Motion, OdometrySample, Origin, Pose, PositionFix, Settings, Slot,
    SlowError, Source, Span, Stamp, Start, TickInputs, Verdict, step,
};

const TICKS_PER_S: i64 = 50;

fn at(tick: i64) -> Stamp {
    Stamp::default() + Span::from_millis(20 * tick)
}

fn origin(tick: i64) -> Origin {
    Origin::counted(tick.unsigned_abs())
}

fn wheels(tick: i64, velocity: [f64; 2]) -> Measurement {
    OdometrySample {
        source: 0,
        start: at(tick - 1),
        stamp: at(tick),
        motion: Motion::Nonholonomic {
            velocity,
            noise: Covariance2::diagonal([1e-4, 1e-4]).unwrap(),
        },
    }
    .into()
}

/// Of wheels that slip aside a little, as every preset has them.
fn slipping(tick: i64, velocity: [f64; 3]) -> Measurement {
    OdometrySample {
        source: 0,
        start: at(tick - 1),
        stamp: at(tick),
        motion: Motion::Holonomic {
            velocity,
            noise: Covariance3::diagonal([1e-4, 1e-6, 1e-4]).unwrap(),
        },
    }
    .into()
}

fn compass(tick: i64, heading_rad: f64) -> Measurement {
    HeadingFix {
        stamp: at(tick),
        origin: origin(tick),
        heading_rad,
        variance: 0.02 * 0.02,
        slow: SlowError {
            variance: 0.02 * 0.02,
            memory: Span::from_seconds(60.0),
        },
        of: HeadingOf::Body,
    }
    .into()
}

fn fix(tick: i64, position: [f64; 2]) -> Measurement {
    fix_with(tick, position, 0.01)
}

fn fix_with(tick: i64, position: [f64; 2], sigma_m: f64) -> Measurement {
    PositionFix {
        stamp: at(tick),
        origin: origin(tick),
        position,
        covariance: Covariance2::diagonal([sigma_m * sigma_m; 2]).unwrap(),
        lever: [0.0; 2],
        slow: SlowError::default(),
    }
    .into()
}

/// A robot whose way is known, and what it is told of it.
struct Drive {
    robot: Estimator<Vec<Slot>>,
    truth: Pose,
    tick: i64,
    velocity: [f64; 2],
}

impl Drive {
    fn starting(start: &Start, truth: Pose) -> Self {
        let slots = vec![Slot::default(); 512];
        Self {
            robot: Estimator::starting(Settings::default(), at(0), start, slots),
            truth,
            tick: 0,
            velocity: [0.0; 2],
        }
    }

    /// A second passes; `says` tells what sensors say at a tenth of it.
    fn pass(&mut self, says: impl Fn(i64, &Pose) -> Vec<Measurement>) {
        self.pass_ticks(TICKS_PER_S, says);
    }

    fn pass_ticks(&mut self, ticks: i64, says: impl Fn(i64, &Pose) -> Vec<Measurement>) {
        let [v, omega] = self.velocity;
        for _ in 0..ticks {
            self.tick += 1;
            let Pose { x, y, phi } = self.truth;
            let way = v / 50.0;
            let middle = phi + 0.5 * omega / 50.0;
            self.truth = Pose::new(
                x + way * middle.cos(),
                y + way * middle.sin(),
                phi + omega / 50.0,
            );
            let mut measurements = vec![wheels(self.tick, self.velocity)];
            if self.tick % 5 == 0 {
                measurements.extend(says(self.tick, &self.truth));
            }
            let inputs = TickInputs {
                stamp: at(self.tick),
                measurements: &measurements,
            };
            step(&mut self.robot, &inputs);
        }
    }

    fn state(&self) -> FindingState {
        self.robot.finding().state
    }

    /// How far off it is, and looks.
    fn errors(&self) -> [f64; 2] {
        let Pose { x, y, phi } = self.robot.extrapolated(at(self.tick)).belief.pose;
        let away = (x - self.truth.x).hypot(y - self.truth.y);
        [
            away,
            coloc_estimator::angle::wrap(phi - self.truth.phi).abs(),
        ]
    }
}

#[test]
fn a_robot_that_stands_is_found_at_once_by_a_compass_and_fixes() {
    let mut drive = Drive::starting(&Start::Unknown, Pose::new(5.0, -3.0, 2.0));
    for _ in 0..4 {
        drive.pass(|tick, truth| vec![compass(tick, truth.phi), fix(tick, [truth.x, truth.y])]);
    }
    assert_eq!(drive.state(), FindingState::Ok);
    let [away, turned] = drive.errors();
    assert!(away < 0.05 && turned < 0.05, "{away} {turned}");
}

#[test]
fn a_compass_alone_finds_no_robot() {
    let mut drive = Drive::starting(&Start::Unknown, Pose::new(5.0, -3.0, 2.0));
    for _ in 0..30 {
        drive.pass(|tick, truth| vec![compass(tick, truth.phi)]);
        assert_ne!(drive.state(), FindingState::Ok);
    }
}

#[test]
fn a_robot_that_was_told_its_place_needs_no_more_than_a_compass() {
    let place = Start::Position([5.0, -3.0], Covariance2::diagonal([0.01; 2]).unwrap());
    let mut drive = Drive::starting(&place, Pose::new(5.0, -3.0, 2.0));
    drive.pass(|_, _| Vec::new());
    assert_eq!(drive.state(), FindingState::Finding);
    for _ in 0..3 {
        drive.pass(|tick, truth| vec![compass(tick, truth.phi)]);
    }
    assert_eq!(drive.state(), FindingState::Ok);
    let [away, turned] = drive.errors();
    assert!(away < 1e-9 && turned < 1e-9, "{away} {turned}");
    let sigma = drive
        .robot
        .extrapolated(at(drive.tick))
        .belief
        .total()
        .variances()[2]
        .sqrt();
    assert!((0.02..0.05).contains(&sigma), "{sigma}");
}

/// It is a radian off: the first metres contradict it, and the robot is found by what its fixes and wheels say.
#[test]
fn a_compass_that_lies_is_found_out_by_driving() {
    let mut drive = Drive::starting(&Start::Unknown, Pose::new(5.0, -3.0, 2.0));
    drive.velocity = [1.0, 0.1];
    for _ in 0..20 {
        drive.pass(|tick, truth| {
            vec![
                compass(tick, truth.phi + 1.0),
                fix(tick, [truth.x, truth.y]),
            ]
        });
    }
    assert_eq!(drive.state(), FindingState::Ok);
    let [away, turned] = drive.errors();
    assert!(away < 0.1 && turned < 0.1, "{away} {turned}");
}

fn known(truth: Pose) -> Start {
    let covariance = Covariance3::diagonal([0.01, 0.01, 0.01]).unwrap();
    Start::Known(Belief::independent(truth, covariance))
}

/// Ten minutes without a fix: the heading stays as good as the compass.
#[test]
fn a_compass_holds_the_heading_and_a_course_does_while_it_moves() {
    let mut drive = Drive::starting(&known(Pose::default()), Pose::default());
    drive.velocity = [1.0, 0.05];
    for _ in 0..600 {
        drive.pass(|tick, truth| vec![compass(tick, truth.phi)]);
    }
    let [_, turned] = drive.errors();
    let sigma = drive
        .robot
        .extrapolated(at(drive.tick))
        .belief
        .total()
        .variances()[2]
        .sqrt();
    assert!(turned < 3.0 * sigma && sigma < 0.03, "{turned} {sigma}");
}

#[test]
fn a_course_over_ground_counts_while_the_wheels_move() {
    let course = |tick: i64, heading_rad: f64| HeadingFix {
        stamp: at(tick),
        origin: origin(tick),
        heading_rad,
        variance: 0.01,
        slow: SlowError::default(),
        of: HeadingOf::Course {
            least_m_s: 0.5,
            lever: [0.0; 2],
        },
    };
    let verdict_of = |wheels: Measurement, heading: f64| {
        let slots = vec![Slot::default(); 16];
        let mut robot =
            Estimator::starting(Settings::default(), at(0), &known(Pose::default()), slots);
        let measurements = [wheels, course(1, heading).into()];
        let inputs = TickInputs {
            stamp: at(1),
            measurements: &measurements,
        };
        let outputs = step(&mut robot, &inputs);
        assert_eq!(outputs.reports[0].source, Source::new(Kind::Heading, 0));
        (outputs.reports[0].verdict, outputs.estimate.belief.pose.phi)
    };
    let verdict = |velocity, heading| verdict_of(wheels(1, velocity), heading);
    let is_fused = |it| matches!(it, Verdict::Accepted { .. });
    let (slipped, turned) = verdict_of(slipping(1, [1.0, 0.0, 0.0]), 0.1);
    assert!(
        is_fused(slipped) && (turned - 0.05).abs() < 1e-3,
        "{slipped:?} {turned}"
    );
    let (sideways, turned) = verdict_of(slipping(1, [1.0, 0.1, 0.0]), 0.1);
    assert!(sideways == Verdict::NotMoving && turned == 0.0);
    let (forward, turned) = verdict([1.0, 0.0], 0.1);
    assert!(
        is_fused(forward) && (turned - 0.05).abs() < 1e-3,
        "{turned}"
    );
    let (backward, turned) = verdict([-1.0, 0.0], 0.1 - PI);
    assert!(
        is_fused(backward) && (turned - 0.05).abs() < 1e-3,
        "{turned}"
    );
    let (standing, turned) = verdict([0.3, 0.0], 0.1);
    assert!(standing == Verdict::NotMoving && turned == 0.0);
    let (wrong, _) = verdict([1.0, 0.0], 1.0);
    assert!(matches!(wrong, Verdict::Gated { .. }));
}

/// Who is told its place by a compass is told who said so.
#[test]
fn it_is_said_who_found_it() {
    let place = Start::Position([0.0; 2], Covariance2::diagonal([0.01; 2]).unwrap());
    let slots = vec![Slot::default(); 512];
    let mut robot = Estimator::starting(Settings::default(), at(0), &place, slots);
    let mut said = None;
    for tick in 1..200 {
        let inputs = TickInputs {
            stamp: at(tick),
            measurements: &[compass(tick, 1.0)],
        };
        let outputs = step(&mut robot, &inputs);
        said = said.or(outputs.finding.decisions().first().copied());
    }
    let Some((_, Decision::Followed { source, .. })) = said else {
        panic!("{said:?}")
    };
    assert_eq!(source, Source::new(Kind::Heading, 0));
}

/// Numbers that look like chance, and are the same each time.
struct Chance(u64);

impl Chance {
    /// Between 0 and 1.
    #[allow(clippy::cast_precision_loss)] // 53 bits.
    fn uniform(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// One of ten headings is that of its back.
#[derive(Copy, Clone)]
struct Flipping {
    speed_m_s: f64,
    fix_sigma_m: f64,
    /// A heading in so many ticks.
    every: i64,
}

impl Flipping {
    /// When robot `number`, which starts from nowhere, is `ok` for the first time, and how long it then looks the wrong way \[s\].
    fn robot(self, number: u64) -> (f64, f64) {
        let chance = RefCell::new(Chance(number.wrapping_mul(0x9e37_79b9_7f4a_7c15) + 1));
        let looks = PI * (2.0 * chance.borrow_mut().uniform() - 1.0);
        let mut drive = Drive::starting(&Start::Unknown, Pose::new(5.0, -3.0, looks));
        drive.velocity = [self.speed_m_s, 0.1];
        let (mut found_s, mut wrong_s) = (f64::INFINITY, 0.0);
        for tenth in 1..=100_u32 {
            drive.pass_ticks(5, |tick, truth| {
                self.said(tick, truth, &mut chance.borrow_mut())
            });
            if drive.state() == FindingState::Ok {
                found_s = f64::min(found_s, 0.1 * f64::from(tenth));
                let [_, turned] = drive.errors();
                wrong_s += if turned > 1.0 { 0.1 } else { 0.0 };
            }
        }
        (found_s, wrong_s)
    }

    fn said(self, tick: i64, truth: &Pose, chance: &mut Chance) -> Vec<Measurement> {
        let mut said = Vec::new();
        if tick % self.every == 0 {
            let back = if chance.uniform() < 0.1 { PI } else { 0.0 };
            said.push(compass(tick, truth.phi + back + 0.02 * chance.normal()));
        }
        if tick % 10 == 0 {
            let sigma = self.fix_sigma_m;
            let position = [truth.x, truth.y].map(|it| it + sigma * chance.normal());
            said.push(fix_with(tick, position, sigma));
        }
        said
    }
}

/// Its first heading may be that of its back, and nothing else says where it looks until it has driven some way.
#[test]
fn a_compass_that_flips_now_and_then_misleads_nobody_who_is_nowhere() {
    let cases = [(0.0, 0.3, 5), (0.2, 1.0, 5), (0.2, 1.0, 50), (1.0, 0.3, 50)];
    for (speed_m_s, fix_sigma_m, every) in cases {
        let flipping = Flipping {
            speed_m_s,
            fix_sigma_m,
            every,
        };
        let robots: Vec<_> = (0..60).map(|number| flipping.robot(number)).collect();
        let misled = robots.iter().filter(|(_, wrong_s)| *wrong_s > 0.0).count();
        let mut found: Vec<_> = robots.iter().map(|(found_s, _)| *found_s).collect();
        found.sort_by(f64::total_cmp);
        assert_eq!(misled, 0, "{speed_m_s} {fix_sigma_m} {every}");
        assert!(found[30] < 5.0 && found[59] < 10.0, "{found:?}");
    }
}
