//! The messages of coloc: what crosses shared memory, under which name, and how it is checked.
//!
//! # Principles
//!
//! * **The bytes are the interface.** A payload is plain `#[repr(C)]` data of fixed size without padding; its layout is
//!   asserted at compile time and its version stands in its type name, because shared memory opens without an error
//!   when two programs agree on name, size and alignment only. A changed field is a new version.
//! * **Nothing from outside is believed.** A received payload is raw: every bit pattern is possible. validate//!   checks it once, with one [`Reject`] per failure; what the rest of coloc computes on has passed it.
//! * **The hot path is send and receive.** Neither allocates, locks nor makes a system call. Everything else (opening,
//!   joining, cleaning up) does all three, and happens before the real-time loop is armed.
//! * **One table of channels.** Who says what to whom, and how its service is dimensioned, is said in [`Channel::TABLE`]
//!   alone: whoever opens a service first fixes its quality for everybody.
//! * **Every message says who, when and by which clock.** A [`Sender`] stamps it; [`Sessions`] tells news from repetitions,
//!   and lets nobody mute anybody.
//!
//! # Invariants of the shared memory
//!
//! * A [`Space`] is a root directory together with a prefix, and a number that is drawn when it begins; everything coloc
//!   leaves on disk or in `/dev/shm` is inside the first or begins with the others, so it can be removed without asking
//!   iceoryx2 what it was.
//! * Every process in a space holds a shared lock on the root directory for as long as it has a port, and one on a file in
//!   `/dev/shm`, in case the directory goes. Who can get the first exclusively is alone, and removes what the dead have
//!   left: at the start, and again when the last one goes.
//! * One user owns the space. Segments are private to that user, so peers are trusted with the memory itself, though
//!   never with the values in it.
pub mod advice;
mod belief_state;
mod channel;
mod clock;
mod health;
mod identity;
mod input;
mod layout;
mod matrix;
mod opinion;
mod payload;
pub mod places;
mod plain;
pub mod private;
mod reject;
mod rhythm;
mod robot_name;
mod space;
mod track;
mod unfit;
mod validate;

pub use belief_state::BeliefState;
pub use channel::{Age, Audience, Channel, Matters, Message, OnPayload, Quality, Speaker, Told};
pub use clock::{Clock, Present, boot};
pub use health::{BusState, Health};
pub use identity::{Sender, Sessions, SourceState};
pub use input::Input;
pub use matrix::all_finite;
pub use opinion::Opinion;
pub use payload::{
    Answer, Assist, AssistAck, AssistCounters, Call, CanCounters, Correction, DriverStatus,
    Estimate, Evidence, Gyro, Header, Heading, Increment, Integrity, Latency, Losses, Neighbour,
    Odometry, OdometryKind, Pose, Position, Readings, RelativePose, Round, RoundEntry, Scan, Seen,
    SeenAtSlot, SeenWithin, Share, Shared, Sight, Sighting, SourceHealth, Status, Suspect, Timing,
    Tracked,
};
pub use plain::Plain;
pub use reject::Reject;
pub use rhythm::Rhythm;
pub use robot_name::{NotARobotName, RobotName};
pub use space::{
    Claim, Group, GroupPage, Lost, NoGroup, OpenError, PortError, Publisher, ReadError, Reader,
    ReceiveError, Remark, Running, SendError, Space, Subscriber, WaitError,
};
pub use track::{NoPose, PastPose, Track};
pub use unfit::{Unfit, WhyUnfit, worst_sigmas};
pub use validate::{Limits, check_split};
