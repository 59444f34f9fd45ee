//! How events read in the log.

use tracing::{debug, info, warn};

use super::throttle::Sum;
use crate::clock::ClockStep;
use crate::event::{Against, Event, GyroNews};
use coloc_drivers::canopen::CanopenEvent;
use coloc_estimator::assist::news::News;
use coloc_estimator::{Decision, Span};
use coloc_shm_types::{BeliefState, Health, Input, Opinion, WhyUnfit};

/// One line for one event, or for several that were added up.
pub(super) fn write((count, event): Sum) {
    let count = (count > 1).then_some(count);
    match event {
        Event::Rejected {
            input,
            source,
            reason,
            gated,
        } => {
            let (d2, gate) = gated.map(|it| (it.d2, it.gate)).unzip();
            warn!(count, source, d2, gate, "{input} rejected: {reason}");
        }
        Event::Health {
            input,
            from,
            to: to @ Health::Ok,
            tick,
        }
        // Said once, and then no more.
        | Event::Health {
            input: input @ Input::Pose,
            from,
            to: to @ Health::Stale,
            tick,
        } => info!(count, tick, "{input}: {from} -> {to}"),
        Event::Health {
            input,
            from,
            to,
            tick,
        } => warn!(count, tick, "{input}: {from} -> {to}"),
        Event::State {
            from,
            to,
            waits_for_wheels,
            tick,
        } => state(count, [from, to], waits_for_wheels, tick),
        Event::Gyro { news, bias, sigma } => gyro(count, news, [bias, sigma]),
        Event::Assist(news) => assist(count, news),
        Event::Fitness { why_unfit, tick } => fitness(count, why_unfit, tick),
        Event::Opinion { from, to, tick } => opinion(count, [from, to], tick),
        Event::Dissent {
            input,
            source,
            against,
        } => dissent(count, &format!("{input} {source}"), against),
        Event::Decided {
            input,
            source,
            decision,
            ..
        } => decided(count, &format!("{input} {source}"), &decision),
        Event::Canopen(event) => canopen(count, event),
        Event::Slips(Some(slip)) => warn!(
            count,
            "wheels slip: odometry.{} is off by {:.2} m/s against the others, or another of them is; up to {:.2} m/s would fit",
            slip.wheel,
            slip.misfit_mps,
            slip.limit_mps
        ),
        Event::Slips(None) => info!(count, "wheels slip no more: they fit one another again"),
        Event::Bus { from, to } => warn!(count, "can: {from} -> {to}"),
        Event::Contested { input, state } if state.contested => warn!(
            count,
            "{input}: {} senders say that they are source {}; give each a number of its own, or stop those that should not run",
            state.live,
            state.number
        ),
        Event::Contested { input, state } => {
            info!(
                count,
                "{input}: no more than one sender says that it is source {}", state.number
            );
        }
        Event::Missed {
            deadlines,
            lateness_ns,
        } => warn!(
            count,
            deadlines,
            lateness_ms = lateness_ns / 1_000_000,
            "deadline missed"
        ),
        Event::ClockStepped(ClockStep { clock, by_ns }) => warn!(
            count,
            by_ns, "somebody set the clock {clock:?}; the pose goes on, stamps are converted anew"
        ),
        Event::NoRoom {
            overflowed,
            folded_early,
        } => {
            warn!(
                count,
                overflowed, folded_early, "the estimator ran out of room: raise history.capacity"
            );
        }
        Event::Lost { events } => lost(events),
        other => debug!("{other:?}"),
    }
}

fn state(count: Option<u64>, [from, to]: [BeliefState; 2], waits_for_wheels: bool, tick: u64) {
    let heading = format!("belief: {from} -> {to}");
    if to == BeliefState::Ok {
        info!(count, tick, "{heading}");
    } else if waits_for_wheels {
        warn!(
            count,
            tick,
            "{heading}: it does not hear its wheels, and knows where it is as soon as they are back"
        );
    } else {
        warn!(count, tick, "{heading}: {}", meaning(to));
    }
}

fn fitness(count: Option<u64>, why_unfit: Option<WhyUnfit>, tick: u64) {
    match why_unfit {
        None => info!(count, tick, "fit to drive on"),
        Some(why) => warn!(count, tick, "not fit to drive on: {why}"),
    }
}

fn opinion(count: Option<u64>, [from, to]: [Opinion; 2], tick: u64) {
    let heading = format!("second opinion: {from} -> {to}");
    match to {
        Opinion::Possible | Opinion::None => info!(count, tick, "{heading}"),
        _ => warn!(count, tick, "{heading}: the robot {}", to.meaning()),
    }
}

fn lost(events: u64) {
    warn!(
        events,
        "telemetry could not keep up: these events are in no log or recording"
    );
}

fn canopen(count: Option<u64>, event: CanopenEvent) {
    match event {
        CanopenEvent::Booted(node) => warn!(count, "canopen: node {node} has booted"),
        CanopenEvent::Operational(node) => info!(count, "canopen: node {node} is operational"),
        CanopenEvent::NotOperational(node) => warn!(
            count,
            "canopen: node {node} says that it is not operational, so it sends no odometry"
        ),
        CanopenEvent::Missing(node) => warn!(
            count,
            "canopen: the heartbeat of node {node} is missing: is it powered, and on this bus?"
        ),
        CanopenEvent::SyncTaken => warn!(count, "canopen: nobody sends SYNC; colocd sends it"),
        CanopenEvent::SyncLeft => {
            info!(
                count,
                "canopen: somebody else sends SYNC; colocd sends none"
            );
        }
    }
}

/// That `who` stands against the belief, or no longer does.
fn dissent(count: Option<u64>, who: &str, against: Option<Against>) {
    let Some(Against {
        for_ns,
        distance_m,
        d2,
    }) = against
    else {
        info!(count, "{who} no longer stands against the belief");
        return;
    };
    let since_ms = for_ns / 1_000_000;
    if distance_m.is_nan() {
        warn!(
            count,
            since_ms, d2, "{who} stands against the belief, and is heard but not fused"
        );
    } else {
        warn!(
            count,
            since_ms,
            d2,
            "{who} stands against the belief, has the robot {distance_m:.1} m away, and is heard but not fused"
        );
    }
}

fn assist(count: Option<u64>, news: News) {
    match news {
        News::Disagree { leaders: [a, b] } => warn!(
            count,
            "assist: leaders {} and {} were told different things of what robots see; is what is said on readings lost?",
            a.0,
            b.0
        ),
        News::Mute(robot) => warn!(
            count,
            "assist: robot {} is seen and does not answer; does its colocd run, and does it reach this one?",
            robot.0
        ),
        News::Answers(robot) => info!(count, "assist: robot {} answers again", robot.0),
        News::Unheard => warn!(
            count,
            "assist: no leader was heard since the start, of itself or by way of another child; does anybody see this robot?"
        ),
    }
}

fn gyro(count: Option<u64>, news: GyroNews, known: [f64; 2]) {
    let [bias, sigma] = known.map(f64::to_degrees);
    let bias = format!("its bias is {bias:.3} ± {sigma:.3} °/s");
    match news {
        GyroNews::Known => info!(count, "gyro: {bias} (1 σ)"),
        GyroNews::Slips => warn!(
            count,
            "odometry: wheels and gyro do not turn alike: the wheels slip, or the gyro is mounted or configured wrongly; the gyro \
             alone turns the robot; {bias}"
        ),
        GyroNews::Holds { after_ns } => info!(
            count,
            "odometry: wheels and gyro turn alike again, after {:.1} s; {bias}",
            Span::from_nanos(after_ns).as_seconds()
        ),
        GyroNews::Wild { count: samples } => warn!(
            count,
            "gyro: {samples} of its samples so far parted from the wheels and from the samples around them, and were not used: noise on its \
             bus, or it is broken"
        ),
    }
}

fn decided(count: Option<u64>, who: &str, decision: &Decision) {
    match decision {
        Decision::Followed { distance_m, .. } if distance_m.is_nan() => {
            info!(count, "the robot has found itself by {who}");
        }
        Decision::Followed {
            distance_m,
            votes: [by, against],
            ..
        } => warn!(
            count,
            by,
            against,
            "{who} is followed: the robot is {distance_m:.1} m from where it was believed to be (the wheels count as one)"
        ),
        Decision::Dropped { distance_m, .. } => warn!(
            count,
            "{who} has the robot {distance_m:.1} m away while it stands: it was carried and may have been turned; drive, that \
             it finds its heading"
        ),
        Decision::Widened { .. } => warn!(
            count,
            "the heading is too uncertain for a fix of {who}: drive, that the robot finds it"
        ),
        Decision::SecondChance { .. } => info!(
            count,
            "the fixes of {who} after a gap agree with one another and are just outside of the gate: the robot looks for itself \
             by them"
        ),
        Decision::Set { distance_m, .. } if distance_m.is_nan() => {
            info!(count, "the pose was set by {who}");
        }
        Decision::Set { distance_m, .. } => info!(
            count,
            "the pose was set by {who}, {distance_m:.1} m from where the robot was believed to be"
        ),
        Decision::Anew { .. } => warn!(count, "what {who} says does not move as the wheels do"),
    }
}

/// What a state that is not good means to the person who reads of it.
fn meaning(state: BeliefState) -> &'static str {
    match state {
        BeliefState::Ok => "the robot knows where it is",
        BeliefState::Finding => {
            "it does not know where it is: it needs its wheels, somebody who says where it is, and to drive"
        }
        BeliefState::Contradicted => {
            "what it measures is beyond the gate again and again; the covariance holds every possibility. See who stands \
             against it, and whether [initial] is where it stands"
        }
        BeliefState::Lost => "it does not know where it is, and nobody has said so for ten seconds",
    }
}
