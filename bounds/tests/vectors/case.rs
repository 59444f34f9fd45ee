//! Finds and reads the vectors, and what all cases have in common.

use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::{env, fs};

use coloc_bounds::{AngleInterval, Measurement, Place, RangeInterval, Seen};
use serde::{Deserialize, Deserializer};

/// A file of cases.
#[derive(Deserialize)]
struct File<T> {
    cases: Vec<T>,
}

/// The cases in `bounded/<file>`; none, and a loud line, on a machine that does not have them.
///
/// # Panics
/// If the file is there but is not what the test expects: that must not pass for a missing file.
pub(crate) fn read_vectors<T: for<'a> Deserialize<'a>>(file: &str) -> Vec<T> {
    let Some(directory) = directory() else {
        eprintln!(
            "SKIPPED: no test vectors; set COLOC_VECTORS to the directory that holds bounded/{file}"
        );
        return Vec::new();
    };
    let path = directory.join("bounded").join(file);
    let text =
        fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let file: File<T> =
        serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    assert!(!file.cases.is_empty(), "{} is empty", path.display());
    file.cases
}

/// `COLOC_VECTORS`, else `shared/vectors` beside the repository or above it.
fn directory() -> Option<PathBuf> {
    if let Some(given) = env::var_os("COLOC_VECTORS") {
        return Some(given.into());
    }
    let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
    above
        .map(|parent| parent.join("shared/vectors"))
        .find(|candidate| candidate.is_dir())
}

/// The largest deviation of one sort, told when the test ends.
pub(crate) struct Worst {
    what: &'static str,
    tolerance: f64,
    found: f64,
}

impl Worst {
    pub(crate) fn new(what: &'static str, tolerance: f64) -> Self {
        Self {
            what,
            tolerance,
            found: 0.0,
        }
    }

    /// # Panics
    /// If the deviation is over the tolerance, or NaN.
    pub(crate) fn take(&mut self, name: impl Display, deviation: f64) {
        let (what, tolerance) = (self.what, self.tolerance);
        assert!(
            deviation <= tolerance,
            "{name}: {what} off by {deviation:e}, {tolerance:e} allowed"
        );
        self.found = self.found.max(deviation);
    }
}

impl Drop for Worst {
    fn drop(&mut self) {
        let Self {
            what,
            tolerance,
            found,
        } = self;
        println!("{what}: largest deviation {found:.1e}, {tolerance:.0e} allowed");
    }
}

/// A robot from 1, or a landmark.
#[derive(Copy, Clone, Deserialize)]
#[serde(untagged)]
pub(crate) enum End {
    Robot(usize),
    Landmark { at: [f64; 2] },
}

impl End {
    pub(crate) fn place(self) -> Place {
        match self {
            Self::Robot(number) => Place::Robot(number - 1),
            Self::Landmark { at } => Place::At(at),
        }
    }
}

/// A number, or "inf".
fn bound<'a, D: Deserializer<'a>>(from: D) -> Result<[f64; 2], D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Bound {
        Finite(f64),
        Word(String),
    }
    let pair = <[Bound; 2]>::deserialize(from)?;
    Ok(pair.map(|it| match it {
        Bound::Finite(value) => value,
        Bound::Word(word) => {
            assert_eq!(word, "inf");
            f64::INFINITY
        }
    }))
}

/// A measurement as the files have it.
#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[allow(non_snake_case)] // So called in the files.
pub(crate) enum Measured {
    Bearing {
        i: End,
        j: End,
        alpha: f64,
        dalpha: f64,
    },
    RangeBearing {
        i: End,
        j: End,
        alpha: f64,
        dalpha: f64,
        #[serde(deserialize_with = "bound")]
        r: [f64; 2],
    },
    RelativeBox {
        i: End,
        j: End,
        d: [f64; 2],
        e: [f64; 2],
        theta: f64,
        dtheta: f64,
        K: usize,
    },
    RangeMax {
        i: End,
        j: End,
        hi: f64,
        K: usize,
    },
    AbsoluteBox {
        i: usize,
        p: [f64; 2],
        e: [f64; 2],
    },
}

impl Measured {
    pub(crate) fn measurement(&self) -> Measurement {
        let between = |i: End, j: End, seen| Measurement::Between {
            from: i.place(),
            to: j.place(),
            seen,
        };
        match *self {
            Self::Bearing {
                i,
                j,
                alpha,
                dalpha,
            } => between(i, j, Seen::Bearing(AngleInterval::new(alpha, dalpha))),
            Self::RangeBearing {
                i,
                j,
                alpha,
                dalpha,
                r: [least, most],
            } => {
                let bearing = AngleInterval::new(alpha, dalpha);
                between(
                    i,
                    j,
                    Seen::RangeBearing(bearing, RangeInterval { least, most }),
                )
            }
            Self::RelativeBox {
                i,
                j,
                d,
                e,
                theta,
                dtheta,
                K,
            } => {
                let seen = Seen::Box {
                    centre: d,
                    half: e,
                    heading: AngleInterval::new(theta, dtheta),
                    directions: K,
                };
                between(i, j, seen)
            }
            Self::RangeMax { i, j, hi, K } => between(
                i,
                j,
                Seen::RangeMax {
                    most: hi,
                    directions: K,
                },
            ),
            Self::AbsoluteBox { i, p, e } => Measurement::Fix {
                robot: i - 1,
                centre: p,
                half: e,
            },
        }
    }
}
