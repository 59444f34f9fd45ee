//! What the channels say, put together to samples of odometry.
//!
//! * What is said of each channel first only says where counting starts.
//! * A sample is formed when every channel has news, and the news belong together: stamps no farther apart than half a
//!   period. Where something was lost this waits for the channel that lags (for `pair_frames` at most), so that a turn is not
//!   made of one wheel's motion and the other's rest.
//! * What counters count is never lost with a frame: the next sample covers the longer time. Where that is longer than
//!   `longest_rate_s` and [`BRIDGED_PERIODS`], nobody knows the path: the sample has the spread of every path that ends so.
//! * What comes less than 1 ms apart (a backlog that came at once) goes into one sample.
//! * What has not moved for [`STILL_AFTER_NS`] while it was listened to stands; after a single sample without a count nobody knows.
//!   An encoder at the edge of a count dithers: what comes back stands, until the way is longer than [`DITHER_COUNTS`]; then all of
//!   it is said.
//! * An angle is of the moment of its frame: a sample has that at its beginning and that at its end.
//! * No sample is faster than the robot can be. Where late frames come at once, their way is spread over what follows.

use std::f64::consts::TAU;

use super::channel::{Channel, Continuity, Part, Update};
use super::counters::OdometryCounters;
use super::kinematics::{Kinematics, NO_SPREAD, Spread, Twist};
use super::reject::FrameReject;
use super::said::Said;
use super::slip::{Slip, SlipLimits, SlipWatch};
use super::tolerance::{SHORTEST_INTERVAL_NS, Tolerance, seconds};

/// The mean velocity of the body over `(start_ns, stamp_ns]`.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct WheelOdometry {
    /// Stamp of the sample before \[ns\].
    pub start_ns: i64,
    /// The latest of the stamps of what made it \[ns\]; later than `start_ns`.
    pub stamp_ns: i64,
    /// `[v_x, v_y, ω]` \[m/s, m/s, rad/s\]; finite.
    pub velocity: [f64; 3],
    /// Whether the robot was measured to stand.
    pub rest: Rest,
    /// Covariance of `velocity` beside the noise that such a velocity has anyway: of a steering angle, of wheels each for itself,
    /// of slip. Zero where nothing is known of it.
    pub spread: [[f64; 3]; 3],
}

/// What says that a robot stands.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub enum Rest {
    /// Nothing: it moves, or did a moment ago.
    #[default]
    Moving,
    /// Speeds of exactly zero, of which some encoders have a dead band, for [`STILL_AFTER_NS`] and longer.
    Speeds,
    /// Counts or distances that have not changed for [`STILL_AFTER_NS`] and longer.
    Counts,
}

/// A robot that drives slowly has pauses between two counts, shorter than this \[ns\].
pub const STILL_AFTER_NS: i64 = 1_000_000_000;

/// Between frames so many usual times apart a robot is taken to go on as it did.
const BRIDGED_PERIODS: f64 = 4.5;

/// A robot that stands may be so many counts from where it began to.
const DITHER_COUNTS: f64 = 2.0;

/// The most channels that kinematics take.
pub const MAX_CHANNELS: usize = 4;

/// The channels of a robot, and the sample that they are about to make.
#[derive(Copy, Clone, Debug)]
pub(super) struct Merge {
    channels: [Option<Channel>; MAX_CHANNELS],
    kinematics: Kinematics,
    tolerance: Tolerance,
    start_ns: Option<i64>,
    /// Times that something came while the channels' news did not belong together.
    held: u32,
    /// Stamp of the newest frame of all \[ns\].
    latest_ns: Option<i64>,
    /// Since when nothing has moved, if nothing does \[ns\].
    still_since_ns: Option<i64>,
    near: Option<Near>,
    /// The sample before said that it stands by its counts.
    stands: bool,
    /// Time between two frames as it was known when the interval began.
    usual_ns: Option<i64>,
    slip: Option<SlipWatch>,
    pub(super) counters: OdometryCounters,
}

/// Since when no wheel is more than a count from where it was, and how far it is \[m\].
#[derive(Copy, Clone, Debug)]
struct Near {
    since_ns: i64,
    ways_m: [f64; MAX_CHANNELS],
}

/// What is new for each channel, checked but not applied yet.
pub(super) type Updates = [Option<(usize, Update)>; MAX_CHANNELS];

impl Merge {
    /// Channels beyond [`MAX_CHANNELS`] are left out.
    pub(super) fn new(
        channels: impl IntoIterator<Item = Channel>,
        kinematics: Kinematics,
        tolerance: Tolerance,
    ) -> Self {
        let mut places = [None; MAX_CHANNELS];
        for (place, channel) in places.iter_mut().zip(channels) {
            *place = Some(channel);
        }
        Self {
            channels: places,
            kinematics,
            tolerance,
            start_ns: None,
            held: 0,
            latest_ns: None,
            still_since_ns: None,
            near: None,
            stands: false,
            usual_ns: None,
            slip: None,
            counters: OdometryCounters::default(),
        }
    }

    /// Watches over slip from `limits` on, of which the counts are known here.
    pub(super) fn watching(mut self, limits: Option<SlipLimits>) -> Self {
        let counts = |channel: &Option<Channel>| channel.map_or(0.0, |it| it.count_m());
        let counts_m = self.channels.each_ref().map(counts);
        self.slip = limits.map(|limits| SlipWatch::new(SlipLimits { counts_m, ..limits }));
        self
    }

    /// How often wheels began to slip.
    pub(super) fn slips(&self) -> u64 {
        self.slip.as_ref().map_or(0, SlipWatch::count)
    }

    /// Wheels that do not fit the others, now.
    pub(super) fn slip(&self) -> Option<Slip> {
        self.slip.as_ref()?.slip()
    }

    /// What was said of channels at one moment; if one refuses, it does not count for any.
    pub(super) fn check(
        &mut self,
        said: impl Iterator<Item = (usize, Result<Said, FrameReject>)>,
        stamp_ns: i64,
    ) -> Result<Updates, FrameReject> {
        let mut updates = [None; MAX_CHANNELS];
        let mut refused = None;
        for (place, (index, said)) in updates.iter_mut().zip(said) {
            let Some(channel) = self.channel(index) else {
                continue;
            };
            match said.and_then(|said| channel.check(said, stamp_ns)) {
                Ok(update) => *place = Some((index, update)),
                // The others look at it all the same: they too must recognise a restarted encoder.
                Err(reason) => {
                    refused.get_or_insert(reason);
                }
            }
        }
        refused.map_or(Ok(updates), Err)
    }

    /// Applies what [`Self::check`] found.
    pub(super) fn apply(&mut self, updates: Updates, stamp_ns: i64) {
        let mut continued = true;
        for (index, update) in updates.into_iter().flatten() {
            let Some(channel) = self.channel(index) else {
                continue;
            };
            let continuity = channel.accept(update, stamp_ns);
            continued &= continuity == Continuity::Continued;
            self.counters.note(continuity);
        }
        if !continued {
            self.begin_anew(stamp_ns);
        }
    }

    /// The sample that is complete now, if one is.
    ///
    /// # Errors
    /// [`FrameReject::Implausible`]: the way is longer than late frames explain.
    pub(super) fn form_sample(&mut self) -> Result<Option<WheelOdometry>, FrameReject> {
        let Some((start_ns, stamp_ns)) = self.interval() else {
            return Ok(None);
        };
        let dt_s = seconds(stamp_ns.saturating_sub(start_ns));
        let least_s = self.channels().map(Channel::least_s).fold(0.0, f64::max);
        // Rounding is no reason to wait.
        let late = least_s > dt_s * (1.0 + 1e-9);
        if late && least_s - dt_s > self.tolerance.latest_s {
            self.counters.gaps += 1;
            self.begin_anew(stamp_ns);
            return Err(FrameReject::Implausible);
        }
        if late && dt_s < self.tolerance.longest_wait_s {
            return Ok(None);
        }
        if self.dithers(start_ns, stamp_ns) {
            return Ok(Some(self.form_rest(start_ns, stamp_ns)));
        }
        let twist = self.twist(dt_s.max(least_s));
        let Twist { velocity, spread } = self.bridged(twist, dt_s);
        self.begin_interval(stamp_ns, if late { dt_s / least_s } else { 1.0 });
        self.counters.samples += 1;
        self.counters.late_ways += u64::from(late);
        let rest = self.rest(velocity, start_ns);
        self.stands = rest == Rest::Counts;
        Ok(Some(WheelOdometry {
            start_ns,
            stamp_ns,
            velocity,
            rest,
            spread,
        }))
    }

    /// A sample of a robot that stands while its counts dither: their way is kept for when it goes.
    fn form_rest(&mut self, start_ns: i64, stamp_ns: i64) -> WheelOdometry {
        self.begin_interval(stamp_ns, 0.0);
        self.counters.samples += 1;
        self.stands = true;
        let near_since_ns = self.near.map_or(start_ns, |near| near.since_ns);
        let since_ns = self.still_since_ns.unwrap_or(near_since_ns);
        self.still_since_ns = Some(since_ns.min(near_since_ns));
        WheelOdometry {
            start_ns,
            stamp_ns,
            velocity: [0.0; 3],
            rest: Rest::Counts,
            spread: NO_SPREAD,
        }
    }

    /// Whether it stands although something was counted.
    fn dithers(&mut self, start_ns: i64, stamp_ns: i64) -> bool {
        if self.channels().any(Channel::is_speed) {
            return false;
        }
        let came_back = self.has_come_back(start_ns, stamp_ns);
        let is_counted = self.channels().any(|it| it.counts() != 0.0);
        let is_little = self
            .channels()
            .all(|it| it.counts().abs() <= DITHER_COUNTS + 0.5);
        is_counted && (came_back || (self.stands && is_little))
    }

    /// Whether every wheel is where it was a second ago, and was never more than a count away.
    fn has_come_back(&mut self, start_ns: i64, stamp_ns: i64) -> bool {
        let said =
            |channel: &Option<Channel>| channel.map_or([0.0; 2], |it| [it.way_m(), it.count_m()]);
        let said = self.channels.each_ref().map(said);
        let near = self.near.get_or_insert(Near {
            since_ns: start_ns,
            ways_m: [0.0; MAX_CHANNELS],
        });
        // What is kept while it stands is in the next way again.
        let before = if self.stands {
            [0.0; MAX_CHANNELS]
        } else {
            near.ways_m
        };
        near.ways_m = std::array::from_fn(|it| before[it] + said[it][0]);
        let within = |counts: f64| {
            let mut ways = near.ways_m.iter().zip(&said);
            ways.all(|(way_m, [_, count_m])| way_m.abs() <= counts * count_m)
        };
        if !within(1.5) {
            *near = Near {
                since_ns: stamp_ns,
                ways_m: [0.0; MAX_CHANNELS],
            };
            return false;
        }
        within(0.5) && start_ns.saturating_sub(near.since_ns) >= STILL_AFTER_NS
    }

    /// After a silence only the sum of the counts is known. The robot ends within its highest speed's reach, and its mean says
    /// somewhere else: the farthest that these can be apart is 3 σ. Velocities are held along an arc, which shows only its chord
    /// of them, by the turn without whole turns: who uses this leaves these out, since an arc that closes shows nothing.
    fn bridged(&self, twist: Twist, dt_s: f64) -> Twist {
        let usual_s = self.usual_ns.map_or(0.0, seconds);
        let longest_s = self.tolerance.longest_rate_s.max(BRIDGED_PERIODS * usual_s);
        let max_speed_mps = self
            .channels()
            .map(Channel::max_speed_mps)
            .fold(0.0, f64::max);
        if dt_s <= longest_s || max_speed_mps == 0.0 {
            return twist;
        }
        let [x, y, turn_rate] = twist.velocity;
        let mut spread = twist.spread;
        let turn_rad = turn_rate * dt_s;
        let turn_rad = turn_rad - (turn_rad / TAU).round() * TAU;
        let sigma_mps = (max_speed_mps + x.hypot(y)) / (3.0 * chord_of_arc(turn_rad));
        spread[0][0] += sigma_mps * sigma_mps;
        spread[1][1] += sigma_mps * sigma_mps;
        Twist { spread, ..twist }
    }

    /// What an interval from `start_ns` with that velocity says of standing, by what was before.
    pub(super) fn rest(&mut self, velocity: [f64; 3], start_ns: i64) -> Rest {
        if velocity.iter().any(|&it| it != 0.0) {
            self.still_since_ns = None;
            return Rest::Moving;
        }
        let since_ns = *self.still_since_ns.get_or_insert(start_ns);
        if start_ns.saturating_sub(since_ns) < STILL_AFTER_NS {
            return Rest::Moving;
        }
        if self.channels().any(Channel::is_speed) {
            Rest::Speeds
        } else {
            Rest::Counts
        }
    }

    /// Time between two frames of a channel, as far as seen.
    pub(super) fn period_ns(&self, index: usize) -> Option<i64> {
        self.channels.get(index)?.as_ref()?.period_ns()
    }

    /// `said` is the part of the way that the interval before has accounted for.
    fn begin_interval(&mut self, stamp_ns: i64, said: f64) {
        (self.start_ns, self.held) = (Some(stamp_ns), 0);
        self.usual_ns = self.channels().filter_map(Channel::period_ns).max();
        for channel in self.channels.iter_mut().flatten() {
            channel.begin_interval(said);
        }
    }

    /// All that was before is given up, also what a channel has not said yet of the time before.
    fn begin_anew(&mut self, stamp_ns: i64) {
        self.begin_interval(stamp_ns, 1.0);
        (self.still_since_ns, self.near, self.stands) = (None, None, false);
        if let Some(slip) = &mut self.slip {
            slip.forget();
        }
        for channel in self.channels.iter_mut().flatten() {
            channel.begin_anew(stamp_ns);
        }
    }

    /// Start and end of a sample, if there is enough for one.
    fn interval(&mut self) -> Option<(i64, i64)> {
        self.note_latest();
        let (start_ns, stamp_ns) = (self.start_ns?, self.latest_news_ns()?);
        let dt_ns = stamp_ns.checked_sub(start_ns)?;
        if dt_ns < SHORTEST_INTERVAL_NS {
            return None;
        }
        if self.news_belong_together(stamp_ns) {
            self.held = 0;
        } else if self.held < self.tolerance.pair_frames {
            self.held += 1;
            return None;
        }
        Some((start_ns, stamp_ns))
    }

    /// After a pause every channel is waited for anew: what one has come in the pause is in its first frame alone.
    fn note_latest(&mut self) {
        let latest_ns = self.channels().filter_map(Channel::last_ns).max();
        let pause_ns = latest_ns
            .zip(self.latest_ns)
            .map(|(now, last)| now.saturating_sub(last));
        let period_ns = self.channels().filter_map(Channel::period_ns).max();
        if pause_ns
            .zip(period_ns)
            .is_some_and(|(pause, period)| pause > period.saturating_mul(2))
        {
            self.held = 0;
        }
        self.latest_ns = latest_ns;
    }

    /// The latest stamp, if every channel has news.
    fn latest_news_ns(&self) -> Option<i64> {
        let complete = self.channels().all(Channel::has_news);
        let latest = self.channels().filter_map(Channel::last_ns).max();
        latest.filter(|_| complete)
    }

    fn news_belong_together(&self, latest_ns: i64) -> bool {
        let earliest_ns = self.channels().filter_map(Channel::last_ns).min();
        let apart_ns = latest_ns.saturating_sub(earliest_ns.unwrap_or(latest_ns));
        let period_ns = self.channels().filter_map(Channel::period_ns).min();
        period_ns.is_none_or(|period_ns| apart_ns <= period_ns / 2)
    }

    fn twist(&mut self, dt_s: f64) -> Twist {
        let part = |channel: &Option<Channel>| channel.map_or(Part::default(), |it| it.part(dt_s));
        let parts = self.channels.each_ref().map(part);
        let twist = self.kinematics.twist(&parts, dt_s);
        let slip = self.slip_of(parts.map(|it| it.value), dt_s);
        let sum =
            |place: usize| [0, 1, 2].map(|it: usize| twist.spread[place][it] + slip[place][it]);
        Twist {
            spread: [0, 1, 2].map(sum),
            ..twist
        }
    }

    fn slip_of(&mut self, speeds: [f64; MAX_CHANNELS], dt_s: f64) -> Spread {
        match (&mut self.slip, &self.kinematics) {
            (Some(watch), Kinematics::LeastSquares(wheels)) => watch.note(wheels, speeds, dt_s),
            _ => NO_SPREAD,
        }
    }

    fn channels(&self) -> impl Iterator<Item = &Channel> {
        self.channels.iter().flatten()
    }

    fn channel(&mut self, index: usize) -> Option<&mut Channel> {
        self.channels.get_mut(index)?.as_mut()
    }
}

/// The chord of an arc that turns by at most half a turn, as a part of the arc.
fn chord_of_arc(turn_rad: f64) -> f64 {
    let half_rad = 0.5 * turn_rad.abs();
    if half_rad < 1e-6 {
        1.0
    } else {
        half_rad.sin() / half_rad
    }
}
