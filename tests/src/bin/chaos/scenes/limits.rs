//! Few descriptors, little memory: it works, or says what it lacks.

use std::time::Duration;

use rand::RngExt;

use crate::fault::Outcome;
use crate::fleet::{Answer, Fleet, VICTIM, Who};
use crate::rounds::{Round, play as play_rounds};
use crate::stage::Stage;
use crate::tally::Tally;

pub(crate) fn play(stage: &Stage, tally: &mut Tally) {
    let mut refusals = Vec::new();
    play_rounds(
        stage,
        tally,
        stage.one_in(6, 9),
        || Fleet::with_other(stage),
        |fleet, round| {
            let limit = limit(round);
            let answer = limited(fleet, &limit, round);
            if let Answer::Refuses(words) = answer.map_err(|fault| fault.after(&limit))? {
                refusals.push(words);
            }
            Ok(())
        },
        |fleet, tally| {
            tally.ends.extend(fleet.end()?);
            Ok(())
        },
    );
    tally.refusals(&refusals);
}

fn limit(round: &mut Round<'_>) -> String {
    match round.number % 3 {
        0 => format!("--files={}", round.chance.random_range(4..80)),
        // With less, the loader cannot load it.
        1 => format!("--memory-mib={}", round.chance.random_range(12..800)),
        _ => "--locked-kib=0".into(),
    }
}

fn limited(fleet: &mut Fleet, limit: &str, round: &mut Round<'_>) -> Outcome<Answer> {
    let who = Who::any(&mut round.chance);
    let mut one = fleet.start_within(who, VICTIM, &[limit.into()]);
    let answer = fleet.answers_or_refuses(&mut one)?;
    if matches!(answer, Answer::Works) {
        round.tally.ends.push(one.program.terminate()?);
    }
    fleet.recovers(Who::Daemon, Duration::from_millis(50), round)?;
    Ok(answer)
}
