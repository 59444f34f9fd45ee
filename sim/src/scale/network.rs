//! What becomes of a word between two robots: it is lost, or late.

use super::{HERTZ, TICKS};
use crate::random::{Noise, Purpose};

/// What is between robots. By default nothing is lost, and a word is a tick under way.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Network {
    /// This part of all words is lost.
    pub loss: f64,
    /// A word is late by up to this, each by another time \[s\].
    pub delay_s: f64,
}

impl Network {
    /// By so many exchanges the latest word is late: what comes between two of them is heard after the second.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // A few.
    pub(super) fn latest(&self) -> usize {
        exchanges(self.delay_s).ceil() as usize
    }
}

#[allow(clippy::cast_precision_loss)] // Fifty and five.
fn exchanges(seconds: f64) -> f64 {
    seconds * HERTZ as f64 / TICKS as f64
}

/// The same, with its chance.
#[derive(Clone, Debug)]
pub(super) struct Way {
    noise: Noise,
    network: Network,
}

impl Way {
    pub(super) fn new(noise: &Noise, network: Network) -> Self {
        Self {
            noise: noise.clone(),
            network,
        }
    }

    /// By how many exchanges a word is late that `speaker` says at the exchange of that number; nothing of one that is lost.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // A few.
    pub(super) fn late(&self, exchange: usize, speaker: usize, listener: usize) -> Option<usize> {
        let Network { loss, delay_s } = self.network;
        if self.network == Network::default() {
            return Some(0);
        }
        let mut draws = self
            .noise
            .draws(Purpose::ScaleNetwork, exchange, speaker, listener);
        if draws.happens(loss) {
            return None;
        }
        Some(exchanges(draws.uniform(0.0, 1.0) * delay_s).ceil() as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_are_lost_and_as_late_as_was_said() {
        let network = Network {
            loss: 0.1,
            delay_s: 0.4,
        };
        assert_eq!((network.latest(), Network::default().latest()), (4, 0));
        let way = Way::new(&Noise::new(1, 0), network);
        let mut counts = [0; 6];
        for exchange in 1..=4000 {
            let late = way.late(exchange, 3, 7);
            counts[late.unwrap_or(5)] += 1;
        }
        assert_eq!(counts[0], 0);
        assert!(
            counts[1..5].iter().all(|it| (800..1000).contains(it)),
            "{counts:?}"
        );
        assert!((330..470).contains(&counts[5]), "{counts:?}");
    }
}
