//! What somebody should know of a team.

use super::team::{Place, Robots, Team};
use crate::kind::RobotId;
use crate::list::FixedList;

/// So much of it in one tick; more is in the counters.
const MOST_NEWS: usize = 16;

/// After so many time-outs without an answer in between a robot counts as mute.
const SILENCES: u8 = 5;

/// Of a tick.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum News {
    /// These leaders know different things of one event, where leaders know all readings.
    Disagree {
        /// Of whom a datum was taken, and of whom one has come.
        leaders: [RobotId; 2],
    },
    /// A child is seen, is told where it is, and does not answer.
    Mute(RobotId),
    /// It does again.
    Answers(RobotId),
    /// This child was never told where it is, for as long as it should have been.
    Unheard,
}

/// Who answers and who does not.
#[derive(Clone, Debug)]
pub(super) struct Answering {
    silences: [u8; 64],
    news: FixedList<News, MOST_NEWS>,
}

impl Default for Answering {
    fn default() -> Self {
        Self {
            silences: [0; 64],
            news: FixedList::new(News::Unheard),
        }
    }
}

impl Answering {
    /// A tick begins.
    pub(super) fn begin(&mut self) {
        self.news.clear();
    }

    pub(super) fn news(&self) -> &[News] {
        self.news.as_slice()
    }

    pub(super) fn say(&mut self, news: News) {
        let _ = self.news.push(news); // What finds no room is counted.
    }

    /// These did not answer in time.
    pub(super) fn silent(&mut self, team: &Team, children: Robots) {
        for child in children.each() {
            let Some(silences) = self.silences.get_mut(child.index()) else {
                continue;
            };
            *silences = silences.saturating_add(1);
            if *silences == SILENCES {
                self.say(News::Mute(team.id(child)));
            }
        }
    }

    /// This one did, however late.
    pub(super) fn answered(&mut self, team: &Team, child: Place) {
        let Some(silences) = self.silences.get_mut(child.index()) else {
            return;
        };
        if core::mem::take(silences) >= SILENCES {
            self.say(News::Answers(team.id(child)));
        }
    }

    /// How many are mute, and the first of them.
    pub(super) fn mutes(&self, team: &Team) -> (u16, RobotId) {
        let all = team.children().each();
        let mut mute = all.filter(|it| {
            let silences = self.silences.get(it.index());
            silences.is_some_and(|it| *it >= SILENCES)
        });
        let first = mute.next();
        let more = u16::try_from(mute.count()).unwrap_or(u16::MAX);
        first.map_or((0, RobotId(0)), |it| (more.saturating_add(1), team.id(it)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_is_silent_five_times_is_mute_until_it_answers() {
        let ids = [RobotId(1), RobotId(7), RobotId(9)];
        let team = Team::new(&ids[..1], &ids[1..]).unwrap();
        let child = team.place(RobotId(9)).unwrap();
        let mut answering = Answering::default();
        (0..4).for_each(|_| answering.silent(&team, Robots::only(child)));
        answering.answered(&team, child);
        (0..4).for_each(|_| answering.silent(&team, Robots::only(child)));
        assert_eq!((answering.mutes(&team).0, answering.news()), (0, &[][..]));
        (0..3).for_each(|_| answering.silent(&team, Robots::only(child)));
        assert_eq!(answering.news(), [News::Mute(RobotId(9))]);
        assert_eq!(answering.mutes(&team), (1, RobotId(9)));
        answering.begin();
        answering.answered(&team, child);
        assert_eq!(answering.news(), [News::Answers(RobotId(9))]);
        assert_eq!(answering.mutes(&team).0, 0);
    }
}
