//! Plays a CARMEN log onto the channel `scan`.

use coloc_scan::View;
use coloc_scan::carmen::{FrontLaser, Line};
use coloc_sensors::{Driver, EndError, Moment, Report};
use coloc_shm_types::{Clock, Publisher, RobotName, Scan, Sender, Space};

use crate::driver::nanos;
use crate::lines::Lines;

/// Says scans of a log as if they were measured now.
#[derive(Debug)]
pub struct Player {
    port: Publisher<Scan>,
    sender: Sender,
    lines: Lines,
    log: FrontLaser,
    scan: Box<Scan>,
    begin: Option<(f64, i64)>,
    report: Report,
}

impl Player {
    /// Speaks as the scanner `source` of `robot`.
    ///
    /// # Errors
    /// If the channel cannot be opened.
    pub fn open(space: &Space, robot: &RobotName, source: u16) -> Result<Self, EndError> {
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
            begin: None,
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
        let (first_s, begin_ns) = *self.begin.get_or_insert((self.log.time_s, at.boottime_ns));
        let stamp_ns = begin_ns.saturating_add(nanos(self.log.time_s - first_s));
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

    fn recorded_ns(&self) -> Option<i64> {
        self.begin.map(|_| nanos(self.log.time_s))
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
