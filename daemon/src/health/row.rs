//! What came of one sensor or one robot, and how it is doing.

use coloc_estimator::Stamp;
use coloc_shm_types::{Health, Input, SourceHealth, SourceState};

use super::fact::Fact;
use super::patience::Patience;
use super::sensor::Sensor;
use crate::config::Config;

/// One source, or an empty place.
#[derive(Copy, Clone, Debug, Default)]
pub(super) struct Row {
    sensor: Sensor,
    /// Beyond which d² it is refused; 0: it meets no gate.
    gate: f64,
    /// What the sensor says of it is missing here.
    counted: SourceHealth,
}

impl Row {
    /// Of a source of `input` whose number is not known yet.
    pub(super) fn blank(input: Input, config: &Config) -> Self {
        Self {
            sensor: Sensor::new(Patience::of(input, config)),
            gate: gate(input, config),
            counted: SourceHealth {
                input: input as u8,
                ..SourceHealth::default()
            },
        }
    }

    /// The same of that source.
    pub(super) fn with(mut self, source: u16) -> Self {
        self.counted.source = source;
        self
    }

    #[inline]
    pub(super) fn note(&mut self, fact: Fact, now: Stamp) {
        self.sensor.note(fact, now);
        match fact {
            Fact::Valid(_) => {}
            Fact::Passed { count, d2 } => {
                self.counted.accepted += count;
                self.met(d2);
            }
            Fact::Refused { d2 } => {
                self.counted.rejected += 1;
                self.met(d2);
            }
            Fact::Invalid | Fact::Repeated => self.counted.rejected += 1,
        }
    }

    fn met(&mut self, d2: Option<f64>) {
        if let Some(d2) = d2 {
            (self.counted.d2, self.counted.gate) = (d2, self.gate);
        }
    }

    pub(super) fn gate(&self) -> f64 {
        self.gate
    }

    pub(super) fn source(&self) -> u16 {
        self.counted.source
    }

    pub(super) fn is_of(&self, input: Input) -> bool {
        self.counted.input == input as u8
    }

    /// It is a robot that cannot be told where it is seen.
    pub(super) fn unreachable(&mut self) {
        self.counted.flags |= SourceHealth::UNREACHABLE;
    }

    /// Whether it stands against the belief.
    pub(super) fn against(&mut self, against: bool) {
        self.counted.flags &= !SourceHealth::AGAINST;
        if against {
            self.counted.flags |= SourceHealth::AGAINST;
        }
    }

    /// Who speaks for it, as far as that is known; it is news when a contest begins or ends.
    pub(super) fn spoken_for(&mut self, state: Option<SourceState>) -> Option<SourceState> {
        let was = self.counted.is_contested();
        let state = state.unwrap_or(self.forgotten());
        self.counted.live_sessions = state.live;
        self.counted.lost = state.lost;
        self.counted.flags &= !SourceHealth::CONTESTED;
        if state.contested {
            self.counted.flags |= SourceHealth::CONTESTED;
        }
        (was != state.contested).then_some(state)
    }

    /// Others have taken its place among those whose sessions are remembered: nobody speaks for it any more.
    fn forgotten(&self) -> SourceState {
        SourceState {
            number: self.counted.source,
            live: 0,
            contested: false,
            lost: self.counted.lost,
        }
    }

    /// The least gives way to another one: that which was heard longest ago, and a robot that cannot be told last of all.
    pub(super) fn rank(&self) -> (bool, Option<Stamp>) {
        (self.counted.is_unreachable(), self.sensor.newest())
    }

    pub(super) fn is_heard(&self, now: Stamp) -> bool {
        matches!(self.sensor.at(now), Health::Ok | Health::Refused)
    }

    pub(super) fn at(&self, now: Stamp) -> SourceHealth {
        let boot_ns = |stamp: Option<Stamp>| stamp.map_or(0, Stamp::as_nanos);
        SourceHealth {
            health: self.sensor.at(now) as u8,
            newest_boot_ns: boot_ns(self.sensor.newest()),
            refused_since_boot_ns: boot_ns(self.sensor.fails_since()),
            ..self.counted
        }
    }
}

fn gate(input: Input, config: &Config) -> f64 {
    let fusion = &config.fusion;
    match input {
        Input::Assist => config.assist.gate,
        Input::Position => fusion.position_gate,
        Input::Heading => fusion.heading_gate,
        Input::Neighbour | Input::Pose => fusion.neighbour_gate,
        Input::Sighting | Input::Seen | Input::Answer => fusion.position.gate,
        Input::Odometry
        | Input::RelativePose
        | Input::Gyro
        | Input::AssistAck
        | Input::Readings
        | Input::Integrity
        | Input::Correction => 0.0,
    }
}
