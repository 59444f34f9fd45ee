//! Rounds with kills beside rounds without: whether the other robot missed more ticks in the former.

use std::fmt;

use crate::fault::{Outcome, fault};
use crate::watch::Book;

/// What is no chance: so many standard deviations of the difference of two means ...
const DEVIATIONS: f64 = 4.0;
/// ... and more than one in so many rounds.
const ROUNDS: f64 = 20.0;

/// Both kinds of rounds.
#[derive(Debug, Default)]
pub(crate) struct Paired {
    pub(crate) with: Rounds,
    pub(crate) without: Rounds,
}

/// What was missed, round by round.
#[derive(Debug, Default)]
pub(crate) struct Rounds {
    books: Vec<Book>,
}

impl Rounds {
    pub(crate) fn add(&mut self, book: Book) {
        self.books.push(book);
    }

    fn total(&self) -> Book {
        let mut total = Book::default();
        self.books.iter().for_each(|book| total.add(*book));
        total
    }

    /// Missed in a round: the mean, and its variance.
    #[allow(clippy::cast_precision_loss, reason = "ticks are fewer than 2⁵³")]
    fn mean(&self) -> (f64, f64) {
        let count = self.books.len().max(1) as f64;
        let mean = self.total().missed as f64 / count;
        let squares = self
            .books
            .iter()
            .map(|book| (book.missed as f64 - mean).powi(2));
        (mean, squares.sum::<f64>() / (count * count))
    }
}

impl Paired {
    /// The other robot misses no more ticks with kills than without.
    pub(crate) fn compare(&self) -> Outcome {
        let ((with, one), (without, other)) = (self.with.mean(), self.without.mean());
        let more = with - without;
        if more > ROUNDS.recip() && more > DEVIATIONS * (one + other).sqrt() {
            fault!("the other robot misses more ticks with kills than without: {self}");
        }
        Ok(())
    }
}

impl fmt::Display for Paired {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [with, without] = [&self.with, &self.without];
        write!(f, "the other robot with kills {with}, without {without}")
    }
}

impl fmt::Display for Rounds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Book {
            ticks,
            missed,
            longest_ns,
        } = self.total();
        let (due, longest_ms) = (ticks + missed, longest_ns / 1_000_000);
        write!(f, "missed {missed} of {due} ticks, longest {longest_ms} ms")
    }
}
