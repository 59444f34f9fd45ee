//! The driver: scans, the robots in them, and what is said of those.

use coloc_daemon::config::Config;
use coloc_scan::carmen::{FrontLaser, Line};
use coloc_scan::{Counts, Finder, Raw, Seen, View};
use coloc_sensors::pace::Playback;
use coloc_sensors::{Driver, EndError, Moment, Report};
use coloc_shm_types::{RelativePose, Scan, Sighting};

use crate::beliefs::{Beliefs, boottime};
use crate::lines::Lines;
use crate::refusal::Refusal;
use crate::section::{Laser, LookSection, Shape, Slow};

/// Where what is seen goes, and where beliefs come from. Words are stamped by `CLOCK_BOOTTIME`; each returns whether it was taken.
pub trait Outlet {
    /// Takes in what robots have said of themselves since.
    ///
    /// # Errors
    /// If a channel is lost.
    fn hear(&mut self, beliefs: &mut Beliefs, now: Moment) -> Result<(), EndError>;

    /// A robot whose heading was seen; what is missing in its header is the sender's.
    fn pose(&mut self, stamp_ns: i64, sighting: RelativePose) -> bool;

    /// A robot of which range and bearing were seen; the same.
    fn range_bearing(&mut self, stamp_ns: i64, sighting: Sighting) -> bool;
}

/// The driver of a laser scanner.
#[derive(Debug)]
pub struct LaserDriver<O> {
    source: u16,
    own_boot: u64,
    finder: Finder,
    slow: Slow,
    beliefs: Beliefs,
    outlet: O,
    seen: Vec<Seen>,
    lines: Lines,
    log: FrontLaser,
    /// What is read as fast as it can be is of the moment at which it is read.
    playback: Option<Playback>,
    tally: Tally,
    remarks: Vec<String>,
}

/// What is counted and shown.
#[derive(Copy, Clone, Debug, Default)]
struct Tally {
    whole: u64,
    broken: u64,
    said: u64,
    nothing_to_say: u64,
    said_ns: i64,
    refused: [u64; 16],
    /// Of the last scan: beams, priors, robots seen.
    last: [f64; 3],
    /// What came of the last scan; none before the first.
    state: Option<Result<(), Refusal>>,
}

/// Names of the figures in the driver's status, in their order.
pub const FIGURES: [&str; 4] = ["beams", "expected", "seen", "bodies"];

/// Of a scan that is played from a log \[s\].
const NANOS: f64 = 1e9;

impl<O: Outlet> LaserDriver<O> {
    /// As `[laser]` says.
    #[must_use]
    pub fn new(section: &Laser, beliefs: Beliefs, own_boot: u64, outlet: O) -> Self {
        let is_timed = !section
            .spec()
            .is_ok_and(|spec| spec.is_some_and(|it| it.is_recording() && !it.is_paced()));
        Self {
            source: section.source,
            own_boot,
            finder: Finder::new(section.settings()),
            slow: section.slow,
            beliefs,
            outlet,
            seen: Vec::with_capacity(coloc_scan::finder::MOST_ROBOTS),
            lines: Lines::default(),
            log: FrontLaser::default(),
            playback: is_timed.then(Playback::default),
            tally: Tally::default(),
            remarks: Vec::with_capacity(8),
        }
    }

    /// Where its words went.
    #[must_use]
    pub fn outlet(&self) -> &O {
        &self.outlet
    }

    /// The same, for good.
    #[must_use]
    pub fn into_outlet(self) -> O {
        self.outlet
    }

    /// Takes in a scan of the channel; those of other scanners are passed over.
    ///
    /// # Errors
    /// If a channel is lost.
    pub fn scan(&mut self, scan: &Scan, now: Moment) -> Result<(), EndError> {
        if scan.header.source != self.source {
            return Ok(());
        }
        let Some(stamp_ns) = boottime(&scan.header, self.own_boot, now) else {
            self.note(Err(Refusal::Clock));
            return Ok(());
        };
        self.raw(&raw(scan), stamp_ns, now)
    }

    /// Takes in a scan whose first beam was measured at `stamp_ns`. Allocates nothing, unless there is news for a person.
    ///
    /// # Errors
    /// If a channel is lost.
    pub fn raw(&mut self, raw: &Raw<'_>, stamp_ns: i64, now: Moment) -> Result<(), EndError> {
        self.outlet.hear(&mut self.beliefs, now)?;
        let looked = self.look(raw, stamp_ns);
        self.note(looked);
        if looked.is_ok() {
            for place in 0..self.seen.len() {
                let seen = self.seen[place];
                self.say(&seen, stamp_ns);
            }
        }
        Ok(())
    }

    fn look(&mut self, raw: &Raw<'_>, stamp_ns: i64) -> Result<(), Refusal> {
        self.seen.clear();
        let Ok(view) = View::check(*raw) else {
            self.tally.broken += 1;
            return Err(Refusal::BadScan);
        };
        self.tally.whole += 1;
        let count = raw.ranges.len();
        let middle_ns = stamp_ns.saturating_add(nanos(view.time(count / 2)));
        let motion = self.beliefs.motion(middle_ns).ok_or(Refusal::NoPose)?;
        let own_heading = self.beliefs.own_heading(middle_ns);
        let priors = self.beliefs.priors(middle_ns);
        if priors.is_empty() {
            return Err(Refusal::NoTeam);
        }
        let before = self.finder.counts();
        self.seen
            .extend_from_slice(self.finder.find_turned(&view, motion, priors, own_heading));
        #[allow(clippy::cast_precision_loss)] // Some thousands.
        let last = [count, priors.len(), self.seen.len()].map(|it| it as f64);
        self.tally.last = last;
        self.count(before, self.finder.counts());
        self.tally.nothing_to_say += u64::from(self.seen.is_empty());
        Ok(())
    }

    fn count(&mut self, before: Counts, after: Counts) {
        let refused = &mut self.tally.refused;
        refused[Refusal::Ambiguous as usize] += after.ambiguous - before.ambiguous;
        refused[Refusal::Nobody as usize] += after.nobody - before.nobody;
        refused[Refusal::Room as usize] += after.left_out - before.left_out;
    }

    fn say(&mut self, seen: &Seen, stamp_ns: i64) {
        let stamp_ns = stamp_ns.saturating_add(nanos(seen.time_s));
        let taken = if seen.has_heading {
            self.outlet.pose(stamp_ns, pose(seen))
        } else {
            let mount = self.beliefs.mount();
            let part = part(seen, mount, self.slow);
            self.outlet.range_bearing(stamp_ns, part)
        };
        if taken {
            self.tally.said += 1;
            self.tally.said_ns = stamp_ns;
        } else {
            self.refuse(Refusal::Channel);
        }
    }

    fn refuse(&mut self, refusal: Refusal) {
        let count = &mut self.tally.refused[refusal as usize];
        *count += 1;
        if *count == 1 {
            self.remarks.push(refusal.said().into());
        }
    }

    /// What came of a scan as a whole; what is new is said.
    fn note(&mut self, looked: Result<(), Refusal>) {
        if let Err(refusal) = looked {
            self.tally.refused[refusal as usize] += 1;
        }
        if self.tally.state.replace(looked) != Some(looked) {
            let said = looked.map_or_else(Refusal::said, |()| "scans are looked through");
            self.remarks.push(said.into());
        }
    }

    fn line(&mut self, line: &str, at: Moment) -> Result<(), EndError> {
        let mut log = std::mem::take(&mut self.log);
        let read = log.read(line);
        let heard = match read {
            Line::Scan => {
                let now_ns = at.boottime_ns;
                let due = |it: &mut Playback| it.stamp_ns(nanos(log.time_s), now_ns);
                let stamp_ns = self.playback.as_mut().map_or(now_ns, due);
                self.raw(&log.raw(), stamp_ns, at)
            }
            Line::Other => Ok(()),
            Line::Broken => {
                self.tally.broken += 1;
                Ok(())
            }
        };
        self.log = log;
        heard
    }

    fn take_lines(
        &mut self,
        at: Moment,
        give: impl FnOnce(&mut Lines, &mut dyn FnMut(&str)),
    ) -> Result<(), EndError> {
        let mut lines = std::mem::take(&mut self.lines);
        let mut result = Ok(());
        give(&mut lines, &mut |line| {
            if result.is_ok() {
                result = self.line(line, at);
            }
        });
        self.lines = lines;
        result
    }
}

/// A sighting of the channel `relative_pose`, seen from the scanner: `colocd` knows where that sits.
fn pose(seen: &Seen) -> RelativePose {
    let [[a, b, c], [d, e, f], [g, h, i]] = seen.covariance;
    RelativePose {
        observed: seen.robot,
        pose: seen.pose,
        covariance: [a, b, c, d, e, f, g, h, i],
        ..RelativePose::default()
    }
}

/// A sighting of the channel `sighting`. Its variances are those of the smallest two independent errors that are no smaller than the
/// correlated ones of a robot of which a side was seen: the channel has no covariance.
fn part(seen: &Seen, mount: [f64; 3], slow: Slow) -> Sighting {
    let polar = seen.range_bearing();
    let [[range, both], [_, bearing]] = polar.covariance;
    let larger = 1.0 + both.abs() / (range * bearing).sqrt();
    Sighting {
        observed: seen.robot,
        has: Sighting::RANGE | Sighting::BEARING,
        who: Sighting::ROBOT,
        range: polar.range_m,
        bearing: polar.bearing_rad,
        white: [range * larger, bearing * larger],
        slow: [
            slow.scale_sigma,
            slow.scale_time_s,
            slow.bearing_sigma_rad,
            slow.bearing_time_s,
        ],
        mount,
        ..Sighting::default()
    }
}

/// A scan of the channel, not checked yet.
#[must_use]
pub fn raw(scan: &Scan) -> Raw<'_> {
    Raw {
        angle_min_rad: scan.angle_min,
        angle_increment_rad: scan.angle_increment,
        time_increment_s: scan.time_increment,
        range_min_m: scan.range_min,
        range_max_m: scan.range_max,
        ranges: scan.ranges(),
        intensities: scan.intensities(),
    }
}

/// The log's own time of the scan that `piece` ends (ns).
pub(crate) fn recorded_ns(lines: &Lines, piece: &[u8]) -> Option<i64> {
    lines.peek(piece, FrontLaser::time_s).map(nanos)
}

#[allow(clippy::cast_possible_truncation)] // A number that is too large is the largest.
pub(crate) fn nanos(seconds: f64) -> i64 {
    (seconds * NANOS).round() as i64
}

impl<O: Outlet> Driver for LaserDriver<O> {
    fn take(&mut self, bytes: &[u8], at: Moment) -> Result<(), EndError> {
        self.take_lines(at, |lines, each| lines.take(bytes, each))
    }

    fn idle(&mut self, at: Moment) -> Result<(), EndError> {
        self.outlet.hear(&mut self.beliefs, at)
    }

    fn interrupted(&mut self) {
        self.lines = Lines::default();
        // Whoever comes next counts its own time.
        self.playback = self.playback.map(|_| Playback::default());
    }

    fn end(&mut self, at: Moment) -> Result<(), EndError> {
        self.take_lines(at, |lines, each| lines.end(each))
    }

    fn recorded_ns(&self, line: &[u8]) -> Option<i64> {
        recorded_ns(&self.lines, line)
    }

    fn report(&self) -> Report {
        let [beams, expected, seen] = self.tally.last;
        #[allow(clippy::cast_precision_loss)] // For people.
        let bodies = self.finder.counts().bodies as f64;
        let nan = f64::NAN;
        Report {
            whole: self.tally.whole,
            broken: self.tally.broken + self.lines.broken,
            said: self.tally.said,
            nothing_to_say: self.tally.nothing_to_say,
            said_ns: self.tally.said_ns,
            refused: self.tally.refused,
            figures: [beams, expected, seen, bodies, nan, nan, nan, nan],
        }
    }

    fn remarks(&mut self) -> Vec<String> {
        std::mem::take(&mut self.remarks)
    }
}

/// What is allowed in the file and was hardly meant.
#[must_use]
pub fn unlikely(config: &Config, section: &Laser) -> Vec<String> {
    let mut found = Vec::new();
    if config.peers().next().is_none() {
        found.push("[[team]] names no other robot: there is nobody to be seen".into());
    }
    for peer in config
        .peers()
        .filter(|peer| section.look_of(peer.id).is_none())
    {
        found.push(format!(
            "no [[laser.look]] is of robot {}: it is not looked for",
            peer.id
        ));
    }
    let named = section.look.iter().flat_map(|it| &it.robots);
    for robot in named.filter(|robot| config.peers().all(|peer| peer.id != **robot)) {
        found.push(format!(
            "a [[laser.look]] is of robot {robot}, which is no other robot of [[team]]"
        ));
    }
    let is_round = |it: &LookSection| it.shape == Shape::Cylinder;
    if section.look.iter().any(is_round) && !config.sighting.heard {
        found.push("a cylinder has no heading: range and bearing are published on the channel sighting, to which colocd does not listen; write [sighting] heard = true for all robots of the team".into());
    }
    if section
        .spec()
        .is_ok_and(|spec| spec.is_some_and(|it| it.is_recording()))
    {
        found.push(format!(
            "laser.input = {:?}: a recording is played as if it were now",
            section.input
        ));
    }
    found
}
