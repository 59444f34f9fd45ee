//! Which counts a counter has, and what that allows.

use crate::config_error::ConfigError;
use crate::signal::SignalDecoder;

use super::super::config::WheelConfig;
use super::super::count::Counts;

/// Which counts a counter has. The DBC file's range alone is no proof of where it wraps.
pub(super) fn counts(
    setting: &str,
    wheel: &WheelConfig,
    signal: &SignalDecoder,
) -> Result<Counts, ConfigError> {
    if !signal.is_integer() {
        return Err(ConfigError::setting(
            setting,
            "cumulative ticks must be an integer signal, this one is a float",
        ));
    }
    let all = Counts {
        bits: signal.size(),
        signed: signal.is_signed(),
        modulus: None,
        range: None,
    };
    if let Some(modulus) = wheel.modulus {
        return with_modulus(setting, all, modulus, signal.raw_range());
    }
    let Some((lowest, highest)) = signal.raw_range() else {
        return Ok(all);
    };
    let number = u64::try_from(highest - lowest + 1).unwrap_or(u64::MAX);
    let missing = (1_i128 << all.bits) - i128::from(number);
    if missing > FEW_CODES || number < ENOUGH_COUNTS {
        if is_rounding(missing, all.bits) {
            return Ok(all);
        }
        let problem = format!(
            "give how many different counts the {} bits of signal {} have: {number} if they wrap after {highest}, as its \
             range in the DBC file may mean, {} if they use every bit",
            all.bits,
            wheel.signal,
            1_i128 << all.bits
        );
        return Err(ConfigError::setting(format!("{setting}.modulus"), problem));
    }
    Ok(Counts {
        modulus: Some(number),
        range: Some((lowest, highest)),
        ..all
    })
}

/// A range that leaves out so few counts leaves out codes, such as "not available": whether the counter wraps before or
/// behind them is a count or two a turn ...
const FEW_CODES: i128 = 2;

/// ... of so many, less than any wheel slips.
const ENOUGH_COUNTS: u64 = 20_000;

/// Whether a range was written with six digits, as in `[0|4.29496E+009]`.
fn is_rounding(missing: i128, bits: u32) -> bool {
    missing > 0 && missing.saturating_mul(200_000) <= 1_i128 << bits
}

/// Which counts these are the DBC file says where its range has as many, else they begin at zero.
fn with_modulus(
    setting: &str,
    all: Counts,
    modulus: u64,
    said: Option<(i128, i128)>,
) -> Result<Counts, ConfigError> {
    let most = 1_i128 << all.bits;
    if !(2..=most).contains(&i128::from(modulus)) {
        let problem = format!(
            "is {modulus}; the signal's {} bits have 2 to {most} counts",
            all.bits
        );
        return Err(ConfigError::setting(format!("{setting}.modulus"), problem));
    }
    if i128::from(modulus) == most {
        return Ok(all);
    }
    Ok(Counts {
        modulus: Some(modulus),
        range: said
            .filter(|(lowest, highest)| highest - lowest + 1 == i128::from(modulus))
            .or((!all.signed).then_some((0, i128::from(modulus) - 1))),
        ..all
    })
}
