//! Lines of the recording, and where some of them are missing.

use super::losses::Teller;
use crate::config::Telemetry;
use crate::event::Event;
use crate::record::Record;

/// On the real-time thread's side.
#[derive(Debug)]
pub(super) struct Recording {
    wanted: bool,
    /// Lines that found no room since it was last told so.
    missing: u64,
}

impl Recording {
    pub(super) fn new(config: &Telemetry) -> Self {
        Self {
            wanted: !config.record.as_os_str().is_empty(),
            missing: 0,
        }
    }

    /// Hands lines on, if there is a recording.
    pub(super) fn lines(&mut self, lines: impl IntoIterator<Item = Record>, teller: &mut Teller) {
        if self.wanted {
            lines.into_iter().for_each(|line| self.line(line, teller));
        }
    }

    /// Where lines are missing, the recording says so before it goes on.
    fn line(&mut self, line: Record, teller: &mut Teller) {
        let tell = |line| teller.link.tell(Event::Recorded(line)).is_ok();
        let lines = self.missing;
        if (lines == 0 || tell(Record::Lost { lines })) && tell(line) {
            self.missing = 0;
        } else {
            self.missing += 1;
            teller.losses.events += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::event::Link;

    fn told(link: &Link) -> Vec<Record> {
        let events = std::iter::from_fn(|| link.next_event());
        let lines = events.filter_map(|event| match event {
            Event::Recorded(line) => Some(line),
            _ => None,
        });
        lines.collect()
    }

    #[test]
    fn where_lines_are_missing_the_recording_says_so_before_it_goes_on() {
        let link = Arc::new(Link::new());
        let mut teller = Teller::new(Arc::clone(&link));
        let mut recording = Recording {
            wanted: true,
            missing: 0,
        };
        let line = Record::Lost { lines: 99 };
        let (room, lost) = (Link::CAPACITY, 3);
        recording.lines(vec![line; room + lost], &mut teller);
        assert_eq!(teller.losses.events, lost as u64);
        assert_eq!(told(&link).len(), room);
        recording.lines([line; 2], &mut teller);
        let gap = Record::Lost { lines: lost as u64 };
        assert_eq!(told(&link), [gap, line, line]);
    }

    #[test]
    fn without_a_recording_nothing_is_handed_on() {
        let link = Arc::new(Link::new());
        let mut teller = Teller::new(Arc::clone(&link));
        let mut recording = Recording::new(&Telemetry::default());
        recording.lines([Record::Lost { lines: 1 }], &mut teller);
        assert_eq!(link.waiting(), 0);
    }
}
