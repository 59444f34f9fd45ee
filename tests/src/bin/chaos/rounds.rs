//! Round after round of a scene, with whom it takes.

use rand_chacha::ChaCha8Rng;

use crate::fault::{Fault, Outcome};
use crate::stage::Stage;
use crate::tally::Tally;
use coloc_tests::output::print_line;

/// One round.
pub(crate) struct Round<'a> {
    /// Its number.
    pub(crate) number: u32,
    pub(crate) chance: ChaCha8Rng,
    pub(crate) tally: &'a mut Tally,
}

/// Plays the rounds of these numbers. Whom they take is set up first, and anew after a round that failed; in the end, `end`
/// is played with them.
pub(crate) fn play<S>(
    stage: &Stage,
    tally: &mut Tally,
    numbers: impl IntoIterator<Item = u32>,
    set_up: impl Fn() -> Outcome<S>,
    mut round: impl FnMut(&mut S, &mut Round<'_>) -> Outcome,
    end: impl FnOnce(S, &mut Tally) -> Outcome,
) {
    let mut cast = None;
    for number in numbers {
        let mut attempt = |tally: &mut Tally| {
            let mut ready = cast.take().map_or_else(&set_up, Ok)?;
            let chance = stage.chance(tally.scene, number);
            let mut this = Round {
                number,
                chance,
                tally,
            };
            round(&mut ready, &mut this)?;
            cast = Some(ready);
            Ok(())
        };
        let result = attempt(tally).or_else(|fault| again_if_late(fault, tally, &mut attempt));
        tally.rounds += 1;
        tally.note(stage, number, result);
        if tally.failures.len() >= stage.failures {
            return;
        }
    }
    let result = cast.map_or(Ok(()), |cast| end(cast, tally));
    tally.note(stage, tally.rounds, result);
}

/// A busy machine is given a second chance, and said so.
fn again_if_late(
    fault: Fault,
    tally: &mut Tally,
    attempt: &mut impl FnMut(&mut Tally) -> Outcome,
) -> Outcome {
    if !fault.is_late {
        return Err(fault);
    }
    print_line(&format!(
        "late, played again (load {}): {fault}",
        crate::stage::load()
    ));
    tally.late += 1;
    attempt(tally)
}
