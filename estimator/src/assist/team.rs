//! Who is in the team, by places in its list: one bit of a mask for each robot.
//!
//! Places ascend as the robots' numbers do, so that all that goes by ascending numbers goes by ascending bits. On the wire are numbers.

use core::fmt;

use crate::kind::RobotId;
use crate::list::FixedList;

/// So many robots have a place.
pub const MOST_ROBOTS: usize = 64;

/// So many of them may lead.
pub const MOST_LEADERS: usize = 8;

/// A robot's place in the list, below [`MOST_ROBOTS`].
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Place(u8);

/// A leader's place among the leaders, below [`MOST_LEADERS`].
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Rank(u8);

/// Robots, a bit for each place.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Robots(u64);

/// The list.
#[derive(Copy, Clone, Debug)]
pub struct Team {
    ids: FixedList<RobotId, MOST_ROBOTS>,
    leaders: Robots,
}

/// Why lists of leaders and children are no team.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum NotATeam {
    /// Nobody leads.
    NoLeader,
    /// More than [`MOST_LEADERS`] lead.
    TooManyLeaders,
    /// More than [`MOST_ROBOTS`] are listed.
    TooManyRobots,
    /// This robot is listed twice.
    Twice(RobotId),
}

impl fmt::Display for NotATeam {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoLeader => f.write_str("no robot of the team is a leader"),
            Self::TooManyLeaders => write!(f, "more than {MOST_LEADERS} robots are leaders"),
            Self::TooManyRobots => write!(f, "the team has more than {MOST_ROBOTS} robots"),
            Self::Twice(RobotId(id)) => {
                write!(f, "robot {id} is listed twice as a leader or a child")
            }
        }
    }
}

impl core::error::Error for NotATeam {}

impl Place {
    #[inline]
    pub(super) fn index(self) -> usize {
        usize::from(self.0)
    }
}

impl Rank {
    #[inline]
    pub(super) fn index(self) -> usize {
        usize::from(self.0)
    }
}

impl Robots {
    /// Nobody.
    pub const NONE: Self = Self(0);

    /// This one alone.
    #[must_use]
    pub fn only(place: Place) -> Self {
        Self(1 << place.0)
    }

    /// Whether it is among them.
    #[must_use]
    pub fn contains(self, place: Place) -> bool {
        self.0 & Self::only(place).0 != 0
    }

    /// With one more.
    #[must_use]
    pub fn with(self, place: Place) -> Self {
        Self(self.0 | Self::only(place).0)
    }

    /// Those of them that are among the `others` too.
    #[must_use]
    pub fn and(self, others: Self) -> Self {
        Self(self.0 & others.0)
    }

    /// Those of them that are not among the `others`.
    #[must_use]
    pub fn without(self, others: Self) -> Self {
        Self(self.0 & !others.0)
    }

    /// How many they are.
    #[must_use]
    pub fn count(self) -> usize {
        self.0.count_ones() as usize
    }

    /// All of them, by ascending numbers.
    pub fn each(self) -> impl Iterator<Item = Place> {
        let mut left = self.0;
        core::iter::from_fn(move || {
            if left == 0 {
                return None;
            }
            #[allow(clippy::cast_possible_truncation)] // Below 64.
            let place = left.trailing_zeros() as u8;
            left &= left - 1;
            Some(Place(place))
        })
    }
}

impl Team {
    /// Of these leaders and children, in whatever order.
    ///
    /// # Errors
    /// Why they are none.
    pub fn new(leaders: &[RobotId], children: &[RobotId]) -> Result<Self, NotATeam> {
        if leaders.is_empty() {
            return Err(NotATeam::NoLeader);
        }
        if leaders.len() > MOST_LEADERS {
            return Err(NotATeam::TooManyLeaders);
        }
        let mut ids = FixedList::new(RobotId(0));
        let mut last = None;
        while let Some(id) = next_after([leaders, children], last) {
            let listed = [leaders, children].map(|list| list.iter().filter(|it| **it == id));
            if listed.into_iter().flatten().count() > 1 {
                return Err(NotATeam::Twice(id));
            }
            if !ids.push(id) {
                return Err(NotATeam::TooManyRobots);
            }
            last = Some(id);
        }
        let team = Self {
            ids,
            leaders: Robots::NONE,
        };
        let places = leaders.iter().filter_map(|id| team.place(*id));
        let leaders = places.fold(Robots::NONE, Robots::with);
        Ok(Self { leaders, ..team })
    }

    /// Where it is in the list.
    #[must_use]
    pub fn place(&self, id: RobotId) -> Option<Place> {
        let found = self.ids.as_slice().binary_search(&id).ok()?;
        u8::try_from(found).ok().map(Place)
    }

    /// Who it is.
    #[must_use]
    pub fn id(&self, place: Place) -> RobotId {
        let id = self.ids.as_slice().get(place.index());
        id.copied().unwrap_or_default()
    }

    /// The leaders.
    #[must_use]
    pub fn leaders(&self) -> Robots {
        self.leaders
    }

    /// All others.
    #[must_use]
    pub fn children(&self) -> Robots {
        let all = match self.ids.as_slice().len() {
            MOST_ROBOTS => u64::MAX,
            some => (1 << some) - 1,
        };
        Robots(all).without(self.leaders)
    }

    /// Its place among the leaders, if it is one.
    #[must_use]
    pub fn rank(&self, place: Place) -> Option<Rank> {
        let before = Robots(Robots::only(place).0 - 1);
        let rank = u8::try_from(self.leaders.and(before).count()).ok()?;
        self.leaders.contains(place).then_some(Rank(rank))
    }
}

/// The smallest number in the lists beyond `last`.
fn next_after(lists: [&[RobotId]; 2], last: Option<RobotId>) -> Option<RobotId> {
    let all = lists.into_iter().flatten().copied();
    all.filter(|id| last.is_none_or(|last| *id > last)).min()
}

#[cfg(test)]
mod tests {
    use super::*;

    const IDS: [RobotId; 4] = [RobotId(30), RobotId(2), RobotId(7), RobotId(5)];

    #[test]
    fn places_ascend_with_numbers() {
        let team = Team::new(&IDS[..2], &IDS[2..]).unwrap();
        let ids: [RobotId; 4] = core::array::from_fn(|i| team.ids.as_slice()[i]);
        assert_eq!(ids, [2, 5, 7, 30].map(RobotId));
        assert_eq!((team.leaders(), team.children()), (Robots(9), Robots(6)));
        let ranks = [2, 5, 30].map(|id| team.rank(team.place(RobotId(id)).unwrap()));
        assert_eq!(ranks, [Some(Rank(0)), None, Some(Rank(1))]);
        assert_eq!(team.place(RobotId(6)), None);
    }

    #[test]
    fn what_is_no_team_says_why() {
        let why = |leaders: &[RobotId], children: &[RobotId]| Team::new(leaders, children).err();
        assert_eq!(why(&[], &IDS), Some(NotATeam::NoLeader));
        assert_eq!(why(&IDS[..2], &IDS[1..]), Some(NotATeam::Twice(RobotId(2))));
        let many: [RobotId; 65] = core::array::from_fn(|i| RobotId(u16::try_from(i).unwrap()));
        assert_eq!(why(&many[..9], &many[9..]), Some(NotATeam::TooManyLeaders));
        assert_eq!(why(&many[..1], &many[1..]), Some(NotATeam::TooManyRobots));
        let full = Team::new(&many[..8], &many[8..64]).unwrap();
        assert_eq!(full.children().count(), 56);
    }
}
