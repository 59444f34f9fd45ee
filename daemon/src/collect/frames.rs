//! From frames to odometry samples: no bus and no clock of its own, so that everything it does can be tried without any.
//!
//! Nothing is dropped here, however much comes: who drains the buses takes a part after the other, and who uses the samples
//! asks for one after the other.

use coloc_drivers::can::{FRAMES_PER_CALL, Received, StampClock};
use coloc_drivers::encoder::{
    FrameReject, GyroDecoder, GyroReading, OdometryDecoder, WheelOdometry,
};

use super::list::List;
use crate::clock::Moment;

/// Frames on their way.
#[derive(Debug)]
pub struct Frames {
    decoder: OdometryDecoder,
    gyro: Option<GyroDecoder>,
    /// What the last frame said of the gyro.
    turn: Option<Result<GyroReading, FrameReject>>,
    lines: Vec<Line>,
    /// Frames that were read and not decoded yet; the first of them that is not placed yet.
    inbox: List<Frame>,
    unplaced: usize,
    /// The first that is not decoded yet.
    next: usize,
}

/// A bus, as far as it matters here.
#[derive(Debug)]
struct Line {
    clock: StampClock,
    /// The last drain left something behind.
    more: bool,
    /// How many of its frames are in the inbox.
    held: usize,
    /// When its last frame came, of the inner clock \[ns\].
    last_ns: i64,
}

#[derive(Copy, Clone, Debug)]
struct Frame {
    received: Received,
    /// Which one it was, of all that were read: frames with one stamp stay in their order.
    number: u64,
}

impl Frames {
    /// Frames of buses with stamps of these clocks.
    #[must_use]
    pub fn new(decoder: OdometryDecoder, clocks: impl IntoIterator<Item = StampClock>) -> Self {
        let line = |clock| Line {
            clock,
            more: false,
            held: 0,
            last_ns: i64::MIN,
        };
        let lines: Vec<Line> = clocks.into_iter().map(line).collect();
        Self {
            decoder,
            gyro: None,
            turn: None,
            inbox: List::with_capacity(FRAMES_PER_CALL * lines.len()),
            lines,
            unplaced: 0,
            next: 0,
        }
    }

    /// The same, of which some tell of a gyro.
    #[must_use]
    pub fn with_gyro(self, gyro: Option<GyroDecoder>) -> Self {
        Self { gyro, ..self }
    }

    /// What the frame that [`Self::next`] took last said of the gyro, once.
    pub fn turn(&mut self) -> Option<Result<GyroReading, FrameReject>> {
        self.turn.take()
    }

    /// The decoder, for its counters.
    #[must_use]
    pub fn decoder(&self) -> &OdometryDecoder {
        &self.decoder
    }

    /// Whether bus `number` may be drained: as much as one call brings finds room.
    #[must_use]
    pub fn has_room_for(&self, number: usize) -> bool {
        self.lines.get(number).is_some_and(|line| line.held == 0)
    }

    /// Takes in a frame of a bus that has room.
    pub fn take(&mut self, received: &Received) {
        let number = self.lines.iter().map(|line| line.held as u64).sum();
        let frame = Frame {
            received: *received,
            number,
        };
        if let Some(line) = self.lines.get_mut(usize::from(received.bus)) {
            line.held += usize::from(self.inbox.push(frame));
        }
    }

    /// Bus `number` was drained; `more`: there is something left.
    pub fn drained(&mut self, number: usize, more: bool) {
        if let Some(line) = self.lines.get_mut(number) {
            line.more = more;
        }
    }

    /// Whether nothing was left on any bus.
    #[must_use]
    pub fn emptied(&self) -> bool {
        !self.lines.iter().any(|line| line.more)
    }

    /// When the last frame came of those that were read as the inner clock \[ns\].
    #[must_use]
    pub fn newest_ns(&self) -> i64 {
        let last = self.lines.iter().map(|line| line.last_ns);
        last.max().unwrap_or(i64::MIN)
    }

    /// Whether there is anything to decode.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.inbox.is_empty()
    }

    /// What the next frame that can be decoded now makes; `None` once there is none. `moment` was read after the drain.
    ///
    /// # Errors
    /// Within: the frame does not count.
    pub fn next(&mut self, moment: &Moment) -> Option<Result<Option<WheelOdometry>, FrameReject>> {
        self.place(moment);
        let frame = self.inbox.as_slice().get(self.next)?.received;
        if self.lines.len() > 1 && frame.stamp_ns > self.latest_ns() {
            self.forget_decoded();
            return None;
        }
        self.next += 1;
        if let Some(line) = self.lines.get_mut(usize::from(frame.bus)) {
            line.held = line.held.saturating_sub(1);
        }
        let made = self.decoder.push(&frame);
        self.turn = self.gyro.as_mut().and_then(|gyro| gyro.push(&frame));
        if self.next == self.inbox.as_slice().len() {
            self.forget_decoded();
        }
        Some(made)
    }

    /// On one bus each frame when its turn comes, as what is due is known best then. On several buses all of them first: a
    /// burst must not be decoded one bus after the other, or the wheels' counts of different moments would make a pair.
    fn place(&mut self, moment: &Moment) {
        let several = self.lines.len() > 1;
        let end = if several {
            self.inbox.as_slice().len()
        } else {
            self.inbox.as_slice().len().min(self.next + 1)
        };
        if self.unplaced >= end {
            return;
        }
        (self.unplaced..end).for_each(|index| self.place_one(index, moment));
        self.unplaced = end;
        if several {
            self.inbox
                .sort_by_key(|frame| (frame.received.stamp_ns, frame.number));
        }
    }

    /// Reads a frame's stamp as the inner clock. The order of a bus is that of its frames, whatever was done to the clock of
    /// the stamps.
    fn place_one(&mut self, index: usize, moment: &Moment) {
        let Some(frame) = self.inbox.as_mut_slice().get_mut(index) else {
            return;
        };
        let received = &mut frame.received;
        let Some(line) = self.lines.get_mut(usize::from(received.bus)) else {
            return;
        };
        let came_ns = match line.clock {
            StampClock::Boottime => received.stamp_ns,
            StampClock::Realtime => moment
                .of_frame(received.stamp_ns)
                .settle(|| self.decoder.due_ns(received), moment.stamp.as_nanos()),
        };
        line.last_ns = came_ns.max(line.last_ns);
        received.stamp_ns = line.last_ns;
    }

    /// What came later than this must wait for older frames that another bus still holds.
    fn latest_ns(&self) -> i64 {
        let behind = self.lines.iter().filter(|line| line.more);
        behind.map(|line| line.last_ns).min().unwrap_or(i64::MAX)
    }

    fn forget_decoded(&mut self) {
        self.inbox.remove_first(self.next);
        self.unplaced -= self.next;
        self.next = 0;
    }
}

#[cfg(test)]
mod tests {
    use coloc_drivers::can::BusSpec;
    use coloc_drivers::encoder::{OdometryConfig, WheelFrames};

    use super::*;
    use crate::clock::{Drain, Reading, Timeline};

    const MS: i64 = 1_000_000;
    const METRES_PER_TICK: f64 = 1e-4;

    /// Frames of two wheels on `buses` buses, each of a wheel.
    fn frames(buses: u8) -> Frames {
        let bus = BusSpec::Local {
            directory: "bus".into(),
        };
        let mut config = OdometryConfig::differential(bus.clone(), 0.5, METRES_PER_TICK, 2.0);
        config.buses = vec![bus; usize::from(buses)];
        if let Some(wheels) = &mut config.wheels {
            wheels.right.bus = usize::from(buses - 1).try_into().unwrap();
        }
        let decoder = OdometryDecoder::new(&config).unwrap();
        Frames::new(decoder, (0..buses).map(|_| StampClock::Boottime))
    }

    fn moment(ms: i64) -> Moment {
        let reading = Reading {
            boot_ns: ms * MS,
            ..Reading::default()
        };
        Timeline::new(&reading).advance(&reading, Drain::EMPTIED)
    }

    fn received(frame: coloc_drivers::can::Frame, ms: i64, bus: u8) -> Received {
        Received {
            frame,
            stamp_ns: ms * MS,
            bus,
        }
    }

    fn samples(frames: &mut Frames, moment: &Moment) -> Vec<WheelOdometry> {
        std::iter::from_fn(|| frames.next(moment))
            .filter_map(|made| made.unwrap())
            .collect()
    }

    #[test]
    fn a_burst_on_two_buses_is_decoded_in_the_order_in_which_it_came() {
        let (mut frames, mut wheels) = (frames(2), WheelFrames::new(METRES_PER_TICK));
        let pairs: Vec<_> = (0..5)
            .map(|turn| wheels.encode(0.01 * f64::from(turn), 0.02 * f64::from(turn)))
            .collect();
        for (wheel, bus) in [(0, 0), (1, 1)] {
            for (turn, pair) in (0..).zip(&pairs) {
                frames.take(&received(pair[wheel], 20 * turn, bus));
            }
        }
        let samples = samples(&mut frames, &moment(100));
        assert_eq!(samples.len(), 4);
        assert!(
            samples
                .iter()
                .all(|it| (it.velocity[0] - 0.75).abs() < 1e-9)
        );
        assert!(frames.is_empty());
    }

    #[test]
    fn what_is_newer_than_what_another_bus_still_holds_waits() {
        let (mut frames, mut wheels) = (frames(2), WheelFrames::new(METRES_PER_TICK));
        let pairs: Vec<_> = (0..6)
            .map(|turn| wheels.encode(0.01 * f64::from(turn), 0.01 * f64::from(turn)))
            .collect();
        for (turn, pair) in (0..).zip(&pairs) {
            frames.take(&received(pair[1], 20 * turn, 1));
        }
        for (turn, pair) in (0..).zip(&pairs[..3]) {
            frames.take(&received(pair[0], 20 * turn, 0));
        }
        frames.drained(0, true);
        assert_eq!(samples(&mut frames, &moment(200)).len(), 2);
        assert!(!frames.emptied() && !frames.is_empty());
        assert!(frames.has_room_for(0) && !frames.has_room_for(1));
        for (turn, pair) in (3..).zip(&pairs[3..]) {
            frames.take(&received(pair[0], 20 * turn, 0));
        }
        frames.drained(0, false);
        assert_eq!(samples(&mut frames, &moment(200)).len(), 3);
        assert!(frames.emptied() && frames.is_empty());
    }
}
