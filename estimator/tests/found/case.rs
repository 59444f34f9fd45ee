//! The files of the vectors `found`: what is known at the start, how the robot moves, what its sources say, and what must come of it.

use std::collections::BTreeMap;

use serde::Deserialize;

#[derive(Deserialize)]
pub(crate) struct Case {
    pub(crate) initial: Initial,
    pub(crate) trust_jump: Trust,
    pub(crate) odometry: Vec<[f64; 6]>,
    pub(crate) sources: Vec<Sender>,
    pub(crate) inputs: BTreeMap<String, Vec<Vec<f64>>>,
    pub(crate) truth: Vec<[f64; 4]>,
    pub(crate) event_s: f64,
    pub(crate) expect: Expect,
}

#[derive(Deserialize)]
#[serde(untagged)]
pub(crate) enum Initial {
    Pose {
        pose: [f64; 3],
        sigma: [f64; 3],
    },
    Position {
        position: [f64; 2],
        sigma: [f64; 2],
    },
    Unknown {
        #[serde(rename = "pose")]
        _pose: String,
    },
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Trust {
    Robot,
    Receiver,
}

#[derive(Deserialize)]
pub(crate) struct Sender {
    pub(crate) id: String,
    pub(crate) kind: SenderKind,
    pub(crate) sigma_white: f64,
    pub(crate) sigma_slow: f64,
    pub(crate) tau_s: f64,
    #[serde(default)]
    pub(crate) sigma_heading: Option<f64>,
}

#[derive(Clone, Copy, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub(crate) enum SenderKind {
    Fix,
    Neighbour,
}

/// See the vectors' README.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Expect {
    pub(crate) found_by_s: Option<f64>,
    pub(crate) noticed_by_s: Option<f64>,
    #[serde(default)]
    pub(crate) never_ok: Vec<[f64; 2]>,
    #[serde(default)]
    pub(crate) ok_throughout: Vec<[f64; 2]>,
    pub(crate) never_ok_wrong_after_s: Option<f64>,
    pub(crate) covered_after_s: Option<f64>,
    pub(crate) named: Option<Vec<String>>,
}
