//! Kills at random moments of life, in turns with the same rounds without kills.

use std::thread::sleep;
use std::time::Duration;

use rand::RngExt;

use crate::bars::{self, Bar};
use crate::fault::{Outcome, fault};
use crate::fleet::{Fleet, OTHER, Started, VICTIM, Who};
use crate::paired::Paired;
use crate::rounds::{Round, play as play_rounds};
use crate::stage::Stage;
use crate::tally::Tally;
use crate::watch::Book;

/// Rounds with kills, then as many with SIGTERM instead.
const BLOCK: u32 = 10;
/// Longest life \[ms\].
const LIFE_MS: u64 = 300;
/// Within which a fix is counted: that is told once a second.
const FED: Bar = Bar(Duration::from_secs(5));

pub(crate) fn play(stage: &Stage, tally: &mut Tally) {
    let mut paired = Paired::default();
    play_rounds(
        stage,
        tally,
        stage.rounds(2 * stage.kills),
        || Cast::new(stage),
        |cast, round| {
            let book = cast.round(round)?;
            if kills(round.number) {
                paired.with.add(book);
            } else {
                paired.without.add(book);
            }
            Ok(())
        },
        Cast::end,
    );
    tally.figures.push(paired.to_string());
    // A busy machine makes ticks late by itself.
    if bars::are_held() {
        tally.note(stage, tally.rounds, paired.compare());
    }
}

fn kills(round: u32) -> bool {
    (round / BLOCK).is_multiple_of(2)
}

/// A fleet whose every part runs.
struct Cast {
    fleet: Fleet,
    victims: [Started; 3],
    /// Files with all of them.
    files: usize,
    most: usize,
}

impl Cast {
    fn new(stage: &Stage) -> Outcome<Self> {
        let mut fleet = Fleet::with_other(stage)?;
        let mut victims = Who::ALL.map(|who| fleet.start(who, VICTIM));
        for victim in &mut victims {
            fleet.answers(victim)?;
        }
        fleet.keep();
        let files = fleet.files().len();
        Ok(Self {
            fleet,
            victims,
            files,
            most: files,
        })
    }

    fn round(&mut self, round: &mut Round<'_>) -> Outcome<Book> {
        self.fleet.watch().take_book(OTHER);
        sleep(Duration::from_millis(round.chance.random_range(0..LIFE_MS)));
        let index = [0, 0, 0, 1, 2][round.chance.random_range(0..5)];
        let kills = kills(round.number);
        let victim = &mut self.victims[index];
        if kills {
            victim.program.kill()?;
        } else {
            round.tally.ends.push(victim.program.terminate()?);
        }
        *victim = self.fleet.start(Who::ALL[index], VICTIM);
        let took = self.fleet.answers(victim)?;
        if kills && index == 0 {
            round.tally.restarts.push(took);
        }
        let book = self.fleet.other_goes_on()?;
        for victim in &mut self.victims {
            victim.program.look()?;
        }
        self.most = self.most.max(self.fleet.files().len());
        if (round.number + 1).is_multiple_of(BLOCK) {
            self.fleet.settles_to(self.files)?;
        }
        Ok(book)
    }

    fn end(mut self, tally: &mut Tally) -> Outcome {
        let (count, last) = self.fleet.watch().refusals();
        if count > 0 {
            let words = format!("{count} messages could not be read, as in `{last}`");
            tally.figures.push(words);
        }
        let files = format!("at most {} files, {} before", self.most, self.files);
        tally.figures.push(files);
        if !self.fleet.watch().is_fed(OTHER, FED.patience()) {
            fault!("fixes do not reach robot2 any more");
        }
        for victim in &mut self.victims {
            tally.ends.push(victim.program.terminate()?);
        }
        tally.ends.extend(self.fleet.end()?);
        Ok(())
    }
}
