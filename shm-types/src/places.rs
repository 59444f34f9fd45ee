//! Where things are if nobody says otherwise: one rule for whoever writes and for whoever reads.
//!
//! | what | for a robot | else |
//! | --- | --- | --- |
//! | shared memory's root | `/run/coloc` | `$XDG_RUNTIME_DIR/coloc` |
//! | saved state | `/var/lib/coloc` | `$XDG_STATE_HOME/coloc`, which is `~/.local/state/coloc` |
//!
//! The first is taken if it is ours, or if it is not there and this user may make it. Nothing is made here.
use std::fmt;
use std::path::{Path, PathBuf};

use rustix::fs::{Access, AtFlags, CWD};

use crate::private::{NotPrivate, own_user};

/// First letters of coloc's files in `/dev/shm`, if nobody says otherwise.
pub const DEFAULT_PREFIX: &str = "coloc";

const ROOT: &str = "/run/coloc";
const STATE: &str = "/var/lib/coloc";
const NAME: &str = "coloc";

/// Where shared memory's root is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SharedMemoryRoot {
    /// The directory, which need not be there yet.
    pub path: PathBuf,
    /// It is in the directory that the system removes when its user logs out.
    pub goes_at_logout: bool,
}

impl fmt::Display for SharedMemoryRoot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let path = self.path.display();
        if !self.goes_at_logout {
            return write!(f, "{path}");
        }
        write!(
            f,
            "{path}, which goes when its user logs out, and what is in /dev/shm with it: on a robot make {ROOT}, \
             or keep both (loginctl enable-linger; RemoveIPC=no in logind.conf)"
        )
    }
}

/// There is no default place for this user on this machine.
#[derive(Debug, thiserror::Error)]
pub enum NoPlace {
    /// Somebody else runs coloc here; programs of two users do not meet.
    #[error(transparent)]
    WrongUser(#[from] NotPrivate),
    /// The user has no directory of his own.
    #[error(
        "no place for {what}: user {user} cannot make {system}, and {variable} names no directory of his. \
         Set {setting}, or make it once as the superuser: install -d -m 700 -o {user} {system}"
    )]
    None {
        /// What it is for.
        what: &'static str,
        /// The user's number.
        user: u32,
        /// The place for a robot.
        system: PathBuf,
        /// The variable that could name another one.
        variable: &'static str,
        /// What to set in the configuration.
        setting: &'static str,
    },
}

/// Where shared memory's root is if `shm.root` is not set.
///
/// # Errors
/// If there is no place, or somebody else's is in it: this user's programs would hear nothing elsewhere.
pub fn shared_memory_root() -> Result<SharedMemoryRoot, NoPlace> {
    root_among(Path::new(ROOT), own_directory("XDG_RUNTIME_DIR"))
}

/// Where robots are looked for by those who only look: the same, but that the place for a robot counts whoever has it.
///
/// # Errors
/// If there is no place.
pub fn root_to_look_at() -> Result<SharedMemoryRoot, NoPlace> {
    match shared_memory_root() {
        Err(NoPlace::WrongUser(_)) => Ok(SharedMemoryRoot {
            path: ROOT.into(),
            goes_at_logout: false,
        }),
        result => result,
    }
}

fn root_among(system: &Path, user: Option<PathBuf>) -> Result<SharedMemoryRoot, NoPlace> {
    let found = |path, goes_at_logout| SharedMemoryRoot {
        path,
        goes_at_logout,
    };
    match (owner(system), user) {
        (Some(owner), _) if owner != own_user() => Err(wrong_user(system, owner)),
        (Some(_), _) => Ok(found(system.into(), false)),
        (None, _) if can_make(system) => Ok(found(system.into(), false)),
        (None, Some(user)) => Ok(found(user.join(NAME), true)),
        (None, None) => Err(NoPlace::None {
            what: "shared memory",
            user: own_user(),
            system: system.into(),
            variable: "XDG_RUNTIME_DIR",
            setting: "shm.root",
        }),
    }
}

/// The directory for what outlives a daemon, if the configuration names no file.
///
/// # Errors
/// If there is no place.
pub fn state_directory() -> Result<PathBuf, NoPlace> {
    let home = || std::env::home_dir().filter(|home| home.is_absolute());
    let user = absolute("XDG_STATE_HOME").or_else(|| Some(home()?.join(".local/state")));
    state_among(Path::new(STATE), user)
}

/// Somebody else's place is no hindrance here: nobody is to be met.
fn state_among(system: &Path, user: Option<PathBuf>) -> Result<PathBuf, NoPlace> {
    let ours = owner(system).map_or_else(|| can_make(system), |owner| owner == own_user());
    match user {
        _ if ours => Ok(system.into()),
        Some(user) => Ok(user.join(NAME)),
        None => Err(NoPlace::None {
            what: "the saved state",
            user: own_user(),
            system: system.into(),
            variable: "XDG_STATE_HOME or HOME",
            setting: "telemetry.state_file",
        }),
    }
}

fn wrong_user(path: &Path, owner: u32) -> NoPlace {
    NoPlace::WrongUser(NotPrivate::WrongUser {
        path: path.into(),
        owner,
        own: own_user(),
    })
}

fn absolute(variable: &str) -> Option<PathBuf> {
    let path = PathBuf::from(std::env::var_os(variable)?);
    path.is_absolute().then_some(path)
}

fn own_directory(variable: &str) -> Option<PathBuf> {
    absolute(variable).filter(|path| path.is_dir() && owner(path) == Some(own_user()))
}

/// Whose the place itself is, be it a link.
fn owner(path: &Path) -> Option<u32> {
    Some(rustix::fs::lstat(path).ok()?.st_uid)
}

fn can_make(path: &Path) -> bool {
    let access = Access::WRITE_OK | Access::EXEC_OK;
    path.parent()
        .is_some_and(|parent| rustix::fs::accessat(CWD, parent, access, AtFlags::EACCESS).is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Somebody else's directory, for the superuser and for anybody else.
    fn strangers(directory: &Path) -> PathBuf {
        if own_user() != 0 {
            return "/usr".into();
        }
        let path = directory.join("strangers");
        std::fs::create_dir(&path).unwrap();
        std::os::unix::fs::chown(&path, Some(65534), None).unwrap();
        path
    }

    #[test]
    fn the_robots_place_comes_first_and_is_made_by_nobody_here() {
        let directory = tempfile::tempdir().unwrap();
        let system = directory.path().join("run");
        let user = directory.path().join("user");
        let expected = SharedMemoryRoot {
            path: system.clone(),
            goes_at_logout: false,
        };
        assert_eq!(root_among(&system, Some(user.clone())).unwrap(), expected);
        assert_eq!(state_among(&system, Some(user.clone())).unwrap(), system);
        assert!(!system.exists());
        std::fs::create_dir(&system).unwrap();
        assert_eq!(root_among(&system, None).unwrap(), expected);
        assert_eq!(state_among(&system, Some(user)).unwrap(), system);
    }

    #[test]
    fn where_that_cannot_be_the_users_own_place_is_taken_with_a_word() {
        let user = Some(PathBuf::from("/home/me"));
        let root = root_among(Path::new("/nowhere/coloc"), user.clone()).unwrap();
        assert_eq!(root.path, Path::new("/home/me/coloc"));
        assert!(root.to_string().contains("enable-linger"), "{root}");
        let state = state_among(Path::new("/nowhere/coloc"), user).unwrap();
        assert_eq!(state, Path::new("/home/me/coloc"));
    }

    #[test]
    fn without_any_the_refusal_names_the_setting() {
        let refusal = |result: Result<String, NoPlace>| result.unwrap_err().to_string();
        let nowhere = Path::new("/nowhere/coloc");
        let root = refusal(root_among(nowhere, None).map(|root| root.to_string()));
        assert!(root.contains("Set shm.root"), "{root}");
        let state = refusal(state_among(nowhere, None).map(|path| path.display().to_string()));
        assert!(state.contains("Set telemetry.state_file"), "{state}");
    }

    #[test]
    fn where_another_user_runs_coloc_nobody_listens_in_vain() {
        let directory = tempfile::tempdir().unwrap();
        let strangers = strangers(directory.path());
        let user = Some(PathBuf::from("/home/me"));
        let refusal = root_among(&strangers, user.clone()).unwrap_err();
        assert!(matches!(refusal, NoPlace::WrongUser(_)), "{refusal}");
        let state = state_among(&strangers, user).unwrap();
        assert_eq!(state, Path::new("/home/me/coloc"));
    }
}
