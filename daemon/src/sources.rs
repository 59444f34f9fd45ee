//! What came of each sensor and each robot: the rows of the status. Nothing is allocated.
//!
//! A source has a row once something of it was valid, or refused while there is room. If there is none, a valid one takes the
//! place of that which was heard longest ago and is not heard any more; a flood of refused ones takes nobody's.

use coloc_estimator::Stamp;
use coloc_shm_types::{Health, Input, SourceHealth, SourceState, Status};

use crate::config::{self, Config};
use crate::health::{Patience, Sensor, patience};

/// The rows.
#[derive(Clone, Debug)]
pub struct Sources {
    rows: [SourceHealth; Status::SOURCES],
    /// Of what and of whom each row is, close together: they are looked through for every input.
    keys: [Option<Key>; Status::SOURCES],
    /// By [`Input`]: beyond which d² is refused; 0 where there is no gate.
    gates: [f64; Input::COUNT],
    sensors: [Sensor; Status::SOURCES],
    /// By [`Input`]: how long it is waited for.
    patience: [Patience; Input::COUNT],
}

type Key = (Input, u16);

impl Sources {
    /// Nobody was heard yet.
    #[must_use]
    pub fn new(config: &Config) -> Self {
        Self {
            rows: [SourceHealth::default(); Status::SOURCES],
            keys: [None; Status::SOURCES],
            gates: gates(&config.fusion),
            sensors: [Sensor::default(); Status::SOURCES],
            patience: patience(&config.health),
        }
    }

    /// A valid input, measured at `stamp` and heard at `now`; what becomes of it is told later.
    pub fn valid(&mut self, input: Input, source: u16, stamp: Stamp, now: Stamp) {
        let key = (input, source);
        let place = self.place(key).or_else(|| self.silent(now));
        if let Some((row, sensor)) = place.and_then(|place| self.claim(place, key)) {
            row.newest_boot_ns = row.newest_boot_ns.max(stamp.as_nanos());
            sensor.valid(stamp);
        }
    }

    /// So many of its inputs changed the belief, or were told on; d² of the last one, if it met a gate.
    pub fn accepted(&mut self, input: Input, source: u16, count: u64, d2: Option<f64>) {
        let Some((row, sensor)) = self.row((input, source)) else {
            return;
        };
        row.accepted += count;
        if count > 0 {
            row.refused_since_boot_ns = 0;
            sensor.passed();
        }
        self.met_gate((input, source), d2);
    }

    /// A valid input that changed nothing, at `now`; d², if it was beyond the gate.
    pub fn refused(&mut self, input: Input, source: u16, d2: Option<f64>, now: Stamp) {
        if let Some(sensor) = self.rejected((input, source), now) {
            sensor.refused(d2.is_some());
        }
        self.met_gate((input, source), d2);
    }

    /// An input that is no valid one, at `now`.
    pub fn invalid(&mut self, input: Input, source: u16, now: Stamp) {
        if let Some(sensor) = self.rejected((input, source), now) {
            sensor.invalid(now);
        }
    }

    fn rejected(&mut self, key: Key, now: Stamp) -> Option<&mut Sensor> {
        let (row, sensor) = self.row(key)?;
        row.rejected += 1;
        if row.refused_since_boot_ns == 0 {
            row.refused_since_boot_ns = now.as_nanos();
        }
        Some(sensor)
    }

    /// An input that is a repetition of an earlier one: it says nothing about how its source is doing.
    pub fn repeated(&mut self, input: Input, source: u16) {
        if let Some((row, _)) = self.row((input, source)) {
            row.rejected += 1;
        }
    }

    /// There is no port by which `robot` could be told where it is seen.
    pub fn unreachable(&mut self, robot: u16) {
        if let Some((row, _)) = self.row((Input::Neighbour, robot)) {
            row.flags |= SourceHealth::UNREACHABLE;
        }
    }

    /// What is known of its sessions; whether that is contested now and was not, or the other way round.
    pub fn sessions(&mut self, input: Input, state: &SourceState) -> bool {
        let Some(row) = self.known((input, state.number)) else {
            return false;
        };
        row.live_sessions = state.live;
        row.lost = state.lost;
        let was = row.is_contested();
        row.flags &= !SourceHealth::CONTESTED;
        if state.contested {
            row.flags |= SourceHealth::CONTESTED;
        }
        was != state.contested
    }

    /// All rows as they are at `now`.
    #[must_use]
    pub fn rows(&mut self, now: Stamp) -> &[SourceHealth; Status::SOURCES] {
        let sensors = self.sensors.iter().zip(&self.keys);
        for (row, (sensor, key)) in self.rows.iter_mut().zip(sensors) {
            if let Some((input, _)) = *key {
                row.health = sensor.at(now, of(&self.patience, input)) as u8;
            }
        }
        &self.rows
    }

    /// Beyond which d² an input of that kind is refused; 0 where there is no gate.
    #[must_use]
    pub fn gate(&self, input: Input) -> f64 {
        self.gates.get(input as usize).copied().unwrap_or(0.0)
    }

    fn met_gate(&mut self, key: Key, d2: Option<f64>) {
        let gate = self.gate(key.0);
        if let Some((row, d2)) = self.known(key).zip(d2) {
            (row.d2, row.gate) = (d2, gate);
        }
    }

    /// The row of somebody, who gets one if there is room.
    fn row(&mut self, key: Key) -> Option<(&mut SourceHealth, &mut Sensor)> {
        let place = self.place(key)?;
        self.claim(place, key)
    }

    /// The row of somebody who has one.
    fn known(&mut self, key: Key) -> Option<&mut SourceHealth> {
        let place = self.keys.iter().position(|it| *it == Some(key))?;
        self.rows.get_mut(place)
    }

    /// Where somebody's row is, or could be.
    fn place(&self, key: Key) -> Option<usize> {
        let own = self.keys.iter().position(|it| *it == Some(key));
        own.or_else(|| self.keys.iter().position(Option::is_none))
    }

    /// The row of who was heard longest ago, out of those that are not heard any more.
    fn silent(&self, now: Stamp) -> Option<usize> {
        let sensors = self.sensors.iter().zip(&self.keys).enumerate();
        let silent = sensors.filter(|(_, (sensor, key))| {
            let heard = key.map(|(input, _)| sensor.at(now, of(&self.patience, input)));
            !matches!(heard, Some(Health::Ok | Health::Refused))
        });
        let rank = |place: usize| {
            let row = self.rows.get(place);
            row.map(|row| (row.is_unreachable(), row.newest_boot_ns))
        };
        let places = silent.map(|(place, _)| place);
        places.min_by_key(|place| rank(*place))
    }

    fn claim(&mut self, place: usize, key: Key) -> Option<(&mut SourceHealth, &mut Sensor)> {
        let (row, own) = self.rows.get_mut(place).zip(self.keys.get_mut(place))?;
        let sensor = self.sensors.get_mut(place)?;
        if *own != Some(key) {
            *own = Some(key);
            *sensor = Sensor::default();
            *row = SourceHealth {
                input: key.0 as u8,
                source: key.1,
                ..SourceHealth::default()
            };
        }
        Some((row, sensor))
    }
}

fn of(patience: &[Patience; Input::COUNT], input: Input) -> Patience {
    patience.get(input as usize).copied().unwrap_or_default()
}

fn gates(fusion: &config::Fusion) -> [f64; Input::COUNT] {
    Input::ALL.map(|input| match input {
        Input::Position => fusion.position_gate,
        Input::Neighbour => fusion.neighbour_gate,
        Input::Odometry | Input::RelativePose => 0.0,
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use coloc_estimator::Span;

    use super::*;

    fn sources() -> Sources {
        let text = "[robot]\nname = \"a\"\nid = 1\n";
        Sources::new(&Config::parse(text, Path::new("a.toml")).unwrap())
    }

    fn at(millis: i64) -> Stamp {
        Stamp::default() + Span::from_millis(millis)
    }

    fn row(sources: &mut Sources, input: Input, source: u16, now: Stamp) -> SourceHealth {
        let rows = sources.rows(now).iter();
        let mut own = rows.filter(|row| (row.input(), row.source) == (Some(input), source));
        let row = *own.next().expect("a row");
        assert!(own.next().is_none(), "one row each");
        row
    }

    #[test]
    fn each_source_has_a_row_of_its_own() {
        let mut sources = sources();
        for (source, count) in [(0, 3), (1, 5)] {
            for k in 1..=count {
                sources.valid(Input::Position, source, at(1000 + k), at(1000 + k));
                sources.accepted(Input::Position, source, 1, Some(0.5));
            }
        }
        sources.valid(Input::Neighbour, 1, at(900), at(1000));
        let found = row(&mut sources, Input::Position, 1, at(1010));
        assert_eq!(
            (found.accepted, found.rejected, found.health()),
            (5, 0, Health::Ok)
        );
        assert_eq!(found.newest_boot_ns, at(1005).as_nanos());
        assert!(found.gate > 0.0 && found.d2 > 0.0);
        assert_eq!(row(&mut sources, Input::Neighbour, 1, at(1010)).accepted, 0);
    }

    #[test]
    fn who_is_refused_is_shown_since_when_and_by_how_much() {
        let mut sources = sources();
        sources.valid(Input::Position, 0, at(1000), at(1000));
        sources.accepted(Input::Position, 0, 1, Some(1.0));
        for millis in [2000, 3000] {
            sources.valid(Input::Position, 0, at(millis), at(millis));
            sources.refused(Input::Position, 0, Some(70.0), at(millis));
        }
        sources.repeated(Input::Position, 0);
        let found = row(&mut sources, Input::Position, 0, at(3000));
        assert_eq!((found.accepted, found.rejected), (1, 3));
        assert_eq!(found.refused_since_boot_ns, at(2000).as_nanos());
        assert!(found.d2 > found.gate, "{found:?}");
        sources.accepted(Input::Position, 0, 1, Some(1.0));
        let found = row(&mut sources, Input::Position, 0, at(3000));
        assert_eq!(found.refused_since_boot_ns, 0);
    }

    #[test]
    fn of_two_receivers_the_one_that_never_passes_is_named() {
        let mut sources = sources();
        for millis in (1000..2000).step_by(100).map(at) {
            for source in [0, 1] {
                sources.valid(Input::Position, source, millis, millis);
            }
            sources.accepted(Input::Position, 0, 1, Some(1.0));
            sources.refused(Input::Position, 1, Some(70.0), millis);
        }
        let health = [0, 1].map(|it| row(&mut sources, Input::Position, it, at(2000)).health());
        assert_eq!(health, [Health::Ok, Health::Refused]);
        sources.invalid(Input::Position, 2, at(2000));
        let garbage = row(&mut sources, Input::Position, 2, at(2000));
        assert_eq!(garbage.health(), Health::Faulty);
    }

    #[test]
    fn a_flood_of_refused_sources_takes_nobodys_row_and_a_valid_one_that_of_who_is_silent() {
        let mut sources = sources();
        for robot in 0..32 {
            let heard = at(1000 + i64::from(robot));
            sources.valid(Input::Neighbour, robot, heard, heard);
        }
        for source in 0..1000 {
            sources.invalid(Input::Position, source, at(2000));
        }
        assert!(sources.rows(at(2000)).iter().all(|row| row.rejected == 0));
        let mut robots_after = |now| {
            sources.valid(Input::Position, 7, now, now);
            let rows = sources.rows(now).iter();
            let kept = rows.filter(|row| row.input() == Some(Input::Neighbour));
            kept.map(|row| row.source).collect::<Vec<_>>()
        };
        let all: Vec<_> = (0..32).collect();
        assert_eq!(robots_after(at(1100)), all, "all of them are heard");
        assert_eq!(robots_after(at(60_000)), all[1..], "robot 0 gave way");
    }

    #[test]
    fn a_contest_is_news_when_it_begins_and_when_it_ends() {
        let mut sources = sources();
        let state = |contested| SourceState {
            number: 3,
            live: 2,
            contested,
            lost: 4,
        };
        assert!(!sources.sessions(Input::Position, &state(true)), "unheard");
        sources.valid(Input::Position, 3, at(1), at(1));
        let news =
            [true, true, false, false].map(|it| sources.sessions(Input::Position, &state(it)));
        assert_eq!(news, [true, false, true, false]);
        let found = row(&mut sources, Input::Position, 3, at(1));
        assert_eq!((found.live_sessions, found.lost), (2, 4));
    }

    #[test]
    fn a_robot_that_cannot_be_told_is_shown_before_it_was_heard() {
        let mut sources = sources();
        sources.unreachable(5);
        let found = row(&mut sources, Input::Neighbour, 5, at(1));
        assert!(found.is_unreachable() && found.health() == Health::NeverSeen);
        sources.valid(Input::Neighbour, 5, at(2), at(2));
        assert!(row(&mut sources, Input::Neighbour, 5, at(2)).is_unreachable());
    }
}
