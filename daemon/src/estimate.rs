//! Step 3 of the tick: the pure step, and nothing else.

use std::hint::black_box;

use coloc_estimator::assist::assistant::{self, Assistant, Carried, Counts, Words};
use coloc_estimator::assist::change::Change;
use coloc_estimator::assist::news::News;
use coloc_estimator::assist::ties::{TIES, Tie};
use coloc_estimator::partial::PositionSettings;
use coloc_estimator::rounds::RoundSettings;
use coloc_estimator::rounds::gate::CHI2_3_ONE_IN_A_MILLION;
use coloc_estimator::settings::{Criterion, GateWeight};
use coloc_estimator::{
    Belief, Covariance2, Covariance3, Estimator, Finding, Floors, FoundSettings, FusionSettings,
    GYRO_SAMPLES, GyroSample, OdometrySettings, Pose, Propagation, Settings, Slot, Span, Stamp,
    Start, TickInputs, TickOutputs, TrustJump, WithBonds, WithGyro, step,
};

use crate::config::{self, Config, InitialHeading, nanos};

/// An estimator's storage.
pub type Places = WithBonds<WithGyro<Box<[Slot]>, Box<[GyroSample]>>, Box<[Tie]>, Box<[Change]>>;

/// The estimator with its storage, which is reserved once. Boxed, as it is too large to be moved over stacks.
#[derive(Debug)]
pub struct Estimate {
    estimator: Box<Estimator<Places>>,
    /// The robot's part in its team, if it has one.
    assistant: Option<Box<Assistant>>,
}

impl Estimate {
    /// Knows no more than `start` says at `stamp`.
    #[must_use]
    pub fn new(config: &Config, stamp: Stamp, start: &Start) -> Self {
        Self::with(settings(config), config.history.capacity, stamp, start)
    }

    /// The same, with settings of its own and so many places.
    #[must_use]
    #[inline(never)]
    pub fn with(settings: Settings, capacity: usize, stamp: Stamp, start: &Start) -> Self {
        let places = places(&settings, capacity);
        Self {
            estimator: Box::new(Estimator::starting(settings, stamp, start, places)),
            assistant: None,
        }
    }

    /// With a part in the team, if it has one.
    #[must_use]
    pub fn with_part(self, assistant: Option<Box<Assistant>>) -> Self {
        Self { assistant, ..self }
    }

    /// What the robot believes after `inputs` and what others say of it, and what it has to tell those.
    pub fn step_among(
        &mut self,
        inputs: &TickInputs<'_>,
        words: &Words<'_>,
    ) -> (TickOutputs<'_>, Carried<'_>) {
        match &mut self.assistant {
            None => (step(&mut self.estimator, inputs), Carried::default()),
            Some(assistant) => assistant::step(&mut self.estimator, assistant, inputs, words),
        }
    }

    /// What became of what leaders said.
    #[must_use]
    pub fn assisted(&self) -> Option<Counts> {
        self.assistant.as_ref().map(|it| it.counts())
    }

    /// What there is to say of that, of the last step.
    #[must_use]
    pub fn assist_news(&self) -> &[News] {
        self.assistant.as_ref().map_or(&[], |it| it.news())
    }

    /// What the robot believes after `inputs`.
    pub fn step(&mut self, inputs: &TickInputs<'_>) -> TickOutputs<'_> {
        step(&mut self.estimator, inputs)
    }

    /// What the last step says of the tick's stamp: the inputs stay where they are, and nothing changes.
    #[must_use]
    pub fn idle(&self, inputs: &TickInputs<'_>) -> TickOutputs<'_> {
        TickOutputs {
            estimate: self.at(inputs.stamp),
            finding: self.finding(),
            outgoing: &[],
            seen: &[],
            answers: &[],
            shared: None,
            reports: &[],
            overflowed: 0,
            folded_early: 0,
        }
    }

    /// What a tick at `stamp` would say without new inputs; it changes nothing.
    #[must_use]
    pub fn at(&self, stamp: Stamp) -> coloc_estimator::Estimate {
        self.estimator.extrapolated(stamp)
    }

    /// Whether it is known where the robot is, by what the last step knew.
    #[must_use]
    pub fn finding(&self) -> &Finding {
        self.estimator.finding()
    }

    /// Does what a tick at `stamp` would do without new inputs.
    pub fn rehearse(&self, stamp: Stamp) {
        black_box(self.at(stamp));
    }
}

/// So many places for measurements, those of a gyro where there is one, and those of what is tracked with leaders where it is.
#[must_use]
pub fn places(settings: &Settings, capacity: usize) -> Places {
    let samples = if settings.gyro.is_some() {
        GYRO_SAMPLES
    } else {
        0
    };
    let [ties, changes] = if settings.assist.is_tracked() {
        [TIES, capacity]
    } else {
        [0; 2]
    };
    WithBonds {
        places: WithGyro {
            slots: vec![Slot::default(); capacity].into_boxed_slice(),
            samples: vec![GyroSample::default(); samples].into_boxed_slice(),
        },
        ties: vec![Tie::default(); ties].into_boxed_slice(),
        changes: vec![Change::default(); changes].into_boxed_slice(),
    }
}

/// What `[initial]` says.
#[must_use]
pub fn start(config: &Config) -> Start {
    let Some([x, y, phi]) = config.initial_pose() else {
        return Start::Unknown;
    };
    let initial = &config.initial;
    let [sx, sy, sphi] = initial.sigma.map(square);
    // Squares of numbers that were checked with the configuration: always a covariance.
    if initial.heading == InitialHeading::Unknown {
        let covariance = Covariance2::diagonal([sx, sy]).unwrap_or(Covariance2::ZERO);
        return Start::Position([x, y], covariance);
    }
    let covariance = Covariance3::diagonal([sx, sy, sphi]).unwrap_or(Covariance3::ZERO);
    Start::Known(Belief::independent(Pose::new(x, y, phi), covariance))
}

/// The configuration in the estimator's words.
#[must_use]
pub fn settings(config: &Config) -> Settings {
    Settings {
        propagation: propagation(&config.fusion),
        fusion: fusion(&config.fusion),
        partial: partial(&config.fusion),
        assist: config.assist.rule(config.fusion.paper),
        position_gate: config.fusion.position_gate,
        heading_gate: config.fusion.heading_gate,
        found: found(config),
        floors: floors(&config.fusion),
        odometry: OdometrySettings {
            reference_period: span(config.motion.reference_period_s),
            hold: span(config.motion.hold_s),
            hold_growth: config.motion.hold_growth,
            outage_variance: config.motion.outage_variance,
        },
        history: span(config.history.length_s),
        gyro: config.gyro.settings(),
        rounds: rounds(config),
        future_tolerance: span(config.history.future_tolerance_s),
    }
}

/// The same of a robot that knows its gyro's bias and the variance of that, where it has one \[rad/s, rad²/s²\].
#[must_use]
pub fn settings_knowing(config: &Config, gyro: Option<[f64; 2]>) -> Settings {
    let mut settings = settings(config);
    if let (Some(own), Some([bias, bias_variance])) = (&mut settings.gyro, gyro) {
        (own.bias, own.bias_variance) = (bias, bias_variance);
    }
    settings
}

pub(crate) fn propagation(fusion: &config::Fusion) -> Propagation {
    match fusion.propagation {
        config::Propagation::Honest if !fusion.paper => Propagation::Honest,
        _ => Propagation::Paper,
    }
}

fn rounds(config: &Config) -> Option<RoundSettings> {
    config.makes_rounds().then(|| RoundSettings {
        robots: config.peers().count() + 1,
        gate: CHI2_3_ONE_IN_A_MILLION,
    })
}

fn floors(fusion: &config::Fusion) -> Floors {
    Floors {
        sighting: fusion.relative_pose_floor.map(square),
        neighbour: fusion.neighbour_floor.map(square),
        fix: fusion.position_floor.map(square),
        heading: square(fusion.heading_floor),
    }
}

fn square(sigma: f64) -> f64 {
    sigma * sigma
}

fn fusion(fusion: &config::Fusion) -> FusionSettings {
    let criterion = match fusion.criterion {
        config::Criterion::Trace => Criterion::Trace,
        config::Criterion::Determinant => Criterion::Determinant,
    };
    let gate = fusion.neighbour_gate;
    if fusion.paper {
        return FusionSettings {
            criterion,
            gate,
            ..FusionSettings::paper()
        };
    }
    let gate_weight = match fusion.gate_weight {
        config::GateWeight::Update => GateWeight::Update,
        config::GateWeight::Half => GateWeight::Half,
    };
    FusionSettings {
        criterion,
        heading_lever_m: fusion.heading_lever_m,
        damping: fusion.damping,
        memory: span(fusion.memory_s),
        reset_on_transmit: fusion.reset_on_transmit,
        gate,
        gate_weight,
        ..FusionSettings::default()
    }
}

fn found(config: &Config) -> FoundSettings {
    let found = FoundSettings {
        enabled: !config.fusion.paper,
        trust_jump: match config.position.trust_jump {
            config::TrustJump::Robot => TrustJump::Robot,
            config::TrustJump::Receiver => TrustJump::Receiver,
        },
        ..FoundSettings::default()
    };
    if config.sighting.heard {
        found.among_others()
    } else {
        found
    }
}

fn partial(fusion: &config::Fusion) -> PositionSettings {
    let own = &fusion.position;
    let (gate, gate_alone) = (own.gate, own.gate_alone);
    if fusion.paper {
        return PositionSettings {
            gate,
            gate_alone,
            ..PositionSettings::paper()
        };
    }
    PositionSettings {
        heading_lever_m: own.heading_lever_m,
        damping: own.damping,
        memory: span(own.memory_s),
        gate,
        gate_alone,
    }
}

fn span(seconds: f64) -> Span {
    Span::from_nanos(nanos(seconds))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn config(lines: &str) -> Config {
        Config::parse(
            &format!("[robot]\nname = \"a\"\nid = 1\n{lines}"),
            Path::new("a.toml"),
        )
        .unwrap()
    }

    #[test]
    fn the_defaults_are_the_estimators() {
        assert_eq!(settings(&config("")), Settings::default());
    }

    #[test]
    fn the_papers_propagation_can_be_had_alone() {
        let paper = settings(&config("[fusion]\npropagation = \"paper\"\n"));
        let expected = Settings {
            propagation: Propagation::Paper,
            ..Settings::default()
        };
        assert_eq!(paper, expected);
    }

    #[test]
    fn floors_reach_the_estimator_as_variances() {
        let floors = settings(&config(
            "[fusion]\nrelative_pose_floor = [0.5, 0.25, 0.125]\nneighbour_floor = [1.0, 2.0, 3.0]\n\
             position_floor = [0.25, 4.0]\nheading_floor = 0.5\n",
        ))
        .floors;
        let expected = Floors {
            sighting: [0.25, 0.0625, 0.015_625],
            neighbour: [1.0, 4.0, 9.0],
            fix: [0.0625, 16.0],
            heading: 0.25,
        };
        assert_eq!(floors, expected);
    }

    #[test]
    fn the_paper_is_the_estimators_paper() {
        assert_eq!(
            settings(&config("[fusion]\npaper = true\n")),
            Settings::paper()
        );
    }
}
