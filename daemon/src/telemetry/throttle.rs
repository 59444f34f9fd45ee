//! Lines that repeat: the first of a kind at once, then a sum every few seconds. A flood stays a few lines.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use crate::clock::ClockStep;
use crate::event::{Event, GyroNews};
use coloc_drivers::canopen::CanopenEvent;
use coloc_estimator::Decision;
use coloc_estimator::assist::news::News;
use coloc_shm_types::WhyUnfit;

const PERIOD: Duration = Duration::from_secs(5);

/// So many sources of one kind have lines of their own; whoever invents more is told with one of these.
const OWN_LINES: u16 = 16;

/// What was noted and not said yet, by its kind.
#[derive(Debug, Default)]
pub(super) struct Throttle {
    kinds: BTreeMap<Kind, Entry>,
}

/// What is to be said: so many of a kind, added up to one.
pub(super) type Sum = (u64, Event);

/// Which event, and what of it makes it another kind.
type Kind = [u8; 4];

#[derive(Debug, Default)]
struct Entry {
    said: Option<Instant>,
    unsaid: Option<Sum>,
}

impl Throttle {
    /// One more.
    pub(super) fn note(&mut self, event: Event) {
        let unsaid = &mut self.kinds.entry(kind(&event)).or_default().unsaid;
        *unsaid = Some(match unsaid.take() {
            Some((count, before)) => (count + 1, added(before, event)),
            None => (1, event),
        });
    }

    /// What is to be said at `now`.
    pub(super) fn due(&mut self, now: Instant) -> impl Iterator<Item = Sum> {
        self.kinds
            .values_mut()
            .filter(move |entry| entry.is_due(now))
            .filter_map(move |entry| entry.say(now))
    }

    /// All that was not said yet.
    pub(super) fn flush(&mut self) -> impl Iterator<Item = Sum> {
        self.kinds
            .values_mut()
            .filter_map(|entry| entry.unsaid.take())
    }
}

impl Entry {
    fn is_due(&self, now: Instant) -> bool {
        self.said
            .is_none_or(|said| now.saturating_duration_since(said) >= PERIOD)
    }

    fn say(&mut self, now: Instant) -> Option<Sum> {
        let sum = self.unsaid.take()?;
        self.said = Some(now);
        Some(sum)
    }
}

fn kind(event: &Event) -> Kind {
    match *event {
        Event::Rejected {
            input,
            source,
            reason,
            ..
        } => [0, input as u8, reason as u8, (source % OWN_LINES) as u8],
        Event::Health {
            input, from, to, ..
        } => [1, input as u8, from as u8, to as u8],
        Event::State {
            from,
            to,
            waits_for_wheels,
            ..
        } => [9, from as u8, to as u8, u8::from(waits_for_wheels)],
        Event::Opinion { from, to, .. } => [18, from as u8, to as u8, 0],
        Event::Fitness { why_unfit, .. } => [15, unfit_number(why_unfit), 0, 0],
        Event::Dissent {
            input,
            source,
            against,
        } => {
            let word = 10 + u8::from(against.is_some());
            [word, input as u8, 0, (source % OWN_LINES) as u8]
        }
        Event::Decided {
            input,
            source,
            decision,
            ..
        } => {
            let word = decision_number(&decision);
            [12, input as u8, word, (source % OWN_LINES) as u8]
        }
        Event::Canopen(event) => canopen_kind(event),
        Event::Slips(slip) => [13, u8::from(slip.is_some()), 0, 0],
        Event::Gyro { news, .. } => {
            let word = match news {
                GyroNews::Known => 0,
                GyroNews::Slips => 1,
                GyroNews::Holds { .. } => 2,
                GyroNews::Wild { .. } => 3,
            };
            [16, word, 0, 0]
        }
        Event::Assist(news) => match news {
            News::Disagree { leaders: [a, b] } => {
                let [a, b] = [a, b].map(|it| (it.0 % OWN_LINES) as u8);
                [17, 0, a, b]
            }
            News::Mute(robot) => [17, 1, (robot.0 % OWN_LINES) as u8, 0],
            News::Answers(robot) => [17, 2, (robot.0 % OWN_LINES) as u8, 0],
            News::Unheard => [17, 3, 0, 0],
        },
        Event::Bus { from, to } => [2, from as u8, to as u8, 0],
        Event::Contested { input, state } => {
            let [high, low] = state.number.to_be_bytes();
            [8, input as u8, high, low]
        }
        Event::Missed { .. } => [3, 0, 0, 0],
        Event::ClockStepped(ClockStep { clock, .. }) => [4, clock as u8, 0, 0],
        Event::NoRoom { .. } => [5, 0, 0, 0],
        Event::Lost { .. } => [6, 0, 0, 0],
        Event::Belief { .. } | Event::Timing(_) | Event::Recorded(_) | Event::Account(_) => {
            [7, 0, 0, 0]
        }
    }
}

fn unfit_number(why: Option<WhyUnfit>) -> u8 {
    match why {
        None => 0,
        Some(WhyUnfit::Belief(_)) => 1,
        Some(WhyUnfit::Position { .. }) => 2,
        Some(WhyUnfit::Heading { .. }) => 3,
    }
}

fn canopen_kind(event: CanopenEvent) -> Kind {
    let (word, node) = match event {
        CanopenEvent::Booted(node) => (0, node),
        CanopenEvent::Operational(node) => (1, node),
        CanopenEvent::NotOperational(node) => (2, node),
        CanopenEvent::Missing(node) => (3, node),
        CanopenEvent::SyncTaken => (4, 0),
        CanopenEvent::SyncLeft => (5, 0),
    };
    [14, word, node, 0]
}

fn decision_number(decision: &Decision) -> u8 {
    match decision {
        Decision::Followed { .. } => 0,
        Decision::Dropped { .. } => 1,
        Decision::Widened { .. } => 2,
        Decision::SecondChance { .. } => 3,
        Decision::Anew { .. } => 4,
        Decision::Set { .. } => 5,
    }
}

/// Two of a kind as one.
fn added(before: Event, event: Event) -> Event {
    match (before, event) {
        (
            Event::Missed {
                deadlines: a,
                lateness_ns: b,
            },
            Event::Missed {
                deadlines,
                lateness_ns,
            },
        ) => Event::Missed {
            deadlines: a.saturating_add(deadlines),
            lateness_ns: b.max(lateness_ns),
        },
        (Event::ClockStepped(before), Event::ClockStepped(ClockStep { clock, by_ns })) => {
            Event::ClockStepped(ClockStep {
                clock,
                by_ns: before.by_ns.saturating_add(by_ns),
            })
        }
        (
            Event::NoRoom {
                overflowed: a,
                folded_early: b,
            },
            Event::NoRoom {
                overflowed,
                folded_early,
            },
        ) => Event::NoRoom {
            overflowed: a.saturating_add(overflowed),
            folded_early: b.saturating_add(folded_early),
        },
        (Event::Lost { events: a }, Event::Lost { events }) => Event::Lost {
            events: a.saturating_add(events),
        },
        (_, newer) => newer,
    }
}

#[cfg(test)]
mod tests {
    use coloc_shm_types::{BusState, Health, Input, Reject};

    use super::*;

    fn rejected(source: u16, reason: Reject) -> Event {
        Event::Rejected {
            input: Input::Position,
            source,
            reason,
            gated: None,
        }
    }

    /// How often each event is said, and with which count, if it comes at 50 Hz for eleven seconds.
    fn said(event: impl Fn() -> Event) -> Vec<(u64, String)> {
        let (mut throttle, start) = (Throttle::default(), Instant::now());
        let mut said = Vec::new();
        for tick in 0..550 {
            throttle.note(event());
            said.extend(throttle.due(start + Duration::from_millis(20) * tick));
        }
        said.extend(throttle.flush());
        let text = |(count, event)| (count, format!("{event:?}"));
        said.into_iter().map(text).collect()
    }

    #[test]
    fn every_kind_of_line_is_said_at_once_and_then_as_a_sum() {
        for event in EVENTS {
            let counts: Vec<u64> = said(event).iter().map(|(count, _)| *count).collect();
            assert_eq!(counts, [1, 250, 250, 49], "{:?}", event());
        }
    }

    #[test]
    fn two_kinds_are_never_added_up() {
        let mut throttle = Throttle::default();
        for event in EVENTS {
            throttle.note(event());
        }
        let said: Vec<_> = throttle.due(Instant::now()).collect();
        assert_eq!(said.len(), EVENTS.len(), "{said:?}");
    }

    const EVENTS: [fn() -> Event; 9] = [
        || Event::Fitness {
            why_unfit: None,
            tick: 7,
        },
        || Event::Gyro {
            news: GyroNews::Known,
            bias: 0.01,
            sigma: 0.001,
        },
        || rejected(3, Reject::Gated),
        || Event::Health {
            input: Input::Position,
            from: Health::Ok,
            to: Health::Stale,
            tick: 7,
        },
        || Event::Bus {
            from: BusState::Active,
            to: BusState::Off,
        },
        || Event::Missed {
            deadlines: 1,
            lateness_ns: 5,
        },
        || {
            Event::ClockStepped(ClockStep {
                clock: crate::config::ClockSource::Realtime,
                by_ns: 1,
            })
        },
        || Event::NoRoom {
            overflowed: 1,
            folded_early: 0,
        },
        || Event::Lost { events: 1 },
    ];

    #[test]
    fn what_is_counted_is_added_up() {
        let no_room = said(|| Event::NoRoom {
            overflowed: 2,
            folded_early: 1,
        });
        assert_eq!(
            no_room[1].1,
            "NoRoom { overflowed: 500, folded_early: 250 }"
        );
        let missed = said(|| Event::Missed {
            deadlines: 3,
            lateness_ns: 9,
        });
        assert_eq!(missed[1].1, "Missed { deadlines: 750, lateness_ns: 9 }");
    }

    #[test]
    fn another_kind_does_not_wait() {
        let (mut throttle, now) = (Throttle::default(), Instant::now());
        for &reason in Reject::ALL {
            throttle.note(rejected(0, reason));
            assert_eq!(throttle.due(now).count(), 1, "{reason}");
        }
    }

    #[test]
    fn every_source_has_its_line_and_a_flood_of_them_a_few() {
        let (mut throttle, now) = (Throttle::default(), Instant::now());
        for source in 0..16 {
            throttle.note(rejected(source, Reject::Gated));
            assert_eq!(throttle.due(now).count(), 1, "{source}");
        }
        (0..u16::MAX).for_each(|source| throttle.note(rejected(source, Reject::Gated)));
        assert_eq!(throttle.due(now).count(), 0);
        assert_eq!(throttle.flush().count(), 16);
    }
}
