//! One source: a sensor, or a robot; whoever speaks for it.
use std::cmp::Reverse;

use super::SourceState;
use super::session::Session;
use super::window::Place;
use crate::{Header, Reject};

/// Sessions of one source that may live at once.
const SESSIONS: usize = 4;

/// Two that alternate for longer than this are no restart \[ns\].
const RESTART_NS: i64 = 2_000_000_000;

#[derive(Clone, Debug)]
pub(super) struct Source {
    number: u16,
    sessions: [Option<Session>; SESSIONS],
    /// Place of the one that was heard last.
    newest: usize,
    contest: Option<Contest>,
    lost: u64,
    /// Messages that passed.
    passed: u64,
}

/// Sessions that come again after another one was heard.
#[derive(Copy, Clone, Debug)]
struct Contest {
    since_ns: i64,
    last_ns: i64,
}

impl Source {
    pub(super) fn beginning(header: &Header, now_ns: i64) -> Self {
        let mut sessions = [None; SESSIONS];
        sessions[0] = Some(Session::beginning(header, now_ns, 0));
        Self {
            number: header.source,
            sessions,
            newest: 0,
            contest: None,
            lost: 0,
            passed: 1,
        }
    }

    pub(super) fn number(&self) -> u16 {
        self.number
    }

    pub(super) fn accept(&mut self, header: &Header, now_ns: i64) -> Result<(), Reject> {
        if let Some(place) = self.nearest(header) {
            return self.go_on(place, header.sequence, now_ns);
        }
        self.begin(header, now_ns);
        Ok(())
    }

    /// The session that the message belongs to: of several counts under one number that to which it is closest.
    fn nearest(&self, header: &Header) -> Option<usize> {
        let places = self.sessions.iter().enumerate();
        places
            .filter_map(|(place, session)| Some((session.as_ref()?.distance(header)?, place)))
            .min()
            .map(|(_, place)| place)
    }

    fn go_on(&mut self, place: usize, sequence: u64, now_ns: i64) -> Result<(), Reject> {
        let session = self.sessions.get_mut(place).and_then(Option::as_mut);
        let passed = self.passed;
        match session.map(|session| session.note(sequence, now_ns, passed)) {
            Some(Place::Seen) | None => return Err(Reject::Replayed),
            Some(Place::Ahead { missing }) => self.lost = self.lost.saturating_add(missing),
            Some(Place::Late) => self.lost = self.lost.saturating_sub(1),
            Some(Place::Earlier) => {}
        }
        self.passed += 1;
        if place != self.newest {
            self.newest = place;
            self.came_again(now_ns);
        }
        Ok(())
    }

    fn begin(&mut self, header: &Header, now_ns: i64) {
        let free = self.sessions.iter().position(Option::is_none);
        let place = free.or_else(|| self.most_silent(now_ns)).unwrap_or(0);
        self.newest = place;
        self.sessions[place] = Some(Session::beginning(header, now_ns, self.passed));
        self.passed += 1;
    }

    /// Of those that were heard at one moment, the one that was heard first.
    fn most_silent(&self, now_ns: i64) -> Option<usize> {
        let silence = |session: &Session| (session.silence(now_ns), Reverse(session.order()));
        let places = self.sessions.iter().enumerate();
        let silences = places.filter_map(|(place, it)| Some((silence(it.as_ref()?), place)));
        let longest = silences.max_by(|((one, first), _), ((other, second), _)| {
            one.total_cmp(other).then(first.cmp(second))
        });
        longest.map(|(_, place)| place)
    }

    fn came_again(&mut self, now_ns: i64) {
        let since_ns = match self.contest {
            Some(contest) if self.goes_on(&contest, now_ns) => contest.since_ns,
            _ => now_ns,
        };
        self.contest = Some(Contest {
            since_ns,
            last_ns: now_ns,
        });
    }

    fn goes_on(&self, contest: &Contest, now_ns: i64) -> bool {
        let patience_ns = self.alive(now_ns).map(Session::patience_ns).max();
        now_ns.saturating_sub(contest.last_ns) <= patience_ns.unwrap_or(0)
    }

    /// It takes two: who is left alone contests nothing.
    fn is_contested(&self, now_ns: i64) -> bool {
        let lasted = |contest: &Contest| contest.last_ns.saturating_sub(contest.since_ns);
        let contest = self.contest.filter(|it| lasted(it) >= RESTART_NS);
        self.live(now_ns) > 1 && contest.is_some_and(|it| self.goes_on(&it, now_ns))
    }

    fn heard(&self) -> impl Iterator<Item = &Session> {
        self.sessions.iter().flatten()
    }

    fn alive(&self, now_ns: i64) -> impl Iterator<Item = &Session> {
        self.heard().filter(move |session| session.is_live(now_ns))
    }

    pub(super) fn live(&self, now_ns: i64) -> usize {
        self.alive(now_ns).count()
    }

    /// When it was heard last \[ns\].
    pub(super) fn heard_ns(&self) -> i64 {
        let last = self.heard().map(Session::heard_ns).max();
        last.unwrap_or(i64::MIN)
    }

    pub(super) fn state(&self, now_ns: i64) -> SourceState {
        SourceState {
            number: self.number,
            live: u8::try_from(self.live(now_ns)).unwrap_or(u8::MAX),
            contested: self.is_contested(now_ns),
            lost: self.lost,
        }
    }
}
