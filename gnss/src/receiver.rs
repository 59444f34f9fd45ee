//! From bytes to fixes: sentences of one moment are put together, whatever their order.
//!
//! An epoch is all sentences of one time. It is complete once everything has come that the epoch before had; if something is missing, when the
//! next one begins or the line is silent. Of what says the position, the best is taken: NAV-PVT, else GGA, else RMC.

use chrono::NaiveDate;
use coloc_sensors::Moment;

use crate::fix::Fix;
use crate::frame::{Frame, Splitter};
use crate::sentence::{self, Content, Minimum, Motion, Noise, Position, Sentence, Talker};
use crate::ubx::{self, Baseline, Solution, Ubx};
use crate::utc::{TimeOfDay, date_near, unix_ns};

/// For so many epochs the better source may be missing before a worse one takes its place.
const PATIENCE: u32 = 5;
const WEEK_MS: i64 = 7 * 86_400_000;

/// Something that a receiver said.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Event {
    /// A fix, or that there is none (quality 0), and when the first of it came.
    Fix(Fix, Moment),
    /// A heading.
    Heading(Heading, Moment),
}

/// Where the body looks, from true north to the right.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Heading {
    /// Since 1970 (ns); none where it is not said.
    pub utc_ns: Option<i64>,
    /// The angle (degrees).
    pub degrees: f64,
    /// What the receiver says of its standard deviation (degrees).
    pub stated_deg: Option<f64>,
    /// Its quality, in the numbers of GGA.
    pub quality: u8,
}

/// What came, and what was wrong with it.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Sentences and messages whose checksum was right.
    pub whole: u64,
    /// Lines whose checksum was missing or wrong.
    pub broken_lines: u64,
    /// Frames of UBX whose checksum was wrong.
    pub broken_frames: u64,
    /// The checksum was right, and the content was not.
    pub malformed: u64,
    /// Manufacturers' own sentences.
    pub proprietary: u64,
    /// Bytes that belong to nothing.
    pub foreign_bytes: u64,
}

/// A receiver, as heard through its bytes.
#[derive(Debug, Default)]
pub struct Receiver {
    splitter: Splitter,
    sentences: Sentences,
}

#[derive(Debug, Default)]
struct Sentences {
    counts: Counts,
    /// The one that counts, where several speak.
    talker: Option<Talker>,
    epoch: Option<Epoch>,
    /// What the epoch before had.
    expected: u8,
    /// The last date that was said, and when.
    known: Option<(NaiveDate, TimeOfDay)>,
    motion: Option<Motion>,
    quality: u8,
    /// How many epochs ago a better source than the one in question spoke; none: never.
    since_solution: Option<u32>,
    since_position: u32,
    /// UTC (ns) and time of the week (ms) of the last NAV-PVT.
    solved: Option<(i64, u32)>,
}

/// Sentences of one time.
#[derive(Clone, Debug)]
struct Epoch {
    time: TimeOfDay,
    arrived: Moment,
    date: Option<NaiveDate>,
    position: Option<Position>,
    minimum: Option<Minimum>,
    noise: Option<Noise>,
    seen: u8,
    given: bool,
}

const GGA: u8 = 1;
const RMC: u8 = 2;
const GST: u8 = 4;
const ZDA: u8 = 8;

impl Receiver {
    /// Of several talkers, one can be chosen.
    #[must_use]
    pub fn new(talker: Option<Talker>) -> Self {
        Self {
            splitter: Splitter::default(),
            sentences: Sentences {
                talker,
                ..Sentences::default()
            },
        }
    }

    /// Takes in bytes that came at one moment.
    pub fn take(&mut self, bytes: &[u8], at: Moment, each: &mut impl FnMut(Event)) {
        let sentences = &mut self.sentences;
        self.splitter
            .take(bytes, |frame| sentences.frame(frame, at, each));
    }

    /// The line has been silent for so long that nothing more of this epoch will come.
    pub fn pause(&mut self, each: &mut impl FnMut(Event)) {
        self.sentences.give(each);
    }

    /// What is half there stays half.
    pub fn cut(&mut self, at: Moment, each: &mut impl FnMut(Event)) {
        let sentences = &mut self.sentences;
        self.splitter.cut(|frame| sentences.frame(frame, at, each));
        sentences.give(each);
    }

    /// What came so far.
    #[must_use]
    pub fn counts(&self) -> Counts {
        Counts {
            broken_frames: self.splitter.broken,
            foreign_bytes: self.splitter.foreign,
            ..self.sentences.counts
        }
    }

    /// The newest time that was said, of a day whose date is known (ns since 1970).
    #[must_use]
    pub fn newest_ns(&self) -> Option<i64> {
        let sentences = &self.sentences;
        let of_epoch = sentences
            .epoch
            .as_ref()
            .and_then(|epoch| sentences.utc_ns(epoch));
        let of_known = || {
            let (date, time) = sentences.known?;
            unix_ns(date, time)
        };
        let of_solution = sentences.solved.map(|(utc_ns, _)| utc_ns);
        of_epoch.or_else(of_known).max(of_solution)
    }
}

impl Sentences {
    fn frame(&mut self, frame: Frame<'_>, at: Moment, each: &mut impl FnMut(Event)) {
        match frame {
            Frame::Line(line) => match Sentence::read(line) {
                Ok(sentence) => self.sentence(sentence, at, each),
                Err(sentence::Broken) => self.counts.broken_lines += 1,
            },
            Frame::Ubx { class, id, payload } => {
                self.counts.whole += 1;
                match ubx::content(class, id, payload) {
                    Ok(Ubx::Solution(solution)) => self.solution(&solution, at, each),
                    Ok(Ubx::Baseline(baseline)) => self.baseline(&baseline, at, each),
                    Ok(Ubx::Nothing) => {}
                    Err(ubx::Malformed) => self.counts.malformed += 1,
                }
            }
        }
    }

    fn sentence(&mut self, sentence: Sentence<'_>, at: Moment, each: &mut impl FnMut(Event)) {
        self.counts.whole += 1;
        let (kind, data) = match sentence {
            Sentence::Standard { talker, .. } if self.talker.is_some_and(|it| it != talker) => {
                return;
            }
            Sentence::Standard { kind, data, .. } => (kind, data),
            Sentence::Proprietary => return self.counts.proprietary += 1,
            Sentence::Other => return,
        };
        match sentence::content(kind, data) {
            Ok(content) => self.content(content, at, each),
            Err(sentence::Malformed) => self.counts.malformed += 1,
        }
    }

    fn content(&mut self, content: Content, at: Moment, each: &mut impl FnMut(Event)) {
        let (time, kind) = match &content {
            Content::Position(it) => (it.time, GGA),
            Content::Minimum(it) => (it.time, RMC),
            Content::Noise(it) => (it.time, GST),
            Content::Date(time, _) => (*time, ZDA),
            Content::Motion(motion) => {
                self.motion = Some(*motion);
                return;
            }
            Content::Heading(degrees) => return each(Event::Heading(self.heading(*degrees), at)),
            Content::Nothing => return,
        };
        let epoch = self.epoch_of(time, at, each);
        let is_first = epoch.seen & kind == 0;
        epoch.seen |= kind;
        match content {
            // Of two talkers the first one counts.
            Content::Position(it) if is_first => epoch.position = Some(it),
            Content::Minimum(it) if is_first => {
                epoch.minimum = Some(it);
                epoch.date = epoch.date.or(it.date);
            }
            Content::Noise(it) if is_first => epoch.noise = Some(it),
            // It has all digits of the year.
            Content::Date(_, date) => epoch.date = Some(date),
            _ => {}
        }
        if self.is_complete() {
            self.give(each);
        }
    }

    fn epoch_of(
        &mut self,
        time: TimeOfDay,
        at: Moment,
        each: &mut impl FnMut(Event),
    ) -> &mut Epoch {
        if self.epoch.as_ref().is_some_and(|epoch| epoch.time != time) {
            self.give(each);
            self.close();
        }
        self.epoch.get_or_insert_with(|| Epoch::new(time, at))
    }

    fn is_complete(&self) -> bool {
        let is_complete = |epoch: &Epoch| epoch.seen & self.expected == self.expected;
        self.expected != 0 && self.epoch.as_ref().is_some_and(is_complete)
    }

    /// The next epoch begins: it is expected to be like this one.
    fn close(&mut self) {
        let Some(epoch) = self.epoch.take() else {
            return;
        };
        if epoch.seen & (GGA | RMC) != 0 {
            self.expected = epoch.seen;
        }
        self.since_solution = self.since_solution.map(|since| since.saturating_add(1));
        self.since_position = match epoch.position {
            Some(_) => 0,
            None => self.since_position.saturating_add(1),
        };
        if let Some(date) = self.date_of(&epoch) {
            self.known = Some((date, epoch.time));
        }
    }

    fn date_of(&self, epoch: &Epoch) -> Option<NaiveDate> {
        let near = self.known.and_then(|known| date_near(known, epoch.time));
        epoch.date.or(near)
    }

    fn utc_ns(&self, epoch: &Epoch) -> Option<i64> {
        unix_ns(self.date_of(epoch)?, epoch.time)
    }

    /// Gives the fix of this epoch, if it has one and was not given before.
    fn give(&mut self, each: &mut impl FnMut(Event)) {
        let Some(epoch) = self.epoch.as_ref().filter(|epoch| !epoch.given) else {
            return;
        };
        let Some(fix) = self.fix(epoch) else {
            return;
        };
        let arrived = epoch.arrived;
        if let Some(epoch) = &mut self.epoch {
            epoch.given = true;
        }
        self.motion = None;
        self.quality = fix.quality;
        each(Event::Fix(fix, arrived));
    }

    fn fix(&self, epoch: &Epoch) -> Option<Fix> {
        if self.since_solution.is_some_and(|since| since < PATIENCE) {
            return None;
        }
        let minimum = epoch.minimum.filter(|_| self.since_position >= PATIENCE);
        let (place, quality) = match (epoch.position, minimum) {
            (Some(it), _) => (it.place, it.quality),
            (None, Some(it)) => (it.place, it.quality),
            (None, None) => return None,
        };
        let motion = epoch.minimum.map(|minimum| minimum.motion).or(self.motion);
        let position = epoch.position.as_ref();
        Some(Fix {
            utc_ns: self.utc_ns(epoch),
            place: place.unwrap_or_default(),
            height_m: position.and_then(|it| it.height_m),
            quality: if place.is_some() { quality } else { 0 },
            satellites: position.and_then(|it| it.satellites),
            hdop: position.and_then(|it| it.hdop),
            stated_m: epoch.noise.map(|noise| noise.sigma_m),
            speed_m_s: motion.and_then(|motion| motion.speed_m_s),
            course_deg: motion.and_then(|motion| motion.course_deg),
        })
    }

    fn solution(&mut self, solution: &Solution, at: Moment, each: &mut impl FnMut(Event)) {
        self.since_solution = Some(0);
        self.quality = solution.quality;
        self.solved = solution.utc_ns.map(|utc_ns| (utc_ns, solution.week_ms));
        let fix = Fix {
            utc_ns: solution.utc_ns,
            place: solution.place,
            height_m: Some(solution.height_m),
            quality: solution.quality,
            satellites: Some(solution.satellites),
            hdop: None,
            stated_m: Some([solution.sigma_m; 2]),
            speed_m_s: Some(solution.speed_m_s),
            course_deg: Some(solution.course_deg),
        };
        each(Event::Fix(fix, at));
    }

    fn baseline(&self, baseline: &Baseline, at: Moment, each: &mut impl FnMut(Event)) {
        let utc_ns = self.solved.map(|(utc_ns, week_ms)| {
            let ahead_ms = i64::from(baseline.week_ms) - i64::from(week_ms) + WEEK_MS / 2;
            utc_ns + (ahead_ms.rem_euclid(WEEK_MS) - WEEK_MS / 2) * 1_000_000
        });
        let heading = Heading {
            utc_ns,
            degrees: baseline.heading_deg,
            stated_deg: Some(baseline.sigma_deg),
            quality: baseline.quality,
        };
        each(Event::Heading(heading, at));
    }

    /// A sentence that says a heading and no time.
    fn heading(&self, degrees: f64) -> Heading {
        Heading {
            utc_ns: None,
            degrees,
            stated_deg: None,
            quality: self.quality,
        }
    }
}

impl Epoch {
    fn new(time: TimeOfDay, arrived: Moment) -> Self {
        Self {
            time,
            arrived,
            date: None,
            position: None,
            minimum: None,
            noise: None,
            seen: 0,
            given: false,
        }
    }
}
