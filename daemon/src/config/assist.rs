//! `[assist]`: who leads and who is carried; written as the sections in [`super::sections`].

use coloc_estimator::assist::assistant::{Agreement, Assistant};
use coloc_estimator::assist::delays::Bounds;
use coloc_estimator::assist::events::OPEN_EVENTS;
use coloc_estimator::assist::fusion::Rule;
use coloc_estimator::assist::search::Patience;
use coloc_estimator::gate::CHI2_3_999;
use coloc_estimator::{FusionSettings, RobotId, Span};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Config, nanos};

/// How long the first answer is waited for, where that time is measured \[ms\].
const FIRST_ACK_MS: u32 = 160;

/// `[assist]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Assist {
    /// Team numbers of the robots that know where they are by other means; the same list on every robot. With none, nobody is carried.
    pub leaders: Vec<u16>,
    /// Team numbers of the robots that they carry; the same list on every robot.
    pub children: Vec<u16>,
    /// How what leaders say gets around; the same on every robot.
    pub mode: AssistMode,
    /// All sightings of one period form an event, of which a child takes one pose of each leader; the same on every robot \[s\].
    #[schemars(range(min = 0.01, max = 60))]
    pub period_s: f64,
    /// When a period begins, by the clock of the stamps; the same on every robot \[s\].
    #[schemars(range(min = 0, max = 60))]
    pub phase_s: f64,
    /// A sighting counts as used if the robot seen has not answered in so long: what a datum there and its answer back take at most.
    /// Say 1000 of a radio that takes 400. 0: as long as answers were seen to take, their mean and four deviations \[ms\].
    #[schemars(range(min = 0, max = 60000))]
    pub ack_timeout_ms: u32,
    /// So long after the sighting a child takes what is said of it, and hands it on; no longer than the history. 0: the answer's time,
    /// and two ticks for each child and each leader; where that time is measured, as long as the history and the events allow \[ms\].
    #[schemars(range(min = 0, max = 60000))]
    pub close_after_ms: u32,
    /// So long after the sighting a child fuses what there is by then, where `mode` is `"bounded-delayed"`: no longer than
    /// `close_after_ms`. 0: two ticks for each child \[ms\].
    #[schemars(range(min = 0, max = 60000))]
    pub max_delay_ms: u32,
    /// So long after a period leaders work out what they say of it, where `mode` is `"full"`; robots tell them what they see after half of
    /// that. No longer than the period. 0: eight ticks, but no longer than the period \[ms\].
    #[schemars(range(min = 0, max = 60000))]
    pub readings_deadline_ms: u32,
    /// How a child fuses what leaders say.
    pub fusion: AssistFusion,
    /// Poses with a d² above this are refused; the default is 99.9 % of chi-square with three degrees of freedom.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub gate: f64,
}

/// How what leaders say gets around.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum AssistMode {
    /// From robot to robot, each child handing on what it takes; what comes is fused at once.
    #[default]
    BoundedInstant,
    /// The same, but what comes waits: it is fused once a pose of each leader is there that was heard within ten events, or after
    /// `max_delay_ms`.
    BoundedDelayed,
    /// All robots tell all leaders what they see. Each leader comes to the same trees, and tells each child in its own; nobody hands on.
    Full,
}

/// How a child fuses what leaders say.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum AssistFusion {
    /// The leader's error as one that may be correlated with anything: honest whatever happens.
    Split,
    /// What the child's error has in common with each leader's is tracked: as accurate as `kf`, and honest where leaders are and learn
    /// nothing from others; each counts as one that errs by twice what it says. Where nobody can say what became of a leader's error, it
    /// counts as one that may be correlated with anything.
    #[default]
    Cross,
    /// As the thesis does: each pose as news. Children come to be surer than they may be.
    Kf,
}

impl Default for Assist {
    fn default() -> Self {
        Self {
            leaders: Vec::new(),
            children: Vec::new(),
            mode: AssistMode::default(),
            period_s: 0.2,
            phase_s: 0.0,
            ack_timeout_ms: 160,
            close_after_ms: 0,
            max_delay_ms: 0,
            readings_deadline_ms: 0,
            fusion: AssistFusion::default(),
            gate: CHI2_3_999,
        }
    }
}

impl Assist {
    /// Whether anybody is carried.
    #[must_use]
    pub fn is_on(&self) -> bool {
        !self.leaders.is_empty()
    }

    /// How long a child listens \[ms\].
    #[must_use]
    pub fn closes_after_ms(&self, rate_hz: f64, history_s: f64) -> u32 {
        if self.close_after_ms > 0 {
            return self.close_after_ms;
        }
        if self.ack_timeout_ms == 0 {
            #[allow(clippy::cast_precision_loss)] // Eight.
            let open_s = self.period_s * OPEN_EVENTS as f64;
            return whole_ms(history_s.min(open_s));
        }
        if self.mode == AssistMode::Full {
            let period_ms = whole_ms(self.period_s);
            let deadline_ms = self.deadline_ms(rate_hz);
            return self.ack_timeout_ms.saturating_add(period_ms + deadline_ms);
        }
        self.ack_timeout_ms.saturating_add(self.search_ms(rate_hz))
    }

    /// Two ticks for each robot \[ms\].
    fn search_ms(&self, rate_hz: f64) -> u32 {
        let robots = u32::try_from(self.leaders.len() + self.children.len()).unwrap_or(u32::MAX);
        2 * robots.saturating_mul(tick_ms(rate_hz))
    }

    /// Between what the time for an answer is chosen, where it is measured: two ticks, and what leaves time to hand on \[ms\].
    #[must_use]
    pub fn ack_bounds(&self, rate_hz: f64, history_s: f64) -> Option<Bounds> {
        let closes_ms = self.closes_after_ms(rate_hz, history_s);
        let least = 2 * tick_ms(rate_hz);
        let most = closes_ms.saturating_sub(self.search_ms(rate_hz)).max(least);
        (self.ack_timeout_ms == 0).then_some(Bounds {
            least,
            first: most.min(FIRST_ACK_MS),
            most,
        })
    }

    /// How long after a period leaders work it out, where they know all readings \[ms\].
    #[must_use]
    pub fn deadline_ms(&self, rate_hz: f64) -> u32 {
        match self.readings_deadline_ms {
            0 => (8 * tick_ms(rate_hz)).min(whole_ms(self.period_s)),
            said => said,
        }
    }

    /// How long what comes waits for the rest \[ms\]; `None`: it does not.
    #[must_use]
    pub fn delay_ms(&self, rate_hz: f64) -> Option<u32> {
        let children = u32::try_from(self.children.len()).unwrap_or(u32::MAX);
        let delay_ms = match self.max_delay_ms {
            0 => 2 * children.saturating_mul(tick_ms(rate_hz)),
            said => said,
        };
        (self.mode == AssistMode::BoundedDelayed).then_some(delay_ms)
    }

    pub(crate) fn rule(&self, paper: bool) -> Rule {
        let gate = self.gate;
        let settings = FusionSettings {
            gate,
            ..FusionSettings::paper()
        };
        match self.fusion {
            AssistFusion::Cross if !paper && self.is_on() => Rule::Cross {
                otherwise: settings,
            },
            AssistFusion::Cross | AssistFusion::Split if !paper => Rule::Split {
                settings,
                reset: true,
            },
            _ => Rule::Kalman { gate },
        }
    }
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // A second at most.
fn tick_ms(rate_hz: f64) -> u32 {
    (1e3 / rate_hz).ceil() as u32
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // A minute at most.
fn whole_ms(seconds: f64) -> u32 {
    (1e3 * seconds) as u32
}

impl Config {
    /// The robot's part in the team; `None` where it has none.
    #[must_use]
    pub fn assistant(&self) -> Option<Box<Assistant>> {
        let assist = &self.assist;
        if !assist.is_on() {
            return None;
        }
        let ids = |list: &[u16]| list.iter().map(|id| RobotId(*id)).collect::<Vec<_>>();
        let (rate_hz, history_s) = (self.tick.rate_hz, self.history.length_s);
        let ack_bounds = assist.ack_bounds(rate_hz, history_s);
        let patience = Patience {
            ack_timeout: ack_bounds.map_or(assist.ack_timeout_ms, |it| it.first),
            close_after: assist.closes_after_ms(rate_hz, history_s),
        };
        let [period, phase] =
            [assist.period_s, assist.phase_s].map(|it| Span::from_nanos(nanos(it)));
        // Lists that are no team were refused with the configuration.
        let (leaders, children) = (ids(&assist.leaders), ids(&assist.children));
        let agreement = Agreement::new(&leaders, &children, period, patience).ok()?;
        let agreement = Agreement {
            phase,
            ack_bounds,
            delay: assist.delay_ms(rate_hz),
            readings_deadline: (assist.mode == AssistMode::Full).then(|| {
                let deadline_ms = assist.deadline_ms(rate_hz);
                Span::from_millis(deadline_ms.into())
            }),
            ..agreement
        };
        Assistant::new(agreement, RobotId(self.robot.id)).map(Box::new)
    }
}
