//! Where robots run on this computer, for commands that only look.

use std::fmt;
use std::path::{Path, PathBuf};

use clap::Args;
use coloc_shm_types::{OpenError, ReadError, RobotName, Running, Space, places};

/// Which shared memory is meant.
#[derive(Clone, Debug, Default, Args)]
pub(crate) struct PlaceArgs {
    /// Look in this shared memory alone: `shm.root` of the robot's configuration
    #[arg(long, value_name = "DIR")]
    pub(crate) root: Option<PathBuf>,
    /// First letters of its files: `shm.prefix` of the robot's configuration [default: those found there, else coloc]
    #[arg(long, value_name = "PREFIX")]
    pub(crate) prefix: Option<String>,
}

/// A root and a prefix.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Place {
    pub(crate) root: PathBuf,
    pub(crate) prefix: String,
}

impl Place {
    /// Whether somebody acts for `robot` there.
    pub(crate) fn runs(&self, robot: &RobotName) -> Result<bool, OpenError> {
        match Space::running(&self.root) {
            // In another user's place nothing is seen of a robot that is being started again.
            Err(OpenError::NotReadable(ReadError::NotShared { .. })) => Ok(false),
            running => Ok(running?.iter().any(|one| one.robot == *robot)),
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.root.display().fmt(f)
    }
}

/// A place and who runs there.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    pub(crate) place: Place,
    pub(crate) robots: Vec<Running>,
}

/// What was found on this computer.
pub(crate) struct Looked {
    /// In the place that was named, or else where programs meet if none is.
    pub(crate) here: Result<Found, OpenError>,
    /// Elsewhere, if none was named: only where somebody runs.
    pub(crate) elsewhere: Vec<Found>,
}

/// Looks without leaving a trace.
pub(crate) fn look(args: &PlaceArgs) -> Looked {
    let known = known();
    let here = args.place(&known);
    let elsewhere = match (&args.root, &here) {
        (Some(_), _) => Vec::new(),
        (None, here) => others(known, here.as_ref().ok()),
    };
    Looked {
        here: here.and_then(Found::of),
        elsewhere,
    }
}

/// Who runs instead: it may have been misspelt.
pub(crate) fn who_else(here: &Found, elsewhere: &[Found]) -> String {
    let here = (!here.robots.is_empty()).then(|| here.names());
    let there = elsewhere
        .iter()
        .map(|found| format!("{} in {}", found.names(), found.place));
    let all: Vec<String> = here.into_iter().chain(there).collect();
    if all.is_empty() {
        return "nobody else runs".into();
    }
    format!("who runs: {}", all.join("; "))
}

fn known() -> Vec<Place> {
    let place = |(root, prefix)| Place { root, prefix };
    Space::places().into_iter().map(place).collect()
}

fn others(known: Vec<Place>, here: Option<&Place>) -> Vec<Found> {
    known
        .into_iter()
        .filter(|place| here.is_none_or(|here| here.root != place.root))
        .filter_map(|place| Found::of(place).ok())
        .filter(|found| !found.robots.is_empty())
        .collect()
}

impl Found {
    fn of(place: Place) -> Result<Self, OpenError> {
        let robots = Space::running(&place.root)?;
        Ok(Self { place, robots })
    }

    pub(crate) fn has(&self, robot: &RobotName) -> bool {
        self.robots.iter().any(|one| one.robot == *robot)
    }

    /// Names, for a sentence.
    pub(crate) fn names(&self) -> String {
        let names: Vec<_> = self.robots.iter().map(|one| one.robot.as_str()).collect();
        names.join(", ")
    }
}

impl PlaceArgs {
    /// With the prefix of what is at `root` now, unless one was named.
    pub(crate) fn at(&self, root: PathBuf) -> Result<Place, OpenError> {
        self.among(root, &known())
    }

    fn place(&self, known: &[Place]) -> Result<Place, OpenError> {
        let root = match &self.root {
            Some(root) => absolute(root),
            None => absolute(&places::root_to_look_at()?.path),
        };
        self.among(root, known)
    }

    fn among(&self, root: PathBuf, known: &[Place]) -> Result<Place, OpenError> {
        let prefix = self.prefix.clone().unwrap_or_else(|| {
            let found = known.iter().find(|place| place.root == root);
            found.map_or(places::DEFAULT_PREFIX.into(), |place| place.prefix.clone())
        });
        Space::check_place(&root, &prefix)?;
        Ok(Place { root, prefix })
    }
}

/// Without links, as spaces are known; as it is if it is not there.
fn absolute(path: &Path) -> PathBuf {
    std::fs::canonicalize(path)
        .or_else(|_| std::path::absolute(path))
        .unwrap_or_else(|_| path.into())
}
