//! The operator's directory, and what is changed there.
use std::path::{Path, PathBuf};

use coloc_shm_types::RobotName;
use coloc_shm_types::private::{NotPrivate, PrivateDirectory};

use crate::keys::{Identity, KeyError, PublicKey, ROBOT_KEY, TEAM, TEAM_KEY, load_team};
use crate::roster::{Book, FLEET, Member, Moment, Role, Roster, RosterError};

/// What is wrong.
#[derive(Debug, thiserror::Error)]
pub enum FleetError {
    /// Of a key.
    #[error(transparent)]
    Key(#[from] KeyError),
    /// Of the roster.
    #[error(transparent)]
    Roster(#[from] RosterError),
    /// Of a file.
    #[error(transparent)]
    Private(#[from] NotPrivate),
    /// There is no roster.
    #[error("there is no roster at {}: begin a team with `coloc-link fleet init`", .0.display())]
    NoRoster(PathBuf),
    /// Of whom it was asked.
    #[error("{0} is not in the roster")]
    Nobody(RobotName),
    /// There is one of that name.
    #[error("{0} is in the roster already: `renew` it, or `revoke` it first")]
    There(RobotName),
}

/// A member to be.
#[derive(Clone, Debug)]
pub struct Newcomer {
    /// Its name.
    pub name: RobotName,
    /// Its number.
    pub id: u16,
    /// What it is.
    pub role: Role,
    /// Where it is called.
    pub addresses: Vec<String>,
    /// The only channels that it may say something on.
    pub says: Option<Vec<String>>,
    /// Whether it leads.
    pub leads: bool,
    /// Until when it is a member.
    pub expires: Moment,
}

/// The operator's directory.
#[derive(Debug)]
pub struct Desk {
    directory: PathBuf,
    key: Identity,
    roster: Roster,
}

/// Reads the roster of a directory, as its `team.pub` has signed it.
///
/// # Errors
/// What is wrong with either.
pub(super) fn book(directory: &Path) -> Result<Book, FleetError> {
    let team = load_team(directory)?;
    let longest = u64::try_from(Roster::LONGEST).unwrap_or(u64::MAX);
    let file = PrivateDirectory::open(directory, |_| true)?.file(FLEET)?;
    let missing = || FleetError::NoRoster(directory.join(FLEET));
    let text = file.read(longest)?.ok_or_else(missing)?;
    Ok(Book::open(text, team)?)
}

impl Desk {
    /// Makes the directory, with a new key and the roster that `begin` makes for it.
    ///
    /// # Errors
    /// If there is a team already, and what the system says.
    pub fn found(
        directory: &Path,
        begin: impl FnOnce(PublicKey) -> Roster,
    ) -> Result<Self, FleetError> {
        let key = Identity::generate().map_err(KeyError::System)?;
        key.save(directory, TEAM_KEY)?;
        let desk = Self {
            directory: directory.into(),
            roster: begin(key.public()),
            key,
        };
        desk.write_down()?;
        Ok(desk)
    }

    /// Opens it.
    ///
    /// # Errors
    /// If something is missing, or not signed.
    pub fn open(directory: &Path) -> Result<Self, FleetError> {
        Ok(Self {
            key: Identity::load(directory, TEAM_KEY)?,
            roster: book(directory)?.roster().clone(),
            directory: directory.into(),
        })
    }

    /// The roster as it is now.
    #[must_use]
    pub const fn roster(&self) -> &Roster {
        &self.roster
    }

    /// Where it lies.
    #[must_use]
    pub fn fleet(&self) -> PathBuf {
        self.directory.join(FLEET)
    }

    /// Adds a member with a key of its own, or makes one for it in its directory.
    ///
    /// # Errors
    /// If there is one of its name, number or key, and what the system says.
    pub fn add(
        &mut self,
        new: Newcomer,
        key: Option<PublicKey>,
        now: Moment,
    ) -> Result<(), FleetError> {
        if self.roster.named(new.name.as_str()).is_some() {
            return Err(FleetError::There(new.name));
        }
        let (made, key) = if let Some(key) = key {
            (None, key)
        } else {
            let made = Identity::generate().map_err(KeyError::System)?;
            let public = made.public();
            (Some(made), public)
        };
        let own = self.directory.join(new.name.as_str());
        let mut roster = self.next(now);
        if new.leads {
            roster.leaders.push(new.name.to_string());
        }
        roster.member.push(Member {
            name: new.name,
            id: new.id,
            role: new.role,
            key,
            next_key: None,
            expires: new.expires,
            addresses: new.addresses,
            says: new.says,
        });
        roster.check()?;
        PrivateDirectory::make(&own, |_| true)?;
        if let Some(made) = made {
            // Of one of this name that was revoked.
            PrivateDirectory::open(&own, |_| true)?
                .file(ROBOT_KEY)?
                .remove()?;
            made.save(&own, ROBOT_KEY)?;
        }
        self.sign(roster)
    }

    /// Takes a member out.
    ///
    /// # Errors
    /// If there is none of that name, and what the system says.
    pub fn revoke(&mut self, name: &RobotName, now: Moment) -> Result<(), FleetError> {
        self.check_member(name)?;
        let mut roster = self.next(now);
        roster.member.retain(|member| member.name != *name);
        roster.leaders.retain(|leader| leader != name.as_str());
        self.sign(roster)
    }

    /// Gives one, or everybody, time until `expires`, and one a new key if it is to have one.
    ///
    /// # Errors
    /// If there is none of that name, and what the system says.
    pub fn renew(
        &mut self,
        name: Option<&RobotName>,
        new_key: bool,
        expires: Moment,
        now: Moment,
    ) -> Result<(), FleetError> {
        if let Some(name) = name {
            self.check_member(name)?;
        }
        let made = if new_key {
            Some(Identity::generate().map_err(KeyError::System)?)
        } else {
            None
        };
        let mut roster = self.next(now);
        for member in &mut roster.member {
            if name.is_some_and(|name| *name != member.name) {
                continue;
            }
            member.expires = expires;
            if let Some(made) = &made {
                member.next_key = Some(made.public());
            } else if let Some(next) = member.next_key.take_if(|_| name.is_some()) {
                member.key = next;
            }
        }
        self.sign(roster)?;
        if let (Some(made), Some(name)) = (made, name) {
            made.replace(&self.directory.join(name.as_str()), ROBOT_KEY)?;
        }
        Ok(())
    }

    /// What there is now, in a line.
    #[must_use]
    pub fn summary(&self) -> String {
        let Roster {
            name,
            version,
            member,
            ..
        } = &self.roster;
        let members = member.len();
        format!("team {name}, roster {version}, {members} members")
    }

    fn check_member(&self, name: &RobotName) -> Result<(), FleetError> {
        let there = self.roster.named(name.as_str()).is_some();
        there
            .then_some(())
            .ok_or_else(|| FleetError::Nobody(name.clone()))
    }

    fn next(&self, now: Moment) -> Roster {
        Roster {
            version: self.roster.version.saturating_add(1),
            issued: now,
            ..self.roster.clone()
        }
    }

    fn sign(&mut self, roster: Roster) -> Result<(), FleetError> {
        roster.check()?;
        self.roster = roster;
        self.write_down()
    }

    /// Writes the roster down, here and in the robots' directories.
    fn write_down(&self) -> Result<(), FleetError> {
        let text = self.roster.sign(&self.key)?;
        let team = format!("{}\n", self.key.public());
        let here = PrivateDirectory::open(&self.directory, |_| true)?;
        let names = self.roster.member.iter().map(|it| it.name.as_str());
        let there = names.filter(|name| self.directory.join(name).is_dir());
        let places = there.map(|name| here.subdirectory(name));
        for place in places {
            write_to(&place?, &team, &text)?;
        }
        write_to(&here, &team, &text)
    }
}

fn write_to(place: &PrivateDirectory, team: &str, text: &str) -> Result<(), FleetError> {
    place.file(TEAM)?.replace(team.as_bytes())?;
    Ok(place.file(FLEET)?.replace(text.as_bytes())?)
}
