//! A case, through the estimator at 50 Hz.

use coloc_estimator::{
    Belief, Covariance2, Covariance3, Decision, Estimator, FindingState, FoundSettings, Kind,
    Measurement, Motion, NeighbourPose, OdometrySample, Origin, Parts, Pose, PositionFix, Settings,
    Slot, SlowError, Source, Span, Stamp, Start, TickInputs, TrustJump, step,
};

use crate::case::{Case, Initial, Sender, SenderKind, Trust};

/// A tick \[ns\].
const TICK_NS: i64 = 20_000_000;

/// Ticks after the last one of the truth, in which the latest come.
pub(crate) const LAST_ARRIVALS: i64 = 45;

/// What was published at a tick.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Published {
    pub(crate) t_s: f64,
    pub(crate) state: FindingState,
    pub(crate) pose: Pose,
    pub(crate) covariance: Covariance3,
    pub(crate) named: Vec<Source>,
    pub(crate) decisions: Vec<(Stamp, Decision)>,
}

/// In which order what is within the history is delivered.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Delivery {
    InTime,
    /// Late by up to 0.9 s, out of order and some of it twice, by this seed.
    Shuffled(u64),
}

struct Arrival {
    at: i64,
    measurement: Measurement,
}

pub(crate) fn run(case: &Case, delivery: Delivery) -> Vec<Published> {
    let settings = Settings {
        found: FoundSettings {
            trust_jump: case.trust_jump.into(),
            ..FoundSettings::default()
        },
        ..Settings::default()
    };
    let mut estimator = Estimator::starting(
        settings,
        Stamp::default(),
        &start(&case.initial),
        vec![Slot::default(); 1024],
    );
    let mut arrivals = arrivals(case, delivery);
    arrivals.sort_by_key(|arrival| arrival.at);
    let mut arrivals = arrivals.into_iter().peekable();
    let ticks = case.truth.last().map_or(0, |last| ticks(last[0])) + LAST_ARRIVALS;
    let mut published = Vec::new();
    for tick in 0..=ticks {
        let stamp = Stamp::from_nanos(tick * TICK_NS);
        let mut measurements = Vec::new();
        while let Some(arrival) = arrivals.next_if(|arrival| arrival.at <= tick) {
            measurements.push(arrival.measurement);
        }
        let outputs = step(
            &mut estimator,
            &TickInputs {
                stamp,
                measurements: &measurements,
            },
        );
        let belief = outputs.estimate.belief;
        let dissents = outputs.finding.dissents().iter();
        published.push(Published {
            t_s: stamp_s(tick),
            state: outputs.finding.state,
            pose: belief.pose,
            covariance: belief.total(),
            named: dissents.map(|dissent| dissent.source).collect(),
            decisions: outputs.finding.decisions().to_vec(),
        });
    }
    published
}

#[allow(clippy::cast_precision_loss)]
fn stamp_s(tick: i64) -> f64 {
    (tick * TICK_NS) as f64 * 1e-9
}

#[allow(clippy::cast_possible_truncation)]
fn ticks(t_s: f64) -> i64 {
    (t_s * 50.0).round() as i64
}

fn start(initial: &Initial) -> Start {
    match initial {
        Initial::Pose {
            pose: [x, y, phi],
            sigma,
        } => {
            let covariance = Covariance3::diagonal(sigma.map(|it| it * it)).unwrap();
            Start::Known(Belief::independent(Pose::new(*x, *y, *phi), covariance))
        }
        Initial::Position { position, sigma } => Start::Position(
            *position,
            Covariance2::diagonal(sigma.map(|it| it * it)).unwrap(),
        ),
        Initial::Unknown { .. } => Start::Unknown,
    }
}

impl From<Trust> for TrustJump {
    fn from(trust: Trust) -> Self {
        match trust {
            Trust::Robot => Self::Robot,
            Trust::Receiver => Self::Receiver,
        }
    }
}

fn arrivals(case: &Case, delivery: Delivery) -> Vec<Arrival> {
    let mut order = Order::new(delivery);
    let mut arrivals = Vec::new();
    let mut tick = 0;
    for &[duration_s, v, omega, forward, sideways, heading] in &case.odometry {
        let noise = [forward, sideways, heading].map(|q| q / 0.02);
        let motion = Motion::Holonomic {
            velocity: [v, 0.0, omega],
            noise: Covariance3::diagonal(noise).unwrap(),
        };
        for _ in 0..ticks(duration_s) {
            tick += 1;
            let sample = OdometrySample {
                source: 0,
                start: Stamp::from_nanos((tick - 1) * TICK_NS),
                stamp: Stamp::from_nanos(tick * TICK_NS),
                motion,
            };
            order.deliver(&mut arrivals, tick, sample.into());
        }
    }
    for (number, sender) in case.sources.iter().enumerate() {
        let number = u16::try_from(number + 1).unwrap();
        for (sequence, input) in case.inputs[&sender.id].iter().enumerate() {
            let tick = ticks(input[0]);
            let origin = Origin {
                source: number,
                session: 0,
                sequence: sequence as u64,
            };
            order.deliver(&mut arrivals, tick, said(sender, tick, origin, input));
        }
    }
    arrivals
}

fn said(sender: &Sender, tick: i64, origin: Origin, input: &[f64]) -> Measurement {
    let stamp = Stamp::from_nanos(tick * TICK_NS);
    let [white, slow] = [sender.sigma_white, sender.sigma_slow].map(|it| it * it);
    match sender.kind {
        SenderKind::Fix => PositionFix {
            stamp,
            origin,
            position: [input[1], input[2]],
            covariance: Covariance2::diagonal([white; 2]).unwrap(),
            lever: [0.0; 2],
            slow: SlowError {
                variance: slow,
                memory: Span::from_seconds(sender.tau_s),
            },
        }
        .into(),
        SenderKind::Neighbour => {
            let heading = sender.sigma_heading.unwrap();
            let independent = [white, white, heading * heading];
            NeighbourPose {
                stamp,
                origin,
                pose: Pose::new(input[1], input[2], input[3]),
                parts: Parts {
                    independent: Covariance3::diagonal(independent).unwrap(),
                    dependent: Covariance3::diagonal([slow, slow, 0.0]).unwrap(),
                },
            }
            .into()
        }
    }
}

/// The source that a case calls by its place in the list.
pub(crate) fn source(case: &Case, id: &str) -> Source {
    let at = case.sources.iter().position(|sender| sender.id == id);
    let at = at.unwrap();
    let kind = match case.sources[at].kind {
        SenderKind::Fix => Kind::Fix,
        SenderKind::Neighbour => Kind::Neighbour,
    };
    Source::new(kind, u16::try_from(at + 1).unwrap())
}

struct Order {
    delivery: Delivery,
    state: u64,
}

impl Order {
    fn new(delivery: Delivery) -> Self {
        let state = match delivery {
            Delivery::InTime => 0,
            Delivery::Shuffled(seed) => seed,
        };
        Self { delivery, state }
    }

    fn deliver(&mut self, arrivals: &mut Vec<Arrival>, tick: i64, measurement: Measurement) {
        let times = if self.delivery == Delivery::InTime || self.below(4) > 0 {
            1
        } else {
            2
        };
        for _ in 0..times {
            let late = if self.delivery == Delivery::InTime {
                0
            } else {
                self.below(45)
            };
            arrivals.push(Arrival {
                at: tick + late,
                measurement,
            });
        }
    }

    /// `SplitMix64`
    fn below(&mut self, most: u64) -> i64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        i64::try_from((z ^ (z >> 31)) % most).unwrap()
    }
}
