//! A roster, for people.
use std::fmt::Write;
use std::path::Path;

use super::FleetError;
use super::desk::book;
use crate::roster::{Member, Moment, Role, Roster};

/// Who is in it, until when, and what is soon over.
///
/// # Errors
/// What is wrong with the roster or its key.
pub fn shown(directory: &Path, now: Moment) -> Result<String, FleetError> {
    let book = book(directory)?;
    let roster = book.roster();
    let mut text = format!(
        "team         {}, key {}\nroster       {}, signed {}\nframe        {}\n",
        roster.name, roster.team, roster.version, roster.issued, roster.datum
    );
    for (name, seconds) in &roster.periods {
        // Writing to a text cannot fail.
        let _ = writeln!(text, "period       {name} {seconds} s");
    }
    for member in &roster.member {
        let _ = writeln!(text, "{}", line(roster, member, now));
    }
    if roster.clock_is_wrong(now) {
        let _ = writeln!(
            text,
            "clock        this computer's says {now}, and the roster was signed later: set it"
        );
    }
    Ok(text)
}

fn line(roster: &Roster, member: &Member, now: Moment) -> String {
    let role = match member.role {
        Role::Robot if roster.leads(&member.name) => "robot, leads",
        Role::Robot => "robot",
        Role::Station => "station, listens",
    };
    let mut parts = vec![format!("{:12} {} ({role})", member.name, member.id)];
    parts.push(if member.addresses.is_empty() {
        "only calls".into()
    } else {
        format!("at {}", member.addresses.join(", "))
    });
    if let Some(says) = &member.says {
        parts.push(format!("says {}", says.join(", ")));
    }
    parts.push(format!("{} {}", time_left(member, now), member.expires));
    if member.next_key.is_some() {
        parts.push("has a new key".into());
    }
    parts.join(", ")
}

fn time_left(member: &Member, now: Moment) -> &'static str {
    const SOON_S: i64 = 30 * 86_400;
    if now > member.expires {
        "OVER since"
    } else if now.later(SOON_S) > member.expires {
        "soon over:"
    } else {
        "until"
    }
}
