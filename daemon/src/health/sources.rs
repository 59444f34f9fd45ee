//! What came of each sensor and each robot: the rows of the status. Nothing is allocated.
//!
//! A source has a row once something of it was valid, or refused while there is room. If there is none, a valid one takes the
//! place of that which was heard longest ago and is not heard any more; a flood of refused ones takes nobody's.

use coloc_estimator::Stamp;
use coloc_shm_types::{Input, SourceHealth, SourceState, Status};

use super::fact::Fact;
use super::row::Row;
use crate::config::Config;

/// The rows.
#[derive(Clone, Debug)]
pub(super) struct Sources {
    rows: [Row; Status::SOURCES],
    /// Whose each row is, close together: they are looked through for every input.
    keys: [Key; Status::SOURCES],
    /// By [`Input`]: how a row of it begins.
    blank: [Row; Input::COUNT],
}

/// Of which [`Input`], and its number.
type Of = (Input, u16);

/// [`Of`] in one word.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
struct Key(u32);

impl Key {
    const NOBODY: Self = Self(u32::MAX);

    fn of((input, source): Of) -> Self {
        Self((input as u32) << u16::BITS | u32::from(source))
    }
}

impl Sources {
    /// Nobody was heard yet.
    pub(super) fn new(config: &Config) -> Self {
        Self {
            rows: [Row::default(); Status::SOURCES],
            keys: [Key::NOBODY; Status::SOURCES],
            blank: Input::ALL.map(|input| Row::blank(input, config)),
        }
    }

    /// Something came of the source, or became of what came before, at `now`.
    #[inline]
    pub(super) fn note(&mut self, of: Of, fact: Fact, now: Stamp) {
        let own = self.place(Key::of(of));
        let place = own.or_else(|| self.begin(of, fact, now));
        if let Some(row) = place.and_then(|place| self.rows.get_mut(place)) {
            row.note(fact, now);
        }
    }

    /// There is no port by which `robot` could be told where it is seen.
    pub(super) fn unreachable(&mut self, robot: u16) {
        let of = (Input::Neighbour, robot);
        let own = self.place(Key::of(of));
        let place = own.or_else(|| self.claim(self.free()?, of));
        if let Some(row) = place.and_then(|place| self.rows.get_mut(place)) {
            row.unreachable();
        }
    }

    /// Who speaks for each source of `input`, as far as that is still known; a contest that begins or ends is `news`.
    pub(super) fn sessions(
        &mut self,
        input: Input,
        state: impl Fn(u16) -> Option<SourceState>,
        news: impl FnMut(SourceState),
    ) {
        let rows = self.rows.iter_mut().filter(|row| row.is_of(input));
        rows.filter_map(|row| row.spoken_for(state(row.source())))
            .for_each(news);
    }

    /// Those and no others stand against the belief.
    pub(super) fn against(&mut self, those: &[Of]) {
        for (row, key) in self.rows.iter_mut().zip(&self.keys) {
            row.against(those.iter().any(|of| Key::of(*of) == *key));
        }
    }

    /// All rows as they are at `now`.
    pub(super) fn rows(&self, now: Stamp) -> impl Iterator<Item = SourceHealth> {
        self.rows.iter().map(move |row| row.at(now))
    }

    /// Beyond which d² an input of that kind is refused; 0 where there is no gate.
    pub(super) fn gate(&self, input: Input) -> f64 {
        self.blank.get(input as usize).map_or(0.0, Row::gate)
    }

    fn place(&self, key: Key) -> Option<usize> {
        self.keys.iter().position(|it| *it == key)
    }

    fn free(&self) -> Option<usize> {
        self.place(Key::NOBODY)
    }

    /// A row for somebody who has none, if there is room for such a fact.
    #[cold]
    fn begin(&mut self, of: Of, fact: Fact, now: Stamp) -> Option<usize> {
        let place = match fact {
            Fact::Valid(_) => self.free().or_else(|| self.silent(now)),
            _ => self.free(),
        };
        self.claim(place?, of)
    }

    /// Where the row is of who was heard longest ago, out of those that are not heard any more.
    fn silent(&self, now: Stamp) -> Option<usize> {
        let rows = self.rows.iter().enumerate();
        let silent = rows.filter(|(_, row)| !row.is_heard(now));
        let first = silent.min_by_key(|(_, row)| row.rank());
        first.map(|(place, _)| place)
    }

    fn claim(&mut self, place: usize, (input, source): Of) -> Option<usize> {
        let blank = self.blank.get(input as usize)?;
        *self.rows.get_mut(place)? = blank.with(source);
        *self.keys.get_mut(place)? = Key::of((input, source));
        Some(place)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use coloc_estimator::Span;
    use coloc_shm_types::Health;

    use super::*;

    const PASSED: Fact = Fact::Passed {
        count: 1,
        d2: Some(1.0),
    };
    const REFUSED: Fact = Fact::Refused { d2: Some(70.0) };

    fn sources() -> Sources {
        let text = "[robot]\nname = \"a\"\nid = 1\n";
        Sources::new(&Config::parse(text, Path::new("a.toml")).unwrap())
    }

    fn at(millis: i64) -> Stamp {
        Stamp::default() + Span::from_millis(millis)
    }

    /// A valid input that comes as soon as it was measured.
    fn came(sources: &mut Sources, of: Of, millis: i64) {
        sources.note(of, Fact::Valid(at(millis)), at(millis));
    }

    fn row(sources: &Sources, input: Input, source: u16, now: Stamp) -> SourceHealth {
        let rows = sources.rows(now);
        let mut own = rows.filter(|row| (row.input(), row.source) == (Some(input), source));
        let row = own.next().expect("a row");
        assert!(own.next().is_none(), "one row each");
        row
    }

    #[test]
    fn each_source_has_a_row_of_its_own() {
        let mut sources = sources();
        for (source, count) in [(0, 3), (1, 5)] {
            for k in 1..=count {
                came(&mut sources, (Input::Position, source), 1000 + k);
                sources.note((Input::Position, source), PASSED, at(1000 + k));
            }
        }
        sources.note((Input::Neighbour, 1), Fact::Valid(at(900)), at(1000));
        let found = row(&sources, Input::Position, 1, at(1010));
        assert_eq!(
            (found.accepted, found.rejected, found.health()),
            (5, 0, Health::Ok)
        );
        assert_eq!(found.newest_boot_ns, at(1005).as_nanos());
        assert!(found.gate > 0.0 && found.d2 > 0.0);
        assert_eq!(row(&sources, Input::Neighbour, 1, at(1010)).accepted, 0);
    }

    #[test]
    fn who_is_refused_is_shown_since_when_and_by_how_much() {
        let (mut sources, key) = (sources(), (Input::Position, 0));
        came(&mut sources, key, 1000);
        sources.note(key, PASSED, at(1000));
        for millis in [2000, 3000] {
            came(&mut sources, key, millis);
            sources.note(key, REFUSED, at(millis));
        }
        sources.note(key, Fact::Repeated, at(3000));
        let found = row(&sources, Input::Position, 0, at(3000));
        assert_eq!((found.accepted, found.rejected), (1, 3));
        assert_eq!(found.refused_since_boot_ns, at(2000).as_nanos());
        assert!(found.d2 > found.gate, "{found:?}");
        sources.note(key, PASSED, at(3000));
        let found = row(&sources, Input::Position, 0, at(3000));
        assert_eq!(found.refused_since_boot_ns, 0);
    }

    #[test]
    fn of_two_receivers_the_one_that_never_passes_is_named() {
        let mut sources = sources();
        for millis in (1000..2000).step_by(100) {
            for (source, fact) in [(0, PASSED), (1, REFUSED)] {
                came(&mut sources, (Input::Position, source), millis);
                sources.note((Input::Position, source), fact, at(millis));
            }
        }
        let health = [0, 1].map(|it| row(&sources, Input::Position, it, at(2000)).health());
        assert_eq!(health, [Health::Ok, Health::Refused]);
        sources.note((Input::Position, 2), Fact::Invalid, at(2000));
        let garbage = row(&sources, Input::Position, 2, at(2000));
        assert_eq!(garbage.health(), Health::Faulty);
    }

    #[test]
    fn a_flood_of_refused_sources_takes_nobodys_row_and_a_valid_one_that_of_who_is_silent() {
        let mut sources = sources();
        for robot in 0..32 {
            came(
                &mut sources,
                (Input::Neighbour, robot),
                1000 + i64::from(robot),
            );
        }
        for source in 0..1000 {
            sources.note((Input::Position, source), Fact::Invalid, at(2000));
        }
        assert!(sources.rows(at(2000)).all(|row| row.rejected == 0));
        let mut robots_after = |millis| {
            came(&mut sources, (Input::Position, 7), millis);
            let rows = sources.rows(at(millis));
            let kept = rows.filter(|row| row.input() == Some(Input::Neighbour));
            kept.map(|row| row.source).collect::<Vec<_>>()
        };
        let all: Vec<_> = (0..32).collect();
        assert_eq!(robots_after(1100), all, "all of them are heard");
        assert_eq!(robots_after(60_000), all[1..], "robot 0 gave way");
    }

    /// What is news of source 3, if that is known of it.
    fn news(sources: &mut Sources, state: Option<SourceState>) -> Vec<SourceState> {
        let mut news = Vec::new();
        let of = |number| state.filter(|state| state.number == number);
        sources.sessions(Input::Position, of, |it| news.push(it));
        news
    }

    fn spoken(contested: bool) -> SourceState {
        SourceState {
            number: 3,
            live: 2,
            contested,
            lost: 4,
        }
    }

    #[test]
    fn a_contest_is_news_when_it_begins_and_when_it_ends() {
        let mut sources = sources();
        assert!(news(&mut sources, Some(spoken(true))).is_empty(), "unheard");
        came(&mut sources, (Input::Position, 3), 1);
        let counts =
            [true, true, false, false].map(|it| news(&mut sources, Some(spoken(it))).len());
        assert_eq!(counts, [1, 0, 1, 0]);
        let found = row(&sources, Input::Position, 3, at(1));
        assert_eq!((found.live_sessions, found.lost), (2, 4));
    }

    /// Its place among the remembered was taken by another source: the row used to say for ever that it was contested.
    #[test]
    fn a_contest_ends_with_the_memory_of_who_speaks() {
        let mut sources = sources();
        came(&mut sources, (Input::Position, 3), 1);
        news(&mut sources, Some(spoken(true)));
        let told = news(&mut sources, None);
        assert_eq!(told.len(), 1);
        assert_eq!(
            (told[0].number, told[0].live, told[0].contested),
            (3, 0, false)
        );
        let found = row(&sources, Input::Position, 3, at(1));
        assert!(!found.is_contested() && found.live_sessions == 0);
        assert_eq!(found.lost, 4, "what was lost stays lost");
    }

    #[test]
    fn a_robot_that_cannot_be_told_is_shown_before_it_was_heard() {
        let mut sources = sources();
        sources.unreachable(5);
        let found = row(&sources, Input::Neighbour, 5, at(1));
        assert!(found.is_unreachable() && found.health() == Health::NeverSeen);
        came(&mut sources, (Input::Neighbour, 5), 2);
        assert!(row(&sources, Input::Neighbour, 5, at(2)).is_unreachable());
    }
}
