//! How likely a drive is if the robot is so: what the filter did not foresee, one after another.

use crate::drive::{Drive, Way};
use crate::filter::{Filter, Innovation};
use crate::robot::{Robot, Step};

/// So long is a turn of the wheels put together before a gyro's is held against it \[s\]. Wheels count in whole ticks: what one interval
/// is short of, the next has too much. Interval by interval that passes for noise of what the robot turned, and wheels that are
/// farther apart, which turn less at each count, look as if they fitted better.
const TOGETHER_S: f64 = 1.0;

/// All that a drive has measured, less what was expected of it. Their number and order do not depend on the robot.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Innovations(pub(crate) Vec<Innovation>);

impl Innovations {
    /// Of a drive, if the robot is so; nothing where the numbers give out.
    pub(crate) fn of(drive: &Drive, robot: &Robot) -> Option<Self> {
        let steps: Vec<Step> = drive.ways().iter().map(|way| robot.step(way)).collect();
        let mut all = partings(drive.ways(), &steps);
        let first = all.len();
        all.extend(vec![
            Innovation::of_parting([0.0, 1.0]);
            drive.fixes().len()
        ]);
        let mut filter = Filter::new(robot, drive);
        let mut whole = true;
        Along::new(drive, robot, &steps).each(&mut filter, |filter, event| {
            let innovation = filter.correct(&drive.fixes()[event.fix], event.time_s);
            whole &= innovation.is_some();
            all[first + event.fix] = innovation.unwrap_or(all[first + event.fix]);
        });
        whole.then_some(Self(all))
    }

    /// The logarithm of the likelihood, but for a constant.
    pub(crate) fn log_likelihood(&self) -> f64 {
        let of = |it: &Innovation| {
            let squared = it.squared().unwrap_or(f64::INFINITY);
            -0.5 * (squared + libm::log(it.determinant()))
        };
        self.0.iter().map(of).sum()
    }
}

/// What parts the wheels from the gyro, of ways that follow each other and are of one state.
fn partings(ways: &[Way], steps: &[Step]) -> Vec<Innovation> {
    let goes_on = |first: &Way, way: &Way| {
        way.gyro.is_some() == first.gyro.is_some()
            && way.state == first.state
            && way.end_s - first.start_s <= TOGETHER_S
    };
    let mut all = Vec::new();
    let mut from = 0;
    while let Some(first) = ways.get(from) {
        let length = ways[from..].iter().take_while(|way| goes_on(first, way));
        let until = from + length.count().max(1);
        if first.gyro.is_some() {
            let whole = steps[from..until].iter().filter_map(|step| step.parting);
            let sum = whole.fold([0.0; 2], |[off, variance], [more, noise]| {
                [off + more, variance + noise]
            });
            // Their number does not depend on the robot: where it has no noise at all, nothing is held against it.
            let parting = if sum[1] > 0.0 { sum } else { [0.0, 1.0] };
            all.push(Innovation::of_parting(parting));
        }
        from = until;
    }
    all
}

/// A fix at the time of which it speaks.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(crate) struct Event {
    pub(crate) time_s: f64,
    /// Its place in the drive.
    pub(crate) fix: usize,
}

/// A drive's steps, and the fixes between them.
pub(crate) struct Along<'a> {
    drive: &'a Drive,
    steps: &'a [Step],
    events: Vec<Event>,
}

impl<'a> Along<'a> {
    pub(crate) fn new(drive: &'a Drive, robot: &Robot, steps: &'a [Step]) -> Self {
        let (begin, end) = (drive.begin_s(), drive.end_s());
        let event = |(fix, it): (usize, &crate::Fix)| Event {
            time_s: (it.stamp_s - robot.receivers[it.receiver].delay_s).clamp(begin, end),
            fix,
        };
        let mut events: Vec<Event> = drive.fixes().iter().enumerate().map(event).collect();
        events.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        Self {
            drive,
            steps,
            events,
        }
    }

    pub(crate) fn events(&self) -> &[Event] {
        &self.events
    }

    /// Takes a filter along all of it, and says when it is at a fix.
    pub(crate) fn each<'r>(
        &self,
        filter: &mut Filter<'r>,
        mut at: impl FnMut(&mut Filter<'r>, &Event),
    ) {
        let mut events = self.events.iter().peekable();
        for (way, step) in self.drive.ways().iter().zip(self.steps) {
            let (mut from_s, length_s) = (way.start_s, way.end_s - way.start_s);
            while let Some(event) = events.next_if(|event| event.time_s <= way.end_s) {
                if event.time_s > from_s {
                    filter.advance(step, (event.time_s - from_s) / length_s);
                    from_s = event.time_s;
                }
                at(filter, event);
            }
            if way.end_s > from_s {
                filter.advance(step, (way.end_s - from_s) / length_s);
            }
        }
    }
}
