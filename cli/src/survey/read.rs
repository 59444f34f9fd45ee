//! From a recording and its configuration to a journey.

use std::collections::{BTreeMap, BTreeSet};

use coloc_calibrate::survey::{Fix, Journey, Leg, Sighting, Slow};
use coloc_daemon::config::Config;
use coloc_daemon::record::{RecordedTick, Recording};
use coloc_estimator::partial::{BodySighting, Reading};
use coloc_estimator::{
    Belief, LandmarkSighting, Measurement, OdometrySample, Origin, PositionFix, Stamp,
};
use nalgebra::{Matrix2, Vector2};

use super::SurveyError;
use super::args::SurveyArgs;

/// A belief as sure as this is one to begin with, σ \[m\] …
pub(super) const SURE_M: f64 = 3.0;
/// … \[rad\].
pub(super) const SURE_RAD: f64 = 0.5;

/// A journey, and what was not used of the recording.
pub(super) struct Read {
    pub(super) journey: Journey,
    /// Numbers of the sensor and the receiver that were used.
    pub(super) used: [Option<u16>; 2],
    /// Sightings of landmarks of one number alone.
    pub(super) alone: usize,
}

/// Nothing is seen in the sensor itself \[m\].
const NEAREST_M: f64 = 1e-3;

/// All of a recording, by kind.
#[derive(Default)]
struct Sorted<'a> {
    samples: Vec<&'a OdometrySample>,
    fixes: Vec<&'a PositionFix>,
    sightings: Vec<&'a LandmarkSighting>,
}

impl<'a> Sorted<'a> {
    fn of(recording: &'a Recording) -> Self {
        let mut sorted = Self::default();
        for measurement in recording.ticks.iter().flat_map(|tick| &tick.measurements) {
            match measurement {
                Measurement::Odometry(it) => sorted.samples.push(it),
                Measurement::Fix(it) => sorted.fixes.push(it),
                Measurement::Landmark(it) => sorted.sightings.push(it),
                _ => {}
            }
        }
        sorted
    }
}

impl Read {
    pub(super) fn new(
        recording: &Recording,
        config: &Config,
        args: &SurveyArgs,
    ) -> Result<Self, SurveyError> {
        let begin = recording.stamp;
        let mut sorted = Sorted::of(recording);
        let sensors = sorted.sightings.iter().map(|it| it.origin.source);
        let sensor = args.sensor.or_else(|| most(sensors));
        let receivers = sorted.fixes.iter().map(|it| it.origin.source);
        let receiver = args.receiver.or_else(|| most(receivers));
        if let Some((asked, there)) = missing(args.sensor, &sorted.sightings, |it| it.origin) {
            return Err(SurveyError::NoSensor(asked, there));
        }
        if let Some((asked, there)) = missing(args.receiver, &sorted.fixes, |it| it.origin) {
            return Err(SurveyError::NoReceiver(asked, there));
        }
        sorted
            .sightings
            .retain(|it| Some(it.origin.source) == sensor);
        sorted.fixes.retain(|it| Some(it.origin.source) == receiver);
        let believed: Vec<_> = (recording.ticks.iter())
            .filter(|tick| is_sure(&tick.belief))
            .map(|tick| believed(tick, begin))
            .collect();
        let Some(&(from_s, _)) = believed.first() else {
            return Err(SurveyError::NeverSure);
        };
        let mount = mount(config, sensor);
        let seen: Vec<_> = (sorted.sightings.iter())
            .filter_map(|it| seen(it, mount, begin))
            .collect();
        let alone = sorted.sightings.len() - seen.len();
        let first = sorted.samples.first().map(|it| it.source);
        let samples = sorted.samples.iter().filter(|it| Some(it.source) == first);
        let fix = sorted.fixes.first();
        let slow = [0, 1].map(|it: usize| middle(seen.iter().map(|(_, slow)| slow[it]).collect()));
        let journey = Journey {
            legs: samples.map(|it| leg(it, config, begin)).collect(),
            fixes: (sorted.fixes.iter())
                .map(|it| fix_of(it, begin))
                .filter(|it| it.stamp_s >= from_s)
                .collect(),
            sighting_slow: slow.map(|sigma| Slow {
                sigma,
                time_s: args.slow_time,
            }),
            own: slow.map(|sigma| args.own * sigma),
            stays: slow.map(|sigma| args.stays * sigma),
            sightings: (seen.into_iter().map(|(it, _)| it))
                .filter(|it| it.stamp_s >= from_s)
                .collect(),
            fix_slow: fix.map_or_else(Slow::default, |it| Slow {
                sigma: it.slow.variance.sqrt(),
                time_s: it.slow.memory.as_seconds().max(1.0),
            }),
            believed,
        };
        Ok(Self {
            journey,
            used: [sensor, receiver],
            alone,
        })
    }
}

/// The number that was asked for, if nobody with it said anything, and who did.
fn missing<T>(
    asked: Option<u16>,
    all: &[&T],
    origin: impl Fn(&T) -> Origin,
) -> Option<(u16, String)> {
    let there: BTreeSet<u16> = all.iter().map(|it| origin(it).source).collect();
    let asked = asked.filter(|it| !there.contains(it))?;
    if there.is_empty() {
        return Some((asked, "there are none at all".into()));
    }
    let there: Vec<_> = there.iter().map(u16::to_string).collect();
    Some((asked, format!("there is {}", there.join(", "))))
}

fn most(numbers: impl Iterator<Item = u16>) -> Option<u16> {
    let mut counts: BTreeMap<u16, usize> = BTreeMap::new();
    for number in numbers {
        *counts.entry(number).or_default() += 1;
    }
    let most = counts
        .into_iter()
        .max_by_key(|(number, count)| (*count, u16::MAX - number));
    most.map(|(number, _)| number)
}

fn seconds(stamp: Stamp, begin: Stamp) -> f64 {
    (stamp - begin).as_seconds()
}

fn is_sure(belief: &Belief) -> bool {
    let [x, y, heading] = belief.total().variances();
    let [position, turn] = [SURE_M, SURE_RAD].map(|it| it * it);
    x < position && y < position && heading < turn
}

fn believed(tick: &RecordedTick, begin: Stamp) -> (f64, [f64; 3]) {
    let pose = tick.belief.pose;
    (seconds(tick.stamp, begin), [pose.x, pose.y, pose.phi])
}

fn leg(sample: &OdometrySample, config: &Config, begin: Stamp) -> Leg {
    Leg {
        start_s: seconds(sample.start, begin),
        end_s: seconds(sample.stamp, begin),
        velocity: sample.motion.velocity(),
        noise_per_s: sample.motion.covariance().matrix() * config.motion.reference_period_s,
    }
}

fn fix_of(fix: &PositionFix, begin: Stamp) -> Fix {
    Fix {
        stamp_s: seconds(fix.stamp, begin),
        position: fix.position,
        covariance: fix.covariance.matrix(),
        lever: fix.lever,
    }
}

fn mount(config: &Config, sensor: Option<u16>) -> [f64; 2] {
    let own = config
        .sighting
        .sensor
        .iter()
        .find(|it| Some(it.source) == sensor);
    let [x, y, _] = own.map_or(config.sighting.mount, |it| it.mount);
    [x, y]
}

/// As range and bearing from where the sensor is, and its slow errors; nothing of one number alone.
fn seen(it: &LandmarkSighting, mount: [f64; 2], begin: Stamp) -> Option<(Sighting, [f64; 2])> {
    let Reading::Place(BodySighting { at, white, slow }) = it.reading else {
        return None;
    };
    let sight = Vector2::from(at) - Vector2::from(mount);
    let range_m = sight.norm();
    if range_m < NEAREST_M {
        return None;
    }
    let (along, across) = (sight / range_m, Vector2::new(-sight.y, sight.x) / range_m);
    let of = |noise: &Matrix2<f64>, axis: &Vector2<f64>| axis.dot(&(noise * axis));
    let [white, slow] = [white.matrix(), slow.matrix()]
        .map(|it| [of(&it, &along), of(&it, &across) / (range_m * range_m)]);
    let sighting = Sighting {
        stamp_s: seconds(it.stamp, begin),
        landmark: it.landmark,
        range_m,
        bearing_rad: sight.y.atan2(sight.x),
        mount,
        white,
    };
    Some((sighting, [slow[0].sqrt() / range_m, slow[1].sqrt()]))
}

fn middle(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers.get(numbers.len() / 2).copied().unwrap_or_default()
}
