//! How often a robot was told something by others: who is told nothing may be inside 3σ all the same, as its σ grows.

use std::collections::BTreeMap;

use coloc_shm_types::{Input, Status};

/// What others say of a robot, or answer it.
const WORDS: [Input; 4] = [Input::Neighbour, Input::Seen, Input::Answer, Input::Assist];
/// Of less time than that nothing can be said \[s\].
const LEAST_S: f64 = 3.0;

/// Of how much time something is known, and in how much of it others' words changed the belief.
#[derive(Clone, Debug, Default)]
pub(crate) struct Told {
    /// Of each session of the daemon: when it last said how many words there were \[s\].
    last: BTreeMap<u64, (f64, u64)>,
    known_s: f64,
    heard_s: f64,
    was_cut: bool,
}

impl Told {
    /// Takes in the counters of a daemon.
    pub(super) fn hear_status(&mut self, status: &Status, time_s: f64) {
        let words = WORDS.iter().map(|input| status.accepted_of(*input)).sum();
        self.hear(status.header.session, time_s, words);
    }

    /// So many words changed the belief until then.
    pub(super) fn hear(&mut self, session: u64, time_s: f64, words: u64) {
        let before = self.last.insert(session, (time_s, words));
        let Some((before_s, said)) = before.filter(|_| time_s > 0.0) else {
            return;
        };
        let passed_s = time_s - before_s.max(0.0);
        self.known_s += passed_s;
        if words > said {
            self.heard_s += passed_s;
        }
    }

    /// Nobody could reach it: that time does not count.
    pub(super) fn pass_over(&mut self) {
        self.last.clear();
        self.was_cut = true;
    }

    /// Share of the time in which it was told something, if it drove for so long; none where nothing can be said.
    pub(super) fn share(&self, drove_s: f64) -> Option<f64> {
        let is_short = drove_s < LEAST_S || (self.was_cut && self.known_s < LEAST_S);
        (!is_short).then(|| self.heard_s / self.known_s.max(LEAST_S))
    }
}

#[cfg(test)]
mod tests {
    use coloc_shm_types::Header;

    use super::*;

    fn heard(words: &[u64]) -> Told {
        let mut told = Told::default();
        for (second, words) in (0_u32..).zip(words) {
            told.hear(1, f64::from(second), *words);
        }
        told
    }

    fn is(share: Option<f64>, expected: f64) -> bool {
        share.is_some_and(|it| (it - expected).abs() < 1e-12)
    }

    #[test]
    fn seconds_with_a_word_count_and_those_without_do_not() {
        assert!(is(heard(&[0, 5, 5, 9, 10]).share(4.0), 0.75));
        assert!(is(heard(&[7; 10]).share(9.0), 0.0));
    }

    #[test]
    fn who_was_not_heard_of_was_told_nothing_unless_it_was_short_or_cut_off() {
        assert!(is(Told::default().share(30.0), 0.0));
        assert_eq!(heard(&[0, 1]).share(1.0), None);
        let mut cut = Told::default();
        cut.pass_over();
        assert_eq!(cut.share(30.0), None);
    }

    #[test]
    fn what_passes_while_nobody_can_be_reached_does_not_count() {
        let mut told = heard(&[0, 1, 2, 3, 4]);
        told.pass_over();
        told.hear(1, 20.0, 4);
        told.hear(1, 21.0, 5);
        assert!(is(told.share(21.0), 1.0));
    }

    #[test]
    fn a_daemon_that_starts_again_counts_from_zero() {
        let mut told = heard(&[0, 4, 8]);
        told.hear(2, 5.0, 0);
        told.hear(2, 6.0, 3);
        assert!(is(told.share(6.0), 1.0));
    }

    #[test]
    fn words_of_others_are_counted_and_those_of_own_sensors_are_not() {
        let mut told = Told::default();
        let mut status = Status {
            header: Header::default(),
            ..Status::default()
        };
        let kinds = [
            (Input::Seen, 0.0),
            (Input::Seen, 1.0),
            (Input::Position, 1.0),
            (Input::RelativePose, 1.0),
            (Input::Answer, 2.0),
        ];
        for (second, (input, expected)) in (0_u32..).zip(kinds) {
            status.accepted[input as usize] += 1;
            told.hear_status(&status, f64::from(second));
            let off: f64 = told.heard_s - expected;
            assert!(off.abs() < 1e-12, "{input:?} {off}");
        }
    }
}
