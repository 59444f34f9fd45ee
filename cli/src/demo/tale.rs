//! What happens to the robots of the scene `lost`, and what is promised of them.

use coloc_daemon::config::TrustJump;
use coloc_shm_types::{BeliefState, Input};
use serde::Serialize;

use super::record::Record;
use crate::comparison::Moment;

/// When it happens \[s\].
pub(crate) const EVENT_S: f64 = 10.0;
/// How far a robot is carried, and a receiver jumps \[m\].
pub(crate) const SHIFT_M: f64 = 10.0;

/// A robot that starts from nowhere is found by then \[s\].
const FOUND_S: f64 = 15.0;
/// After the event \[s\]: it is noticed, is over, may be believed at most, is named.
const NOTICED_S: f64 = 2.5;
const OVER_S: f64 = 20.0;
const WRONG_S: f64 = 2.0;
const NAMED_S: f64 = 5.0;

/// χ² with three degrees of freedom: an honest pose is outside once in a million.
const CHI2_3: f64 = 30.66;
/// Two possibilities in one ellipse cost this much more.
const TWO_PLACES: f64 = 2.0;

/// The second receiver, where there is one.
const SECOND: u16 = 1;

/// What happens to one robot.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) enum Tale {
    /// It does not know where it starts.
    Nowhere,
    /// It is carried away and turned.
    Carried,
    /// One of its two receivers jumps.
    Liar,
    /// Its only receiver jumps, and the robot is told to doubt it.
    Doubted,
}

/// A promise, and what came of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Trial {
    pub(crate) promise: String,
    /// What was seen of it.
    pub(crate) seen: String,
    pub(crate) kept: bool,
}

impl Tale {
    /// In a few words, as in "robot1 starts from nowhere".
    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::Nowhere => "starts from nowhere",
            Self::Carried => "is carried away",
            Self::Liar => "has two receivers, one jumps",
            Self::Doubted => "has one receiver, and it jumps",
        }
    }

    /// What the picture calls the event, if it shows one.
    pub(crate) fn event(self) -> Option<&'static str> {
        match self {
            Self::Nowhere => None,
            Self::Carried => Some("carried"),
            Self::Liar | Self::Doubted => Some("receiver jumps"),
        }
    }

    pub(crate) fn knows_its_start(self) -> bool {
        self != Self::Nowhere
    }

    pub(crate) fn receivers(self) -> u16 {
        if self == Self::Liar { 2 } else { 1 }
    }

    pub(crate) fn trust_jump(self) -> TrustJump {
        match self {
            Self::Doubted => TrustJump::Receiver,
            _ => TrustJump::Robot,
        }
    }

    /// By what a receiver is off \[m\]; `None` while it says where the robot is.
    pub(crate) fn lie_m(self, receiver: u16, time_s: f64) -> Option<[f64; 2]> {
        let liar = match self {
            Self::Liar => SECOND,
            Self::Doubted => 0,
            Self::Nowhere | Self::Carried => return None,
        };
        (receiver == liar && time_s >= EVENT_S).then_some([-SHIFT_M, 0.0])
    }

    /// What is promised, as far as it is due within what was heard.
    pub(crate) fn trials(self, record: &Record) -> Vec<Trial> {
        let moments = &record.moments;
        let until_s = moments.last().map_or(0.0, |it| it.comparison.time_s);
        let own = match self {
            Self::Nowhere => vec![(FOUND_S, found(moments))],
            Self::Carried => vec![
                (EVENT_S + NOTICED_S, noticed(moments)),
                (EVENT_S + OVER_S, over(moments)),
            ],
            Self::Liar => vec![
                (0.0, undisturbed(moments)),
                (EVENT_S + NAMED_S, named(record)),
            ],
            Self::Doubted => vec![
                (EVENT_S + NOTICED_S, contradicted(moments)),
                (EVENT_S + NOTICED_S, covers_both(moments)),
            ],
        };
        let own = own.into_iter().chain([(0.0, self.honest(moments))]);
        // A quarter of a second before: the last ticks may not have been heard.
        own.filter(|(due_s, _)| until_s >= due_s - 0.25)
            .map(|(_, trial)| trial)
            .collect()
    }
}

fn trial(promise: String, kept: bool, seen: String) -> Trial {
    Trial {
        promise,
        seen,
        kept,
    }
}

fn seconds(time_s: Option<f64>) -> String {
    time_s.map_or("never".into(), |time_s| format!("{time_s:.1} s"))
}

fn is_ok(moment: &Moment) -> bool {
    moment.state == BeliefState::Ok
}

/// From when on it was ok until the end.
fn ok_since(moments: &[Moment]) -> Option<f64> {
    let after = moments
        .iter()
        .rposition(|it| !is_ok(it))
        .map_or(0, |at| at + 1);
    moments.get(after).map(|it| it.comparison.time_s)
}

fn after_event(moments: &[Moment]) -> &[Moment] {
    let first = moments.partition_point(|it| it.comparison.time_s < EVENT_S);
    &moments[first..]
}

fn by(time_s: Option<f64>, limit_s: f64) -> bool {
    time_s.is_some_and(|time_s| time_s <= limit_s)
}

fn found(moments: &[Moment]) -> Trial {
    let since = ok_since(moments);
    let began = moments.first().is_some_and(|it| !is_ok(it));
    let promise = format!("starts from nowhere, ok by {FOUND_S:.0} s and from then on");
    trial(promise, began && by(since, FOUND_S), seconds(since))
}

/// How long after the event it was no longer ok.
fn doubted_after(moments: &[Moment]) -> Option<f64> {
    let doubted = after_event(moments).iter().find(|it| !is_ok(it));
    doubted.map(|it| it.comparison.time_s - EVENT_S)
}

fn noticed(moments: &[Moment]) -> Trial {
    let after = doubted_after(moments);
    let promise = format!("carried, which it notices within {NOTICED_S} s");
    trial(promise, by(after, NOTICED_S), seconds(after))
}

fn over(moments: &[Moment]) -> Trial {
    let since = ok_since(moments).map(|time_s| time_s - EVENT_S);
    let noticed = doubted_after(moments).is_some();
    let promise = format!("ok again within {OVER_S:.0} s and from then on");
    trial(promise, noticed && by(since, OVER_S), seconds(since))
}

fn undisturbed(moments: &[Moment]) -> Trial {
    let doubt = moments.iter().find(|it| !is_ok(it));
    let seen = doubt.map_or(String::new(), |it| {
        format!("{} at {:.1} s", it.state, it.comparison.time_s)
    });
    trial(
        "one receiver of two jumps, ok throughout".into(),
        doubt.is_none(),
        seen,
    )
}

/// The liar, in time, and nobody else.
fn named(record: &Record) -> Trial {
    let liar = (Input::Position, SECOND);
    let after = record.against.get(&liar).map(|time_s| time_s - EVENT_S);
    let alone = record.against.len() == 1;
    let promise = format!("names the liar within {NAMED_S:.0} s and nobody else");
    let kept = alone && after.is_some_and(|after| (0.0..=NAMED_S).contains(&after));
    let names = record.against.keys();
    let names: Vec<_> = names
        .map(|(input, source)| format!("{input} {source}"))
        .collect();
    let names = names.join(", ");
    trial(promise, kept, format!("{names}, {}", seconds(after)))
}

fn contradicted(moments: &[Moment]) -> Trial {
    let ever = doubted_after(moments);
    let late = |it: &&Moment| it.comparison.time_s > EVENT_S + NOTICED_S;
    let stays = after_event(moments)
        .iter()
        .filter(late)
        .all(|it| it.state == BeliefState::Contradicted);
    let promise = format!("its receiver jumps, contradicted within {NOTICED_S} s, to the end");
    trial(promise, stays && by(ever, NOTICED_S), seconds(ever))
}

/// d² of a place in the plane.
fn distance(moment: &Moment, [x, y]: [f64; 2]) -> f64 {
    let [xx, xy, yy] = moment.covariance;
    let estimate = &moment.comparison.estimate;
    let [x, y] = [x - estimate.x, y - estimate.y];
    (yy * x * x - 2.0 * xy * x * y + xx * y * y) / (xx * yy - xy * xy)
}

/// Where the robot is, and where its receiver has it.
fn covers_both(moments: &[Moment]) -> Trial {
    let worst = after_event(moments)
        .iter()
        .filter(|it| !is_ok(it))
        .flat_map(|it| {
            let truth = &it.comparison.truth;
            let lie = [truth.x - SHIFT_M, truth.y];
            [[truth.x, truth.y], lie].map(|place| distance(it, place))
        })
        .fold(0.0, f64::max);
    let promise = "its ellipse then holds both places".into();
    trial(
        promise,
        worst <= CHI2_3 + TWO_PLACES,
        format!("d² ≤ {worst:.1}"),
    )
}

impl Tale {
    /// The truth is inside whatever the state, but for a moment after the robot is carried.
    fn honest(self, moments: &[Moment]) -> Trial {
        let is_carried = self == Self::Carried;
        let held_to_it = |it: &&Moment| {
            let since = it.comparison.time_s - EVENT_S;
            !(is_carried && (0.0..=WRONG_S).contains(&since))
        };
        let wrong = moments.iter().filter(held_to_it).find(|it| is_outside(it));
        let but = if is_carried {
            format!(", but for {WRONG_S:.0} s")
        } else {
            String::new()
        };
        let seen = wrong.map_or(String::new(), |it| {
            format!("NEES {:.0} at {:.1} s", it.nees, it.comparison.time_s)
        });
        let kept = wrong.is_none() && !moments.is_empty();
        trial(format!("the truth in its ellipse{but}"), kept, seen)
    }
}

fn is_outside(moment: &Moment) -> bool {
    let limit = CHI2_3 + if is_ok(moment) { 0.0 } else { TWO_PLACES };
    moment.nees.is_nan() || moment.nees > limit
}
