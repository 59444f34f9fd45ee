//! Saying once a second how the driver is doing, on the channel `driver`.

use std::time::{Duration, Instant};

use coloc_shm_types::{Clock, DriverStatus, Health, Publisher, RobotName, Sender, Space};

use crate::end::EndError;
use crate::health::{Counts, Vitals};
use crate::moment::Moment;
use crate::run::Report;

/// From one status to the next.
pub const PERIOD: Duration = Duration::from_secs(1);

/// The driver's own end of the channel `driver`.
#[derive(Debug)]
pub struct Reporter {
    port: Publisher<DriverStatus>,
    sender: Sender,
    driver: [u8; 16],
    vitals: Vitals,
    next: Instant,
}

/// What the program itself knows.
#[derive(Copy, Clone, Debug, Default)]
pub struct Line {
    /// Whether the input is open.
    pub is_open: bool,
    /// How often it was opened.
    pub opened: u64,
    /// Bytes that came.
    pub bytes: u64,
}

impl Reporter {
    /// Speaks as the driver `name` of the sensor `source` of `robot`.
    ///
    /// # Errors
    /// If the channel cannot be opened.
    pub fn open(
        space: &Space,
        robot: &RobotName,
        name: &str,
        source: u16,
    ) -> Result<Self, EndError> {
        let random = |error| EndError::System {
            what: "no random number",
            error,
        };
        Ok(Self {
            port: space.publisher::<DriverStatus>(robot)?,
            sender: Sender::start(source, Clock::Boottime).map_err(random)?,
            driver: DriverStatus::named(name),
            vitals: Vitals::default(),
            next: Instant::now(),
        })
    }

    /// Publishes, if a second is over; the health then.
    pub fn report(&mut self, line: Line, report: &Report) -> Option<Health> {
        let now = Instant::now();
        if now < self.next {
            return None;
        }
        self.next = now + PERIOD;
        let now_ns = Moment::now().boottime_ns;
        let counts = Counts {
            bytes: line.bytes,
            whole: report.whole,
            of_use: report.said.saturating_add(report.nothing_to_say),
        };
        let health = self.vitals.judge(counts, now_ns);
        // It is the newest that matters: who missed it gets the next.
        let _ = self.port.send(DriverStatus {
            header: self.sender.header(now_ns),
            driver: self.driver,
            health: health as u8,
            open: u8::from(line.is_open),
            reserved: [0; 6],
            opened: line.opened,
            bytes: line.bytes,
            whole: report.whole,
            broken: report.broken,
            said: report.said,
            said_ns: report.said_ns,
            refused: report.refused,
            figures: report.figures,
        });
        Some(health)
    }
}
