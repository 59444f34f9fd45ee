//! Groups of users, as this computer knows them.
use std::fmt;

use nix::unistd::{Gid, Group as Known};
use rustix::process::{getegid, geteuid, getgroups};

use super::error::NoGroup;

/// A group of this computer's users.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Group {
    id: u32,
    name: Option<String>,
}

impl Group {
    /// The group of this name; or with this number, which need not have a name.
    ///
    /// # Errors
    /// If there is none.
    pub fn find(text: &str) -> Result<Self, NoGroup> {
        if let Ok(id) = text.parse() {
            return Ok(Self::numbered(id));
        }
        match Known::from_name(text) {
            Ok(Some(known)) => Ok(Self {
                id: known.gid.as_raw(),
                name: Some(known.name),
            }),
            Ok(None) => Err(NoGroup::Unknown { name: text.into() }),
            Err(error) => Err(NoGroup::Unreadable {
                name: text.into(),
                source: error.into(),
            }),
        }
    }

    /// The one with this number.
    pub(super) fn numbered(id: u32) -> Self {
        let known = Known::from_gid(Gid::from_raw(id)).ok().flatten();
        Self {
            id,
            name: known.map(|known| known.name),
        }
    }

    /// Whether this process may give files to it, as far as that can be told: it is a member, or the superuser.
    ///
    /// # Errors
    /// If it is not, with what to do.
    pub fn check_membership(&self) -> Result<(), NoGroup> {
        let member = || getgroups().is_ok_and(|all| all.iter().any(|one| one.as_raw() == self.id));
        if geteuid().is_root() || getegid().as_raw() == self.id || member() {
            return Ok(());
        }
        Err(self.not_a_member())
    }

    pub(super) fn not_a_member(&self) -> NoGroup {
        NoGroup::NotAMember {
            group: self.to_string(),
            word: self.word(),
            user: geteuid().as_raw(),
        }
    }

    pub(super) fn id(&self) -> u32 {
        self.id
    }

    /// As commands want it.
    pub(super) fn word(&self) -> String {
        self.name.clone().unwrap_or_else(|| self.id.to_string())
    }
}

impl fmt::Display for Group {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.name {
            Some(name) => write!(f, "{name} ({})", self.id),
            None => self.id.fmt(f),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_group_has_a_name_or_a_number() {
        assert_eq!(Group::find("root").unwrap(), Group::find("0").unwrap());
        assert_eq!(Group::find("0").unwrap().to_string(), "root (0)");
        assert_eq!(Group::find("4000000001").unwrap().to_string(), "4000000001");
    }

    #[test]
    fn who_is_no_group_is_told_how_to_become_one() {
        for name in ["no-such-group", "", "-1", "99999999999"] {
            let refusal = Group::find(name).unwrap_err().to_string();
            assert!(refusal.contains("groupadd"), "{refusal}");
        }
    }
}
