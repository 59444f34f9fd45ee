//! How a team comes to a round: what each robot's process does at a slot, as a machine that is told messages and the time.
//!
//! ```text
//! slot        everybody says which round it knows                                      Hello
//! + hello     everybody shares with one leader: the newest round known, then the lowest id, among those heard   Share
//! + deadline  a leader with shares of more than half of the team makes the next round  Round
//! later       who missed it asks whoever has it                                        Ask
//! ```
//!
//! A robot shares with one leader a slot, and a leader needs more than half (half with the lowest id counts too), so there is one round a slot
//! at most; a slot's number names it. Nobody shares with a leader that knows less than itself, so the newest round always wins. A round that hardly anybody
//! heard of may be overtaken by one that was made without it: who has applied it takes it back ([`advice`]).
//!
//! Phases end early once everybody has spoken. What is lost is not sent again: the next slot comes soon.

use std::sync::Arc;

use crate::member::Member;
use crate::round::{Gates, Robot, Round, Share, Verdict};
use coloc_estimator::rounds::{Correction, Standing};

/// What robots say to one another.
#[derive(Clone, Debug, PartialEq)]
pub enum Message {
    /// I am here, and know this round.
    Hello {
        /// Who.
        from: Robot,
        /// Now.
        slot: u64,
        /// The slot of the newest round known.
        known: u64,
    },
    /// Lead me.
    Share {
        /// Who leads.
        leader: Robot,
        /// The slot of the newest round known.
        known: u64,
        /// What is believed and seen.
        share: Box<Share>,
    },
    /// What came of a slot.
    Round(Arc<Round>),
    /// Is there a newer one?
    Ask {
        /// Who asks.
        from: Robot,
        /// Newer than this.
        known: u64,
    },
}

impl Message {
    /// Bytes on the wire, headers of 24 included.
    #[must_use]
    pub fn bytes(&self) -> usize {
        24 + match self {
            Self::Hello { .. } | Self::Ask { .. } => 8,
            Self::Share { share, .. } => 8 * (21 + 12 * share.sightings.len()),
            Self::Round(round) => 8 * round.numbers(),
        }
    }
}

/// A message on its way.
#[derive(Clone, Debug, PartialEq)]
pub struct Post {
    /// To whom; `None`: to everybody else.
    pub to: Option<Robot>,
    /// What.
    pub message: Message,
}

/// How long a robot waits, and what a leader believes.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Rules {
    /// Robots in the team.
    pub robots: usize,
    /// From a slot until everybody shares \[ns\].
    pub hello_ns: i64,
    /// From a slot until the round is made \[ns\].
    pub deadline_ns: i64,
    /// A robot whose last round nobody knows any more joins anew after so many slots.
    pub patience: u32,
    /// χ² of sightings.
    pub gates: Gates,
}

/// What a robot's own belief should do about a round.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Advice {
    /// Nothing.
    Nothing,
    /// Take this.
    Correct(Correction),
    /// Take back what came after this.
    Undo(Option<u64>),
}

/// What `robot`, whose belief has this `standing`, should do about `round`.
#[must_use]
pub fn advice(round: &Round, robot: Robot, standing: Standing) -> Advice {
    let told = round.correction(robot);
    match (standing, told) {
        (Standing::Since(slot), Some(told)) if told.slot == slot => Advice::Nothing,
        // Whoever told this knows less than the robot.
        (Standing::Since(slot), _) if round.slot <= slot => Advice::Nothing,
        (Standing::Since(slot), Some(told)) if told.slot > slot => Advice::Correct(*told),
        (Standing::Since(_), told) => Advice::Undo(told.map(|told| told.slot)),
        (Standing::Joining(from), Some(told)) if told.slot >= from => Advice::Correct(*told),
        (Standing::Joining(_), _) => Advice::Nothing,
    }
}

/// What a robot did about a round.
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct Followed {
    /// A correction that was taken.
    pub taken: Option<crate::member::Taken>,
    /// One that was refused; the robot joins anew.
    pub refused: Option<coloc_estimator::rounds::Refusal>,
    /// Whether a round was taken back.
    pub undone: bool,
    /// Whether it has to join anew, from the next slot on.
    pub joins: bool,
}

/// Does with `member` what [`advice`] says, until there is none; `slot` is the present one.
pub fn follow(member: &mut Member, round: &Round, robot: Robot, slot: u64) -> Followed {
    let mut followed = Followed::default();
    if let Advice::Undo(last) = advice(round, robot, member.standing()) {
        followed.undone = member.undo(last);
        if !followed.undone {
            followed.joins = true;
            member.join(slot + 1);
            return followed;
        }
    }
    if let Advice::Correct(told) = advice(round, robot, member.standing()) {
        match member.correct(&told) {
            Ok(taken) => followed.taken = Some(taken),
            Err(refusal) => {
                followed.refused = Some(refusal);
                followed.joins = true;
                member.join(slot + 1);
            }
        }
    }
    followed
}

/// One robot's part in the rounds.
#[derive(Clone, Debug)]
pub struct Party {
    me: Robot,
    rules: Rules,
    round: Arc<Round>,
    at: Option<Present>,
    /// Slots in a row at which nobody knew this robot's last round.
    unknown: u32,
}

#[derive(Clone, Debug)]
struct Present {
    slot: u64,
    begin_ns: i64,
    own: Share,
    /// The newest round that each knows.
    heard: Vec<Option<u64>>,
    leader: Option<Robot>,
    shares: Vec<Share>,
    is_over: bool,
}

impl Party {
    /// Of robot `me`, that knows nothing yet.
    #[must_use]
    pub fn new(me: Robot, rules: Rules) -> Self {
        Self::knowing(me, rules, Arc::new(Round::beginning(rules.robots)))
    }

    /// Of robot `me`, that knows this round.
    #[must_use]
    pub fn knowing(me: Robot, rules: Rules, round: Arc<Round>) -> Self {
        Self {
            me,
            rules,
            round,
            at: None,
            unknown: 0,
        }
    }

    /// The newest round that it knows.
    #[must_use]
    pub fn round(&self) -> &Arc<Round> {
        &self.round
    }

    /// Whether this robot waited long enough for somebody to know its last round. It joins anew then.
    pub fn has_to_join(&mut self, standing: Standing) -> bool {
        let last = self.round.last(self.me);
        let is_unknown = match standing {
            Standing::Since(slot) => slot >= self.round.slot && last != Some(slot),
            Standing::Joining(_) => false,
        };
        self.unknown = if is_unknown { self.unknown + 1 } else { 0 };
        self.unknown > self.rules.patience
    }

    /// A slot begins, at which `own` is believed and seen.
    pub fn begin(&mut self, now_ns: i64, own: Share, post: &mut Vec<Post>) -> Vec<Verdict> {
        let mut heard = vec![None; self.rules.robots];
        heard[self.me] = Some(self.round.slot);
        let slot = own.shared.slot;
        self.at = Some(Present {
            slot,
            begin_ns: now_ns,
            own,
            heard,
            leader: None,
            shares: Vec::new(),
            is_over: false,
        });
        post.push(Post {
            to: None,
            message: Message::Hello {
                from: self.me,
                slot,
                known: self.round.slot,
            },
        });
        self.advance(now_ns, post)
    }

    /// Time passes.
    pub fn tick(&mut self, now_ns: i64, post: &mut Vec<Post>) -> Vec<Verdict> {
        self.advance(now_ns, post)
    }

    /// A message comes in. Verdicts are those of a round that this robot makes.
    pub fn hear(&mut self, now_ns: i64, message: &Message, post: &mut Vec<Post>) -> Vec<Verdict> {
        match message {
            Message::Hello { from, slot, known } => self.hello(*from, *slot, *known, post),
            Message::Share {
                leader,
                known,
                share,
            } => self.shared(*leader, *known, share),
            Message::Round(round) => self.adopt(round),
            Message::Ask { from, known } if self.round.slot > *known => post.push(Post {
                to: Some(*from),
                message: Message::Round(self.round.clone()),
            }),
            Message::Ask { .. } => (),
        }
        self.advance(now_ns, post)
    }

    fn hello(&mut self, from: Robot, slot: u64, known: u64, post: &mut Vec<Post>) {
        if known > self.round.slot {
            post.push(Post {
                to: Some(from),
                message: Message::Ask {
                    from: self.me,
                    known: self.round.slot,
                },
            });
        }
        if let Some(at) = self.at.as_mut().filter(|at| at.slot == slot)
            && let Some(heard) = at.heard.get_mut(from)
        {
            *heard = Some(known);
        }
    }

    fn shared(&mut self, leader: Robot, known: u64, share: &Share) {
        let knows_enough = known <= self.round.slot;
        if let Some(at) = &mut self.at
            && leader == self.me
            && knows_enough
            && at.slot == share.shared.slot
            && at.shares.iter().all(|it| it.robot != share.robot)
        {
            at.shares.push(share.clone());
        }
    }

    fn adopt(&mut self, round: &Arc<Round>) {
        if round.slot > self.round.slot && round.robots() == self.rules.robots {
            self.round = round.clone();
            if let Some(at) = &mut self.at {
                at.is_over |= at.slot <= round.slot;
            }
        }
    }

    fn advance(&mut self, now_ns: i64, post: &mut Vec<Post>) -> Vec<Verdict> {
        let Some(at) = self.at.as_mut().filter(|at| !at.is_over) else {
            return Vec::new();
        };
        let everybody = at.heard.iter().all(Option::is_some);
        if at.leader.is_none() && (everybody || now_ns >= at.begin_ns + self.rules.hello_ns) {
            // By what was said, its own too: so all who heard the same name the same.
            let best = |(id, known): &(usize, u64)| (std::cmp::Reverse(*known), *id);
            let heard = at.heard.iter().enumerate();
            let heard = heard.filter_map(|(id, known)| known.map(|known| (id, known)));
            let leader = heard.min_by_key(best).map_or(self.me, |(id, _)| id);
            at.leader = Some(leader);
            if leader == self.me {
                at.shares.push(at.own.clone());
            } else {
                post.push(Post {
                    to: Some(leader),
                    message: Message::Share {
                        leader,
                        known: self.round.slot,
                        share: Box::new(at.own.clone()),
                    },
                });
            }
        }
        let is_late = now_ns >= at.begin_ns + self.rules.deadline_ns;
        match at.leader {
            Some(leader) if leader == self.me => {
                let here = at.heard.iter().flatten().count();
                if is_late || at.shares.len() >= here.max(2) {
                    return self.conclude(post);
                }
            }
            Some(leader) if is_late => {
                at.is_over = true;
                post.push(Post {
                    to: Some(leader),
                    message: Message::Ask {
                        from: self.me,
                        known: self.round.slot,
                    },
                });
            }
            _ => (),
        }
        Vec::new()
    }

    /// The leader's word.
    fn conclude(&mut self, post: &mut Vec<Post>) -> Vec<Verdict> {
        let Some(at) = self.at.as_mut() else {
            return Vec::new();
        };
        at.is_over = true;
        let (here, team) = (2 * at.shares.len(), self.rules.robots);
        let has_lowest = at.shares.iter().any(|share| share.robot == 0);
        if here < team || (here == team && !has_lowest) {
            return Vec::new();
        }
        let gates = &self.rules.gates;
        let Some((round, verdicts)) = self.round.next(at.slot, self.me, &at.shares, gates) else {
            return Vec::new();
        };
        self.round = Arc::new(round);
        post.push(Post {
            to: None,
            message: Message::Round(self.round.clone()),
        });
        verdicts
    }
}
