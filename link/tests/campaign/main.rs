//! A team on one computer, in bad times and in large numbers: what it costs, how soon help is back, what an attacker gets.
//!
//! ```text
//! cargo test -p coloc-link --test campaign                                    each part for some seconds
//! cargo test --release -p coloc-link --test campaign -- --full [PART]…        as docs/fleet.md tells it
//! ```
//!
//! Links, daemons and attackers are processes of their own; what robots say is said here. Only what does not depend on how busy the
//! computer is fails the short form.
#![allow(clippy::unwrap_used)] // A test may panic.

mod attack;
mod burden;
mod change;
mod clocks;
mod process;
mod ring;
mod rounds;
#[path = "../support/mod.rs"]
#[allow(dead_code)] // Other tests use the rest.
mod support;
mod talk;
mod team;
mod trouble;

use std::process::ExitCode;

/// How much is done.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(crate) enum Extent {
    Short,
    Full,
}

impl Extent {
    pub(crate) fn of<T>(self, short: T, full: T) -> T {
        match self {
            Self::Short => short,
            Self::Full => full,
        }
    }
}

type Part = (&'static str, fn(Extent));

const PARTS: [Part; 13] = [
    ("cost", burden::cost),
    ("numbers", burden::numbers),
    ("million", burden::million),
    ("links", trouble::links),
    ("daemons", trouble::daemons),
    ("partition", trouble::partition),
    ("knocks", attack::knocks),
    ("flood", attack::a_flood),
    ("change", change::one_by_one),
    ("clocks", clocks::wrong),
    ("rounds", rounds::rounds),
    ("evidence", rounds::evidence),
    ("ring", ring::ring),
];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.first().map(String::as_str) {
        Some("colocd") => return coloc_daemon::main_from_args(&arguments),
        Some("coloc-rounds") => return coloc_party::program::main_from_args(&arguments),
        Some("coloc-bounds") => return coloc_monitor::program::main_from_args(&arguments),
        Some("attack") => return attack::attack(&arguments),
        // A runner asks for tests one by one; this is none of its kind.
        _ if arguments.iter().any(|it| it == "--list") => return ExitCode::SUCCESS,
        _ => {}
    }
    let full = arguments.iter().any(|it| it == "--full");
    let extent = if full { Extent::Full } else { Extent::Short };
    let wanted: Vec<_> = arguments.iter().filter(|it| !it.starts_with('-')).collect();
    for (name, part) in PARTS {
        if wanted.is_empty() || wanted.iter().any(|it| *it == name) {
            part(extent);
        }
    }
    ExitCode::SUCCESS
}
