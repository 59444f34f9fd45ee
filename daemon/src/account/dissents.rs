//! Who stands against the belief: told when somebody begins to, and when somebody no longer does.

use coloc_estimator::{Dissent, Stamp};
use coloc_shm_types::Input;

use super::losses::Teller;
use super::verdicts::input;
use crate::event::{Against, Event};

/// So many sources are judged at a time.
const MOST: usize = 16;

/// At the last tick.
#[derive(Debug)]
pub(super) struct Dissents {
    those: [(Input, u16); MOST],
    count: usize,
}

impl Default for Dissents {
    /// Nobody does.
    fn default() -> Self {
        Self {
            those: [(Input::Position, 0); MOST],
            count: 0,
        }
    }
}

impl Dissents {
    /// At `now`; true if these are others than before.
    pub(super) fn update(&mut self, now_are: &[Dissent], now: Stamp, teller: &mut Teller) -> bool {
        if now_are.is_empty() && self.count == 0 {
            return false;
        }
        for (who, dissent) in now_are.iter().map(|it| (of(it), it)) {
            if !self.those().contains(&who) {
                tell(who, Some(against(dissent, now)), teller);
            }
        }
        for who in self.those() {
            if !now_are.iter().any(|it| of(it) == *who) {
                tell(*who, None, teller);
            }
        }
        self.replace(now_are)
    }

    pub(super) fn those(&self) -> &[(Input, u16)] {
        self.those.get(..self.count).unwrap_or_default()
    }

    fn replace(&mut self, now_are: &[Dissent]) -> bool {
        let mut new = Self::default();
        for (place, dissent) in new.those.iter_mut().zip(now_are) {
            *place = of(dissent);
            new.count += 1;
        }
        let changed = new.those() != self.those();
        *self = new;
        changed
    }
}

fn of(dissent: &Dissent) -> (Input, u16) {
    (input(dissent.source.kind), dissent.source.number)
}

fn against(dissent: &Dissent, now: Stamp) -> Against {
    Against {
        for_ns: (now - dissent.since).as_nanos(),
        distance_m: dissent.distance_m,
        d2: dissent.d2,
    }
}

fn tell((input, source): (Input, u16), against: Option<Against>, teller: &mut Teller) {
    teller.tell(Event::Dissent {
        input,
        source,
        against,
    });
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use coloc_estimator::{Kind, Source};

    use super::*;
    use crate::event::Link;

    fn dissent(number: u16) -> Dissent {
        Dissent {
            source: Source::new(Kind::Fix, number),
            since: Stamp::from_nanos(1_000),
            d2: 40.0,
            distance_m: 3.0,
        }
    }

    #[test]
    fn it_is_told_once_when_one_begins_and_when_one_ends() {
        let link = Arc::new(Link::new());
        let mut teller = Teller::new(Arc::clone(&link));
        let mut dissents = Dissents::default();
        let now = Stamp::from_nanos(3_000);
        assert!(!dissents.update(&[], now, &mut teller));
        assert!(dissents.update(&[dissent(1)], now, &mut teller));
        assert!(!dissents.update(&[dissent(1)], now, &mut teller));
        assert!(dissents.update(&[dissent(2)], now, &mut teller));
        assert_eq!(dissents.those(), [(Input::Position, 2)]);
        let mut told = Vec::new();
        while let Some(Event::Dissent {
            source, against, ..
        }) = link.next_event()
        {
            told.push((source, against.map(|it| it.for_ns)));
        }
        assert_eq!(told, [(1, Some(2_000)), (2, Some(2_000)), (1, None)]);
    }
}
