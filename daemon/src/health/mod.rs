//! How each input is doing, and whether the belief may be driven on: decided here alone, at every tick, from what became of the
//! last inputs.
//!
//! What is told of one source is a [`Fact`]. It goes to two sensors, that of the kind and that of
//! the source's row, which decide by the same rules. A kind has one of its own because not every source has a row.
//!
//! | at the tick | health |
//! | --- | --- |
//! | the kind cannot be heard (no CAN bus that can receive, a channel that has no place); a kind alone | faulty |
//! | the newest valid sample is recent, and the last three changed nothing | refused |
//! | the newest valid sample is recent | ok |
//! | else: something invalid came within `stale` | faulty |
//! | else: there was a valid sample once | stale |
//! | else | never seen |
//!
//! Recent is what is not older than `stale`, or, but for wheels, than 2.5 of the source's own intervals, whichever is longer.

mod fact;
mod patience;
mod row;
mod sensor;
mod sources;
mod standing;

use coloc_estimator::{Belief, Finding, Stamp};
use coloc_shm_types::{BusState, Health, Input, SourceState, Status};

use crate::config::Config;
use patience::Patience;
use sensor::Sensor;
use sources::Sources;
use standing::Limits;

pub use fact::Fact;
pub use standing::Standing;

/// Watches all inputs.
#[derive(Clone, Debug)]
pub struct Watch {
    kinds: [Kind; Input::COUNT],
    sources: Sources,
    limits: Limits,
    /// Whether the estimator asks who is right.
    doubts: bool,
}

/// All sources of one kind, as one.
#[derive(Copy, Clone, Debug)]
struct Kind {
    sensor: Sensor,
    /// It cannot be heard at all.
    broken: bool,
}

impl Watch {
    /// Nothing seen yet.
    #[must_use]
    pub fn new(config: &Config) -> Self {
        Self {
            kinds: Input::ALL.map(|input| Kind::new(Patience::of(input, config))),
            sources: Sources::new(config),
            limits: Limits::new(&config.health),
            doubts: !config.fusion.paper,
        }
    }

    /// Something came of a source, or became of what came before, at `now`.
    pub fn note(&mut self, (input, source): (Input, u16), fact: Fact, now: Stamp) {
        self.kind(input).sensor.note(fact, now);
        self.sources.note((input, source), fact, now);
    }

    /// Something came at `now` that does not even say of which source it is.
    pub fn note_garbage(&mut self, input: Input, now: Stamp) {
        self.kind(input).sensor.note(Fact::Invalid, now);
    }

    /// Whether `input` cannot be heard at all.
    pub fn broken(&mut self, input: Input, broken: bool) {
        self.kind(input).broken = broken;
    }

    /// How the wheels' buses are doing; whether odometry comes over them `alone`, so that without them there is none.
    pub fn buses(&mut self, worst: BusState, alone: bool) {
        self.broken(Input::Odometry, alone && worst >= BusState::Off);
    }

    /// There is no port by which `robot` could be told where it is seen.
    pub fn unreachable(&mut self, robot: u16) {
        self.sources.unreachable(robot);
    }

    /// Asks for each source of `input` how many speak for it; what is `news` of that.
    pub fn sessions(
        &mut self,
        input: Input,
        state: impl Fn(u16) -> Option<SourceState>,
        news: impl FnMut(SourceState),
    ) {
        self.sources.sessions(input, state, news);
    }

    /// Every kind's health at the tick stamped `now`, by [`Input`].
    #[must_use]
    pub fn at(&self, now: Stamp) -> [Health; Input::COUNT] {
        self.kinds.each_ref().map(|kind| kind.at(now))
    }

    /// Writes every source's row as it is at `now`.
    pub fn write_to(&self, status: &mut Status, now: Stamp) {
        for (place, row) in status.sources.iter_mut().zip(self.sources.rows(now)) {
            *place = row;
        }
    }

    /// Beyond which d² an input of that kind is refused; 0 where there is no gate.
    #[must_use]
    pub fn gate(&self, input: Input) -> f64 {
        self.sources.gate(input)
    }

    /// What a robot with such inputs may say of its belief, by what the estimator finds.
    #[must_use]
    pub fn standing(
        &self,
        health: [Health; Input::COUNT],
        belief: &Belief,
        finding: &Finding,
    ) -> Standing {
        let kinds = self.kinds.each_ref();
        let gated = kinds.map(|kind| kind.sensor.is_gated());
        let found = self.doubts.then_some(finding.state);
        self.limits.standing(health, gated, belief, found)
    }

    /// Those and no others stand against the belief.
    pub fn against(&mut self, those: &[(Input, u16)]) {
        self.sources.against(those);
    }

    #[allow(clippy::indexing_slicing)] // One place for each of the inputs' numbers.
    fn kind(&mut self, input: Input) -> &mut Kind {
        &mut self.kinds[input as usize]
    }
}

impl Kind {
    fn new(patience: Patience) -> Self {
        Self {
            sensor: Sensor::new(patience),
            broken: false,
        }
    }

    fn at(&self, now: Stamp) -> Health {
        if self.broken {
            Health::Faulty
        } else {
            self.sensor.at(now)
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use coloc_estimator::Span;

    use super::*;

    fn watch() -> Watch {
        let text = "[robot]\nname = \"a\"\nid = 1\n";
        Watch::new(&Config::parse(text, Path::new("a.toml")).unwrap())
    }

    fn stamp(millis: i64) -> Stamp {
        Stamp::default() + Span::from_millis(millis)
    }

    fn of(watch: &Watch, input: Input, millis: i64) -> Health {
        watch.at(stamp(millis))[input as usize]
    }

    fn row(watch: &Watch, input: Input, source: u16, millis: i64) -> Option<Health> {
        let mut rows = watch.sources.rows(stamp(millis));
        let row = rows.find(|row| (row.input(), row.source) == (Some(input), source));
        row.map(|row| row.health())
    }

    #[test]
    fn a_bus_that_cannot_receive_is_faulty_at_once() {
        let mut watch = watch();
        watch.note((Input::Odometry, 0), Fact::Valid(stamp(1000)), stamp(1000));
        for (worst, alone, expected) in [
            (BusState::Off, true, Health::Faulty),
            (BusState::Off, false, Health::Ok),
            (BusState::Passive, true, Health::Ok),
        ] {
            watch.buses(worst, alone);
            assert_eq!(of(&watch, Input::Odometry, 1000), expected);
        }
    }

    #[test]
    fn what_says_of_no_source_what_it_is_makes_its_kind_faulty_alone() {
        let mut watch = watch();
        watch.note_garbage(Input::Position, stamp(1000));
        assert_eq!(of(&watch, Input::Position, 1000), Health::Faulty);
        assert_eq!(of(&watch, Input::Neighbour, 1000), Health::NeverSeen);
        assert_eq!(
            watch
                .sources
                .rows(stamp(1000))
                .filter_map(|it| it.input())
                .count(),
            0
        );
    }

    /// One fact is told once, and of one source the row and the kind say the same.
    #[test]
    fn a_row_and_its_kind_agree_whatever_is_told() {
        let mut watch = watch();
        let (input, mut millis) = (Input::Position, 0);
        let refused = Fact::Refused { d2: Some(70.0) };
        let passed = Fact::Passed {
            count: 1,
            d2: Some(0.5),
        };
        let facts = [passed, refused, refused, refused, Fact::Repeated, passed];
        for fact in facts.into_iter().chain([Fact::Invalid; 3]) {
            millis += 200;
            watch.note((input, 3), Fact::Valid(stamp(millis)), stamp(millis));
            watch.note((input, 3), fact, stamp(millis));
            for later in [0, 400, 900, 1100, 60_000] {
                let health = of(&watch, input, millis + later);
                assert_eq!(row(&watch, input, 3, millis + later), Some(health));
            }
        }
    }

    /// It is said with each input that is beyond it.
    #[test]
    fn fixes_and_neighbours_have_their_gates_and_nothing_else_has_one() {
        let gate = |input| watch().gate(input);
        assert!((gate(Input::Position) - 9.210_340).abs() < 1e-6);
        assert!((gate(Input::Neighbour) - 11.344_867).abs() < 1e-6);
        assert!(gate(Input::Odometry).max(gate(Input::RelativePose)) <= 0.0);
    }

    #[test]
    fn a_source_without_a_row_still_counts_for_its_kind() {
        let mut watch = watch();
        for robot in 0..32 {
            watch.note(
                (Input::Neighbour, robot),
                Fact::Valid(stamp(1000)),
                stamp(1000),
            );
        }
        watch.note((Input::Position, 0), Fact::Valid(stamp(1000)), stamp(1000));
        assert_eq!(of(&watch, Input::Position, 1000), Health::Ok);
        assert_eq!(row(&watch, Input::Position, 0, 1000), None);
    }
}
