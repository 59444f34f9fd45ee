//! How this robot's wheels say that it moved: the same buses and the same decoders as `colocd`'s, read a second time.

use std::collections::BTreeMap;

use coloc_daemon::clock::{Drain, KernelTime, TimeSource, Timeline};
use coloc_daemon::collect::frames::Frames;
use coloc_daemon::config::Config;
use coloc_drivers::can::{Bus, Filter};
use coloc_drivers::encoder::{
    BaseDecoder, BaseReading, OdometryConfig, OdometryCounters, OdometryDecoder, WheelOdometry,
};
use coloc_sensors::EndError;
use coloc_shm_types::{Odometry, OdometryKind};

/// A flood of frames is taken in so many turns at a time.
const MOST_TURNS: usize = 64;

/// So many sessions of bases at once; who was silent longest gives way.
const MOST_LIVES: usize = 16;

/// The buses, and the base that speaks on a channel.
#[derive(Debug)]
pub struct Wheels {
    buses: Vec<Bus>,
    frames: Option<Frames>,
    timeline: Timeline,
    base: Option<BaseDecoder>,
    lives: BTreeMap<(u16, u64), BaseDecoder>,
    counters: OdometryCounters,
}

impl Wheels {
    /// Opens the buses of `[odometry]`; without that section there are none.
    ///
    /// # Errors
    /// A signal that the DBC file does not have, or a bus that cannot be opened.
    pub fn open(config: &Config) -> Result<Self, EndError> {
        let odometry = config.odometry.as_ref();
        let on_can = odometry.filter(|it| it.is_on_can());
        let decoder = on_can.map(OdometryDecoder::new).transpose();
        let decoder = decoder.map_err(|error| EndError::Input(error.to_string()))?;
        let specs = on_can.map(|it| it.buses.as_slice()).unwrap_or_default();
        let buses = specs.iter().zip(0_u8..).map(|(spec, number)| {
            let ids = decoder.iter().flat_map(|it| it.wanted_ids(number));
            Bus::open(spec, number, Filter::ids(ids))
        });
        let buses: Result<Vec<_>, _> = buses.collect();
        let mut buses = buses.map_err(|error| EndError::Input(error.to_string()))?;
        Bus::play_together(&mut buses);
        let clocks = buses.iter().map(Bus::stamp_clock);
        let has_base = |it: &&OdometryConfig| it.base.is_some();
        let base = odometry.filter(has_base).map(BaseDecoder::new).transpose();
        Ok(Self {
            frames: decoder.map(|decoder| Frames::new(decoder, clocks)),
            buses,
            timeline: Timeline::new(&KernelTime.read()),
            base: base.map_err(|error| EndError::Input(error.to_string()))?,
            lives: BTreeMap::new(),
            counters: OdometryCounters::default(),
        })
    }

    /// Hands all that has come on the buses to `take`.
    pub fn drain(&mut self, take: &mut impl FnMut(&WheelOdometry)) {
        let Some(frames) = &mut self.frames else {
            return;
        };
        for _ in 0..MOST_TURNS {
            let not_before_ns = KernelTime.now_ns();
            for (number, bus) in self.buses.iter_mut().enumerate() {
                if frames.has_room_for(number) {
                    let drained = bus.receive(&mut |received| frames.take(received));
                    frames.drained(number, drained.more);
                }
            }
            let drain = Drain {
                emptied: frames.emptied(),
                not_before_ns,
            };
            let moment = self.timeline.advance(&KernelTime.read(), drain);
            // What does not count is counted by colocd.
            while let Some(made) = frames.next(&moment) {
                if let Ok(Some(odometry)) = made {
                    take(&odometry);
                }
            }
            if frames.emptied() {
                break;
            }
        }
        let now_ns = KernelTime.now_ns();
        self.buses.iter_mut().for_each(|bus| bus.supervise(now_ns));
    }

    /// What a message of a base comes to that was checked, whose stamps are of `CLOCK_BOOTTIME`.
    pub fn hear(&mut self, message: &Odometry) -> Option<WheelOdometry> {
        let unheard = self.base?;
        let key = (message.header.source, message.header.session);
        if self.lives.len() >= MOST_LIVES && !self.lives.contains_key(&key) {
            let oldest = self.lives.iter().min_by_key(|(_, it)| it.last_ns());
            let oldest = oldest.map(|(key, _)| *key)?;
            self.lives.remove(&oldest);
        }
        let life = self.lives.entry(key).or_insert(unheard);
        let stamp_ns = message.header.stamp_ns;
        match reading(message)? {
            BaseReading::Velocity(velocity) if message.start_ns != 0 => {
                life.over(velocity, (message.start_ns, stamp_ns)).ok()
            }
            reading => life.push(reading, stamp_ns, &mut self.counters)?.ok()?,
        }
    }
}

fn reading(message: &Odometry) -> Option<BaseReading> {
    let [first, second, third, _] = message.values;
    #[allow(clippy::cast_possible_truncation)] // Whole, and below 2^53: the message was checked.
    let count = |value: f64| value as i64;
    Some(match message.kind().ok()? {
        OdometryKind::Twist => BaseReading::Velocity([first, second, third]),
        OdometryKind::WheelDistances => BaseReading::Distances([first, second]),
        OdometryKind::WheelCounts => BaseReading::Counts([first, second].map(count)),
    })
}
