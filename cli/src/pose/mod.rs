//! `coloc pose`: tells a robot where it is, and says what came of it.
//!
//! ```text
//! seek (where it runs) ──► telling (one message, counted) ──► outcome (believed, refused, or neither in time)
//! ```

mod args;
mod outcome;
mod seek;
mod telling;

use coloc_shm_types::{OpenError, PortError, Reject, RobotName};

pub(crate) use args::PoseArgs;

use crate::demo::interrupt::Interrupt;
use crate::output::{complain, print_line};
use crate::status::Status;
use telling::Telling;

/// Why it does not believe it.
#[derive(Debug, thiserror::Error)]
enum PoseError {
    #[error(transparent)]
    Open(#[from] OpenError),
    #[error(transparent)]
    Port(#[from] PortError),
    #[error("{robot} does not run in {place}; {who_else}")]
    NotThere {
        robot: RobotName,
        place: String,
        who_else: String,
    },
    #[error("{robot} runs in {places}: choose one with --root")]
    Several { robot: RobotName, places: String },
    #[error("cannot handle signals: {0}")]
    Signals(std::io::Error),
    #[error("no random number for this session: {0}")]
    Random(std::io::Error),
    #[error("{0} runs and says nothing: see its log")]
    Silent(RobotName),
    #[error("{robot} has refused the pose: {reason}")]
    Refused { robot: RobotName, reason: Reject },
    #[error("{0} has not taken the pose in time: its daemon may be of an older coloc, or stopped")]
    NotTaken(RobotName),
    #[error(
        "{0} has taken the pose and is elsewhere: it was set again, or its sources disagree and have won; see its log \
         (a history of several seconds, `history.length_s`, takes as long)"
    )]
    Elsewhere(RobotName),
}

/// The whole command.
pub(crate) fn command(args: &PoseArgs) -> Status {
    tell(args).unwrap_or_else(|error| {
        complain(&format!("coloc: {error}"));
        Status::Failed
    })
}

fn tell(args: &PoseArgs) -> Result<Status, PoseError> {
    let interrupt = Interrupt::catch().map_err(PoseError::Signals)?;
    let place = seek::choose(args)?;
    let telling = Telling::open(&place, args)?;
    let said = telling.tell(&interrupt)?;
    if let Some(sentence) = said {
        print_line(&sentence);
    }
    Ok(interrupt.signal().map_or(Status::Done, Status::Interrupted))
}
