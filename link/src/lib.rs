//! `coloc-link`: carries what robots say to one another between computers.
//!
//! * **Who says what is independent of who carries it.** Every message is signed by its robot ([`wire`]); who that may be, and what
//!   it may say, is in the team's [`roster`]; [`admission`] makes of bytes from the network a message, or a reason.
//! * **Nothing here knows one kind of message.** What a kind is, who says it and how old it may get is in the table of channels of
//!   `coloc-shm-types`; [`kinds`] gives each of its rows a number on the wire, and [`reach`] says how far it goes.
//! * **Clocks are measured**, not trusted ([`clock_offset`]).
//! * **A link is of one robot.** It carries what that robot says, and says to that robot what came for it: so nothing goes in circles,
//!   and robots that share a computer each have their own.
//! * **Nobody waits for the network.** What is to be sent waits in a bounded [`queue`] and grows too old there.

pub mod admission;
pub mod budget;
pub mod check;
pub mod clock_offset;
pub mod discovery;
pub mod engine;
pub mod fleet;
pub mod keys;
pub mod kinds;
pub mod networks;
pub mod post;
pub mod program;
pub mod queue;
pub mod reach;
pub mod rehearsal;
pub mod roster;
pub mod section;
pub mod space;
pub mod tls;
pub mod weather;
pub mod wire;
pub mod wrong_clock;
