//! Landmarks that a drive with fixes teaches are where they say to be: in worlds whose landmarks are known, and in MR.CLAM 1 and 6.
#![allow(clippy::unwrap_used)] // What fails here fails the test.

use std::collections::BTreeMap;
use std::path::PathBuf;

use coloc_calibrate::survey::{Enough, Fix, Found, Journey, Leg, Sighting, Slow, Unfit, survey};
use coloc_sim::World;
use coloc_sim::mrclam::Recording;
use coloc_sim::random::{Draws, Noise, Purpose};
use nalgebra::{Matrix2, Matrix3, Vector2};

/// χ² with two degrees of freedom, 95 %.
const CHI2_2_95: f64 = 5.991_464_547_107_979;

/// How the cameras err: of the range as a part of it, and beside it \[m\]; of the bearing \[rad\].
const WHITE: [f64; 3] = [0.006, 0.005, 0.006];
const SLOW: [Slow; 2] = [
    Slow {
        sigma: 0.045,
        time_s: 10.0,
    },
    Slow {
        sigma: 0.013,
        time_s: 10.0,
    },
];

fn chance(seed: u64) -> Draws {
    Noise::new(seed, 0).draws(Purpose::RelativePose, 0, 0, 0)
}

fn white(range_m: f64) -> [f64; 2] {
    let along = WHITE[0] * range_m;
    [along * along + WHITE[1] * WHITE[1], WHITE[2] * WHITE[2]]
}

/// What a camera errs by beside what it says of itself.
#[derive(Copy, Clone)]
struct Camera {
    /// This part of its sightings is of somewhere else.
    stray: f64,
    /// Slow errors, the same for all in an image: of the range as a part of it, and of the bearing.
    together: [Slow; 2],
    /// σ of those of each landmark alone, that last as long.
    own: [f64; 2],
    /// σ of what stays about each landmark.
    stays: [f64; 2],
}

const NONE: [f64; 2] = [0.0; 2];

/// It errs slowly about all in an image together.
const TOGETHER: Camera = Camera {
    stray: 0.02,
    together: SLOW,
    own: NONE,
    stays: NONE,
};

/// It errs slowly about each landmark otherwise.
const OWN: Camera = Camera {
    together: [still(SLOW[0]), still(SLOW[1])],
    own: sigmas(SLOW),
    ..TOGETHER
};

const STAYS: Camera = Camera {
    stays: sigmas(SLOW),
    ..OWN
};

/// All of these at once.
const ALL: Camera = Camera {
    together: SLOW,
    ..STAYS
};

const fn still(slow: Slow) -> Slow {
    Slow { sigma: 0.0, ..slow }
}

const fn sigmas([range, bearing]: [Slow; 2]) -> [f64; 2] {
    [range.sigma, bearing.sigma]
}

/// A slow error a second later.
fn later(error: f64, sigma: f64, time_s: f64, chance: &mut Draws) -> f64 {
    let kept = (-1.0 / time_s).exp();
    kept * error + sigma * (1.0 - kept * kept).sqrt() * chance.normal()
}

/// A drive of five minutes in a hall with fifteen landmarks, seen once a second.
struct Hall {
    camera: Camera,
    journey: Journey,
    landmarks: BTreeMap<u16, [f64; 2]>,
    /// What stays about each.
    stays: BTreeMap<u16, [f64; 2]>,
    /// What it errs by about each for a while.
    own: BTreeMap<u16, [f64; 2]>,
}

const LEG_S: f64 = 0.1;
const LEGS: usize = 3000;
const FIX_SIGMA_M: f64 = 0.1;

impl Hall {
    fn new(seed: u64, camera: Camera) -> Self {
        let mut chance = chance(seed);
        let place = |chance: &mut Draws| [chance.uniform(-6.0, 6.0), chance.uniform(-4.0, 4.0)];
        let landmarks: BTreeMap<u16, [f64; 2]> =
            (6..21).map(|it| (it, place(&mut chance))).collect();
        let mut errors = |sigmas: [f64; 2]| -> BTreeMap<u16, [f64; 2]> {
            let error = |it: &u16| (*it, sigmas.map(|sigma| sigma * chance.normal()));
            landmarks.keys().map(error).collect()
        };
        let mut hall = Self {
            stays: errors(camera.stays),
            own: errors(camera.own),
            camera,
            journey: Journey {
                sighting_slow: camera.together,
                own: camera.own,
                stays: camera.stays,
                ..Journey::default()
            },
            landmarks,
        };
        let mut pose = [1.0, 0.0, 0.5];
        let mut slow = camera.together.map(|it| it.sigma * chance.normal());
        for leg in 0..LEGS {
            let time_s = LEG_S * f64::from(u32::try_from(leg).unwrap());
            if leg % 10 == 0 {
                hall.fix(pose, time_s, &mut chance);
                hall.look(pose, time_s, slow, &mut chance);
                hall.journey.believed.push((time_s, off(pose, &mut chance)));
                for (kind, it) in camera.together.into_iter().enumerate() {
                    slow[kind] = later(slow[kind], it.sigma, it.time_s, &mut chance);
                    for own in hall.own.values_mut() {
                        own[kind] = later(own[kind], camera.own[kind], it.time_s, &mut chance);
                    }
                }
            }
            pose = hall.drive(pose, time_s, &mut chance);
        }
        hall
    }

    /// Round the hall; what the wheels say is not quite it.
    fn drive(&mut self, [x, y, heading]: [f64; 3], time_s: f64, chance: &mut Draws) -> [f64; 3] {
        let home = (-y).atan2(-x) - heading;
        let to_home = home.sin() * (x.hypot(y) / 4.0).min(1.0);
        let velocity = [0.4, 0.0, 0.3 * (0.11 * time_s).sin() + 0.5 * to_home];
        let per_s = [1e-3, 0.0, 3e-3];
        let noise = per_s.map(|it: f64| (it * LEG_S).sqrt() * chance.normal());
        let [ahead, turn] = [0, 2].map(|it: usize| velocity[it] * LEG_S + noise[it]);
        self.journey.legs.push(Leg {
            start_s: time_s,
            end_s: time_s + LEG_S,
            velocity,
            noise_per_s: Matrix3::from_diagonal(&per_s.into()),
        });
        let (sin, cos) = (heading + 0.5 * turn).sin_cos();
        [x + ahead * cos, y + ahead * sin, heading + turn]
    }

    fn fix(&mut self, pose: [f64; 3], stamp_s: f64, chance: &mut Draws) {
        self.journey.fixes.push(fix_at(pose, stamp_s, chance));
    }

    fn look(
        &mut self,
        [x, y, heading]: [f64; 3],
        stamp_s: f64,
        slow: [f64; 2],
        chance: &mut Draws,
    ) {
        for (landmark, place) in &self.landmarks {
            let (dx, dy) = (place[0] - x, place[1] - y);
            let (range, bearing) = (dx.hypot(dy), dy.atan2(dx) - heading);
            let bearing = bearing.sin().atan2(bearing.cos());
            let [range_variance, bearing_variance] = white(range);
            let [own, stays] = [self.own[landmark], self.stays[landmark]];
            let [part, turned] = [0, 1].map(|it| slow[it] + own[it] + stays[it]);
            let is_stray = chance.uniform(0.0, 1.0) < self.camera.stray;
            let [more_m, more_rad] =
                [1.5, 0.5].map(|it| f64::from(u8::from(is_stray)) * chance.uniform(-it, it));
            if (0.3..6.0).contains(&range) && bearing.abs() < 0.8 {
                self.journey.sightings.push(Sighting {
                    stamp_s,
                    landmark: *landmark,
                    range_m: (range * (1.0 + part)
                        + range_variance.sqrt() * chance.normal()
                        + more_m)
                        .max(0.1),
                    bearing_rad: bearing
                        + turned
                        + bearing_variance.sqrt() * chance.normal()
                        + more_rad,
                    mount: [0.0; 2],
                    white: white(range),
                });
            }
        }
    }
}

fn fix_at([x, y, _]: [f64; 3], stamp_s: f64, chance: &mut Draws) -> Fix {
    Fix {
        stamp_s,
        position: [x, y].map(|it| it + FIX_SIGMA_M * chance.normal()),
        covariance: Matrix2::from_diagonal_element(FIX_SIGMA_M * FIX_SIGMA_M),
        lever: [0.0; 2],
    }
}

/// As a filter believes to be.
fn off([x, y, heading]: [f64; 3], chance: &mut Draws) -> [f64; 3] {
    [
        x + 0.1 * chance.normal(),
        y + 0.1 * chance.normal(),
        heading + 0.1 * chance.normal(),
    ]
}

fn distance(found: &Found, truth: [f64; 2]) -> f64 {
    let off = Vector2::from(found.position) - Vector2::from(truth);
    off.dot(&(found.covariance.try_inverse().unwrap() * off))
}

/// The share of landmarks inside of their 95 % ellipses, of how many, and their RMS error \[m\].
fn held(camera: Camera, told: Camera, halls: u64) -> [f64; 3] {
    let (mut inside, mut count, mut squares) = (0.0, 0.0, 0.0);
    for seed in 0..halls {
        let mut hall = Hall::new(seed, camera);
        hall.journey.sighting_slow = told.together;
        (hall.journey.own, hall.journey.stays) = (told.own, told.stays);
        let found = survey(&hall.journey, &Enough::default(), &|_| ()).unwrap();
        for found in found.landmarks.iter().filter(|it| it.unfit.is_none()) {
            let truth = hall.landmarks[&found.landmark];
            inside += f64::from(u8::from(distance(found, truth) <= CHI2_2_95));
            count += 1.0;
            squares += (Vector2::from(found.position) - Vector2::from(truth)).norm_squared();
        }
    }
    [inside / count, count, (squares / count).sqrt()]
}

#[test]
fn landmarks_are_inside_of_their_ellipses_as_often_as_these_say() {
    for (name, camera) in [("together", TOGETHER), ("own", OWN), ("stays", STAYS)] {
        let [inside, count, rms_m] = held(camera, camera, 40);
        println!(
            "{name}: {count} landmarks, {rms_m:.3} m RMS, {:.1} % inside",
            100.0 * inside
        );
        assert!(count >= 200.0, "{count} landmarks");
        assert!((0.91..=0.985).contains(&inside), "{inside}");
        assert!(rms_m < 0.12, "{rms_m} m");
        // Who does not know which kind it is says all of them.
        let [inside, count, rms_m] = held(camera, ALL, 15);
        println!(
            "{name}, as all kinds: {count} landmarks, {rms_m:.3} m RMS, {:.1} % inside",
            100.0 * inside
        );
        assert!(inside >= 0.91 && rms_m < 0.12, "{inside}, {rms_m} m");
    }
}

#[test]
fn what_was_not_seen_well_enough_is_refused_under_its_reason() {
    let mut hall = Hall::new(
        1,
        Camera {
            stray: 0.0,
            ..TOGETHER
        },
    );
    // One that is moved half-way, one of few sightings, and one of a short time.
    let half_s = 0.5 * LEG_S * f64::from(u32::try_from(LEGS).unwrap());
    let often = |landmark: u16, journey: &Journey| {
        journey
            .sightings
            .iter()
            .filter(|it| it.landmark == landmark)
            .count()
    };
    let mut by_count: Vec<u16> = hall.landmarks.keys().copied().collect();
    by_count.sort_by_key(|it| often(*it, &hall.journey));
    let [.., brief, few, moved] = by_count[..] else {
        panic!("fifteen")
    };
    for it in hall
        .journey
        .sightings
        .iter_mut()
        .filter(|it| it.landmark == moved && it.stamp_s > half_s)
    {
        it.range_m += 1.5;
    }
    let mut left = 4;
    let first_s = hall
        .journey
        .sightings
        .iter()
        .find(|it| it.landmark == brief)
        .unwrap()
        .stamp_s;
    hall.journey.sightings.retain(|it| {
        left -= i32::from(it.landmark == few);
        (it.landmark != few || left >= 0) && (it.landmark != brief || it.stamp_s < first_s + 9.0)
    });
    let enough = Enough {
        sightings: 5,
        ..Enough::default()
    };
    let found = survey(&hall.journey, &enough, &|_| ()).unwrap();
    let unfit = |number: u16| {
        found
            .landmarks
            .iter()
            .find(|it| it.landmark == number)
            .unwrap()
            .unfit
    };
    assert!(
        matches!(unfit(moved), Some(Unfit::Stray { .. })),
        "{:?}",
        unfit(moved)
    );
    assert!(
        matches!(unfit(few), Some(Unfit::Few { sightings: 4, .. })),
        "{:?}",
        unfit(few)
    );
    assert!(
        matches!(unfit(brief), Some(Unfit::Few { .. } | Unfit::Brief { .. })),
        "{:?}",
        unfit(brief)
    );
    let strict = Enough {
        sigma_m: 1e-3,
        ..Enough::default()
    };
    let found = survey(&hall.journey, &strict, &|_| ()).unwrap();
    assert!(found.landmarks.iter().all(|it| it.unfit.is_some()));
}

/// One in `COLOC_DATA`, or in `shared/data` beside the repository or above it.
fn recording(name: &str) -> Option<Recording> {
    let given = std::env::var_os("COLOC_DATA").map(PathBuf::from);
    let here = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let above = here.ancestors().map(|folder| folder.join("shared/data"));
    let folders = given.into_iter().chain(above).map(|it| it.join(name));
    let found = folders.into_iter().find(|it| it.is_dir());
    if found.is_none() {
        println!("SKIPPED: no recording {name}: set COLOC_DATA to the folder that has it");
    }
    found.map(|it| Recording::load(&it).unwrap())
}

/// The camera's stamps are late by this \[s\].
const LATENCY_S: f64 = 0.04;
/// Of the drive, this part [s], and of its images two a second.
const DRIVE_S: f64 = 900.0;
const IMAGE_S: f64 = 0.5;
/// What such a camera errs by about a landmark for the whole drive, as a part of its slow errors: minutes apart, errors about the same one have
/// a tenth of their variance in common.
const STAYS_PART: f64 = 0.3;
/// Variances of v over v² and of ω, in a second, of these robots' wheels.
const WHEELS: [f64; 2] = [5.075 * 0.02, 0.345 * 0.02];

/// What one robot drove and saw of landmarks; fixes once a second, made from its truth.
fn recorded(recording: &Recording, robot: usize) -> Journey {
    let world = recording.resample();
    let mut chance = chance(robot as u64);
    let mut journey = Journey {
        sighting_slow: SLOW,
        own: sigmas(SLOW),
        stays: sigmas(SLOW).map(|it| STAYS_PART * it),
        ..Journey::default()
    };
    let steps = (0..world.steps()).take_while(|it| world.time_s(*it) - world.start_s() < DRIVE_S);
    for step in steps {
        let time_s = world.time_s(step) - world.start_s();
        let [v, omega] = world.odometry(step, robot);
        journey.legs.push(Leg {
            start_s: time_s,
            end_s: time_s + world.dt_s(),
            velocity: [v, 0.0, omega],
            noise_per_s: Matrix3::from_diagonal(&[WHEELS[0] * v * v, 0.0, WHEELS[1]].into()),
        });
        if let (0, Some(truth)) = (step % 50, world.truth(step, robot)) {
            let truth = [truth.x, truth.y, truth.phi];
            journey.fixes.push(fix_at(truth, time_s, &mut chance));
            journey.believed.push((time_s, off(truth, &mut chance)));
        }
    }
    let mut next_s = 0.0;
    for it in &recording.robots[robot].measurements {
        let stamp_s = it.time_s - LATENCY_S - world.start_s();
        let subject = recording
            .barcodes
            .get(&it.barcode)
            .copied()
            .unwrap_or_default();
        let is_same_image = journey
            .sightings
            .last()
            .is_some_and(|last| (last.stamp_s - stamp_s).abs() < 1e-6);
        if !(0.0..DRIVE_S).contains(&stamp_s) || subject < 6 || (stamp_s < next_s && !is_same_image)
        {
            continue;
        }
        next_s = stamp_s + IMAGE_S;
        journey.sightings.push(Sighting {
            stamp_s,
            landmark: u16::try_from(subject).unwrap(),
            range_m: it.range_m,
            bearing_rad: it.bearing_rad,
            mount: [0.0; 2],
            white: white(it.range_m),
        });
    }
    journey
}

/// As surveyed, with the two that are swapped in the first recording swapped back.
fn surveyed(name: &str, recording: &Recording) -> BTreeMap<u16, [f64; 2]> {
    let number = |subject| match (name, subject) {
        ("mrclam1", 11) => 17,
        ("mrclam1", 17) => 11,
        (_, other) => u16::try_from(other).unwrap(),
    };
    let all = recording.landmarks.iter();
    all.map(|it| (number(it.subject), it.position)).collect()
}

#[test]
fn recorded_robots_find_the_landmarks_where_they_were_surveyed() {
    for name in ["mrclam1", "mrclam6"] {
        if let Some(recording) = recording(name) {
            found_where_surveyed(name, &recording);
        }
    }
}

fn found_where_surveyed(name: &str, recording: &Recording) {
    let truth = surveyed(name, recording);
    let mut errors = Vec::new();
    for robot in 0..recording.robots.len() {
        let found = survey(&recorded(recording, robot), &Enough::default(), &|_| ()).unwrap();
        for it in found.landmarks.iter().filter(|it| it.unfit.is_none()) {
            let off = Vector2::from(it.position) - Vector2::from(truth[&it.landmark]);
            errors.push((off.norm(), distance(it, truth[&it.landmark])));
            println!(
                "R{} {}: {:.3} m off, σ {:.3} m, {:?}",
                robot + 1,
                it.landmark,
                off.norm(),
                it.sigma_m(),
                it.sightings
            );
        }
        println!("R{}: larger {:?}", robot + 1, found.larger);
    }
    let count = f64::from(u32::try_from(errors.len()).unwrap());
    let rms_m = (errors.iter().map(|(off, _)| off * off).sum::<f64>() / count).sqrt();
    let inside: f64 = errors
        .iter()
        .map(|(_, it)| f64::from(u8::from(*it <= CHI2_2_95)))
        .sum::<f64>()
        / count;
    println!(
        "{name}: {count} landmarks, {rms_m:.3} m RMS, {:.1} % inside of their 95 %",
        100.0 * inside
    );
    assert!(
        count >= 60.0 && rms_m < 0.15 && inside > 0.9,
        "{count}, {rms_m} m, {inside}"
    );
}
