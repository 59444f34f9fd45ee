//! A subscriber, who was heard there, and how much of it a tick takes.

use coloc_estimator::{Measurement, Span, Stamp};
use coloc_shm_types::{Input, Message, PortError, Reject, RobotName, Sessions, Space, Subscriber};
use tracing::warn;

use super::list::List;
use crate::account::Account;
use crate::clock::Moment;

/// Of one channel.
#[derive(Debug)]
pub(super) struct Port<M: Message> {
    /// None if there was no place for it: then this input is not heard, which its health says.
    subscriber: Option<Subscriber<M>>,
    sessions: Sessions,
    input: Input,
    /// How many messages a tick still takes in, and how many it takes in all.
    left: usize,
    most: usize,
    /// When it was looked at, and when something came, or it was opened.
    looked: Option<Stamp>,
    heard: Option<Stamp>,
    rest: Span,
}

/// A channel that may wait and on which nobody has spoken for so long …
const SILENT: Span = Span::from_millis(1000);

/// … is looked at so often, or four times in a history: what begins to speak there is taken in that much later, and for its own stamp.
const REST: Span = Span::from_millis(60);

impl<M: Message> Port<M> {
    /// Subscribes to `robot`'s channel; publishers that are there already are connected at once.
    ///
    /// # Errors
    /// If the port cannot be opened for another reason than that its channel is full.
    pub(super) fn open(
        space: &Space,
        robot: &RobotName,
        (input, sources, most): (Input, usize, usize),
    ) -> Result<Self, PortError> {
        let subscriber = match space.subscriber(robot) {
            Ok(subscriber) => Some(subscriber),
            Err(problem @ PortError::Full { .. }) => {
                warn!("{input} is not heard until this robot is started again: {problem}");
                None
            }
            Err(problem) => return Err(problem),
        };
        // Whom this does not reach now the first receive will.
        let _ = subscriber.as_ref().map(Subscriber::refresh);
        Ok(Self {
            subscriber,
            sessions: Sessions::new(sources),
            input,
            left: most,
            most,
            looked: None,
            heard: None,
            rest: REST,
        })
    }

    /// That much of the past is kept.
    pub(super) fn within(self, history: Span) -> Self {
        let quarter = Span::from_nanos(history.as_nanos() / 4);
        Self {
            rest: REST.min(quarter),
            ..self
        }
    }

    /// The input that is not heard, if it is not.
    pub(super) fn deaf(&self) -> Option<Input> {
        self.subscriber.is_none().then_some(self.input)
    }

    /// The tick is over: the next one takes in as many again.
    pub(super) fn clear(&mut self) {
        self.left = self.most;
    }

    /// Takes in what `check` makes a measurement of.
    pub(super) fn drain(
        &mut self,
        moment: &Moment,
        into: &mut List<Measurement>,
        account: &mut Account,
        check: impl Fn(&M) -> Result<Measurement, Reject>,
    ) {
        self.drain_but(|_| false, moment, into, account, check);
    }

    /// [`Self::drain`], and as if there were none of those that are `passed_over`.
    pub(super) fn drain_but(
        &mut self,
        passed_over: impl Fn(&M) -> bool,
        moment: &Moment,
        into: &mut List<Measurement>,
        account: &mut Account,
        check: impl Fn(&M) -> Result<Measurement, Reject>,
    ) {
        let mut keep = |measurement: Measurement| {
            let stamp = measurement.stamp();
            // There is room: the list holds what all the ports take in.
            let _ = into.push(measurement);
            stamp
        };
        // One that is passed over takes no place among those that were here before.
        let check = |message: &M| {
            let is_heard = !passed_over(message);
            is_heard
                .then(|| check(message))
                .ok_or(Reject::Unsupported)?
        };
        let mut take = |message: &M, heard: Result<_, _>| {
            let is_heard = !passed_over(message);
            let source = message.header().source;
            (source, is_heard.then(|| heard.map(&mut keep)))
        };
        while let Some((source, heard)) = self.hear(moment, account, check, &mut take) {
            match heard {
                None => {}
                Some(Ok(stamp)) => account.valid(self.input, source, stamp),
                Some(Err(reason)) => self.refuse(source, reason, account),
            }
        }
    }

    /// [`Self::drain`], of a channel on which most robots hear nobody: a look at it is 4 % of a tick.
    pub(super) fn drain_seldom(
        &mut self,
        moment: &Moment,
        into: &mut List<Measurement>,
        account: &mut Account,
        check: impl Fn(&M) -> Result<Measurement, Reject>,
    ) {
        let now = moment.stamp;
        let heard = *self.heard.get_or_insert(now);
        if now - heard > SILENT && self.looked.is_some_and(|looked| now - looked < self.rest) {
            return;
        }
        self.looked = Some(now);
        self.drain(moment, into, account, check);
        if self.left < self.most {
            self.heard = Some(now);
        }
    }

    /// The next message, and what `check` makes of it; `None` if there is none, or enough for this tick.
    pub(super) fn next<T>(
        &mut self,
        moment: &Moment,
        account: &mut Account,
        check: impl Fn(&M) -> Result<T, Reject>,
    ) -> Option<(M, Result<T, Reject>)> {
        self.hear(moment, account, check, |message, heard| (*message, heard))
    }

    /// The same, as `take` has the two: where they lie, so that only what is kept is copied.
    #[inline]
    fn hear<T, U>(
        &mut self,
        moment: &Moment,
        account: &mut Account,
        check: impl Fn(&M) -> Result<T, Reject>,
        mut take: impl FnMut(&M, Result<T, Reject>) -> U,
    ) -> Option<U> {
        let subscriber = self.subscriber.as_ref().filter(|_| self.left > 0)?;
        let (sessions, now_ns) = (&mut self.sessions, moment.stamp.as_nanos());
        let received = subscriber.receive_with(|mut message| {
            to_inner(&mut message, moment);
            let heard = check(&message).and_then(|made| {
                sessions.accept(message.header(), now_ns)?;
                Ok(made)
            });
            take(&message, heard)
        });
        // One publisher's messages cannot be read; the others' come at the next tick.
        let received = received.inspect_err(|_| account.unreadable(self.input));
        let taken = received.ok()??;
        // Refused ones count: a flood of them must not make the tick longer than a flood of good ones.
        self.left -= 1;
        Some(taken)
    }

    /// A message that changes nothing.
    pub(super) fn refuse(&self, source: u16, reason: Reject, account: &mut Account) {
        match reason {
            Reject::Replayed | Reject::OutOfOrder => account.repeated(self.input, source, reason),
            _ => account.invalid(self.input, source, reason),
        }
    }

    /// Says who speaks on this channel.
    pub(super) fn tell_sessions(&self, now: Stamp, account: &mut Account) {
        let state = |source| self.sessions.state(source, now.as_nanos());
        account.sessions(self.input, state);
    }
}

/// What follows sees the inner clock alone.
fn to_inner(message: &mut impl Message, moment: &Moment) {
    let inner = moment.inner(message.header());
    message.move_stamps(inner.stamp_ns.saturating_sub(message.header().stamp_ns));
    *message.header_mut() = inner;
}
