//! The search where every leader knows all readings: one tree for each leader, each directed reading in at most one of them.
//!
//! All leaders take turns, one level of their trees at a time, the surest first. So each leader gives a child at most one pose, by the
//! shortest way that is left, and no reading is in the poses of two. Leaders do not relay. Every leader comes to the same trees, if
//! they know the same readings and traces.

use super::team::{MOST_LEADERS, MOST_ROBOTS, Place, Robots, Team};
use crate::list::FixedList;

/// Whom each robot sees at one event.
#[derive(Copy, Clone, Debug)]
pub struct Graph {
    sees: [Robots; MOST_ROBOTS],
}

/// From one robot of a tree to the next.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Edge {
    /// Who sees.
    pub parent: Place,
    /// Who is seen: it gets a pose.
    pub child: Place,
    /// Degree of observation: how many sightings the pose is made of.
    pub degree: u8,
}

/// What one leader reaches, in the order in which it was found: parents come before their children.
#[derive(Copy, Clone, Debug)]
pub struct Tree {
    leader: Place,
    edges: FixedList<Edge, MOST_ROBOTS>,
    /// The leader and all children that are in it.
    visited: Robots,
    /// Where the level begins that was found last; before the first, the leader itself is that level.
    level: Option<usize>,
}

/// The trees of all leaders.
#[derive(Copy, Clone, Debug)]
pub struct Forest {
    trees: FixedList<Tree, MOST_LEADERS>,
}

impl Default for Graph {
    fn default() -> Self {
        Self {
            sees: [Robots::NONE; MOST_ROBOTS],
        }
    }
}

impl Graph {
    /// With a reading of `observed` by `observer`.
    pub fn see(&mut self, observer: Place, observed: Place) {
        if let Some(seen) = self.sees.get_mut(observer.index()) {
            *seen = seen.with(observed);
        }
    }

    /// Whom it sees.
    #[must_use]
    pub fn seen_by(&self, observer: Place) -> Robots {
        let seen = self.sees.get(observer.index());
        seen.copied().unwrap_or_default()
    }
}

/// Sorts leaders by the traces of their covariances, of equal ones the smaller number first.
pub fn by_priority(leaders: &mut [(f64, Place)]) {
    leaders.sort_unstable_by(|(a, one), (b, other)| a.total_cmp(b).then(one.cmp(other)));
}

impl Tree {
    fn new(leader: Place) -> Self {
        Self {
            leader,
            edges: FixedList::new(Edge::default()),
            visited: Robots::only(leader),
            level: None,
        }
    }

    /// Whose tree it is.
    #[must_use]
    pub fn leader(&self) -> Place {
        self.leader
    }

    /// Its edges.
    #[must_use]
    pub fn edges(&self) -> &[Edge] {
        self.edges.as_slice()
    }

    /// Whether the child gets a pose.
    #[must_use]
    pub fn reaches(&self, child: Place) -> bool {
        self.visited.contains(child)
    }

    /// One level more; whether there was any.
    fn grow(&mut self, free: &mut Graph) -> bool {
        let found = self.edges().len();
        let Some(level) = self.level.replace(found) else {
            self.grow_from(self.leader, 1, free);
            return true;
        };
        for index in level..found {
            if let Some(Edge { child, degree, .. }) = self.edges().get(index).copied() {
                self.grow_from(child, degree.saturating_add(1), free);
            }
        }
        level < found
    }

    fn grow_from(&mut self, parent: Place, degree: u8, free: &mut Graph) {
        let Some(seen) = free.sees.get_mut(parent.index()) else {
            return;
        };
        let next = seen.without(self.visited);
        *seen = seen.without(next);
        for child in next.each() {
            // There is room: a child is visited once.
            let _ = self.edges.push(Edge {
                parent,
                child,
                degree,
            });
            self.visited = self.visited.with(child);
        }
    }
}

impl Forest {
    /// Of the leaders in the order of their priority; others than the team's leaders have no tree.
    #[must_use]
    pub fn new(team: &Team, graph: &Graph, leaders: &[Place]) -> Self {
        let mut free = Graph {
            sees: graph.sees.map(|seen| seen.and(team.children())),
        };
        let mut trees = FixedList::new(Tree::new(Place::default()));
        for leader in leaders {
            if team.leaders().contains(*leader) {
                let _ = trees.push(Tree::new(*leader)); // There is room for all that a team may have.
            }
        }
        let mut grows = true;
        while grows {
            grows = false;
            for tree in trees.as_mut_slice() {
                grows |= tree.grow(&mut free);
            }
        }
        Self { trees }
    }

    /// In the order of priority.
    #[must_use]
    pub fn trees(&self) -> &[Tree] {
        self.trees.as_slice()
    }
}
