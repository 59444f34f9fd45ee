//! What a leader knows of an event where all robots tell leaders what they see, and whom it reaches by that.
//!
//! Every leader that heard the same comes to the same trees ([`Forest`]), and says of each child in its own where that one is. What it knew
//! goes with that as a digest: leaders that heard something else say another one.

use super::datum::{Reading, carried, extend};
use super::digest::Digest;
use super::events::Terms;
use super::path::Path;
use super::readings::{Readings, Sight};
use super::refusal::Refusal;
use super::search::MOST_READINGS;
use super::slot::Slot;
use super::team::{MOST_LEADERS, MOST_ROBOTS, Place, Robots, Team};
use super::tree::{Edge, Forest, Graph, by_priority};
use crate::convert::GlobalPose;
use crate::list::FixedList;
use crate::stamp::{Span, Stamp};

/// So many robots may tell what they see: each child sees sixteen at most.
pub const MOST_SPEAKERS: usize = MOST_LEADERS + MOST_READINGS;

/// No robot is farther away \[m\].
const FARTHEST: f64 = 1e12;

/// What one robot said.
#[derive(Copy, Clone, Debug)]
struct Statement {
    speaker: Place,
    readings: Readings,
}

/// Of one event: the next one's words come when it is over.
#[derive(Clone, Debug)]
pub struct Gathered {
    slot: Option<Slot>,
    /// By ascending places.
    statements: FixedList<Statement, MOST_SPEAKERS>,
}

/// Where a child is, by one leader.
#[derive(Copy, Clone, Debug)]
pub struct Reached {
    /// When it is there.
    pub stamp: Stamp,
    /// The way to it.
    pub path: Path,
    /// Where.
    pub said: GlobalPose,
}

impl Default for Gathered {
    fn default() -> Self {
        let nobody = Statement {
            speaker: Place::default(),
            readings: Readings::default(),
        };
        Self {
            slot: None,
            statements: FixedList::new(nobody),
        }
    }
}

impl Gathered {
    /// Nothing is known any more.
    pub fn forget(&mut self) {
        self.slot = None;
        self.statements.clear();
    }

    /// The event of which something is known.
    #[must_use]
    pub fn slot(&self) -> Option<Slot> {
        self.slot
    }

    /// How many robots have said something of it.
    #[must_use]
    pub fn count(&self) -> usize {
        self.statements.as_slice().len()
    }

    /// Takes what a robot says. False if it has said something of the event before, that is not open any more, or there is no room;
    /// then nothing has changed.
    ///
    /// # Errors
    /// It cannot be what that robot sees at an event that is over now. Nothing has changed.
    pub fn hear(
        &mut self,
        terms: &Terms,
        speaker: Place,
        readings: &Readings,
        now: Stamp,
        is_open: bool,
    ) -> Result<bool, Refusal> {
        check(terms, speaker, readings, now)?;
        let is_older = self.slot.is_some_and(|slot| readings.slot < slot);
        if is_older || !is_open {
            return Ok(false);
        }
        let is_newer = self.slot != Some(readings.slot);
        let statements = if is_newer {
            &[]
        } else {
            self.statements.as_slice()
        };
        let Err(at) = statements.binary_search_by_key(&speaker, |it| it.speaker) else {
            return Ok(false);
        };
        if is_newer {
            self.forget();
            self.slot = Some(readings.slot);
        }
        Ok(self.statements.insert(
            at,
            Statement {
                speaker,
                readings: *readings,
            },
        ))
    }

    /// All that it knows.
    #[must_use]
    pub fn digest(&self) -> u32 {
        let mut digest = Digest::new();
        for Statement { speaker, readings } in self.statements.as_slice() {
            digest.add(speaker.index() as u64);
            digest.add(readings.trace.map_or(0, f64::to_bits));
            for sight in readings.sights() {
                digest.add(u64::from(sight.observed.0));
                digest.add(sight.since.as_nanos().unsigned_abs());
                let numbers = sight.reading.relative.to_vector();
                let covariance = sight.reading.covariance.to_row_major();
                let numbers = numbers.iter().chain(&covariance);
                numbers.for_each(|number| digest.add(number.to_bits()));
            }
        }
        digest.end()
    }

    /// The trees of all leaders.
    #[must_use]
    pub fn forest(&self, team: &Team) -> Forest {
        let mut graph = Graph::default();
        let mut leaders = FixedList::<_, MOST_LEADERS>::new((0.0, Place::default()));
        for Statement { speaker, readings } in self.statements.as_slice() {
            let seen = readings.sights().iter();
            let seen = seen.filter_map(|sight| team.place(sight.observed));
            seen.for_each(|child| graph.see(*speaker, child));
            if let Some(trace) = readings.trace {
                let _ = leaders.push((trace, *speaker)); // There is room for all that a team may have.
            }
        }
        by_priority(leaders.as_mut_slice());
        let mut places = [Place::default(); MOST_LEADERS];
        let count = leaders.as_slice().len();
        for (place, (_, leader)) in places.iter_mut().zip(leaders.as_slice()) {
            *place = *leader;
        }
        Forest::new(team, &graph, places.get(..count).unwrap_or(&[]))
    }

    /// Where the children of the leader `own`'s tree are. `first` says where a sighting of its own puts whom it saw.
    pub fn reach(
        &self,
        terms: &Terms,
        own: Place,
        first: impl Fn(Stamp, &Reading) -> Option<GlobalPose>,
        mut tell: impl FnMut(&Reached),
    ) {
        let Some(slot) = self.slot else {
            return;
        };
        let begin = terms.slots.begin(slot);
        let forest = self.forest(&terms.team);
        let Some(tree) = forest.trees().iter().find(|it| it.leader() == own) else {
            return;
        };
        let mut reached: [Option<Reached>; MOST_ROBOTS] = [None; MOST_ROBOTS];
        for edge in tree.edges() {
            let Some((by, sight)) = self.sight(&terms.team, *edge) else {
                continue;
            };
            let stamp = begin + sight.since;
            let next = if edge.parent == own {
                first(stamp, &sight.reading).map(|said| Reached {
                    stamp,
                    path: Path::first(own, edge.child),
                    said,
                })
            } else {
                let from = reached.get(edge.parent.index()).copied().flatten();
                let from = from.as_ref();
                from.and_then(|from| {
                    further(from, edge.child, (stamp, &sight.reading), by, terms, begin)
                })
            };
            if let (Some(next), Some(place)) = (next, reached.get_mut(edge.child.index())) {
                tell(&next);
                *place = Some(next);
            }
        }
    }

    fn sight(&self, team: &Team, edge: Edge) -> Option<(&Readings, &Sight)> {
        let statements = self.statements.as_slice();
        let at = statements.binary_search_by_key(&edge.parent, |it| it.speaker);
        let readings = &statements.get(at.ok()?)?.readings;
        let mut sights = readings.sights().iter();
        let sight = sights.find(|it| team.place(it.observed) == Some(edge.child))?;
        Some((readings, sight))
    }
}

/// One hop more. `None` where the robot in between does not say how it got from where it was seen to where it saw the next one.
fn further(
    from: &Reached,
    child: Place,
    (stamp, reading): (Stamp, &Reading),
    by: &Readings,
    terms: &Terms,
    begin: Stamp,
) -> Option<Reached> {
    let path = from.path.to(child).ok()?;
    let said = if from.stamp == stamp {
        from.said
    } else {
        let period_s = terms.slots.period().as_seconds();
        let [a, b] = [from.stamp, stamp].map(|it| (it - begin).as_seconds() / period_s);
        carried(&from.said, &by.trail?.between(a, b), terms.propagation)
    };
    Some(Reached {
        stamp,
        path,
        said: extend(&said, reading, terms.propagation),
    })
}

fn check(terms: &Terms, speaker: Place, readings: &Readings, now: Stamp) -> Result<(), Refusal> {
    let (team, slots) = (&terms.team, &terms.slots);
    if readings.trace.is_some() && !team.leaders().contains(speaker) {
        return Err(Refusal::NotALeader);
    }
    let is_over = slots.begin(readings.slot) + slots.period() <= now;
    if slots.of(readings.stamp) != readings.slot || !is_over {
        return Err(Refusal::WrongEvent);
    }
    let mut seen = Robots::only(speaker);
    for sight in readings.sights() {
        let child = team.place(sight.observed).ok_or(Refusal::UnknownRobot)?;
        if seen.contains(child) {
            return Err(Refusal::Looped);
        }
        if !team.children().contains(child) {
            return Err(Refusal::NotAChild);
        }
        seen = seen.with(child);
        if sight.since < Span::ZERO || sight.since >= slots.period() {
            return Err(Refusal::WrongEvent);
        }
    }
    if is_near(readings) {
        Ok(())
    } else {
        Err(Refusal::NotFinite)
    }
}

/// Whether all numbers are some. Covariances are by their type.
fn is_near(readings: &Readings) -> bool {
    let seen = readings.sights().iter().map(|it| it.reading.relative);
    let trail = readings.trail.iter().flat_map(|it| it.ends);
    let mut numbers = seen.chain(trail).flat_map(|it| [it.x, it.y, it.phi]);
    let trace = readings.trace.unwrap_or(0.0);
    trace.is_finite() && trace >= 0.0 && numbers.all(|it| it.abs() <= FARTHEST)
}
