//! The driver: what the receiver says, judged, and said on the robot's channels.

use coloc_daemon::config::Config;
use coloc_sensors::{Driver, EndError, Moment, Report};
use coloc_shm_types::{Clock, Heading, Position};

use crate::datum::Origin;
use crate::fix::Fix;
use crate::gate::{Gates, Placed};
use crate::local::LocalFrame;
use crate::receiver::{self, Event, Receiver};
use crate::refusal::Refusal;
use crate::section::{Gnss, HeadingFrom};
use crate::sigma::Sigma;
use crate::stamp::Stamper;

/// Silence for so long ends an epoch (ns), and for so long a frame (ns).
const PAUSE_NS: i64 = 300_000_000;
const CUT_NS: i64 = 1_000_000_000;
/// Farther from the datum a plane is no map (m).
const FARTHEST_M: f64 = 50_000.0;
/// No course is better than that, however fast the robot is (rad).
const LEAST_COURSE_RAD: f64 = 0.005;
/// A heading without a time of its own is dated by the last fix, if that is no older (ns).
const FRESH_NS: i64 = 5_000_000_000;

/// Where messages go. Each returns whether it was taken.
pub trait Outlet {
    /// A fix; what is missing in its header is the sender's.
    fn position(&mut self, stamp_ns: i64, position: Position) -> bool;

    /// A heading.
    fn heading(&mut self, stamp_ns: i64, heading: Heading) -> bool;
}

/// The driver of a satellite receiver.
#[derive(Debug)]
pub struct GnssDriver<O> {
    section: Gnss,
    receiver: Receiver,
    events: Vec<Event>,
    origin: Origin,
    gates: Gates,
    stamper: Stamper,
    outlet: O,
    /// When the last byte came (ns).
    heard_ns: i64,
    /// The last time that was said, and when: UTC and arrival.
    dated: Option<(i64, Moment)>,
    place: Option<[f64; 2]>,
    last_position_ns: Option<i64>,
    last_heading_ns: Option<i64>,
    tally: Tally,
    remarks: Vec<String>,
}

/// What is counted and shown.
#[derive(Copy, Clone, Debug, Default)]
struct Tally {
    said: u64,
    said_ns: i64,
    refused: [u64; 16],
    /// What came of the last fix; none before the first.
    last: Option<Result<(), Refusal>>,
    fix: Fix,
    sigma: Option<Sigma>,
}

impl<O: Outlet> GnssDriver<O> {
    /// As `[gnss]` says; messages go to `outlet`, with stamps of [`Self::clock`].
    pub fn new(section: Gnss, origin: Origin, outlet: O, stamper: Stamper) -> Self {
        Self {
            receiver: Receiver::new(section.talker()),
            events: Vec::new(),
            origin,
            gates: Gates::new(&section),
            stamper,
            outlet,
            heard_ns: 0,
            dated: None,
            place: None,
            last_position_ns: None,
            last_heading_ns: None,
            tally: Tally::default(),
            remarks: Vec::new(),
            section,
        }
    }

    /// Of which clock its stamps are.
    #[must_use]
    pub fn clock(&self) -> Clock {
        self.stamper.clock()
    }

    /// Where its messages went.
    #[must_use]
    pub fn outlet(&self) -> &O {
        &self.outlet
    }

    /// The same, for good.
    #[must_use]
    pub fn into_outlet(self) -> O {
        self.outlet
    }

    fn act(&mut self) {
        let mut events = std::mem::take(&mut self.events);
        for event in events.drain(..) {
            match event {
                Event::Fix(fix, arrived) => self.fix(&fix, arrived),
                Event::Heading(heading, arrived) => self.heading(heading, arrived),
            }
        }
        self.events = events;
    }

    fn fix(&mut self, fix: &Fix, arrived: Moment) {
        self.tally.fix = *fix;
        if let Some(utc_ns) = fix.utc_ns {
            self.dated = Some((utc_ns, arrived));
        }
        let judged = self.judge(fix, arrived);
        let said = judged.and_then(|(stamp_ns, position, placed)| {
            self.gates.pass(placed)?;
            self.last_position_ns = Some(stamp_ns);
            self.place = Some(fix.place);
            self.said(stamp_ns, |outlet| outlet.position(stamp_ns, position))
        });
        self.remark(said);
        if said.is_ok() {
            self.course(fix, arrived);
        }
    }

    /// What is said of a fix, if all is well with it but perhaps its place.
    fn judge(&mut self, fix: &Fix, arrived: Moment) -> Result<(i64, Position, Placed), Refusal> {
        self.gates.check(fix)?;
        let floor = self.section.floor(fix.quality).ok_or(Refusal::Quality)?;
        let stamp_ns = self.stamper.stamp(fix.utc_ns, arrived)?;
        self.gates.check_after_gap(fix, stamp_ns)?;
        if self
            .last_position_ns
            .is_some_and(|last_ns| stamp_ns <= last_ns)
        {
            return Err(Refusal::Repeated);
        }
        if let Some(said) = self.origin.add(fix) {
            self.remarks.push(said);
        }
        let frame = self.origin.frame().ok_or(Refusal::NoDatum)?;
        let place = placed(frame, fix)?;
        let sigma = Sigma::of(floor, fix);
        self.tally.sigma = Some(sigma);
        let variance = sigma.new_m * sigma.new_m;
        let position = Position {
            quality: fix.quality,
            position: place,
            covariance: [variance, 0.0, 0.0, variance],
            slow_sigma_m: sigma.slow_m,
            slow_time_s: sigma.slow_time_s,
            ..Position::default()
        };
        let velocity = fix.velocity().map(|velocity| frame.turn(velocity));
        let placed = Placed {
            at_ns: stamp_ns,
            place,
            velocity,
            sigma,
            quality: fix.quality,
        };
        Ok((stamp_ns, position, placed))
    }

    /// The course of a fix that was published.
    fn course(&mut self, fix: &Fix, arrived: Moment) {
        let section = &self.section.course;
        let moves = |speed: &f64| section.publish && *speed >= section.least_speed_m_s;
        let Some((speed, course)) = fix.speed_m_s.filter(moves).zip(fix.course_deg) else {
            return;
        };
        let sigma = (section.sigma_m_s / speed).max(LEAST_COURSE_RAD);
        let heading = Heading {
            what: Heading::COURSE,
            quality: fix.quality,
            variance: sigma * sigma,
            slow_sigma_rad: section.slow_sigma_rad,
            slow_time_s: section.slow_time_s,
            ..Heading::default()
        };
        let said = self.turned(heading, course, fix.utc_ns, arrived);
        self.remark(said);
    }

    fn heading(&mut self, said: receiver::Heading, arrived: Moment) {
        let section = &self.section.heading;
        let what = match section.from {
            HeadingFrom::Antennas => Heading::ANTENNAS,
            HeadingFrom::Compass => Heading::COMPASS,
            HeadingFrom::Nothing => return,
        };
        let sigma = (said.stated_deg.unwrap_or(0.0).to_radians()).max(section.sigma_rad);
        let heading = Heading {
            what,
            quality: said.quality,
            variance: sigma * sigma,
            slow_sigma_rad: section.slow_sigma_rad,
            slow_time_s: section.slow_time_s,
            ..Heading::default()
        };
        let utc_ns = said.utc_ns.or_else(|| self.dated_by_fix(arrived));
        let counts = self.section.floor(said.quality).is_some() && sigma.is_finite();
        let turned = if counts {
            self.turned(heading, said.degrees, utc_ns, arrived)
        } else {
            Err(Refusal::Heading)
        };
        if let Err(refusal) = turned {
            // Where there is no fix there is no heading; the fix says so.
            self.tally.refused[refusal as usize] += 1;
        }
    }

    /// Some receivers say a heading without a time: as much later than the last fix as it came later.
    fn dated_by_fix(&self, arrived: Moment) -> Option<i64> {
        let (utc_ns, at) = self.dated?;
        let later_ns = arrived.boottime_ns.saturating_sub(at.boottime_ns);
        (0..=FRESH_NS)
            .contains(&later_ns)
            .then(|| utc_ns.saturating_add(later_ns))
    }

    fn turned(
        &mut self,
        heading: Heading,
        degrees: f64,
        utc_ns: Option<i64>,
        arrived: Moment,
    ) -> Result<(), Refusal> {
        let stamp_ns = self.stamper.stamp(utc_ns, arrived)?;
        let frame = self.origin.frame().ok_or(Refusal::NoDatum)?;
        let datum = frame.datum();
        let place = self
            .place
            .unwrap_or([datum.latitude_deg, datum.longitude_deg]);
        let heading = Heading {
            heading: frame.heading(degrees, place),
            ..heading
        };
        if self
            .last_heading_ns
            .is_some_and(|last_ns| stamp_ns <= last_ns)
        {
            return Err(Refusal::Repeated);
        }
        self.last_heading_ns = Some(stamp_ns);
        self.said(stamp_ns, |outlet| outlet.heading(stamp_ns, heading))
    }

    fn said(&mut self, stamp_ns: i64, say: impl FnOnce(&mut O) -> bool) -> Result<(), Refusal> {
        if !say(&mut self.outlet) {
            return Err(Refusal::Channel);
        }
        self.tally.said += 1;
        self.tally.said_ns = stamp_ns;
        Ok(())
    }

    /// Counts a refusal; what is new is said.
    fn remark(&mut self, said: Result<(), Refusal>) {
        if let Err(refusal) = said {
            self.tally.refused[refusal as usize] += 1;
        }
        if self.tally.last.replace(said) != Some(said) {
            let words = said.err().map(Refusal::said);
            self.remarks
                .push(words.unwrap_or_else(|| "fixes pass".into()));
        }
    }
}

fn placed(frame: &LocalFrame, fix: &Fix) -> Result<[f64; 2], Refusal> {
    let local = frame.to_local(fix.place, fix.height_m);
    let near = local.filter(|[x, y, _]| x.hypot(*y) <= FARTHEST_M);
    near.map(|[x, y, _]| [x, y]).ok_or(Refusal::Far)
}

impl<O: Outlet> Driver for GnssDriver<O> {
    fn take(&mut self, bytes: &[u8], at: Moment) -> Result<(), EndError> {
        self.heard_ns = at.boottime_ns;
        let events = &mut self.events;
        self.receiver
            .take(bytes, at, &mut |event| events.push(event));
        self.act();
        Ok(())
    }

    fn idle(&mut self, at: Moment) -> Result<(), EndError> {
        let silent_ns = at.boottime_ns.saturating_sub(self.heard_ns);
        let events = &mut self.events;
        let mut note = |event| events.push(event);
        if silent_ns >= CUT_NS {
            self.receiver.cut(at, &mut note);
        } else if silent_ns >= PAUSE_NS {
            self.receiver.pause(&mut note);
        }
        self.act();
        Ok(())
    }

    fn interrupted(&mut self) {
        let events = &mut self.events;
        self.receiver
            .cut(Moment::now(), &mut |event| events.push(event));
        self.act();
    }

    fn end(&mut self, at: Moment) -> Result<(), EndError> {
        let events = &mut self.events;
        self.receiver.cut(at, &mut |event| events.push(event));
        self.act();
        Ok(())
    }

    /// By the sentences before: what a fix says is said when the next one begins.
    fn recorded_ns(&self, _: &[u8]) -> Option<i64> {
        self.receiver.newest_ns()
    }

    fn report(&self) -> Report {
        let counts = self.receiver.counts();
        let fix = &self.tally.fix;
        let number = |value: Option<f64>| value.unwrap_or(f64::NAN);
        #[allow(clippy::cast_precision_loss)] // Seconds are enough.
        let behind_s = (self.stamper.behind_ns()).map(|behind_ns| behind_ns as f64 * 1e-9);
        Report {
            whole: counts.whole,
            broken: counts.broken_lines + counts.broken_frames + counts.malformed,
            said: self.tally.said,
            nothing_to_say: 0,
            said_ns: self.tally.said_ns,
            refused: self.tally.refused,
            figures: [
                fix.quality.into(),
                number(fix.satellites.map(f64::from)),
                number(fix.hdop),
                number(fix.worst_m()),
                number(self.tally.sigma.map(|sigma| sigma.total_m())),
                number(behind_s),
                self.origin.fixes().into(),
                f64::from(u8::from(self.gates.is_settled())),
            ],
        }
    }

    fn remarks(&mut self) -> Vec<String> {
        std::mem::take(&mut self.remarks)
    }
}

/// Names of the figures in the driver's status, in their order.
pub const FIGURES: [&str; 8] = [
    "quality",
    "satellites",
    "hdop",
    "stated_sigma_m",
    "believed_sigma_m",
    "behind_s",
    "datum_fixes",
    "settled",
];

/// What is allowed in the file and was hardly meant.
#[must_use]
pub fn unlikely(config: &Config, section: &Gnss) -> Vec<String> {
    let mut found = Vec::new();
    if config.position.receivers == 0 {
        found.push("position.receivers = 0: colocd starts at the origin instead of waiting for a fix; write receivers = 1".into());
    }
    if config.peers().next().is_some() && section.datum.latitude_deg.is_none() {
        found.push("[gnss.datum] is measured by each robot for itself: write one latitude and longitude for the whole team".into());
    }
    if section.spec().is_ok_and(|spec| spec.is_recording()) {
        found.push(format!(
            "gnss.input = {:?}: a recording is played as if it were now",
            section.input
        ));
    }
    found
}
