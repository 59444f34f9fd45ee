//! Plays a CARMEN log onto the channel `scan`.

use coloc_scan::View;
use coloc_scan::carmen::{FrontLaser, Line};
use coloc_sensors::pace::Playback;
use coloc_sensors::{Driver, EndError, Moment, Report};
use coloc_shm_types::{Clock, Publisher, RobotName, Scan, Sender, Space};

use crate::driver::{nanos, recorded_ns};
use crate::lines::Lines;

/// Says scans of a log as if they were measured now.
#[derive(Debug)]
pub struct Player {
    port: Publisher<Scan>,
    sender: Sender,
    lines: Lines,
    log: FrontLaser,
    scan: Box<Scan>,
    /// Of a log that is read as fast as it can be each scan is of the moment at which it is read.
    playback: Option<Playback>,
    report: Report,
}

impl Player {
    /// Speaks as the scanner `source` of `robot`, of a log that is read at recorded speed if it is `paced`.
    ///
    /// # Errors
    /// If the channel cannot be opened.
    pub fn open(
        space: &Space,
        robot: &RobotName,
        source: u16,
        paced: bool,
    ) -> Result<Self, EndError> {
        let sender = Sender::start(source, Clock::Boottime).map_err(|error| EndError::System {
            what: "no random number",
            error,
        })?;
        Ok(Self {
            port: space.publisher(robot)?,
            sender,
            lines: Lines::default(),
            log: FrontLaser::default(),
            scan: Box::default(),
            playback: paced.then(Playback::default),
            report: Report {
                figures: [f64::NAN; 8],
                ..Report::default()
            },
        })
    }

    fn line(&mut self, line: &str, at: Moment) {
        match self.log.read(line) {
            Line::Scan if View::check(self.log.raw()).is_ok() => self.say(at),
            Line::Scan | Line::Broken => self.report.broken += 1,
            Line::Other => {}
        }
    }

    fn say(&mut self, at: Moment) {
        self.report.whole += 1;
        let now_ns = at.boottime_ns;
        let due = |it: &mut Playback| it.stamp_ns(nanos(self.log.time_s), now_ns);
        let stamp_ns = self.playback.as_mut().map_or(now_ns, due);
        let raw = self.log.raw();
        let scan = &mut *self.scan;
        scan.header = self.sender.header(stamp_ns);
        scan.angle_min = raw.angle_min_rad;
        scan.angle_increment = raw.angle_increment_rad;
        #[allow(clippy::cast_precision_loss)] // At most 2048.
        let gaps = (raw.ranges.len() - 1) as f32;
        scan.angle_max = raw.angle_min_rad + gaps * raw.angle_increment_rad;
        scan.range_min = raw.range_min_m;
        scan.range_max = raw.range_max_m;
        scan.fill(raw.ranges, raw.intensities);
        if self.port.send(*scan).is_ok() {
            self.report.said += 1;
            self.report.said_ns = stamp_ns;
        }
    }

    fn take_lines(&mut self, at: Moment, give: impl FnOnce(&mut Lines, &mut dyn FnMut(&str))) {
        let mut lines = std::mem::take(&mut self.lines);
        give(&mut lines, &mut |line| self.line(line, at));
        self.lines = lines;
    }
}

impl Driver for Player {
    fn take(&mut self, bytes: &[u8], at: Moment) -> Result<(), EndError> {
        self.take_lines(at, |lines, each| lines.take(bytes, each));
        Ok(())
    }

    fn idle(&mut self, _: Moment) -> Result<(), EndError> {
        Ok(())
    }

    fn interrupted(&mut self) {
        self.lines = Lines::default();
    }

    fn end(&mut self, at: Moment) -> Result<(), EndError> {
        self.take_lines(at, |lines, each| lines.end(each));
        Ok(())
    }

    fn recorded_ns(&self, line: &[u8]) -> Option<i64> {
        recorded_ns(&self.lines, line)
    }

    fn report(&self) -> Report {
        let broken = self.report.broken + self.lines.broken;
        Report {
            broken,
            ..self.report
        }
    }

    fn remarks(&mut self) -> Vec<String> {
        Vec::new()
    }
}
