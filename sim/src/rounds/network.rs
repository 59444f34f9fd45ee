//! The radio between robots that make rounds, and what goes wrong with it.

use coloc_rounds::{Message, Post};

use crate::method::Sent;
use crate::random::{Noise, Purpose};
use crate::scenario::Radio;

/// What goes wrong beside the radio's own losses.
#[derive(Copy, Clone, Debug, Default, PartialEq)]
pub struct Trouble {
    /// Share of slots at which a robot is not there at all.
    pub absent: f64,
    /// Whether whoever leads is killed in every slot: by turns before its round is out, when half have it, and when all have it.
    pub kills_leaders: bool,
    /// Robots from this number on hear nothing of the others, from one time to another \[s\].
    pub split: Option<(usize, [f64; 2])>,
    /// A robot that loses all it knows of what it shares with others, and when \[s\].
    pub restart: Option<(usize, f64)>,
}

/// A message on its way.
#[derive(Clone, Debug)]
struct Flying {
    arrives_ns: i64,
    to: usize,
    message: Message,
}

/// The radio.
#[derive(Clone, Debug)]
pub(super) struct Network {
    robots: usize,
    radio: Radio,
    trouble: Trouble,
    noise: Noise,
    flying: Vec<Flying>,
    /// Deliveries so far, for chance.
    count: usize,
    sent: Sent,
}

impl Network {
    pub(super) fn new(robots: usize, radio: Radio, trouble: Trouble, noise: Noise) -> Self {
        Self {
            robots,
            radio,
            trouble,
            noise,
            flying: Vec::new(),
            count: 0,
            sent: Sent::default(),
        }
    }

    pub(super) fn sent(&self) -> Sent {
        self.sent
    }

    /// Whether `robot` is there in `slot`.
    pub(super) fn is_here(&self, slot: u64, robot: usize) -> bool {
        let slot = usize::try_from(slot).unwrap_or(usize::MAX);
        let mut draws = self.noise.draws(Purpose::Rounds, slot, robot, 0xffff);
        !draws.happens(self.trouble.absent)
    }

    fn is_cut(&self, a: usize, b: usize, now_s: f64) -> bool {
        self.trouble.split.is_some_and(|(first, [from, to])| {
            (a < first) != (b < first) && (from..to).contains(&now_s)
        })
    }

    /// Sends; every delivery is lost with `more` beside the radio's own loss.
    #[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation)] // Hours in nanoseconds.
    pub(super) fn send(&mut self, from: usize, post: &Post, now_ns: i64, more: f64) {
        self.sent.messages += 1;
        self.sent.bytes += post.message.bytes() as u64;
        let all = 0..self.robots;
        for to in all.filter(|to| *to != from && post.to.is_none_or(|it| it == *to)) {
            self.count += 1;
            let mut draws = self.noise.draws(Purpose::Rounds, self.count, to, from);
            let is_lost = draws.happens(self.radio.loss) | draws.happens(more);
            if is_lost || self.is_cut(from, to, now_ns as f64 * 1e-9) {
                continue;
            }
            let [low, high] = self.radio.delay_s;
            let delay_s = if high > 0.0 {
                draws.uniform(low, high)
            } else {
                0.0
            };
            self.flying.push(Flying {
                arrives_ns: now_ns + (delay_s * 1e9) as i64,
                to,
                message: post.message.clone(),
            });
        }
    }

    /// What has arrived by now, in the order of sending.
    pub(super) fn arrived(&mut self, now_ns: i64) -> Vec<(usize, Message)> {
        let arrived = self.flying.extract_if(.., |it| it.arrives_ns <= now_ns);
        arrived.map(|it| (it.to, it.message)).collect()
    }
}
