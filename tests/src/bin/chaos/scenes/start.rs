//! Kills within start, evenly over the time that a start takes; now and then the one that comes next is to end at once.

use std::thread::sleep;
use std::time::Duration;

use rand::RngExt;

use crate::fault::Outcome;
use crate::fleet::{Fleet, VICTIM, Who};
use crate::rounds::{Round, play as play_rounds};
use crate::stage::Stage;
use crate::tally::Tally;

pub(crate) fn play(stage: &Stage, tally: &mut Tally) {
    play_rounds(
        stage,
        tally,
        stage.one_in(6, 6),
        || {
            let mut fleet = Fleet::with_other(stage)?;
            Ok((start_time(&mut fleet)?, fleet))
        },
        |(start, fleet), round| kill_within(*start, fleet, round),
        |(start, fleet), tally| {
            let start = format!("a start takes {} ms", start.as_millis());
            tally.figures.extend([start, fleet.litter.figures()]);
            tally.ends.extend(fleet.end()?);
            Ok(())
        },
    );
}

fn kill_within(start: Duration, fleet: &mut Fleet, round: &mut Round<'_>) -> Outcome {
    let who = Who::any(&mut round.chance);
    if round.chance.random() {
        among_others(who, start, fleet, round)?;
    } else {
        let mut victim = fleet.start(who, VICTIM);
        sleep(start.mul_f64(round.chance.random()));
        victim.program.kill()?;
    }
    fleet.recovers(who, start, round)
}

/// All start at once, and one of them is killed: the others answer.
fn among_others(who: Who, start: Duration, fleet: &mut Fleet, round: &mut Round<'_>) -> Outcome {
    let mut all = Who::ALL.map(|who| fleet.start(who, VICTIM));
    sleep(start.mul_f64(round.chance.random_range(0.0..2.0)));
    for one in all.iter_mut().filter(|one| one.who == who) {
        one.program.kill()?;
    }
    for mut one in all.into_iter().filter(|one| one.who != who) {
        fleet.answers(&mut one)?;
        round.tally.ends.push(one.program.terminate()?);
    }
    Ok(())
}

/// The median of a few.
pub(crate) fn start_time(fleet: &mut Fleet) -> Outcome<Duration> {
    let mut times = Vec::new();
    for _ in 0..3 {
        let mut victim = fleet.start(Who::Daemon, VICTIM);
        times.push(fleet.answers(&mut victim)?);
        victim.program.terminate()?;
    }
    times.sort_unstable();
    Ok(times[1])
}
