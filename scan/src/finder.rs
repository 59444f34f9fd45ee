//! From a scan to the robots in it.

mod candidate;
mod judge;
mod names;
mod pattern;
mod place;
mod reading;
mod seen;
mod settings;
mod turned;
mod verdict;
mod window;

use crate::associate::{Associator, Odds, Pair};
use crate::beams::{Beams, ScannerMotion};
use crate::fit::Sample;
use crate::marks::{self, Mark};
use crate::pieces::{Piece, cut};
use crate::shape::Look;
use crate::view::{MOST_BEAMS, View};
use candidate::{Candidate, Candidates};
use place::Place;
use reading::Reading;
use turned::Likeness;

pub use place::Prior;
pub use seen::{RangeBearing, Seen};
pub use settings::{Noise, Settings};
pub use turned::OwnHeading;

/// As many robots of a team are looked for.
pub const MOST_ROBOTS: usize = 64;
const MOST_PAIRS: usize = 256;

/// What came of all scans, counted.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Scans.
    pub scans: u64,
    /// Bodies that look like a robot, where one may be.
    pub bodies: u64,
    /// Of these: said to be a robot.
    pub seen: u64,
    /// They may be more than one robot.
    pub ambiguous: u64,
    /// They may be nobody of the team.
    pub nobody: u64,
    /// What there was no room for.
    pub left_out: u64,
}

/// Finds robots in scans.
#[derive(Debug)]
pub struct Finder {
    settings: Settings,
    beams: Beams,
    pieces: Vec<Piece>,
    samples: Vec<Sample>,
    /// Of the window as it was first, while all of a body is looked at.
    aside: Vec<Sample>,
    marks: Vec<Mark>,
    places: Vec<Place>,
    candidates: Candidates,
    pairs: Vec<Pair>,
    readings: Vec<Reading>,
    /// Of each pair.
    likenesses: Vec<Likeness>,
    own_heading: OwnHeading,
    odds: Vec<Odds>,
    mixed: Vec<Odds>,
    associator: Associator,
    seen: Vec<Seen>,
    counts: Counts,
}

impl Finder {
    /// Takes all the memory that it needs.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        Self {
            settings,
            beams: Beams::new(),
            pieces: Vec::with_capacity(MOST_BEAMS),
            samples: Vec::with_capacity(MOST_BEAMS),
            aside: Vec::with_capacity(MOST_BEAMS),
            marks: Vec::with_capacity(marks::MOST_SEEN),
            places: Vec::with_capacity(MOST_ROBOTS),
            candidates: Candidates::new(),
            pairs: Vec::with_capacity(MOST_PAIRS),
            readings: Vec::with_capacity(MOST_PAIRS),
            likenesses: Vec::with_capacity(MOST_PAIRS),
            own_heading: OwnHeading::default(),
            odds: Vec::with_capacity(MOST_PAIRS),
            mixed: Vec::with_capacity(MOST_PAIRS),
            associator: Associator::new(MOST_ROBOTS, MOST_PAIRS),
            seen: Vec::with_capacity(MOST_ROBOTS),
            counts: Counts::default(),
        }
    }

    /// What it was made for.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// What came of all scans.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Everything in the last scan that looks like a robot where one may be: its middle and how many beams met it.
    pub fn bodies(&self) -> impl Iterator<Item = ([f64; 2], usize)> {
        self.candidates.all().iter().map(|candidate| {
            let centre = candidate.body().centre();
            ([centre.x, centre.y], candidate.beams)
        })
    }

    /// The robots of `team` that are in a scan, while the scanner moves like that. Allocates nothing.
    pub fn find(&mut self, view: &View<'_>, motion: ScannerMotion, team: &[Prior]) -> &[Seen] {
        self.find_turned(view, motion, team, OwnHeading::default())
    }

    /// The same where the own heading is uncertain, so that all priors may be off by one angle.
    pub fn find_turned(
        &mut self,
        view: &View<'_>,
        motion: ScannerMotion,
        team: &[Prior],
        own_heading: OwnHeading,
    ) -> &[Seen] {
        self.own_heading = own_heading;
        self.counts.scans += 1;
        self.seen.clear();
        self.candidates.clear();
        self.settle(team);
        self.beams.fill(view, motion);
        self.counts.left_out += cut(&self.beams, self.settings.farthest_m, &mut self.pieces);
        for look in 0..self.settings.looks.len() {
            if !self.places.iter().any(|place| place.prior.look == look) {
                continue;
            }
            match self.settings.looks[look] {
                Look::Marks(pattern) => self.look_for_marks(look, &pattern),
                _ => self.look_through(look),
            }
        }
        self.counts.bodies += self.candidates.all().len() as u64;
        self.pair();
        self.tell();
        &self.seen
    }

    /// Where robots are looked for: priors that can be computed with.
    fn settle(&mut self, team: &[Prior]) {
        self.places.clear();
        for prior in team {
            if self.places.len() == MOST_ROBOTS {
                self.counts.left_out += 1;
                continue;
            }
            let place = Place::of(prior, &self.settings.looks, &self.own_heading);
            self.places.extend(place);
        }
    }

    /// Whether what `may_be` asks holds for a robot that looks so.
    fn are_places(&self, look: usize, may_be: impl Fn(&Place) -> bool) -> bool {
        let mut places = self.places.iter().filter(|it| it.prior.look == look);
        places.any(may_be)
    }

    fn keep(&mut self, candidate: &Candidate) {
        self.counts.left_out += u64::from(!self.candidates.keep(candidate));
    }
}
