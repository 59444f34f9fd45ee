//! The table as people read it.

use std::fmt::Write;

use super::{FAULTS, Fault, Place, Way};

const BEGIN: &str = "<!-- The table of tests/src/faults/table.rs begins -->\n";
const END: &str = "<!-- The table ends -->\n";

/// The table.
fn markdown() -> String {
    let mut text = String::from(
        "| fault | in a word | how it is made | health of odometry | state of the bus | counted | estimate | well again |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    for fault in FAULTS {
        let Fault {
            name, word, made, ..
        } = fault;
        let (health, bus) = (changes(fault, fault.health), changes(fault, fault.bus));
        let (counted, estimate, again) = (counted(fault), estimate(fault), fault.again);
        let place = place(fault);
        writeln!(text, "| {name} | {word} | {made}{place} | {health} | {bus} | {counted} | {estimate} | tick {again} |").unwrap();
    }
    text
}

/// `page` with its table replaced by the current one.
///
/// # Panics
/// If the page has no place for it.
#[must_use]
pub fn filled_in(page: &str) -> String {
    let (before, rest) = page.split_once(BEGIN).expect("the line before the table");
    let (_, after) = rest.split_once(END).expect("the line after the table");
    format!("{before}{BEGIN}{}{END}{after}", markdown())
}

/// Changes while the fault lasts; those after it are counted from its end.
fn changes<T: std::fmt::Display>(fault: &Fault, changes: &[(u32, T)]) -> String {
    let when = |tick: u32| match tick.checked_sub(fault.ticks) {
        None | Some(0) => format!("{tick}"),
        Some(after) => format!("+{after}"),
    };
    let text: Vec<_> = changes
        .iter()
        .map(|(tick, to)| format!("{}: {to}", when(*tick)))
        .collect();
    if text.is_empty() {
        "–".into()
    } else {
        text.join(", ")
    }
}

fn counted(fault: &Fault) -> String {
    let text: Vec<_> = fault
        .counts
        .iter()
        .map(|count| {
            format!(
                "`{}` {}{}",
                count.name,
                if count.or_more { "≥ " } else { "" },
                count.by
            )
        })
        .collect();
    if text.is_empty() {
        "–".into()
    } else {
        text.join(", ")
    }
}

fn estimate(fault: &Fault) -> String {
    match fault.estimate {
        Way::Kept => "within 3σ, then exact".into(),
        Way::Turns(angle) => format!("turns by {angle:.2} rad"),
    }
}

fn place(fault: &Fault) -> &'static str {
    match fault.place {
        Place::Anywhere => "",
        Place::NoHardware => " (not on hardware)",
        Place::Interface => " (interfaces only)",
        Place::Virtual => " (virtual interfaces only)",
    }
}
