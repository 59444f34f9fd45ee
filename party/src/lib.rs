//! `coloc-rounds`: one joint filter of the team, in rounds, beside `colocd`.
//!
//! ```text
//! colocd ── shared ──► coloc-rounds ◄── share, round, call ──► the others' coloc-rounds
//!        ◄ correction ─┘    ▲
//!                           └── relative_pose
//! ```
//!
//! * **A [`Seat`](coloc_rounds::seat::Seat) decides**, and knows no channel and no clock: it is told messages and the time. The rounds themselves are
//!   [`coloc_rounds`].
//! * **Nothing here is waited for.** `colocd` goes on with its wheels and its receiver whatever becomes of this process, and takes a correction only
//!   if a round can have made it of what it shared.
//! * **Running is switching on.** While this program runs the robot takes part in rounds; when it is asked to end, the robot goes back to split
//!   covariance intersection. One that was killed changes nothing: its next life goes on.
#![forbid(unsafe_code)]

pub mod channels;
pub mod program;
pub mod refusal;
pub mod wire;
