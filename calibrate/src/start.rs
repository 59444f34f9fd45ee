//! Where a search begins: what the gyro reads when nothing turns, and which way the robot looked when the drive began.

use std::f64::consts::TAU;

use coloc_estimator::{Belief, Covariance3, Pose, honest};

use crate::drive::{Drive, State, Way};
use crate::likelihood::{Along, Innovations};
use crate::robot::{Robot, Step, Wheels};

/// Beside the heading at which the ways lie on each other, these are tried \[parts of a turn\].
const TRIED: u8 = 12;

/// `robot` with a bias of the gyro, and the heading at the begin of the drive under which the drive is most likely, of some.
pub(crate) fn guess(drive: &Drive, robot: &Robot) -> Robot {
    let mut robot = robot.clone();
    if let (Some(gyro), Some(bias_radps)) = (&mut robot.gyro, bias(drive, &robot.wheels)) {
        gyro.bias_radps = bias_radps;
    }
    let robot = &robot;
    let with = |heading_rad: f64| Robot {
        heading_rad,
        ..robot.clone()
    };
    let all_around = (0..TRIED).map(|it| f64::from(it) / f64::from(TRIED) * TAU);
    let tried = all_around.chain(laid_on(drive, robot)).map(with);
    let likely = |robot: &Robot| {
        let innovations = Innovations::of(drive, robot);
        innovations.map_or(f64::NEG_INFINITY, |it| it.log_likelihood())
    };
    tried
        .map(|it| (likely(&it), it))
        .max_by(|(a, _), (b, _)| a.total_cmp(b))
        .map_or_else(|| robot.clone(), |(_, it)| it)
}

/// What the gyro has read beyond the wheels, standing if it stood for a second \[rad/s\].
fn bias(drive: &Drive, wheels: &Wheels) -> Option<f64> {
    let still = drive.stood_s() > 1.0;
    let is_of_it = |way: &&Way| match way.state {
        State::Standing => still,
        State::Rolling => !still,
        State::Missing => false,
    };
    let (mut beyond, mut took_s) = (0.0, 0.0);
    for way in drive.ways().iter().filter(is_of_it) {
        if let Some(read) = way.gyro {
            let [_, turn] = wheels.held(way.read);
            beyond += read - if still { 0.0 } else { turn };
            took_s += way.end_s - way.start_s;
        }
    }
    (took_s > 0.0).then(|| beyond / took_s)
}

/// By how much the wheels' own way is turned so that it lies on the fixes, over its first parts and over all of it.
fn laid_on(drive: &Drive, robot: &Robot) -> Vec<f64> {
    let steps: Vec<Step> = drive.ways().iter().map(|way| robot.step(way)).collect();
    let along = Along::new(drive, robot, &steps);
    let places = driven(drive, &steps, &along);
    [8, 4, 2, 1]
        .into_iter()
        .filter_map(|part| turn(drive, &along, &places[..places.len() / part]))
        .collect()
}

/// Where the wheels alone are at each fix.
fn driven(drive: &Drive, steps: &[Step], along: &Along<'_>) -> Vec<[f64; 2]> {
    let mut belief = Belief::independent(Pose::default(), Covariance3::ZERO);
    let mut places = Vec::new();
    let mut events = along.events().iter().peekable();
    for (way, step) in drive.ways().iter().zip(steps) {
        while events.next_if(|it| it.time_s <= way.end_s).is_some() {
            places.push([belief.pose.x, belief.pose.y]);
        }
        belief.pose = honest::advance(&belief, &step.certain(1.0)).belief.pose;
    }
    places
}

/// The turn that lays `places` best on the fixes.
fn turn(drive: &Drive, along: &Along<'_>, places: &[[f64; 2]]) -> Option<f64> {
    let fixes = along
        .events()
        .iter()
        .map(|it| drive.fixes()[it.fix].position);
    let pairs: Vec<_> = places.iter().copied().zip(fixes).collect();
    let count = f64::from(u32::try_from(pairs.len()).ok().filter(|it| *it > 1)?);
    let mean = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let sum = points.fold([0.0; 2], |[a, b], [x, y]| [a + x, b + y]);
        sum.map(|it| it / count)
    };
    let own = mean(&mut pairs.iter().map(|it| it.0));
    let said = mean(&mut pairs.iter().map(|it| it.1));
    let (mut cross, mut dot) = (0.0, 0.0);
    for (a, b) in &pairs {
        let (a, b) = (
            [a[0] - own[0], a[1] - own[1]],
            [b[0] - said[0], b[1] - said[1]],
        );
        cross += a[0] * b[1] - a[1] * b[0];
        dot += a[0] * b[0] + a[1] * b[1];
    }
    Some(libm::atan2(cross, dot))
}
