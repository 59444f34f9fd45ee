//! Who may say what to whom: the one table of all channels. Qualities of services are derived from it, and a network that is
//! to carry a channel carries it by this table.
use core::fmt::Debug;

use iceoryx2::prelude::ZeroCopySend;

use crate::{
    Answer, Assist, AssistAck, Call, Correction, DriverStatus, Estimate, Evidence, Gyro, Header,
    Heading, Increment, Integrity, Neighbour, Odometry, Plain, Pose, Position, Readings,
    RelativePose, Round, Scan, Seen, Share, Shared, Sighting, Status, Timing, Tracked,
};

/// A service of a robot: `coloc/<robot>/<channel>`.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Hash)]
pub enum Channel {
    /// How the base moves, where that does not come over CAN.
    Odometry,
    /// Sightings of other robots.
    RelativePose,
    /// Fixes.
    Position,
    /// What neighbours say.
    Neighbour,
    /// The pose, as a person or a map says it.
    Pose,
    /// Headings.
    Heading,
    /// Yaw rates.
    Gyro,
    /// Sightings that say a part only.
    Sighting,
    /// What other robots say that have seen this one so.
    Seen,
    /// What robots say that this one has seen so.
    Answer,
    /// What leaders say of it.
    Assist,
    /// What became of that where it was handed on.
    AssistAck,
    /// The belief.
    Estimate,
    /// Where the daemon's time goes.
    Timing,
    /// The counters.
    Status,
    /// How the sensors' drivers are doing.
    DriverStatus,
    /// What laser scanners see.
    Scan,
    /// How other robots move, and at which bearing they saw this one.
    Increment,
    /// Where neighbours are, seen from here.
    Tracked,
    /// What a robot's own sensors say of a slot, with hard bounds.
    Evidence,
    /// Where the robot must be, and whether its estimate can be right.
    Integrity,
    /// What is believed at a slot, for who makes rounds.
    Shared,
    /// What a robot believes and sees at a slot, for a leader.
    Share,
    /// What came of a slot.
    Round,
    /// Who is there at a slot, and the question for a round.
    Call,
    /// What rounds do to the belief.
    Correction,
    /// What robots see of children, for leaders.
    Readings,
}

/// What is said on a channel, and how its service is dimensioned.
///
/// All of them overflow: the newest message pushes out the oldest, nobody ever waits.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Told {
    /// The channel.
    pub channel: Channel,
    /// The last part of the service's name.
    pub name: &'static str,
    /// What it carries, in a few words.
    pub what: &'static str,
    /// Who says it.
    pub by: Speaker,
    /// To whom.
    pub to: Audience,
    /// How old it may get and still be of use.
    pub age: Age,
    /// Whether all of them matter, or the newest alone.
    pub matters: Matters,
    /// Size of a message (bytes).
    pub size: usize,
    /// Whether who joins later gets the last one.
    pub late_joiner: bool,
    /// Publishers at once, those that were killed and not yet reaped included.
    pub publishers: usize,
    /// Subscribers at once, likewise.
    pub subscribers: usize,
    /// Messages of one publisher that wait for one subscriber.
    pub buffer: usize,
}

/// Who may say something on a channel of a robot.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Speaker {
    /// Drivers of the robot's own sensors.
    Drivers,
    /// The robot's own `colocd`.
    Own,
    /// Other robots' `colocd`, each as itself.
    Neighbours,
    /// The robot's own `coloc-track`.
    Tracker,
    /// Other robots' `coloc-track`, each as itself.
    Trackers,
    /// The robot's own `coloc-bounds`.
    Bounds,
    /// The robot's own `coloc-rounds`.
    Rounds,
}

/// For whom it is.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Audience {
    /// The robot's `colocd`, and whoever listens in.
    Robot,
    /// Anyone.
    Anyone,
}

/// How old something may get and still be of use.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Age {
    /// As far as the history of the estimator reaches: `history.length_s`.
    History,
    /// That many milliseconds.
    Millis(u32),
}

/// What of a channel matters.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Matters {
    /// Every message: a lost one is lost information.
    All,
    /// The newest: it makes the earlier ones needless.
    Newest,
}

/// How a service is dimensioned.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub struct Quality {
    /// Publishers at once, those that were killed and not yet reaped included.
    pub publishers: usize,
    /// Subscribers at once, likewise.
    pub subscribers: usize,
    /// Messages of one publisher that wait for one subscriber.
    pub buffer: usize,
    /// Messages that a subscriber gets which joins later.
    pub history: usize,
}

/// Anything that a sensor's driver says.
const DRIVERS: Told = Told {
    channel: Channel::Odometry,
    name: "",
    what: "",
    by: Speaker::Drivers,
    to: Audience::Robot,
    age: Age::History,
    matters: Matters::All,
    size: 0,
    late_joiner: false,
    // A receiver or a scanner each, and the zombies of their restarts.
    publishers: 16,
    subscribers: 16,
    // Half a second of a sensor at 100 Hz, and three ticks of one at 1 kHz.
    buffer: 64,
};

/// Anything that the daemon says about itself.
const DAEMON: Told = Told {
    by: Speaker::Own,
    to: Audience::Anyone,
    matters: Matters::Newest,
    late_joiner: true,
    // One daemon, and the zombies of its restarts.
    publishers: 4,
    ..DRIVERS
};

/// What `coloc-rounds` says to the others of a team.
const ROUNDS: Told = Told {
    by: Speaker::Rounds,
    to: Audience::Anyone,
    age: Age::Millis(1000),
    publishers: 4,
    // All others of a team that makes rounds, and who listens in.
    subscribers: 24,
    buffer: 4,
    ..DRIVERS
};

impl Channel {
    /// So many other robots can speak to one.
    pub const TEAM: usize = 64;

    /// The table, in the order of the channels.
    ///
    /// Whoever opens a service first fixes its quality, so a change here is seen once all processes have restarted.
    pub const TABLE: [Told; 27] = [
        Told {
            channel: Self::Odometry,
            name: "odometry",
            what: "wheel distances, wheel counts or a body twist, of a base that does not speak CAN",
            size: size_of::<Odometry>(),
            // Five seconds of a base at 50 Hz: a robot that was stopped for so long loses no way.
            buffer: 256,
            ..DRIVERS
        },
        Told {
            channel: Self::RelativePose,
            name: "relative_pose",
            what: "sightings of other robots",
            size: size_of::<RelativePose>(),
            ..DRIVERS
        },
        Told {
            channel: Self::Position,
            name: "position",
            what: "satellite fixes",
            size: size_of::<Position>(),
            ..DRIVERS
        },
        Told {
            channel: Self::Neighbour,
            name: "neighbour",
            what: "where other robots have seen this one",
            by: Speaker::Neighbours,
            size: size_of::<Neighbour>(),
            // And the zombies of some.
            publishers: Self::TEAM + 16,
            buffer: 16,
            ..DRIVERS
        },
        Told {
            channel: Self::Pose,
            name: "pose",
            what: "this robot's pose, set by a person or said by a map",
            size: size_of::<Pose>(),
            // A localiser, a person or two, and the zombies of their restarts.
            publishers: 8,
            subscribers: 8,
            buffer: 16,
            ..DRIVERS
        },
        Told {
            channel: Self::Heading,
            name: "heading",
            what: "which way the robot looks: a compass, two antennas, the course over ground",
            size: size_of::<Heading>(),
            ..DRIVERS
        },
        Told {
            channel: Self::Gyro,
            name: "gyro",
            what: "yaw rates",
            size: size_of::<Gyro>(),
            // One gyro, its driver's restarts, and who listens in.
            publishers: 8,
            subscribers: 8,
            // A second at 200 Hz: a robot that was stopped for so long loses no turn.
            buffer: 256,
            ..DRIVERS
        },
        Told {
            channel: Self::Sighting,
            name: "sighting",
            what: "sightings of other robots and landmarks that say a part only: range and bearing, or one of the two",
            size: size_of::<Sighting>(),
            ..DRIVERS
        },
        Told {
            channel: Self::Seen,
            name: "seen",
            what: "where other robots have seen this one in part, and the question where it believes to be",
            by: Speaker::Neighbours,
            size: size_of::<Seen>(),
            // And the zombies of some.
            publishers: Self::TEAM + 16,
            buffer: 16,
            ..DRIVERS
        },
        Told {
            channel: Self::Answer,
            name: "answer",
            what: "where robots believed to be that this one has seen in part",
            by: Speaker::Neighbours,
            size: size_of::<Answer>(),
            publishers: Self::TEAM + 16,
            buffer: 16,
            ..DRIVERS
        },
        Told {
            channel: Self::Assist,
            name: "assist",
            what: "where leaders have this robot, through whatever chain of children",
            by: Speaker::Neighbours,
            size: size_of::<Assist>(),
            publishers: Self::TEAM + 16,
            buffer: 16,
            ..DRIVERS
        },
        Told {
            channel: Self::AssistAck,
            name: "assist_ack",
            what: "whether a child has used what this one handed on to it",
            by: Speaker::Neighbours,
            size: size_of::<AssistAck>(),
            publishers: Self::TEAM + 16,
            buffer: 16,
            ..DRIVERS
        },
        Told {
            channel: Self::Estimate,
            name: "estimate",
            what: "both poses, velocity, covariances, and whether to drive on them, at every tick",
            age: Age::Millis(1000),
            size: size_of::<Estimate>(),
            subscribers: 32,
            buffer: 16,
            ..DAEMON
        },
        Told {
            channel: Self::Timing,
            name: "timing",
            what: "where the time of every tick went, inside of the daemon",
            age: Age::Millis(5000),
            matters: Matters::All,
            size: size_of::<Timing>(),
            late_joiner: false,
            // For who measures the daemon, not for everybody's every day.
            subscribers: 8,
            // A tenth of a second at 1 kHz: they come in bursts of half of that.
            buffer: 128,
            ..DAEMON
        },
        Told {
            channel: Self::Status,
            name: "status",
            what: "counters and health of every source, once a second",
            age: Age::Millis(5000),
            size: size_of::<Status>(),
            // A message is large, and its memory is reserved for every subscriber that there may be.
            subscribers: 16,
            buffer: 2,
            ..DAEMON
        },
        Told {
            channel: Self::DriverStatus,
            name: "driver",
            what: "what each driver of a sensor has heard, said and refused, once a second",
            to: Audience::Anyone,
            age: Age::Millis(5000),
            matters: Matters::Newest,
            size: size_of::<DriverStatus>(),
            late_joiner: true,
            buffer: 4,
            ..DRIVERS
        },
        Told {
            channel: Self::Scan,
            name: "scan",
            what: "what a laser scanner sees, for `coloc-laser`",
            to: Audience::Anyone,
            age: Age::Millis(1000),
            size: size_of::<Scan>(),
            // A message is large, and its memory is reserved for every subscriber that there may be.
            publishers: 8,
            subscribers: 8,
            buffer: 4,
            ..DRIVERS
        },
        Told {
            channel: Self::Increment,
            name: "increment",
            what: "how other robots move by their own wheels, and at which bearing they saw this one, for `coloc-track`",
            by: Speaker::Trackers,
            to: Audience::Anyone,
            age: Age::Millis(1000),
            size: size_of::<Increment>(),
            // And the zombies of some.
            publishers: Self::TEAM + 16,
            subscribers: 8,
            buffer: 64,
            ..DRIVERS
        },
        Told {
            channel: Self::Tracked,
            name: "tracked",
            what: "where neighbours are, seen from here, as `coloc-track` has it",
            by: Speaker::Tracker,
            to: Audience::Anyone,
            age: Age::Millis(1000),
            matters: Matters::Newest,
            size: size_of::<Tracked>(),
            publishers: 4,
            // One of each neighbour at a time.
            buffer: 128,
            ..DRIVERS
        },
        Told {
            channel: Self::Evidence,
            name: "evidence",
            what: "what this robot's own sensors say of a slot, with hard bounds, for the team's `coloc-bounds`",
            by: Speaker::Bounds,
            to: Audience::Anyone,
            age: Age::Millis(1000),
            size: size_of::<Evidence>(),
            publishers: 4,
            // All others of a team, and who listens in.
            subscribers: Self::TEAM + 16,
            buffer: 4,
            ..DRIVERS
        },
        Told {
            channel: Self::Integrity,
            name: "integrity",
            what: "where this robot must be, and whether its estimate can be right, as `coloc-bounds` has it",
            by: Speaker::Bounds,
            age: Age::Millis(5000),
            size: size_of::<Integrity>(),
            buffer: 4,
            ..DAEMON
        },
        Told {
            channel: Self::Shared,
            name: "shared",
            what: "what is believed at a slot, for the robot's own `coloc-rounds`",
            age: Age::Millis(1000),
            size: size_of::<Shared>(),
            subscribers: 8,
            buffer: 4,
            late_joiner: false,
            ..DAEMON
        },
        Told {
            channel: Self::Share,
            name: "share",
            what: "what a robot believes and sees at a slot, for one leader",
            size: size_of::<Share>(),
            ..ROUNDS
        },
        Told {
            channel: Self::Round,
            name: "round",
            what: "what came of a slot: the robots' corrections and what each pair shares",
            size: size_of::<Round>(),
            matters: Matters::Newest,
            late_joiner: true,
            buffer: 2,
            ..ROUNDS
        },
        Told {
            channel: Self::Call,
            name: "call",
            what: "who is there at a slot, and the question for a round that was missed",
            size: size_of::<Call>(),
            // Their colocd too: who makes rounds is told no neighbour's pose.
            subscribers: 40,
            buffer: 16,
            ..ROUNDS
        },
        Told {
            channel: Self::Correction,
            name: "correction",
            what: "what the team's rounds do to this robot's belief",
            by: Speaker::Rounds,
            size: size_of::<Correction>(),
            publishers: 4,
            subscribers: 8,
            buffer: 16,
            ..DRIVERS
        },
        Told {
            channel: Self::Readings,
            name: "readings",
            what: "all that another robot saw of children in one event, for this one, a leader",
            by: Speaker::Neighbours,
            size: size_of::<Readings>(),
            publishers: Self::TEAM + 16,
            // One an event.
            buffer: 4,
            ..DRIVERS
        },
    ];

    /// All of them.
    pub const ALL: [Self; Self::TABLE.len()] = {
        let mut all = [Self::Odometry; Self::TABLE.len()];
        let mut place = 0;
        while place < all.len() {
            all[place] = Self::TABLE[place].channel;
            place += 1;
        }
        all
    };

    /// Its row in the table.
    #[must_use]
    pub const fn told(self) -> Told {
        Self::TABLE[self as usize]
    }

    /// The last part of the service's name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        self.told().name
    }

    /// How its service is dimensioned.
    #[must_use]
    pub const fn quality(self) -> Quality {
        let told = self.told();
        Quality {
            publishers: told.publishers,
            subscribers: told.subscribers,
            buffer: told.buffer,
            history: told.late_joiner as usize,
        }
    }
}

/// A payload, which knows its channel.
pub trait Message: ZeroCopySend + Plain + Debug + Copy + 'static {
    /// The channel on which it travels.
    const CHANNEL: Channel;

    /// Its name and version, as the shared memory knows it.
    const TYPE_NAME: &'static str;

    /// Who says it and when.
    fn header(&self) -> &Header;

    /// The same, for who reads the stamp as another clock.
    fn header_mut(&mut self) -> &mut Header;

    /// Moves all other stamps that it has and that are set, for the same \[ns\].
    fn move_stamps(&mut self, by_ns: i64);

    /// Whether its stamp is that of the message which it answers, as it came: who answers has no other word for it.
    const ECHOES: bool;

    /// Adds to what may depend on anything of the place that it tells, which is that of the robot that it speaks to, or that of the robot
    /// that speaks where it [echoes](Self::ECHOES); `added` is a covariance of `[x, y, φ]`, 3×3, full row-major (m², m·rad, rad²).
    /// Whether it tells such a place.
    fn widen(&mut self, added: &[f64; 9]) -> bool;
}

/// A part of a covariance, of `[x, y, φ]` or of `[x, y]`, full row-major.
trait Part {
    /// Adds one of `[x, y, φ]`.
    fn add(&mut self, added: &[f64; 9]);
}

impl Part for [f64; 9] {
    fn add(&mut self, added: &[f64; 9]) {
        self.iter_mut()
            .zip(added)
            .for_each(|(own, more)| *own += more);
    }
}

impl Part for [f64; 4] {
    fn add(&mut self, added: &[f64; 9]) {
        let [xx, xy, _, yx, yy, ..] = added;
        self.iter_mut()
            .zip([xx, xy, yx, yy])
            .for_each(|(own, more)| *own += more);
    }
}

/// What is to be done with the payload of a channel, whichever it is.
pub trait OnPayload {
    /// What comes of it.
    type Out;

    /// Does it.
    fn on<M: Message>(self) -> Self::Out;
}

macro_rules! travels {
    ($($payload:ident $version:literal $([$($stamp:ident)*])? $(widens $dependent:ident)? $(echoes $echoes:literal)?,)*) => {
        impl Channel {
            /// Does something with its payload: for who carries channels without knowing one of them.
            pub fn with_payload<W: OnPayload>(self, what: W) -> W::Out {
                match self {
                    $(Self::$payload => what.on::<$payload>(),)*
                }
            }
        }

        $(impl Message for $payload {
            const CHANNEL: Channel = Channel::$payload;
            const TYPE_NAME: &'static str = concat!("coloc.", stringify!($payload), ".", $version);

            fn header(&self) -> &Header {
                &self.header
            }

            fn header_mut(&mut self) -> &mut Header {
                &mut self.header
            }

            fn move_stamps(&mut self, _by_ns: i64) {
                $($(
                    if self.$stamp != 0 {
                        self.$stamp = self.$stamp.saturating_add(_by_ns);
                    }
                )*)?
            }

            const ECHOES: bool = false $(|| $echoes)?;

            fn widen(&mut self, added: &[f64; 9]) -> bool {
                let parts: &mut [&mut dyn Part] = &mut [$(&mut self.$dependent)?];
                for part in parts.iter_mut() {
                    part.add(added);
                }
                !parts.is_empty()
            }
        })*
    };
}

travels! {
    Odometry "v2" [start_ns],
    RelativePose "v2",
    Position "v2",
    Neighbour "v2" widens dependent,
    Pose "v1",
    Heading "v1",
    Gyro "v1",
    Sighting "v1",
    Seen "v1" widens dependent,
    Answer "v1" widens dependent echoes true,
    Assist "v2" widens dependent,
    AssistAck "v1",
    Estimate "v5",
    Timing "v2",
    Status "v6",
    DriverStatus "v1" [said_ns],
    Scan "v1",
    Increment "v1" [start_ns],
    Tracked "v1" [seen_ns],
    Evidence "v1",
    Integrity "v1" [judged_stamp_ns],
    Shared "v1",
    Share "v1",
    Round "v1",
    Call "v1",
    Correction "v1",
    Readings "v1",
}

#[cfg(test)]
mod tests {
    use iceoryx2::service::static_config::message_type_details::{TypeDetail, TypeVariant};

    use super::*;

    #[test]
    fn every_channel_has_its_row_and_its_own_name() {
        for (place, told) in Channel::TABLE.iter().enumerate() {
            assert_eq!(told.channel as usize, place);
            assert_eq!(Channel::ALL[place], told.channel);
            assert_eq!(told.channel.told(), *told);
            let named = Channel::TABLE
                .iter()
                .filter(|other| other.name == told.name);
            assert_eq!((named.count(), told.name.is_empty()), (1, false));
        }
    }

    fn assert_named<M: Message>() {
        let detail = TypeDetail::new::<M>(TypeVariant::FixedSize);
        assert_eq!(detail.type_name().to_string(), M::TYPE_NAME);
        assert_eq!(detail.size(), M::CHANNEL.told().size);
    }

    #[test]
    fn every_payload_is_called_and_as_large_as_the_table_says() {
        assert_named::<Odometry>();
        assert_named::<RelativePose>();
        assert_named::<Position>();
        assert_named::<Neighbour>();
        assert_named::<Pose>();
        assert_named::<Heading>();
        assert_named::<Gyro>();
        assert_named::<Sighting>();
        assert_named::<Seen>();
        assert_named::<Answer>();
        assert_named::<Assist>();
        assert_named::<AssistAck>();
        assert_named::<Estimate>();
        assert_named::<Timing>();
        assert_named::<Status>();
        assert_named::<DriverStatus>();
        assert_named::<Scan>();
        assert_named::<Evidence>();
        assert_named::<Integrity>();
        assert_named::<Shared>();
        assert_named::<Share>();
        assert_named::<Round>();
        assert_named::<Call>();
        assert_named::<Correction>();
        assert_named::<Readings>();
    }

    #[test]
    fn what_is_not_known_of_a_stamp_goes_into_the_dependent_part_alone() {
        let added = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0];
        let mut pose = Neighbour::default();
        assert!(pose.widen(&added));
        assert_eq!((pose.dependent, pose.independent), (added, [0.0; 9]));
        let mut place = Answer::default();
        assert!(place.widen(&added) && Answer::ECHOES && !Seen::ECHOES);
        assert_eq!(
            (place.dependent, place.independent),
            ([1.0, 2.0, 4.0, 5.0], [0.0; 4])
        );
        assert!(!Odometry::default().widen(&added));
    }

    #[test]
    fn a_whole_team_can_speak_to_one_robot_and_some_may_have_died() {
        for channel in [
            Channel::Neighbour,
            Channel::Seen,
            Channel::Answer,
            Channel::Assist,
            Channel::AssistAck,
            Channel::Readings,
        ] {
            assert!(channel.quality().publishers > Channel::TEAM);
        }
    }
}
