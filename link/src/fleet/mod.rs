//! `coloc-link fleet`: the operator's side of a roster.
//!
//! The operator has one directory: the team's private key, its public one, the roster, and a directory for each robot that was added, to
//! be copied to that robot as it is. Every change signs a roster of the next version; it is enough to copy it to one robot that runs,
//! the links hand it on.

mod desk;
mod show;

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};
use coloc_sensors::{EndError, Moment as Present};
use coloc_shm_types::RobotName;

use crate::keys::PublicKey;
use crate::roster::{Moment, Role, Roster};

pub use desk::{Desk, FleetError, Newcomer};
pub use show::shown;

/// What is done to a team.
#[derive(Debug, Subcommand)]
pub enum Fleet {
    /// Begin a team: a directory with its key and an empty roster.
    Init {
        /// The operator's directory.
        directory: PathBuf,
        /// What the team is called.
        #[arg(long, default_value = "team")]
        name: String,
        /// The frame that all poses are in: a word that all agree on, or the receivers' datum.
        #[arg(long, default_value = "common")]
        datum: String,
        /// A period that all share, in seconds, as `assist=0.5`.
        #[arg(long = "period", value_parser = period)]
        periods: Vec<(String, f64)>,
    },
    /// Add a member, with a directory to copy to its computer.
    Add {
        /// The operator's directory.
        directory: PathBuf,
        /// The robot's name, as in its robot.toml.
        name: RobotName,
        /// Its number, as in its robot.toml.
        #[arg(long)]
        id: u16,
        /// Where it is called, `host:port`; none for who only calls.
        #[arg(long = "address")]
        addresses: Vec<String>,
        /// What it is.
        #[arg(long, value_enum, default_value = "robot")]
        role: RoleArg,
        /// That it leads.
        #[arg(long)]
        leads: bool,
        /// The only channels that it may say something on.
        #[arg(long = "says", value_delimiter = ',')]
        says: Vec<String>,
        /// Its public key, if it has made one itself; else one is made for it.
        #[arg(long)]
        key: Option<PublicKey>,
        /// For how long.
        #[command(flatten)]
        until: Until,
    },
    /// Take a member out, at once.
    Revoke {
        /// The operator's directory.
        directory: PathBuf,
        /// Whom.
        name: RobotName,
    },
    /// Give members more time, or one a new key; a new key that it has by now takes the place of the old one.
    Renew {
        /// The operator's directory.
        directory: PathBuf,
        /// Whom; without a name everybody.
        name: Option<RobotName>,
        /// Make a new key, which stands beside the old one until it is renewed again.
        #[arg(long, requires = "name")]
        new_key: bool,
        /// For how long.
        #[command(flatten)]
        until: Until,
    },
    /// Print the roster, if it is signed as it should be.
    Show {
        /// The operator's directory, or a robot's.
        directory: PathBuf,
    },
}

/// How long.
#[derive(Clone, Copy, Debug, Args)]
pub struct Until {
    /// For so many days from now.
    #[arg(long, default_value_t = 365)]
    days: u32,
}

/// [`Role`] as it is typed.
#[derive(Copy, Clone, Debug, ValueEnum)]
pub enum RoleArg {
    /// It speaks for itself.
    Robot,
    /// A base station: it listens.
    Station,
}

fn period(text: &str) -> Result<(String, f64), String> {
    let (name, seconds) = text.split_once('=').ok_or("write it as name=seconds")?;
    let seconds = seconds.parse().map_err(|_| "write it as name=seconds")?;
    Ok((name.into(), seconds))
}

impl Until {
    fn after(self, now: Moment) -> Moment {
        now.later(i64::from(self.days) * 86_400)
    }
}

/// Does it, and prints what there is to say.
///
/// # Errors
/// What is wrong.
pub fn run(command: Fleet) -> Result<(), EndError> {
    let now = Moment::of_ns(Present::now().realtime_ns);
    let text = told(command, now).map_err(|error| EndError::Input(error.to_string()))?;
    coloc_sensors::page::check(text, &[], false)
}

/// Does it at `now`; what there is to say.
///
/// # Errors
/// What is wrong.
pub fn told(command: Fleet, now: Moment) -> Result<String, FleetError> {
    match command {
        Fleet::Init {
            directory,
            name,
            datum,
            periods,
        } => {
            let roster = |team| Roster {
                name,
                datum,
                periods: periods.into_iter().collect(),
                ..Roster::begin(team, now)
            };
            let desk = Desk::found(&directory, roster)?;
            Ok(format!(
                "{}\nwhoever has {} decides who the team is: keep it off the robots\n",
                desk.summary(),
                directory.join(crate::keys::TEAM_KEY).display(),
            ))
        }
        Fleet::Add {
            directory,
            name,
            id,
            addresses,
            role,
            leads,
            says,
            key,
            until,
        } => {
            let mut desk = Desk::open(&directory)?;
            let newcomer = Newcomer {
                name: name.clone(),
                id,
                role: match role {
                    RoleArg::Robot => Role::Robot,
                    RoleArg::Station => Role::Station,
                },
                addresses,
                says: (!says.is_empty()).then_some(says),
                leads,
                expires: until.after(now),
            };
            desk.add(newcomer, key, now)?;
            let own = directory.join(name.as_str());
            Ok(format!(
                "{}\ncopy {} to {name} as its [link] directory, with its modes, and delete {} here\n",
                desk.summary(),
                own.display(),
                own.join(crate::keys::ROBOT_KEY).display(),
            ))
        }
        Fleet::Revoke { directory, name } => {
            let mut desk = Desk::open(&directory)?;
            desk.revoke(&name, now)?;
            Ok(handed_on(&desk))
        }
        Fleet::Renew {
            directory,
            name,
            new_key,
            until,
        } => {
            let mut desk = Desk::open(&directory)?;
            desk.renew(name.as_ref(), new_key, until.after(now), now)?;
            Ok(handed_on(&desk))
        }
        Fleet::Show { directory } => shown(&directory, now),
    }
}

fn handed_on(desk: &Desk) -> String {
    format!(
        "{}\ncopy {} into the [link] directory of one robot that runs: the links hand it on\n",
        desk.summary(),
        desk.fleet().display(),
    )
}

#[cfg(test)]
mod tests;
