//! `coloc-link`: carries what robots say to one another between computers.
//!
//! * **Who says what is independent of who carries it.** Every message is signed by its robot ([`wire`]); who that may be, and what
//!   it may say, is in the team's [`roster`]; [`admission`] makes of bytes from the network a message, or a reason.
//! * **Nothing here knows one kind of message.** What a kind is, who says it and how old it may get is in the table of channels of
//!   `coloc-shm-types`; [`kinds`] gives each of its rows a number on the wire.
//! * **Clocks are measured**, not trusted ([`clock_offset`]).

pub mod admission;
pub mod clock_offset;
pub mod keys;
pub mod kinds;
pub mod roster;
pub mod tls;
pub mod wire;
