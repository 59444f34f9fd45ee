//! What can be told without the network: keys, roster, time, clock.
use coloc_daemon::config::Config;
use coloc_sensors::EndError;

use super::Findings;
use crate::keys::{Identity, ROBOT_KEY, load_team};
use crate::roster::{Book, FLEET, Moment, Role, Roster};
use crate::section::Link;
use crate::wire;

/// A member whose time is over in less is told so (s).
const SOON_S: i64 = 30 * 86_400;

/// Looks at the robot's own directory; the roster, if there is one to go on with.
pub(super) fn look(
    config: &Config,
    section: &Link,
    now: Moment,
    findings: &mut Findings,
) -> Result<Option<Roster>, EndError> {
    let directory = section.own_directory(config)?;
    findings.tell("directory", &directory.display().to_string());
    findings.tell("listens", &section.listen);
    if section.discover {
        findings.tell(
            "discovery",
            "on: members are also called where multicast DNS finds them",
        );
    }
    findings.tell(
        "wire",
        &format!(
            "version {}, {} and newer understood",
            wire::NEWEST,
            wire::OLDEST
        ),
    );
    let (identity, team) = if section.insecure {
        findings.warn("link.insecure: everybody on this computer can speak for any robot".into());
        let identity = Identity::insecure(config.robot.id);
        (identity, Identity::insecure(0).public())
    } else {
        let loaded = Identity::load(&directory, ROBOT_KEY)
            .and_then(|identity| Ok((identity, load_team(&directory)?)));
        match loaded {
            Ok(both) => both,
            Err(error) => {
                findings.warn(error.to_string());
                return Ok(None);
            }
        }
    };
    findings.tell("key", &identity.public().to_string());
    let text = std::fs::read_to_string(directory.join(FLEET));
    let book = text.map_err(|error| error.to_string());
    let book = book.and_then(|text| Book::open(text, team).map_err(|error| error.to_string()));
    match book {
        Ok(book) => {
            look_at_roster(config, book.roster(), &identity, now, findings);
            Ok(Some(book.roster().clone()))
        }
        Err(error) => {
            let path = directory.join(FLEET);
            findings.warn(format!("{}: {error}", path.display()));
            Ok(None)
        }
    }
}

/// What a roster means for the robot.
pub(super) fn look_at_roster(
    config: &Config,
    roster: &Roster,
    identity: &Identity,
    now: Moment,
    findings: &mut Findings,
) {
    let members = roster.member.len();
    findings.tell(
        "roster",
        &format!(
            "{} of team {}, {members} members, signed {}",
            roster.version, roster.name, roster.issued
        ),
    );
    if roster.clock_is_wrong(now) {
        findings.warn(format!(
            "this computer's clock says {now}, and the roster was signed later: it is my clock that is wrong; set it (chrony, PTP)"
        ));
    } else {
        findings.tell("clock", &format!("{now}"));
    }
    let (id, name) = (config.robot.id, &config.robot.name);
    let Some(own) = roster.member(id).filter(|own| own.name == *name) else {
        findings.warn(format!(
            "{name}, number {id}, is not in the roster: `coloc-link fleet add` it"
        ));
        return;
    };
    if !own.has(&identity.public()) {
        findings.warn(format!(
            "the roster has another key of {name} than its directory: `coloc-link fleet renew` it"
        ));
    }
    if own.role == Role::Station {
        findings.tell("role", "station: it listens and says nothing");
    }
    if now > own.expires {
        findings.warn(format!(
            "{name}'s time in the roster was over at {}: `coloc-link fleet renew` it",
            own.expires
        ));
    } else if now.later(SOON_S) > own.expires {
        findings.warn(format!(
            "{name}'s time in the roster is over at {}: `coloc-link fleet renew` it",
            own.expires
        ));
    } else {
        findings.tell(
            "member",
            &format!("{name}, number {id}, until {}", own.expires),
        );
    }
    for listed in &config.team {
        let known = roster
            .member(listed.id)
            .is_some_and(|member| member.name == listed.name);
        if !known {
            findings.warn(format!(
                "[[team]] has {}, number {}, and the roster has not",
                listed.name, listed.id
            ));
        }
    }
    for member in roster
        .member
        .iter()
        .filter(|it| it.id != id && it.role == Role::Robot)
    {
        let known = config
            .team
            .iter()
            .any(|listed| listed.id == member.id && listed.name == member.name);
        if !known {
            findings.warn(format!(
                "the roster has {}, number {}, and [[team]] has not: colocd will not hear it",
                member.name, member.id
            ));
        }
    }
}
