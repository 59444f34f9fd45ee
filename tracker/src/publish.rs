//! The channels: what is heard, and what is said.

use std::os::fd::BorrowedFd;

use coloc_daemon::config::{ClockSource, Config};
use coloc_sensors::{EndError, Moment};
use coloc_shm_types::{
    Clock, Estimate, Increment, Message, PortError, Publisher, RelativePose, Sender, Sighting,
    Space, Subscriber, Tracked,
};

use crate::feed::Fed;
use crate::tracker::{Bearing, Moved, Tracker};

/// Its ears and its mouths.
#[derive(Debug)]
pub struct Channels {
    estimates: Subscriber<Estimate>,
    sightings: Subscriber<Sighting>,
    increments: Subscriber<Increment>,
    tracks: Publisher<Tracked>,
    sender: Sender,
    peers: Vec<Peer>,
    /// To `colocd`, where that hears of other robots by way of it.
    feed: Option<Mouth>,
}

/// To `colocd`.
#[derive(Debug)]
struct Mouth {
    sightings: Publisher<Sighting>,
    poses: Publisher<RelativePose>,
    sender: Sender,
}

/// Another robot.
#[derive(Debug)]
struct Peer {
    id: u16,
    port: Publisher<Increment>,
    sender: Sender,
}

impl Channels {
    /// Of the robot of a configuration.
    ///
    /// # Errors
    /// If a channel cannot be opened.
    pub fn open(space: &Space, config: &Config) -> Result<Self, EndError> {
        let name = &config.robot.name;
        // Stamps that go to other computers are of a clock that these have too.
        let clock = match config.clock.source {
            ClockSource::Boottime => Clock::Boottime,
            ClockSource::Realtime | ClockSource::Tai => Clock::Realtime,
        };
        let random = EndError::of("no random number");
        let sender = Sender::start(config.robot.id, Clock::Boottime).map_err(random)?;
        let random = EndError::of("no random number");
        let outward = Sender::start(config.robot.id, clock).map_err(random)?;
        let peers = config.peers().map(|peer| {
            Ok(Peer {
                id: peer.id,
                port: space.publisher(&peer.name)?,
                sender: outward.beside(),
            })
        });
        let peers: Result<_, PortError> = peers.collect();
        let random = EndError::of("no random number");
        let fed = Sender::start(RelativePose::TRACK, Clock::Boottime).map_err(random)?;
        let feed = config.sighting.through_track.then(|| {
            Ok(Mouth {
                sightings: space.publisher(name)?,
                poses: space.publisher(name)?,
                sender: fed,
            })
        });
        let feed: Result<_, PortError> = feed.transpose();
        Ok(Self {
            estimates: space.subscriber(name)?,
            sightings: space.subscriber(name)?,
            increments: space.subscriber(name)?,
            tracks: space.publisher(name)?,
            sender,
            peers: peers?,
            feed: feed?,
        })
    }

    /// Readable once `colocd` has said something.
    ///
    /// # Errors
    /// If the channel is lost.
    pub fn bell(&self) -> Result<BorrowedFd<'_>, EndError> {
        Ok(self.estimates.bell()?)
    }

    /// Takes in all that has come, and tells the others what they should know of it; of how many bytes it was.
    pub fn hear(&mut self, tracker: &mut Tracker, now: Moment) -> u64 {
        let mut bytes = 0;
        while let Some(estimate) = next(&self.estimates, &mut bytes) {
            tracker.hear_estimate(&estimate, now);
        }
        while let Some(increment) = next(&self.increments, &mut bytes) {
            tracker.hear_increment(&increment, now);
        }
        while let Some(sighting) = next(&self.sightings, &mut bytes) {
            if let Some(bearing) = tracker.hear_sighting(&sighting, now) {
                self.tell_bearing(&bearing, tracker, now);
            }
        }
        bytes
    }

    fn tell_bearing(&mut self, bearing: &Bearing, tracker: &mut Tracker, now: Moment) {
        let peer = self.peers.iter_mut().find(|it| it.id == bearing.to);
        if let Some(peer) = peer {
            let is_taken = peer.tell(now, [bearing.at_ns; 2], |message| Increment {
                flags: Increment::BEARING,
                bearing: bearing.bearing_rad,
                bearing_variance: bearing.variance,
                ..message
            });
            tracker.note_said(bearing.at_ns, is_taken);
        }
    }

    /// Tells all others how this robot moved.
    pub fn tell_moved(&mut self, moved: &Moved, tracker: &mut Tracker, now: Moment) {
        let Moved { span_ns, increment } = moved;
        let covariance = increment.covariance;
        for peer in &mut self.peers {
            let is_taken = peer.tell(now, *span_ns, |message| Increment {
                displacement: increment.displacement.into(),
                covariance: std::array::from_fn(|it| covariance[(it / 3, it % 3)]),
                ..message
            });
            tracker.note_said(span_ns[1], is_taken);
        }
    }

    /// Says to `colocd` what it hears by way of the tracks.
    pub fn feed(&mut self, tracker: &mut Tracker) {
        for fed in tracker.fed() {
            let Some(mouth) = &mut self.feed else {
                return;
            };
            let (at_ns, sent) = match fed {
                Fed::Sighting(message) => (message.header.stamp_ns, mouth.sightings.send(message)),
                Fed::Pose(at_ns, pose) => {
                    let header = mouth.sender.header(at_ns);
                    (at_ns, mouth.poses.send(RelativePose { header, ..*pose }))
                }
            };
            tracker.note_said(at_ns, sent.is_ok());
        }
    }

    /// Publishes where the others are.
    pub fn tell_tracks(&mut self, tracker: &mut Tracker) {
        let told: Vec<_> = tracker.told().collect();
        for (at_ns, tracked) in told {
            let header = self.sender.header(at_ns);
            let sent = self.tracks.send(Tracked { header, ..tracked });
            tracker.note_said(at_ns, sent.is_ok());
        }
    }
}

/// What cannot be read is as if it had not come.
fn next<M: Message>(messages: &Subscriber<M>, bytes: &mut u64) -> Option<M> {
    let message = messages.receive().ok().flatten();
    *bytes += message.as_ref().map_or(0, |_| size_of::<M>() as u64);
    message
}

impl Peer {
    /// Of a span by `CLOCK_BOOTTIME`, by the clock that the others understand.
    fn tell(
        &mut self,
        now: Moment,
        span_ns: [i64; 2],
        filled: impl FnOnce(Increment) -> Increment,
    ) -> bool {
        let ahead_ns = match self.sender.clock() {
            Clock::Boottime => 0,
            Clock::Realtime | Clock::Tai => now.realtime_ns.saturating_sub(now.boottime_ns),
        };
        let [start_ns, end_ns] = span_ns.map(|it| it.saturating_add(ahead_ns));
        let message = filled(Increment {
            header: self.sender.header(end_ns),
            start_ns,
            ..Increment::default()
        });
        self.port.send(message).is_ok()
    }
}
