//! Slots of the common clock, one after another: what was measured in each becomes evidence, that of the whole team a verdict.
//!
//! No clock and no I/O: everything is told with its moment on the common clock \[ns\].

use coloc_bounds::AngleInterval;
use coloc_bounds::evidence::{Area, Evidence, Gather, Seen};
use coloc_bounds::monitor::{Contained, Judge, Monitor, Outcome, Standing, distance};
use coloc_bounds::slot::Suspect;
use coloc_bounds::team::{Motion, Supports};
use coloc_shm_types as shm;

use crate::section::{Bounds, Integrity};

/// So much of what was measured waits at most.
const MOST_WAITING: usize = 8192;

/// After so many slots that nobody closed it begins anew.
const MOST_MISSED: i64 = 3;

/// A team that has not found itself after so many slots cannot: nothing bounds it.
const PATIENCE: u32 = 10;

/// Something of this robot, at a moment.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Event {
    /// The receiver has its antenna there, which is at a lever \[m\].
    Fix(Area, [f64; 2]),
    /// A neighbour is seen; the number is an index in the team.
    Seen(Seen),
    /// The compass says a heading \[rad\].
    Compass(f64),
    /// `colocd` believes to be there \[m\].
    Estimate([f64; 2]),
}

/// How the wheels say that it moved.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Moved {
    /// \[ns\]
    pub start_ns: i64,
    /// \[ns\]
    pub end_ns: i64,
    /// `[v_x, v_y, ω]` \[m/s, m/s, rad/s\].
    pub velocity: [f64; 3],
}

/// What is to be said. Headers have no sender yet, but the moment is in `stamp_ns`.
#[derive(Clone, Debug, PartialEq)]
pub enum Said {
    /// To the team.
    Evidence(Box<shm::Evidence>),
    /// To whoever wants to know.
    Integrity(Box<shm::Integrity>),
}

/// The slot that is going on and those before.
#[derive(Debug)]
pub struct Watch {
    own: usize,
    team: Vec<u16>,
    bounds: Bounds,
    slot_ns: i64,
    grace_ns: i64,
    /// Its number times its length is where it begins; `None` before the first.
    slot: Option<i64>,
    monitor: Monitor,
    judge: Judge,
    moved: Vec<Moved>,
    events: Vec<(i64, Event)>,
    /// Of the others, with the number of the slot.
    heard: Vec<(i64, usize, Evidence)>,
    /// Of this slot, once it was told.
    told: Option<Told>,
    open_slots: u32,
    /// Slots that were not closed in time.
    skipped: u64,
    closed: u64,
    last: shm::Integrity,
}

#[derive(Clone, Debug)]
struct Told {
    evidence: Evidence,
    judged: Option<(i64, Area)>,
}

impl Watch {
    /// Of robot `own`, by its number, in `team`.
    #[must_use]
    pub fn new(own: u16, others: &[u16], bounds: &Bounds, integrity: Integrity) -> Self {
        let mut team: Vec<u16> = others.iter().copied().chain([own]).collect();
        team.sort_unstable();
        team.dedup();
        let place = team.iter().position(|it| *it == own).unwrap_or_default();
        Self {
            own: place,
            monitor: Monitor::new(team.len(), bounds.settings(place)),
            team,
            slot_ns: nanos(bounds.slot_s),
            grace_ns: nanos(bounds.grace_s),
            bounds: bounds.clone(),
            slot: None,
            judge: Judge::new(integrity.alarm_slots, integrity.clear_slots),
            moved: Vec::new(),
            events: Vec::new(),
            heard: Vec::new(),
            told: None,
            open_slots: 0,
            skipped: 0,
            closed: 0,
            last: shm::Integrity::default(),
        }
    }

    /// The place of a robot in the team.
    #[must_use]
    pub fn place(&self, robot: u16) -> Option<usize> {
        self.team.iter().position(|it| *it == robot)
    }

    /// Slots closed, skipped, and the last word.
    #[must_use]
    pub fn closed(&self) -> (u64, u64, &shm::Integrity) {
        (self.closed, self.skipped, &self.last)
    }

    /// The wheels say something.
    pub fn hear_moved(&mut self, moved: Moved) {
        if moved.start_ns < moved.end_ns && self.moved.len() < MOST_WAITING {
            self.moved.push(moved);
        }
    }

    /// Another sensor, or `colocd`, says something of `at_ns`; whether its slot is still open.
    pub fn hear(&mut self, at_ns: i64, event: Event) -> bool {
        let is_open = self.own_begin_ns().is_none_or(|begin_ns| at_ns > begin_ns);
        let is_taken = is_open && self.events.len() < MOST_WAITING;
        if is_taken {
            self.events.push((at_ns, event));
        }
        is_taken
    }

    /// Where what this robot can still tell of begins.
    fn own_begin_ns(&self) -> Option<i64> {
        let slot = self.slot? + i64::from(self.told.is_some());
        Some(slot * self.slot_ns)
    }

    /// Another robot tells its evidence; whether its slot is still open.
    pub fn hear_evidence(&mut self, message: &shm::Evidence) -> bool {
        let (Some(robot), Ok(epoch)) = (
            self.place(message.header.source),
            i64::try_from(message.epoch),
        ) else {
            return false;
        };
        let slot = epoch.saturating_sub(1);
        let is_known = self
            .heard
            .iter()
            .any(|(of, who, _)| (*of, *who) == (slot, robot));
        let is_open = self
            .slot
            .is_some_and(|now| (now..=now + MOST_MISSED).contains(&slot));
        if is_open && !is_known {
            let evidence = self.evidence_of(message);
            self.heard.push((slot, robot, evidence));
        }
        is_open
    }

    /// Goes on to `now_ns`.
    pub fn step(&mut self, now_ns: i64) -> Vec<Said> {
        let mut said = Vec::new();
        let current = now_ns.div_euclid(self.slot_ns);
        let Some(slot) = self.slot else {
            // It begins with the first slot that is whole.
            self.slot = Some(current + 1);
            return said;
        };
        let late = now_ns - self.grace_ns - (slot + 1) * self.slot_ns;
        if late > MOST_MISSED * self.slot_ns || current + MOST_MISSED < slot {
            return vec![self.begin_anew(current)];
        }
        if late > self.slot_ns {
            self.skip(slot);
            return said;
        }
        if self.told.is_none() && late >= -self.grace_ns / 2 {
            let told = self.gather(slot);
            said.push(Said::Evidence(Box::new(
                self.message_of(slot, &told.evidence),
            )));
            self.told = Some(told);
        }
        if late >= 0 {
            said.push(Said::Integrity(Box::new(self.close(slot))));
        }
        said
    }

    /// The clock was set, or nobody looked for long.
    fn begin_anew(&mut self, current: i64) -> Said {
        self.skipped += 1;
        self.monitor = Monitor::new(self.team.len(), self.bounds.settings(self.own));
        self.judge.judge(None);
        self.moved.clear();
        self.events.clear();
        self.heard.clear();
        self.told = None;
        self.slot = Some(current + 1);
        self.open_slots = 0;
        let own = self.team[self.own];
        self.last = shm::Integrity {
            header: self.header(current * self.slot_ns),
            epoch: epoch(current - 1),
            robot: own,
            state: shm::Integrity::STALE,
            ..shm::Integrity::default()
        };
        Said::Integrity(Box::new(self.last))
    }

    fn header(&self, stamp_ns: i64) -> shm::Header {
        shm::Header {
            stamp_ns,
            source: self.team[self.own],
            ..shm::Header::default()
        }
    }

    /// Nothing is used that was measured in it: everybody can have moved.
    fn skip(&mut self, slot: i64) {
        self.skipped += 1;
        let nothing = vec![None; self.team.len()];
        // The arena of a configuration is one.
        let _ = self.monitor.close(&nothing);
        self.judge.judge(None);
        self.go_on(slot);
    }

    fn go_on(&mut self, slot: i64) {
        let end_ns = (slot + 1) * self.slot_ns;
        self.moved.retain(|it| it.end_ns > end_ns);
        self.events.retain(|it| it.0 > end_ns);
        self.heard.retain(|it| it.0 > slot);
        self.told = None;
        self.slot = Some(slot + 1);
    }

    /// What this robot knows of the slot.
    fn gather(&mut self, slot: i64) -> Told {
        let [begin_ns, end_ns] = [slot, slot + 1].map(|it| it * self.slot_ns);
        let heading = self.monitor.team.headings[self.own];
        let mut gather = Gather::begin(self.bounds.wheels(), heading);
        self.moved.sort_by_key(|it| (it.end_ns, it.start_ns));
        self.events.sort_by_key(|it| it.0);
        let mut at_ns = begin_ns;
        let mut judged_ns = None;
        for (moment_ns, event) in &self.events {
            if *moment_ns <= begin_ns || *moment_ns > end_ns {
                continue;
            }
            self.drive(&mut gather, at_ns, *moment_ns);
            at_ns = *moment_ns;
            match *event {
                Event::Fix(area, lever) => gather.fix_of_antenna(area, lever),
                Event::Seen(seen) => gather.see(seen),
                Event::Compass(heading) => {
                    gather.turn_to(AngleInterval::new(heading, self.bounds.compass_rad));
                }
                Event::Estimate(position) => {
                    gather.estimate(position);
                    judged_ns = Some(*moment_ns);
                }
            }
        }
        self.drive(&mut gather, at_ns, end_ns);
        let (evidence, judged) = gather.end();
        Told {
            evidence,
            judged: judged_ns.zip(judged),
        }
    }

    /// By the wheels, and where they say nothing by the fastest that there is.
    fn drive(&self, gather: &mut Gather, from_ns: i64, to_ns: i64) {
        let wheels = self.bounds.wheels();
        let mut at_ns = from_ns;
        let mut samples = self.moved.iter().filter(|it| it.end_ns > from_ns);
        let mut sample = samples.next();
        while at_ns < to_ns {
            let (until_ns, motion) = match sample {
                Some(it) if it.end_ns <= at_ns => {
                    sample = samples.next();
                    continue;
                }
                Some(it) if it.start_ns <= at_ns => {
                    let until_ns = it.end_ns.min(to_ns);
                    let [forward, sideways, rate] = it.velocity;
                    let motion = Motion {
                        velocity: [forward, sideways],
                        ..wheels.motion([forward, rate], seconds(until_ns - at_ns))
                    };
                    (until_ns, motion)
                }
                Some(it) => {
                    let until_ns = it.start_ns.min(to_ns);
                    (until_ns, wheels.unknown(seconds(until_ns - at_ns)))
                }
                None => (to_ns, wheels.unknown(seconds(to_ns - at_ns))),
            };
            gather.drive(&motion);
            at_ns = until_ns;
        }
    }

    fn close(&mut self, slot: i64) -> shm::Integrity {
        let told = self.told.take();
        let mut evidence = vec![None; self.team.len()];
        for (_, robot, of) in self.heard.iter().filter(|it| it.0 == slot) {
            evidence[*robot] = Some(of.clone());
        }
        evidence[self.own] = told.as_ref().map(|it| it.evidence.clone());
        self.closed += 1;
        let outcome = self.monitor.close(&evidence);
        let judged = told.and_then(|it| it.judged);
        self.last = match outcome {
            Ok(outcome) => self.word(slot, &outcome, judged),
            Err(_) => shm::Integrity::default(),
        };
        self.go_on(slot);
        self.last
    }

    fn word(
        &mut self,
        slot: i64,
        outcome: &Outcome,
        judged: Option<(i64, Area)>,
    ) -> shm::Integrity {
        let is_open = self.monitor.is_open(self.own);
        self.open_slots = if is_open { self.open_slots + 1 } else { 0 };
        let is_sure = outcome.standing == Standing::Ok && !is_open;
        let far = judged
            .filter(|_| is_sure)
            .and_then(|(_, area)| distance(&outcome.believed, self.own, &area).ok());
        let contained = self.judge.judge(far.map(|it| it.at_least > 0.0));
        let heading = self.monitor.team.headings[self.own];
        let end_ns = (slot + 1) * self.slot_ns;
        let mut word = shm::Integrity {
            header: self.header(end_ns),
            epoch: epoch(slot),
            judged_stamp_ns: far.and(judged).map_or(0, |it| it.0),
            distance_m: far.map_or(0.0, |it| it.at_least),
            heading: [heading.centre, heading.half],
            robot: self.team[self.own],
            state: self.state(outcome.standing, is_open, contained),
            contained: match contained {
                Contained::Unknown => shm::Integrity::UNKNOWN,
                Contained::Yes => shm::Integrity::YES,
                Contained::No => shm::Integrity::NO,
            },
            ..shm::Integrity::default()
        };
        for (place, suspect) in word.conflicts.iter_mut().zip(&outcome.suspects) {
            *place = self.suspect(*suspect, end_ns);
            word.conflict_count += 1;
        }
        self.region(&mut word, judged.filter(|_| is_sure));
        word
    }

    fn region(&self, word: &mut shm::Integrity, judged: Option<(i64, Area)>) {
        let Some(polygon) = self.monitor.polygon(self.own) else {
            return;
        };
        word.area_m2 = coloc_bounds::polygon::area(&polygon).max(0.0);
        for (place, vertex) in word.vertices.iter_mut().zip(&polygon) {
            *place = *vertex;
            word.vertex_count += 1;
        }
        if let Some((_, area)) = judged {
            let away = |it: &[f64; 2]| {
                let [x, y] = [it[0] - area.centre[0], it[1] - area.centre[1]];
                x.hypot(y)
            };
            word.protection_radius_m = polygon.iter().map(away).fold(0.0, f64::max);
        }
    }

    fn state(&self, standing: Standing, is_open: bool, contained: Contained) -> u8 {
        match standing {
            Standing::Violated => shm::Integrity::BOUNDS_VIOLATED,
            Standing::Starting if self.open_slots < PATIENCE => shm::Integrity::STARTING,
            _ if is_open => shm::Integrity::NOT_OBSERVABLE,
            _ if contained == Contained::No => shm::Integrity::ESTIMATE_OUTSIDE,
            _ => shm::Integrity::OK,
        }
    }

    fn suspect(&self, suspect: Suspect, stamp_ns: i64) -> shm::Suspect {
        let (kind, robot, other) = match suspect {
            Suspect::Fix(robot) => (shm::Suspect::FIX, robot, None),
            Suspect::Sightings(robot) => (shm::Suspect::SIGHTINGS, robot, None),
            Suspect::Sighting(robot, other) => (shm::Suspect::SIGHTING, robot, Some(other)),
            Suspect::Motion(robot) => (shm::Suspect::MOTION, robot, None),
            Suspect::Compass(robot) => (shm::Suspect::COMPASS, robot, None),
        };
        shm::Suspect {
            kind,
            robot: self.team[robot],
            other: other.map_or(0, |it| self.team[it]),
            stamp_ns,
            ..shm::Suspect::default()
        }
    }

    fn message_of(&self, slot: i64, evidence: &Evidence) -> shm::Evidence {
        let mut message = shm::Evidence {
            header: self.header((slot + 1) * self.slot_ns),
            epoch: epoch(slot),
            turn: [evidence.turn.centre, evidence.turn.half],
            ..shm::Evidence::default()
        };
        for (place, value) in message.moved.iter_mut().zip(evidence.moved.values()) {
            *place = *value;
        }
        if let Some(compass) = evidence.compass {
            message.has |= shm::Evidence::COMPASS;
            message.compass = [compass.centre, compass.half];
        }
        if let Some(Area { centre, half }) = evidence.fix {
            message.has |= shm::Evidence::FIX;
            (message.fix, message.fix_half) = (centre, half);
        }
        for (place, seen) in message.seen.iter_mut().zip(&evidence.seen) {
            *place = shm::SeenWithin {
                observed: self.team[seen.observed],
                centre: seen.area.centre,
                half: seen.area.half,
                turn: seen.turn.centre,
                turn_half: seen.turn.half,
                ..shm::SeenWithin::default()
            };
            message.seen_count += 1;
        }
        message
    }

    fn evidence_of(&self, message: &shm::Evidence) -> Evidence {
        let interval = |[centre, half]: [f64; 2]| AngleInterval::new(centre, half);
        let seen = message.seen().iter().filter_map(|it| {
            Some(Seen {
                observed: self.place(it.observed)?,
                area: Area {
                    centre: it.centre,
                    half: it.half,
                },
                turn: AngleInterval::new(it.turn, it.turn_half),
            })
        });
        let has = |flag: u8| message.has & flag != 0;
        Evidence {
            moved: Supports::new(message.moved.to_vec()),
            turn: interval(message.turn),
            compass: has(shm::Evidence::COMPASS).then(|| interval(message.compass)),
            fix: has(shm::Evidence::FIX).then_some(Area {
                centre: message.fix,
                half: message.fix_half,
            }),
            seen: seen.collect(),
        }
    }
}

/// As it stands in messages.
fn epoch(slot: i64) -> u64 {
    u64::try_from(slot + 1).unwrap_or_default()
}

/// Of seconds that were checked with the configuration.
#[allow(clippy::cast_possible_truncation)]
pub(crate) fn nanos(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}

#[allow(clippy::cast_precision_loss)] // Of a slot.
fn seconds(ns: i64) -> f64 {
    ns as f64 * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;
    const IDS: [u16; 3] = [4, 7, 9];
    /// All look along x and stand.
    const TRUTH: [[f64; 2]; 3] = [[0.0, 0.0], [3.0, 0.0], [0.0, 3.0]];

    fn team() -> Vec<Watch> {
        let bounds = Bounds {
            compass_rad: 0.09,
            ..Bounds::default()
        };
        let watch = |own: &u16| {
            let others: Vec<_> = IDS.into_iter().filter(|it| it != own).collect();
            Watch::new(*own, &others, &bounds, Integrity::default())
        };
        IDS.iter().map(watch).collect()
    }

    /// What robot `place` measures at a moment; its estimate is off by so much.
    fn measure(watch: &mut Watch, place: usize, at_ns: i64, off: f64, fix_off: f64) {
        let [x, y] = TRUTH[place];
        let mut hear = |event| watch.hear(at_ns, event);
        hear(Event::Compass(0.02));
        hear(Event::Estimate([x + off, y]));
        if place < 2 {
            let area = Area {
                centre: [x + fix_off, y],
                half: [0.3; 2],
            };
            hear(Event::Fix(area, [0.0; 2]));
        }
        for (observed, at) in TRUTH.iter().enumerate().filter(|it| it.0 != place) {
            let area = Area {
                centre: [at[0] - x, at[1] - y],
                half: [0.3; 2],
            };
            let turn = AngleInterval::new(0.0, 0.05);
            hear(Event::Seen(Seen {
                observed,
                area,
                turn,
            }));
        }
    }

    /// From one moment to another, in steps of 20 ms; the last words.
    fn play(
        team: &mut [Watch],
        [from, to]: [i64; 2],
        deaf: Option<usize>,
        off: [f64; 3],
        fix_off: f64,
    ) -> Vec<Option<shm::Integrity>> {
        let mut words = vec![None; team.len()];
        for step in from..to {
            let now_ns = 20 * MS * step;
            let mut told = Vec::new();
            for (place, watch) in team.iter_mut().enumerate() {
                watch.hear_moved(Moved {
                    start_ns: now_ns - 20 * MS,
                    end_ns: now_ns,
                    velocity: [0.0; 3],
                });
                if step % 5 == 0 {
                    measure(
                        watch,
                        place,
                        now_ns,
                        off[place],
                        fix_off * f64::from(u8::from(place == 0)),
                    );
                }
                for said in watch.step(now_ns) {
                    match said {
                        Said::Evidence(it) => told.push((place, it)),
                        Said::Integrity(it) => words[place] = Some(*it),
                    }
                }
            }
            for (from, message) in told {
                for (place, watch) in team.iter_mut().enumerate() {
                    if place != from && deaf != Some(place) {
                        assert!(watch.hear_evidence(&message));
                    }
                }
            }
        }
        words
    }

    fn holds(word: &shm::Integrity, at: [f64; 2]) -> bool {
        let vertices = word.vertices();
        let next = vertices.iter().cycle().skip(1);
        vertices.len() > 2
            && vertices.iter().zip(next).all(|(a, b)| {
                let [ux, uy] = [b[0] - a[0], b[1] - a[1]];
                ux * (at[1] - a[1]) - uy * (at[0] - a[0]) >= -1e-9
            })
    }

    #[test]
    fn everybody_knows_where_he_is_and_who_lies_is_outside() {
        let mut team = team();
        let words = play(&mut team, [0, 200], None, [0.0, 0.0, 2.0], 0.0);
        for (place, word) in words.iter().enumerate() {
            let word = word.as_ref().expect("a slot was closed");
            assert!(holds(word, TRUTH[place]), "{word:?}");
            let expected = if place == 2 {
                [shm::Integrity::ESTIMATE_OUTSIDE, shm::Integrity::NO]
            } else {
                [shm::Integrity::OK, shm::Integrity::YES]
            };
            assert_eq!([word.state, word.contained], expected, "{word:?}");
            assert_eq!(word.header.stamp_ns % (500 * MS), 0);
            assert!(word.protection_radius_m > 0.1 && word.area_m2 < 3.0);
        }
        let honest = play(&mut team, [200, 400], None, [0.0; 3], 0.0);
        let word = honest[2].as_ref().expect("a slot was closed");
        assert_eq!(word.contained, shm::Integrity::YES);
    }

    #[test]
    fn a_fix_that_lies_is_named_by_all() {
        let mut team = team();
        play(&mut team, [0, 200], None, [0.0; 3], 0.0);
        let words = play(&mut team, [200, 231], None, [0.0; 3], 3.0);
        for word in words {
            let word = word.expect("a slot was closed");
            assert_eq!(word.state, shm::Integrity::BOUNDS_VIOLATED, "{word:?}");
            let [suspect] = word.conflicts() else {
                panic!("{word:?}");
            };
            assert_eq!((suspect.kind, suspect.robot), (shm::Suspect::FIX, IDS[0]));
        }
    }

    #[test]
    fn who_hears_nobody_knows_himself_and_who_has_no_fix_then_nothing() {
        let mut team = team();
        let words = play(&mut team, [0, 500], Some(2), [0.0; 3], 0.0);
        let word = words[2].as_ref().expect("a slot was closed");
        assert_eq!(word.state, shm::Integrity::NOT_OBSERVABLE, "{word:?}");
        assert_eq!(word.contained, shm::Integrity::UNKNOWN);
        assert_eq!(word.vertex_count, 0);
    }

    #[test]
    fn what_nobody_looked_at_in_time_is_skipped_or_begins_anew() {
        let mut team = team();
        play(&mut team, [0, 200], None, [0.0; 3], 0.0);
        let watch = &mut team[0];
        let slot = watch.slot.unwrap();
        let begin_ns = slot * watch.slot_ns;
        assert_eq!(watch.step(begin_ns + 1_200 * MS), []);
        assert_eq!((watch.closed().1, watch.slot), (1, Some(slot + 1)));
        assert!(
            !watch.hear(begin_ns + 100 * MS, Event::Compass(0.0)),
            "it is over"
        );
        let said = watch.step(begin_ns + 60_000 * MS);
        let [Said::Integrity(word)] = said.as_slice() else {
            panic!("{said:?}");
        };
        assert_eq!(word.state, shm::Integrity::STALE);
        // And when the clock is set back.
        let said = watch.step(begin_ns);
        assert!(matches!(said.as_slice(), [Said::Integrity(_)]));
        assert_eq!(watch.slot, Some(slot + 1));
    }

    #[test]
    fn without_wheels_a_robot_can_be_anywhere_that_it_could_drive_to() {
        let mut watch = team().remove(0);
        watch.step(0);
        let slot = watch.slot.unwrap();
        let told = watch.gather(slot);
        let most = told
            .evidence
            .moved
            .values()
            .iter()
            .copied()
            .fold(0.0, f64::max);
        assert!((1.0..1.5).contains(&most), "{most}");
        let begin_ns = slot * watch.slot_ns;
        watch.hear_moved(Moved {
            start_ns: begin_ns,
            end_ns: begin_ns + 400 * MS,
            velocity: [1.0, 0.0, 0.0],
        });
        let told = watch.gather(slot);
        assert!((told.evidence.turn.half - (0.4 * 0.7 + 0.1 * 3.0)).abs() < 1e-9);
    }

    #[test]
    fn evidence_survives_its_message() {
        let mut team = team();
        play(&mut team, [0, 30], None, [0.0; 3], 0.0);
        measure(&mut team[0], 0, 610 * MS, 0.0, 0.0);
        let slot = team[0].slot.unwrap();
        let told = team[0].gather(slot);
        let message = team[0].message_of(slot, &told.evidence);
        assert_eq!(team[0].evidence_of(&message), told.evidence);
        assert!(told.evidence.fix.is_some() && told.evidence.compass.is_some());
    }
}
