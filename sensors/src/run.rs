//! The life of a driver: wait, hand on what came, say how it is doing, until asked to end.

use std::io;
use std::time::Duration;

use crate::end::EndError;
use crate::input::{Input, Step};
use crate::moment::Moment;
use crate::pace::Pace;
use crate::stop::Stop;
use crate::voice::Voice;

/// What understands a sensor.
pub trait Driver {
    /// Takes in bytes, cut anywhere.
    ///
    /// # Errors
    /// If it cannot go on.
    fn take(&mut self, bytes: &[u8], at: Moment) -> Result<(), EndError>;

    /// Nothing came for [`IDLE`].
    ///
    /// # Errors
    /// If it cannot go on.
    fn idle(&mut self, at: Moment) -> Result<(), EndError>;

    /// The input was lost: what comes next does not continue what came before.
    fn interrupted(&mut self);

    /// Nothing will come any more.
    ///
    /// # Errors
    /// If it could not say the last of it.
    fn end(&mut self, at: Moment) -> Result<(), EndError>;

    /// When what comes next of a recording was measured, as far as `line` of it and all before say: it is held back until then
    /// (ns, of any clock).
    fn recorded_ns(&self, line: &[u8]) -> Option<i64>;

    /// What it has to tell of itself.
    fn report(&self) -> Report;

    /// What a person should hear, since it was last asked.
    fn remarks(&mut self) -> Vec<String>;
}

/// What a driver tells of itself, counted from its start.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// Messages that were whole and right.
    pub whole: u64,
    /// Messages that were broken, cut or mixed up.
    pub broken: u64,
    /// What was said on the robot's channels.
    pub said: u64,
    /// What was understood, and there was nothing to say of it.
    pub nothing_to_say: u64,
    /// When the last of it was measured.
    pub said_ns: i64,
    /// What was refused, by the driver's own reasons.
    pub refused: [u64; 16],
    /// The driver's own numbers.
    pub figures: [f64; 8],
}

/// After so long without a byte a message is at its end.
pub const IDLE: Duration = Duration::from_millis(100);

/// Runs `driver` on `input` until it ends.
///
/// # Errors
/// Why it could not go on.
pub fn run(
    driver: &mut impl Driver,
    input: &mut Input,
    stop: &Stop,
    voice: &mut Voice<'_>,
) -> Result<(), EndError> {
    let mut life = Life {
        pace: input.spec().is_paced().then(Pace::default),
        stop,
        voice,
    };
    let ended = life.turns(driver, input);
    voice.finish();
    ended
}

/// Who listens takes in the last words within a tick or two; they go with the port that said them.
const LAST_WORDS: Duration = Duration::from_millis(100);

fn end(driver: &mut impl Driver, stop: &Stop) -> Result<(), EndError> {
    driver.end(Moment::now())?;
    stop.wait(None, LAST_WORDS).map_err(cannot_wait)?;
    Ok(())
}

/// A recording of which nothing was understood was hardly meant.
fn played(
    driver: &mut impl Driver,
    input: &Input,
    stop: &Stop,
    bytes: u64,
) -> Result<(), EndError> {
    end(driver, stop)?;
    if driver.report().whole > 0 {
        return Ok(());
    }
    Err(EndError::Input(format!(
        "{}: in {bytes} bytes there was no whole message: is it a recording of this sensor?",
        input.spec()
    )))
}

struct Life<'l, 'v> {
    pace: Option<Pace>,
    stop: &'l Stop,
    voice: &'l mut Voice<'v>,
}

enum Turn {
    On,
    Over,
    /// The recording is at its end.
    Played,
}

impl Life<'_, '_> {
    fn turns(&mut self, driver: &mut impl Driver, input: &mut Input) -> Result<(), EndError> {
        loop {
            match self.turn(driver, input)? {
                Turn::On => {}
                Turn::Over => return end(driver, self.stop),
                Turn::Played => return played(driver, input, self.stop, self.voice.line.bytes),
            }
            self.voice.line.is_open = input.is_open();
            self.voice.say(&driver.report(), driver.remarks())?;
        }
    }

    fn turn(&mut self, driver: &mut impl Driver, input: &mut Input) -> Result<Turn, EndError> {
        match input.step(self.stop, IDLE).map_err(cannot_wait)? {
            Step::Bytes => {
                self.voice.line.bytes += input.bytes().len() as u64;
                return self.hand_on(driver, input.bytes());
            }
            Step::Quiet => driver.idle(Moment::now())?,
            Step::Opened => {
                self.voice.line.opened += 1;
                self.voice.remark(format!("{} is open", input.spec()));
            }
            Step::Lost(why) => {
                driver.interrupted();
                self.voice.remark(format!("{why}; it is tried again"));
            }
            Step::Unreadable(why) => return Err(EndError::Input(why)),
            Step::End => return Ok(Turn::Played),
            Step::Stop => return Ok(Turn::Over),
        }
        Ok(Turn::On)
    }

    /// A recording is handed on line by line, each at its time; of minutes of it, so it says meanwhile how it is doing.
    fn hand_on(&mut self, driver: &mut impl Driver, bytes: &[u8]) -> Result<Turn, EndError> {
        let Some(pace) = &mut self.pace else {
            driver.take(bytes, Moment::now())?;
            return Ok(Turn::On);
        };
        self.voice.line.is_open = true;
        for piece in bytes.split_inclusive(|byte| *byte == b'\n') {
            let recorded = driver.recorded_ns(piece);
            let is_asked = recorded.map_or(Ok(false), |it| pace.keep(it, self.stop));
            if is_asked.map_err(cannot_wait)? {
                return Ok(Turn::Over);
            }
            driver.take(piece, Moment::now())?;
            self.voice.say(&driver.report(), driver.remarks())?;
        }
        Ok(Turn::On)
    }
}

fn cannot_wait(error: io::Error) -> EndError {
    EndError::System {
        what: "it cannot be waited",
        error,
    }
}
