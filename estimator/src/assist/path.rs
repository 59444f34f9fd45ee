//! The way of a datum: its leader, every child that it went through, and the one that it is for.

use super::refusal::Refusal;
use super::team::{Place, Robots, Team};
use crate::kind::RobotId;
use crate::list::FixedList;

/// A datum goes no further: its leader, and fifteen sightings.
pub const LONGEST_PATH: usize = 16;

/// At least a leader and a child, nobody twice, no leader after the first.
#[derive(Copy, Clone, Debug)]
pub struct Path {
    places: FixedList<Place, LONGEST_PATH>,
    robots: Robots,
    /// The one before the last, and the last.
    end: [Place; 2],
}

impl PartialEq for Path {
    fn eq(&self, other: &Self) -> bool {
        self.places() == other.places()
    }
}

impl Path {
    /// The first hop of a leader.
    #[must_use]
    pub fn first(leader: Place, child: Place) -> Self {
        let mut places = FixedList::new(leader);
        let _ = places.push(leader) && places.push(child); // There is room.
        Self {
            places,
            robots: Robots::only(leader).with(child),
            end: [leader, child],
        }
    }

    /// From the wire.
    ///
    /// # Errors
    /// Why it is none of this team's.
    pub fn new(team: &Team, ids: &[RobotId]) -> Result<Self, Refusal> {
        let [leader, child, rest @ ..] = ids else {
            return Err(Refusal::PathTooShort);
        };
        let leader = team.place(*leader).ok_or(Refusal::NotALeader)?;
        if !team.leaders().contains(leader) {
            return Err(Refusal::NotALeader);
        }
        let child = relay(team, *child)?;
        rest.iter()
            .try_fold(Self::first(leader, child), |path, id| {
                path.to(relay(team, *id)?)
            })
    }

    /// One hop more.
    ///
    /// # Errors
    /// It is too long already, or went there before.
    pub fn to(&self, child: Place) -> Result<Self, Refusal> {
        if self.robots.contains(child) {
            return Err(Refusal::Looped);
        }
        let mut longer = *self;
        if !longer.places.push(child) {
            return Err(Refusal::PathTooLong);
        }
        longer.robots = longer.robots.with(child);
        longer.end = [self.end[1], child];
        Ok(longer)
    }

    /// All of it.
    #[must_use]
    pub fn places(&self) -> &[Place] {
        self.places.as_slice()
    }

    /// Whose datum it is.
    #[must_use]
    pub fn leader(&self) -> Place {
        let first = self.places().first();
        first.copied().unwrap_or_default()
    }

    /// Who sends it.
    #[must_use]
    pub fn sender(&self) -> Place {
        self.end[0]
    }

    /// Whom it is for.
    #[must_use]
    pub fn end(&self) -> Place {
        self.end[1]
    }

    /// Degree of observation: how many sightings it is made of.
    #[must_use]
    pub fn hops(&self) -> usize {
        self.places().len() - 1
    }

    /// Whether it went there.
    #[must_use]
    pub fn goes_through(&self, place: Place) -> bool {
        self.robots.contains(place)
    }

    /// Whether it is full.
    #[must_use]
    pub fn is_longest(&self) -> bool {
        self.places().len() == LONGEST_PATH
    }
}

fn relay(team: &Team, id: RobotId) -> Result<Place, Refusal> {
    let place = team.place(id).ok_or(Refusal::UnknownRobot)?;
    if team.leaders().contains(place) {
        return Err(Refusal::LeaderRelays);
    }
    Ok(place)
}
