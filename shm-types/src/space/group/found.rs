//! The pages on this computer, and whose places they belong to.
use std::fs::Metadata;
use std::io::{self, ErrorKind};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use rustix::io::Errno;

use super::super::error::OpenError;
use super::super::roll::Running;
use super::super::transport::{Refusal, SHARED_MEMORY};
use super::super::{config, segments};
use super::error::ReadError;
use super::page::View;
use super::users::Group;
use super::{PAGE, door};
use crate::RobotName;
use crate::private::own_user;

/// A page by its name, whether it can be read or not.
#[derive(Debug)]
pub(super) struct Found {
    pub(super) robot: RobotName,
    path: PathBuf,
    pub(super) door: PathBuf,
    metadata: Metadata,
    prefix: String,
    /// Of the root, as it stands in names.
    hash: String,
}

/// Where robots are, and whose that is.
#[derive(Debug)]
pub(super) struct Site {
    pub(super) root: PathBuf,
    pub(super) owner: u32,
}

impl Site {
    /// Behind a directory that cannot be entered, everything is its owner's.
    pub(super) fn of(root: &Path) -> io::Result<Self> {
        match std::fs::canonicalize(root) {
            Ok(root) => Ok(Self {
                owner: root.metadata()?.uid(),
                root,
            }),
            Err(error) if error.kind() == ErrorKind::PermissionDenied => {
                let (Some(parent), Some(name)) = (root.parent(), root.file_name()) else {
                    return Err(error);
                };
                let above = Self::of(parent)?;
                Ok(Self {
                    root: above.root.join(name),
                    ..above
                })
            }
            Err(error) => Err(error),
        }
    }

    /// The pages of those who live there.
    pub(super) fn pages(&self) -> Vec<Found> {
        let hash = format!("{:016x}", config::hash(&self.root));
        let mut pages = all();
        pages.retain(|it| it.hash == hash && it.owner() == self.owner && !door::is_dead(&it.door));
        pages.sort_by(|one, other| one.robot.cmp(&other.robot));
        pages
    }
}

impl Found {
    fn parse(name: &str) -> Option<Self> {
        let space = segments::space_of(name)?;
        let (prefix, hash) = segments::prefix_and_hash(space)?;
        let (stem, robot) = name.strip_suffix(PAGE)?.split_once('.')?;
        let path = Path::new(SHARED_MEMORY).join(name);
        Some(Self {
            robot: RobotName::new(robot).ok()?,
            door: door::path(stem),
            metadata: path.symlink_metadata().ok()?,
            prefix: prefix.into(),
            hash: hash.into(),
            path,
        })
    }

    pub(super) fn owner(&self) -> u32 {
        self.metadata.uid()
    }

    pub(super) fn view(&self) -> Result<View, ReadError> {
        View::open(&self.path, self.owner()).map_err(|refusal| self.refused(refusal))
    }

    fn refused(&self, refusal: Refusal) -> ReadError {
        let robot = self.robot.clone();
        let source = match refusal {
            Refusal::System(Errno::ACCESS) => {
                let group = Group::numbered(self.metadata.gid());
                return ReadError::NotInGroup {
                    robot,
                    group: group.to_string(),
                    word: group.word(),
                    own: own_user(),
                };
            }
            Refusal::Missing => return ReadError::Gone { robot },
            Refusal::System(error) => error.into(),
            Refusal::HalfMade | Refusal::NotOurs => Errno::PERM.into(),
        };
        ReadError::System {
            action: "read",
            robot,
            source,
        }
    }

    fn running(&self) -> Result<Running, ReadError> {
        let about = self.view()?.about();
        Ok(Running {
            robot: self.robot.clone(),
            who: about.map(|about| (about.id, about.process)),
            since: self.metadata.modified().ok(),
        })
    }

    /// Root and prefix, if it is another user's, can be read, and is of the place that it says.
    fn place(&self) -> Option<(PathBuf, String)> {
        if self.owner() == own_user() {
            return None;
        }
        let root = PathBuf::from(self.view().ok()?.about()?.root);
        let site = Site::of(&root).ok()?;
        let is_true = site.owner == self.owner()
            && site.root == root
            && self.hash == format!("{:016x}", config::hash(&root));
        is_true.then(|| (root, self.prefix.clone()))
    }
}

fn all() -> Vec<Found> {
    let entries = std::fs::read_dir(SHARED_MEMORY).into_iter().flatten();
    let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    names.filter_map(|name| Found::parse(&name)).collect()
}

/// Whose a root is, if it is there.
pub(crate) fn owner(root: &Path) -> Option<u32> {
    Site::of(root).ok().map(|site| site.owner)
}

/// The robots of another user at `root` that this one may read.
pub(crate) fn running(root: &Path) -> Result<Vec<Running>, OpenError> {
    let site = Site::of(root).map_err(|source| OpenError::System {
        action: "look at",
        path: root.into(),
        source,
    })?;
    let (mut running, mut refused) = (Vec::new(), None);
    for page in site.pages() {
        match page.running() {
            Ok(robot) => running.push(robot),
            Err(error) => refused = Some(error),
        }
    }
    match refused {
        Some(refused) if running.is_empty() => Err(refused.into()),
        None if running.is_empty() => Err(site.not_shared().into()),
        _ => Ok(running),
    }
}

impl Site {
    pub(super) fn not_shared(&self) -> ReadError {
        ReadError::NotShared {
            root: self.root.clone(),
            owner: self.owner,
            own: own_user(),
        }
    }
}

/// Root and prefix of all places of other users where this one may read something.
pub(crate) fn places() -> impl Iterator<Item = (PathBuf, String)> {
    let pages = all().into_iter().filter(|page| !door::is_dead(&page.door));
    pages.filter_map(|page| page.place())
}

/// Whether the file at `path` is a page behind whose door nobody is.
pub(crate) fn is_dead_page(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str());
    let page = name.and_then(Found::parse);
    page.is_some_and(|page| door::is_dead(&page.door))
}
