//! What a payload is held against before anything is computed on it.
//!
//! `validate` has no memory: whether a message came before is asked of [`Replay`](crate::Replay) afterwards, so that
//! a message that failed leaves no trace.
use crate::matrix::{Matrix, all_finite};
use crate::{Header, Reject};

/// What may be: the moment, the span of the history, the team.
#[derive(Copy, Clone, Debug)]
pub struct Limits<'a> {
    /// The present (ns of the configured clock).
    pub now_ns: i64,
    /// How far back the history reaches (ns).
    pub history_ns: i64,
    /// By how much clocks of the team may differ (ns).
    pub future_tolerance_ns: i64,
    /// By how much the clock was set back while this program ran (ns): senders that started before that have sessions
    /// that seem to begin in the future.
    pub set_back_ns: i64,
    /// Team number of the robot that validates.
    pub own: u16,
    /// Team numbers of all robots.
    pub robots: &'a [u16],
}

impl Limits<'_> {
    /// That all `numbers` are finite.
    pub(crate) fn check_finite(numbers: &[f64]) -> Result<(), Reject> {
        if all_finite(numbers) {
            Ok(())
        } else {
            Err(Reject::NotFinite)
        }
    }

    /// That `robot` is of the team.
    pub(crate) fn check_member(&self, robot: u16) -> Result<(), Reject> {
        if self.robots.contains(&robot) {
            Ok(())
        } else {
            Err(Reject::UnknownRobot)
        }
    }

    /// That `robot` is of the team and somebody else.
    pub(crate) fn check_other(&self, robot: u16) -> Result<(), Reject> {
        if robot == self.own {
            Err(Reject::UnknownRobot)
        } else {
            self.check_member(robot)
        }
    }

    /// That the stamp lies in [now − history, now + tolerance], and the session does not begin after that.
    ///
    /// A session from the future would make every honest message after it look like a replay.
    pub(crate) fn check_time(&self, header: &Header) -> Result<(), Reject> {
        let latest_ns = self.now_ns.saturating_add(self.future_tolerance_ns);
        let earliest_ns = self.now_ns.saturating_sub(self.history_ns);
        let latest_session_ns = latest_ns.saturating_add(self.set_back_ns);
        match header {
            Header { stamp_ns, .. } if *stamp_ns > latest_ns => Err(Reject::FromFuture),
            Header { session_ns, .. } if *session_ns > latest_session_ns => Err(Reject::FromFuture),
            Header { stamp_ns, .. } if *stamp_ns < earliest_ns => Err(Reject::TooOld),
            _ => Ok(()),
        }
    }
}

/// That P and `P_i`, row by row, are covariances, and that `P − P_i` is one: what every belief has to be.
///
/// # Errors
/// The first that fails.
pub fn check_split(total: &[f64; 9], independent: &[f64; 9]) -> Result<(), Reject> {
    let [total, independent] = [total, independent].map(|rows| Matrix::<3>::from_row_major(*rows));
    Matrix::check_split(&total, &independent)
}
