//! The whole demo, as a person runs it: real daemons, a real bus, real shared memory.

mod stage;
mod team;
mod trouble;
