//! One slot after another: what a team's evidence leaves, who is suspected, and whether an estimate can be right.

use crate::diagnosis::{Distance, membership};
use crate::evidence::{Area, DIRECTIONS, Evidence, Wheels};
use crate::heading::Link;
use crate::interval::AngleInterval;
use crate::mean::{Memory, Promise};
use crate::measurement::{Measurement, Refused};
use crate::polytope::{Arena, BadFrame, Polytope, Source};
use crate::simplex::NoVertex;
use crate::slot::{Closed, Suspect, Verdict, close};
use crate::team::{Pair, Sighting, Supports, Team};

/// In how many directions a sighting's box is supported, beside its own four.
const BOX_DIRECTIONS: usize = 8;

/// Added to each right-hand side: rounding of sines \[m\].
pub const SLACK_M: f64 = 1e-9;

/// In a larger team only pairs of the own robot are kept.
const MOST_OF_ALL_PAIRS: usize = 8;

/// After so many slots in a row that do not fit, everything is forgotten.
const MOST_VIOLATED: u32 = 20;

/// How it goes about it.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Settings {
    /// The robot whose monitor this is, from 0: in a large team its pairs alone are kept.
    pub own: usize,
    /// Length of a slot \[s\].
    pub slot_s: f64,
    /// How a robot can move of which nothing is heard.
    pub wheels: Wheels,
    /// A pair is kept for so many slots after one has seen the other.
    pub pair_slots: u64,
    /// Where everybody is at any rate.
    pub arena: Arena,
    /// Of the means of errors.
    pub means: Promise,
    /// While nothing is known, a fix is taken to be off by so much at least \[m\], and a compass \[rad\].
    pub initial: [f64; 2],
}

/// How things are after a slot.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Standing {
    /// All fits.
    Ok,
    /// It does not.
    Violated,
    /// Everything was forgotten, and nothing is known yet.
    Starting,
}

/// What came of a slot.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// After it.
    pub standing: Standing,
    /// Everything without which alone all fits. One is a finding, several are "one of these", none where it does not fit is "more than one".
    pub suspects: Vec<Suspect>,
    /// Of how many sightings and fixes nothing could be made.
    pub refused: Vec<Refused>,
    /// All sightings and fixes, without those of whom is suspected.
    pub measurements: Vec<Measurement>,
    /// All rows that were believed.
    pub believed: Polytope,
}

/// What is known of a team, slot by slot.
#[derive(Clone, Debug)]
pub struct Monitor {
    settings: Settings,
    /// After the last slot.
    pub team: Team,
    slot: u64,
    /// For each pair of `team`, when one saw the other.
    seen: Vec<u64>,
    violated: u32,
    starting: bool,
    memory: Memory,
    /// The means did not fit in the last slot.
    drifting: bool,
}

/// One sighting of a slot, and who has it.
#[derive(Copy, Clone, Debug)]
struct Said {
    sighting: Sighting,
    turn: AngleInterval,
}

impl Monitor {
    /// Of `robots` of which nothing is known.
    #[must_use]
    pub fn new(robots: usize, settings: Settings) -> Self {
        Self {
            settings,
            team: Team::new(robots, DIRECTIONS),
            slot: 0,
            seen: Vec::new(),
            violated: 0,
            starting: true,
            memory: Memory::new(settings.means),
            drifting: false,
        }
    }

    /// A robot is known to be in `area`, in the common frame, and to look along `heading`.
    pub fn place(&mut self, robot: usize, area: Area, heading: AngleInterval) {
        let Area { centre, half } = area;
        let mut region = Supports::zero(DIRECTIONS);
        let still = crate::team::Motion {
            velocity: centre,
            velocity_half: half,
            rate: 0.0,
            rate_half: 0.0,
            seconds: 1.0,
        };
        region.add_motion(&still, AngleInterval::new(0.0, 0.0));
        self.team.regions[robot] = region;
        self.team.headings[robot] = heading;
    }

    /// Whether nothing stops the region of `robot` but the arena.
    #[must_use]
    pub fn is_open(&self, robot: usize) -> bool {
        let region = self.team.regions[robot].values();
        region.iter().any(|it| it.is_infinite())
    }

    /// Closes a slot by what each robot tells of it; `None` of whom nothing was heard in time.
    ///
    /// # Errors
    /// If the arena means nothing.
    pub fn close(&mut self, evidence: &[Option<Evidence>]) -> Result<Outcome, BadFrame> {
        self.slot += 1;
        let unheard = Supports::disc(
            DIRECTIONS,
            self.settings.wheels.max_speed_mps * self.settings.slot_s,
        );
        let robots = self.team.regions.len();
        let of = |robot: usize| evidence.get(robot).and_then(Option::as_ref);
        let moved: Vec<_> = (0..robots)
            .map(|it| of(it).map_or(&unheard, |it| &it.moved).clone())
            .collect();
        self.team.predict(&moved);
        let said = self.said(evidence);
        let (said, mut suspects, mut fits) = self.turn(evidence, said);
        self.meet(&said);
        let sightings: Vec<_> = said.iter().map(|it| it.sighting).collect();
        if fits {
            // What contradicts the positions here, contradicts them in the rows too, and is named there.
            let _ = self.team.headings_from_positions(&sightings);
        }
        let mut measurements: Vec<_> = sightings
            .iter()
            .map(|it| self.team.measurement(it))
            .collect();
        let least = if self.starting {
            self.settings.initial[0]
        } else {
            0.0
        };
        let fixes = (0..robots).filter_map(|robot| {
            let Area { centre, half } = of(robot)?.fix?;
            let half = half.map(|it| it.max(least));
            Some(Measurement::Fix {
                robot,
                centre,
                half,
            })
        });
        measurements.extend(fixes);
        if !fits && suspects.is_empty() {
            measurements.clear();
        }
        let mut predicted = self.team.clone();
        let arena = self.settings.arena;
        let mut closed = close(&mut self.team, &measurements, arena, SLACK_M)?;
        if let Verdict::Violated {
            suspects: named, ..
        } = &closed.verdict
        {
            // Headings and positions do not fit: no single thing explains both.
            suspects = if fits { named.clone() } else { Vec::new() };
            fits = false;
        }
        if !fits {
            leave_out(&mut measurements, &suspects);
        }
        self.memory.hear(&measurements, robots);
        let named = (self.memory).judge(&measurements, robots, arena, SLACK_M)?;
        let is_new = !self.drifting;
        self.drifting = named.is_some();
        if let Some(named) = named.filter(|_| fits) {
            // All that was concluded may have been dragged along.
            let headings = core::mem::take(&mut predicted.headings);
            if is_new {
                self.forget();
            } else {
                self.team = predicted;
            }
            self.team.headings = headings;
            leave_out(&mut measurements, &named);
            let refused = core::mem::take(&mut closed.refused);
            closed = close(&mut self.team, &measurements, arena, SLACK_M)?;
            closed.refused = refused;
            (suspects, fits) = (named, false);
        }
        let Closed {
            refused, believed, ..
        } = closed;
        let standing = self.stand(fits, &suspects);
        Ok(Outcome {
            standing,
            suspects,
            refused: refused.into_iter().map(|it| it.1).collect(),
            measurements,
            believed,
        })
    }

    /// All that can be asked about.
    fn said(&self, evidence: &[Option<Evidence>]) -> Vec<Said> {
        let robots = self.team.regions.len();
        let of = |observer: usize| evidence[observer].iter().flat_map(|it| it.seen.iter());
        let all = (0..robots.min(evidence.len())).flat_map(|observer| {
            of(observer).map(move |seen| Said {
                sighting: Sighting {
                    observer,
                    observed: seen.observed,
                    centre: seen.area.centre,
                    half: seen.area.half,
                    directions: BOX_DIRECTIONS,
                },
                turn: seen.turn,
            })
        });
        all.filter(|it| {
            it.sighting.observed < robots && it.sighting.observed != it.sighting.observer
        })
        .collect()
    }

    /// Headings after the slot. What is left of the sightings, who is suspected, and whether all fits.
    fn turn(
        &mut self,
        evidence: &[Option<Evidence>],
        said: Vec<Said>,
    ) -> (Vec<Said>, Vec<Suspect>, bool) {
        if let Some(headings) = self.headings(evidence, &said, &[]) {
            self.team.headings = headings;
            return (said, Vec::new(), true);
        }
        let robots = 0..self.team.headings.len();
        let each = robots.flat_map(|it| [Suspect::Motion(it), Suspect::Compass(it)]);
        let one = said
            .iter()
            .map(|it| Suspect::Sighting(it.sighting.observer, it.sighting.observed));
        let mut suspects: Vec<_> = each
            .chain(one)
            .filter(|it| self.headings(evidence, &said, &[*it]).is_some())
            .collect();
        for robot in 0..self.team.headings.len() {
            let all = Suspect::Sightings(robot);
            let known = |it: &Suspect| matches!(it, Suspect::Sighting(of, _) if *of == robot);
            if !suspects.iter().any(known) && self.headings(evidence, &said, &[all]).is_some() {
                suspects.push(all);
            }
        }
        suspects.sort_unstable();
        // Without any of them, where there are some; without any measurement, where there is none.
        let left: Vec<_> = said
            .into_iter()
            .filter(|it| !suspects.iter().any(|suspect| names(*suspect, it)))
            .collect();
        let found = (!suspects.is_empty())
            .then(|| self.headings(evidence, &left, &suspects))
            .flatten();
        self.team.headings = found.unwrap_or_else(|| self.turned(evidence, &[]));
        (left, suspects, false)
    }

    /// Before anything is measured.
    fn turned(&self, evidence: &[Option<Evidence>], without: &[Suspect]) -> Vec<AngleInterval> {
        let Settings { wheels, slot_s, .. } = self.settings;
        let unheard = AngleInterval::new(0.0, wheels.max_turn_radps * slot_s);
        let robots = self.team.headings.iter().enumerate();
        robots
            .map(|(robot, heading)| {
                let turn = evidence.get(robot).and_then(Option::as_ref);
                if without.contains(&Suspect::Motion(robot)) {
                    AngleInterval::UNKNOWN
                } else {
                    heading.plus(&turn.map_or(unheard, |it| it.turn))
                }
            })
            .collect()
    }

    /// `None` if they do not fit.
    fn headings(
        &self,
        evidence: &[Option<Evidence>],
        said: &[Said],
        without: &[Suspect],
    ) -> Option<Vec<AngleInterval>> {
        let least = if self.starting {
            self.settings.initial[1]
        } else {
            0.0
        };
        let mut team = Team::new(self.team.headings.len(), DIRECTIONS);
        team.headings = self.turned(evidence, without);
        for (robot, of) in evidence.iter().enumerate() {
            let compass = of.as_ref().and_then(|it| it.compass);
            if let Some(compass) = compass
                && !without.contains(&Suspect::Compass(robot))
            {
                let half = compass.half.max(least);
                let compass = AngleInterval::new(compass.centre, half);
                team.compass(robot, compass).ok()?;
            }
        }
        let left = said
            .iter()
            .filter(|it| !without.iter().any(|suspect| names(*suspect, it)));
        let links: Vec<_> = left
            .map(|it| Link {
                from: it.sighting.observer,
                to: it.sighting.observed,
                turn: it.turn,
            })
            .collect();
        team.headings_from_links(&links).ok()?;
        Some(team.headings)
    }

    /// Pairs of whom one sees the other begin, those of whom none has for long end.
    fn meet(&mut self, said: &[Said]) {
        let Settings {
            own, pair_slots, ..
        } = self.settings;
        let of_all = self.team.regions.len() <= MOST_OF_ALL_PAIRS;
        for Said { sighting, .. } in said {
            let (i, j) = (
                sighting.observer.min(sighting.observed),
                sighting.observer.max(sighting.observed),
            );
            if !of_all && i != own && j != own {
                continue;
            }
            let known = self.team.pairs.iter().position(|it| (it.i, it.j) == (i, j));
            if let Some(known) = known {
                self.seen[known] = self.slot;
            } else {
                let region = Supports::unknown(DIRECTIONS);
                self.team.pairs.push(Pair { i, j, region });
                self.seen.push(self.slot);
            }
        }
        let slot = self.slot;
        let is_kept: Vec<_> = self.seen.iter().map(|it| it + pair_slots >= slot).collect();
        let mut kept = is_kept.iter();
        self.team.pairs.retain(|_| *kept.next().unwrap_or(&false));
        let mut kept = is_kept.iter();
        self.seen.retain(|_| *kept.next().unwrap_or(&false));
    }

    fn stand(&mut self, fits: bool, suspects: &[Suspect]) -> Standing {
        if fits {
            self.violated = 0;
            self.starting &= self.is_open(self.settings.own);
            return if self.starting {
                Standing::Starting
            } else {
                Standing::Ok
            };
        }
        self.violated += 1;
        if suspects.len() != 1 || self.violated >= MOST_VIOLATED {
            self.forget();
        }
        Standing::Violated
    }

    /// From scratch.
    fn forget(&mut self) {
        self.team = Team::new(self.team.regions.len(), DIRECTIONS);
        self.seen.clear();
        self.violated = 0;
        self.starting = true;
    }

    /// The corners of where `robot` must be, counter-clockwise \[m\]; `None` where only the arena stops it.
    #[must_use]
    pub fn polygon(&self, robot: usize) -> Option<Vec<[f64; 2]>> {
        let region = self.team.regions[robot].values();
        (!self.is_open(robot)).then(|| crate::polygon::of_supports(region))
    }
}

/// Of all of them, if nobody in particular is suspected.
fn leave_out(measurements: &mut Vec<Measurement>, suspects: &[Suspect]) {
    let is_meant = |place: usize| {
        let source = Source::Measurement(place);
        suspects.is_empty() || suspects.iter().any(|it| it.means(source, measurements))
    };
    let left = (0..measurements.len()).filter(|it| !is_meant(*it));
    *measurements = left.map(|it| measurements[it]).collect();
}

fn names(suspect: Suspect, said: &Said) -> bool {
    let Sighting {
        observer, observed, ..
    } = said.sighting;
    suspect == Suspect::Sighting(observer, observed) || suspect == Suspect::Sightings(observer)
}

/// How far an estimate that has `robot` somewhere in `area` is at least from where it can be \[m\]: zero inside.
///
/// # Errors
/// If nothing is believed, or the program fails.
pub fn distance(believed: &Polytope, robot: usize, area: &Area) -> Result<Distance, NoVertex> {
    let Distance { metres, at_least } = membership(believed, robot, area.centre)?;
    let room = area.half[0].max(area.half[1]);
    Ok(Distance {
        metres: (metres - room).max(0.0),
        at_least: (at_least - room).max(0.0),
    })
}

/// Whether a robot is where it is said to be.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub enum Contained {
    /// Nobody knows.
    #[default]
    Unknown,
    /// It can be.
    Yes,
    /// It cannot.
    No,
}

/// Slot by slot whether an estimate can be right, so that a single slot is no alarm.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Judge {
    /// So many slots outside in a row are an alarm.
    pub alarm_slots: u32,
    /// And so many inside end it.
    pub clear_slots: u32,
    outside: u32,
    inside: u32,
    contained: Contained,
}

impl Judge {
    /// Of an estimate of which nothing is known.
    #[must_use]
    pub fn new(alarm_slots: u32, clear_slots: u32) -> Self {
        Self {
            alarm_slots,
            clear_slots,
            outside: 0,
            inside: 0,
            contained: Contained::Unknown,
        }
    }

    /// Whether it cannot be right.
    #[must_use]
    pub fn is_alarm(&self) -> bool {
        self.contained == Contained::No
    }

    /// After a slot in which the estimate was outside, inside, or could not be judged.
    pub fn judge(&mut self, is_outside: Option<bool>) -> Contained {
        match is_outside {
            None => *self = Self::new(self.alarm_slots, self.clear_slots),
            Some(true) => {
                (self.outside, self.inside) = (self.outside.saturating_add(1), 0);
                if self.outside >= self.alarm_slots {
                    self.contained = Contained::No;
                }
            }
            Some(false) => {
                (self.outside, self.inside) = (0, self.inside.saturating_add(1));
                if self.contained != Contained::No || self.inside >= self.clear_slots {
                    self.contained = Contained::Yes;
                }
            }
        }
        self.contained
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evidence::{Gather, Seen};

    const WHEELS: Wheels = Wheels {
        speed_mps: 0.07,
        sideways_mps: 0.03,
        turn_radps: 0.7,
        max_speed_mps: 2.0,
        max_turn_radps: 3.0,
    };

    /// Three robots in a triangle that look along x and stand still.
    const TRUTH: [[f64; 2]; 3] = [[0.0, 0.0], [3.0, 0.0], [0.0, 3.0]];

    fn monitor() -> Monitor {
        promised(1.0)
    }

    fn promised(share: f64) -> Monitor {
        let settings = Settings {
            own: 0,
            slot_s: 0.5,
            wheels: WHEELS,
            pair_slots: 10,
            arena: Arena {
                centre: [0.0; 2],
                half: 1e4,
            },
            means: Promise {
                slots: 4,
                fixes: share,
                sightings: share,
            },
            initial: [0.3, 0.09],
        };
        Monitor::new(TRUTH.len(), settings)
    }

    fn evidence(monitor: &Monitor, robot: usize, fix: Option<[f64; 2]>) -> Evidence {
        let mut gather = Gather::begin(WHEELS, monitor.team.headings[robot]);
        for _ in 0..25 {
            gather.drive(&WHEELS.motion([0.0, 0.0], 0.02));
        }
        gather.turn_to(AngleInterval::new(0.01, 0.09));
        for (observed, at) in TRUTH.iter().enumerate().filter(|it| it.0 != robot) {
            let area = Area {
                centre: [at[0] - TRUTH[robot][0], at[1] - TRUTH[robot][1]],
                half: [0.3; 2],
            };
            let turn = AngleInterval::new(0.0, 0.05);
            gather.see(Seen {
                observed,
                area,
                turn,
            });
        }
        if let Some(centre) = fix {
            let half = [0.3; 2];
            gather.fix(Area { centre, half });
        }
        gather.end().0
    }

    fn honest(monitor: &Monitor) -> Vec<Option<Evidence>> {
        let fixes = [Some(TRUTH[0]), Some(TRUTH[1]), None];
        (0..3)
            .map(|it| Some(evidence(monitor, it, fixes[it])))
            .collect()
    }

    fn settled() -> Monitor {
        let mut monitor = monitor();
        for _ in 0..4 {
            let told = honest(&monitor);
            monitor.close(&told).unwrap();
        }
        monitor
    }

    #[test]
    fn a_team_finds_itself_by_its_fixes() {
        let mut monitor = monitor();
        assert!(monitor.is_open(2) && monitor.polygon(2).is_none());
        let told = honest(&monitor);
        let outcome = monitor.close(&told).unwrap();
        assert_eq!(outcome.standing, Standing::Ok);
        for (robot, at) in TRUTH.iter().enumerate() {
            let here = Area {
                centre: *at,
                half: [0.0; 2],
            };
            let away = Area {
                centre: [at[0] + 2.0, at[1]],
                half: [0.0; 2],
            };
            let far = |area| distance(&outcome.believed, robot, area).unwrap();
            assert!(far(&here).metres < 1e-9);
            assert!(far(&away).at_least > 0.5);
        }
    }

    #[test]
    fn a_fix_that_lies_is_named_alone_and_the_next_slot_tries_again() {
        let mut monitor = settled();
        let mut told = honest(&monitor);
        told[0] = Some(evidence(&monitor, 0, Some([3.0, 0.0])));
        let outcome = monitor.close(&told).unwrap();
        assert_eq!(outcome.standing, Standing::Violated);
        assert_eq!(outcome.suspects, [Suspect::Fix(0)]);
        let told = honest(&monitor);
        assert_eq!(monitor.close(&told).unwrap().standing, Standing::Ok);
    }

    /// Slots until the fix of the first robot, off by 0.6 m, is found; a single slot allows that. And the monitor after ten.
    fn off_by_a_little(share: f64) -> (Option<usize>, Monitor) {
        let mut monitor = promised(share);
        let mut found = None;
        for number in 0..14 {
            let mut told = honest(&monitor);
            if number >= 4 {
                told[0] = Some(evidence(&monitor, 0, Some([-0.6, 0.0])));
            }
            let outcome = monitor.close(&told).unwrap();
            if outcome.standing == Standing::Violated {
                assert!(outcome.suspects.contains(&Suspect::Fix(0)));
                found = found.or(Some(number - 4));
            }
        }
        (found, monitor)
    }

    #[test]
    fn what_a_single_slot_allows_does_not_fit_in_the_mean() {
        assert_eq!(off_by_a_little(1.0).0, None);
        let (found, mut monitor) = off_by_a_little(0.3);
        assert!(found.is_some_and(|it| it < 4), "{found:?}");
        assert!(monitor.is_open(0), "nobody knows which of two fixes lies");
        for _ in 0..4 {
            let told = honest(&monitor);
            monitor.close(&told).unwrap();
        }
        let told = honest(&monitor);
        assert_eq!(monitor.close(&told).unwrap().standing, Standing::Ok);
        assert!(!monitor.is_open(0));
    }

    #[test]
    fn who_begins_believes_a_fix_only_within_the_bounds_of_a_beginning() {
        let begun = |initial_m| {
            let mut monitor = monitor();
            monitor.settings.initial[0] = initial_m;
            let told = honest(&monitor);
            monitor.close(&told).unwrap();
            crate::polygon::area(&monitor.polygon(0).unwrap())
        };
        assert!(begun(0.6) > 1.5 * begun(0.3));
        assert!((begun(0.1) - begun(0.3)).abs() < 1e-12);
    }

    #[test]
    fn a_compass_that_lies_is_among_the_suspects() {
        let mut monitor = settled();
        let mut told = honest(&monitor);
        told[2].as_mut().unwrap().compass = Some(AngleInterval::new(2.0, 0.09));
        let outcome = monitor.close(&told).unwrap();
        assert_eq!(outcome.standing, Standing::Violated);
        assert_eq!(outcome.suspects, [Suspect::Compass(2)]);
        assert!(monitor.team.headings[2].contains(0.0, 0.0));
    }

    #[test]
    fn who_is_not_heard_of_grows_and_nobody_else() {
        let mut monitor = settled();
        let mut told = honest(&monitor);
        let area =
            |monitor: &Monitor, robot| crate::polygon::area(&monitor.polygon(robot).unwrap());
        let before = [0, 1, 2].map(|it| area(&monitor, it));
        told[2] = None;
        for of in told.iter_mut().flatten() {
            of.seen.retain(|it| it.observed != 2);
        }
        let outcome = monitor.close(&told).unwrap();
        assert_eq!(outcome.standing, Standing::Ok);
        assert!(area(&monitor, 2) > before[2] + 4.0);
        assert!(area(&monitor, 0) < before[0] + 0.2);
        for _ in 0..12 {
            monitor.close(&told).unwrap();
        }
        assert_eq!(monitor.team.pairs.len(), 1, "of those who see each other");
    }

    #[test]
    fn when_several_may_be_wrong_everything_is_forgotten() {
        let mut monitor = settled();
        let mut told = honest(&monitor);
        for robot in [0, 1] {
            let away = [
                TRUTH[robot][0] + 3.0,
                TRUTH[robot][1] - 9.0 * TRUTH[robot][0],
            ];
            told[robot] = Some(evidence(&monitor, robot, Some(away)));
        }
        let outcome = monitor.close(&told).unwrap();
        assert_eq!(outcome.standing, Standing::Violated);
        assert_ne!(outcome.suspects.len(), 1);
        assert!(monitor.is_open(0));
        let told = honest(&monitor);
        assert_eq!(monitor.close(&told).unwrap().standing, Standing::Ok);
    }

    #[test]
    fn robots_that_are_not_there_are_nobody() {
        let mut monitor = settled();
        let mut told = honest(&monitor);
        told[0].as_mut().unwrap().seen[0].observed = 9;
        told[1].as_mut().unwrap().seen[0].observed = 1;
        told[2].as_mut().unwrap().seen[0].area.half = [f64::NAN; 2];
        let outcome = monitor.close(&told).unwrap();
        assert_eq!(outcome.standing, Standing::Ok);
        assert_eq!(outcome.refused, [Refused::NotFinite]);
    }

    #[test]
    fn two_slots_outside_are_an_alarm_and_five_inside_its_end() {
        let mut judge = Judge::new(2, 5);
        let mut say = |it| judge.judge(Some(it));
        assert_eq!(say(false), Contained::Yes);
        assert_eq!(say(true), Contained::Yes);
        assert_eq!(say(true), Contained::No);
        for _ in 0..4 {
            assert_eq!(say(false), Contained::No);
        }
        assert_eq!(say(false), Contained::Yes);
        assert_eq!(judge.judge(None), Contained::Unknown);
    }
}
