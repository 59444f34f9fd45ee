//! What a payload is held against before anything is computed on it.
//!
//! `validate` has no memory: whether a message came before is asked of [`Sessions`](crate::Sessions) afterwards, so that
//! a message that failed here leaves no trace. Who may speak is checked in `identity`.
use crate::matrix::{Matrix, all_finite};
use crate::{Clock, Header, Present, Reject};

/// What may be: the moment, the span of the history, the team.
#[derive(Copy, Clone, Debug)]
pub struct Limits<'a> {
    /// The present, by every clock that stamps may be of.
    pub now: Present,
    /// Which start of this computer that is ([`boot`](crate::boot)): stamps of [`Clock::Boottime`] must be of the same.
    pub boot: u64,
    /// How far back the history reaches (ns).
    pub history_ns: i64,
    /// By how much clocks of the team may differ (ns).
    pub future_tolerance_ns: i64,
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

    /// That none of `deviations` is below zero.
    pub(crate) fn check_not_negative(deviations: &[f64]) -> Result<(), Reject> {
        if deviations.iter().all(|deviation| *deviation >= 0.0) {
            Ok(())
        } else {
            Err(Reject::NotPositiveSemidefinite)
        }
    }

    /// That it asks for nothing that is not done yet.
    pub(crate) fn check_supported(supported: bool) -> Result<(), Reject> {
        supported.then_some(()).ok_or(Reject::Unsupported)
    }

    /// That the stamp is of a clock that can be asked.
    pub(crate) fn check_clock(&self, header: &Header) -> Result<(), Reject> {
        self.now_by(header).map(|_| ())
    }

    /// That the stamp is of a clock that can be asked, and lies in [now − history, now + tolerance] by it.
    pub(crate) fn check_time(&self, header: &Header) -> Result<(), Reject> {
        let now_ns = self.now_by(header)?;
        let latest_ns = now_ns.saturating_add(self.future_tolerance_ns);
        let earliest_ns = now_ns.saturating_sub(self.history_ns);
        match header.stamp_ns {
            stamp_ns if stamp_ns > latest_ns => Err(Reject::FromFuture),
            stamp_ns if stamp_ns < earliest_ns => Err(Reject::TooOld),
            _ => Ok(()),
        }
    }

    /// The present by the clock of the header. Who does not know his boot has no clock in common with anybody.
    fn now_by(&self, header: &Header) -> Result<i64, Reject> {
        let clock = header.clock()?;
        let same_boot = header.boot == self.boot && header.boot != 0;
        let comparable = clock != Clock::Boottime || same_boot;
        let now_ns = self.now.of(clock).filter(|_| comparable);
        now_ns.ok_or(Reject::ForeignClock)
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
