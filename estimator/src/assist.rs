//! Leaders and children: robots with good positions carry the rest of the team, beyond sight and beyond radio.
//!
//! The equations are those of T. R. Wanasinghe's thesis (Memorial University of Newfoundland, 2017), chapters 3 and 4, corrected where
//! they are wrong. A leader knows where it is by other means. What it sees of a child is a pose of the child in the common frame: a
//! datum ([`datum`]). A child that has one hands it on to the children that it sees, each time one sighting longer. The child's own
//! belief is never a part of it, so that nothing is told twice.
//!
//! ```text
//! first hop    (y*, R*) = (x_l, P_l) ⊕ z      R_ind = the same with P_l = 0
//! each more    (y*, R*) := (y*, R*) ⊕ z       R_ind likewise
//! ```
//!
//! | file | what it does |
//! |---|---|
//! | [`datum`] | composes what a leader says of a child |
//! | [`kalman`], [`fusion`], [`cross`] | what a child makes of it, in three ways |
//! | [`transition`] | what becomes of a leader's error |
//! | [`change`] | the same of a stretch of a history |
//! | [`bond`] | what a child keeps of it, also where the leader was not heard for long |
//! | [`ties`] | what a history keeps for that |
//! | `sent` | what a leader says of its error |
//! | [`tree`] | which pose goes where, if leaders know all readings |
//! | [`readings`], [`trail`], [`gathered`] | what leaders are told for that, and whom they reach |
//! | `full`, `digest` | a robot's part in it, and what reveals that leaders were told different things |
//! | [`search`], [`path`] | the same without a centre, at one child and one event |
//! | [`delays`] | how long an answer is waited for |
//! | [`events`], [`slot`], [`refusal`] | all events that are open at a child, and what it does not listen to |
//! | [`assistant`] | a robot's part in all that, beside its estimator |
//! | `way` | a robot's own way between two moments |
//! | [`news`] | what somebody should know of it |
//! | [`wait`] | when the thesis's child fuses what has come |
//! | [`team`] | robots as bits |

pub mod assistant;
pub mod bond;
pub mod change;
pub mod cross;
pub mod datum;
pub mod delays;
mod digest;
pub mod events;
mod full;
pub mod fusion;
pub mod gathered;
pub mod kalman;
pub mod news;
pub mod path;
pub mod readings;
pub mod refusal;
pub mod search;
mod sent;
pub mod slot;
pub mod team;
pub mod ties;
pub mod trail;
pub mod transition;
pub mod tree;
pub mod wait;
mod way;
