//! Text files of number columns: `#` begins a comment, white space separates, plain or gzip.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use flate2::read::MultiGzDecoder;

/// A recording that could not be read, and where.
#[derive(Debug, thiserror::Error)]
#[error("{}{}: {kind}", path.display(), line.map(|line| format!(":{line}")).unwrap_or_default())]
pub struct ReadError {
    /// The file, or the folder where a file was looked for.
    pub path: PathBuf,
    /// Line in the (unpacked) file, from 1.
    pub line: Option<usize>,
    /// What is wrong.
    pub kind: ReadErrorKind,
}

/// What is wrong with a recording.
#[derive(Debug, thiserror::Error)]
pub enum ReadErrorKind {
    /// The operating system, or gzip, refused.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// Too few columns.
    #[error("{found} columns where {expected} are needed")]
    Columns {
        /// Numbers on the line.
        found: usize,
        /// Numbers that are needed.
        expected: usize,
    },
    /// Not a finite number.
    #[error("\"{0}\" is not a finite number")]
    Number(String),
    /// A subject or barcode that is not a small whole number.
    #[error("{0} is not a subject or barcode number")]
    Code(f64),
    /// Time runs backwards.
    #[error("time runs backwards, from {before} s to {now} s")]
    Backwards {
        /// Time of the row before.
        before: f64,
        /// Time of this row.
        now: f64,
    },
    /// A file without a single row.
    #[error("no rows")]
    Empty,
    /// No robot in the folder.
    #[error("no RobotN_Odometry.dat (or .dat.gz) here: not an MR.CLAM recording")]
    NoRobots,
    /// A file of the recording is missing.
    #[error("{0} (or {0}.gz) is missing")]
    Missing(String),
}

impl ReadError {
    pub(super) fn in_file(path: &Path, kind: impl Into<ReadErrorKind>) -> Self {
        Self {
            path: path.to_owned(),
            line: None,
            kind: kind.into(),
        }
    }

    pub(super) fn on_line(path: &Path, line: usize, kind: impl Into<ReadErrorKind>) -> Self {
        Self {
            path: path.to_owned(),
            line: Some(line),
            kind: kind.into(),
        }
    }
}

/// The file `name` or `name.gz` in `folder`.
pub(super) fn find(folder: &Path, name: &str) -> Option<PathBuf> {
    [name.to_owned(), format!("{name}.gz")]
        .into_iter()
        .map(|name| folder.join(name))
        .find(|path| path.is_file())
}

/// [`find`], as an error where there is none.
pub(super) fn require(folder: &Path, name: &str) -> Result<PathBuf, ReadError> {
    find(folder, name)
        .ok_or_else(|| ReadError::in_file(folder, ReadErrorKind::Missing(name.to_owned())))
}

/// Rows of a table with at least `N` columns, each with its line number; further columns are ignored.
pub(super) fn rows<const N: usize>(path: &Path) -> Result<Vec<(usize, [f64; N])>, ReadError> {
    let reader = open(path).map_err(|error| ReadError::in_file(path, error))?;
    let mut rows = Vec::new();
    for (index, text) in reader.lines().enumerate() {
        let line = index + 1;
        let text = text.map_err(|error| ReadError::on_line(path, line, error))?;
        let numbers = text.split('#').next().unwrap_or_default();
        if !numbers.trim().is_empty() {
            rows.push((
                line,
                columns(numbers).map_err(|kind| ReadError::on_line(path, line, kind))?,
            ));
        }
    }
    if rows.is_empty() {
        Err(ReadError::in_file(path, ReadErrorKind::Empty))
    } else {
        Ok(rows)
    }
}

/// [`rows`] whose first column is a time that never decreases.
pub(super) fn timed_rows<const N: usize>(path: &Path) -> Result<Vec<[f64; N]>, ReadError> {
    let rows = rows::<N>(path)?;
    let mut before = f64::NEG_INFINITY;
    for (line, row) in &rows {
        if row[0] < before {
            return Err(ReadError::on_line(
                path,
                *line,
                ReadErrorKind::Backwards {
                    before,
                    now: row[0],
                },
            ));
        }
        before = row[0];
    }
    Ok(rows.into_iter().map(|(_, row)| row).collect())
}

fn open(path: &Path) -> io::Result<BufReader<Box<dyn Read>>> {
    let file = File::open(path)?;
    let packed = path.extension().is_some_and(|extension| extension == "gz");
    let bytes: Box<dyn Read> = if packed {
        Box::new(MultiGzDecoder::new(file))
    } else {
        Box::new(file)
    };
    Ok(BufReader::new(bytes))
}

fn columns<const N: usize>(text: &str) -> Result<[f64; N], ReadErrorKind> {
    let mut numbers = [0.0; N];
    let mut found = 0;
    for (slot, word) in numbers.iter_mut().zip(text.split_whitespace()) {
        *slot = number(word)?;
        found += 1;
    }
    if found == N {
        Ok(numbers)
    } else {
        Err(ReadErrorKind::Columns { found, expected: N })
    }
}

fn number(word: &str) -> Result<f64, ReadErrorKind> {
    let parsed = word.parse().ok().filter(|number: &f64| number.is_finite());
    parsed.ok_or_else(|| ReadErrorKind::Number(word.to_owned()))
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    fn file(text: &str) -> tempfile::NamedTempFile {
        let mut file = tempfile::NamedTempFile::new().expect("a temporary file");
        file.write_all(text.as_bytes()).expect("written");
        file
    }

    #[test]
    fn comments_tabs_and_further_columns_are_no_trouble() {
        let file = file("# Time\n1.0 \t 2.0 3.0 99 # note\n\n2.0 4.0 5.0\n");
        assert_eq!(
            timed_rows::<3>(file.path()).expect("read"),
            [[1.0, 2.0, 3.0], [2.0, 4.0, 5.0]]
        );
    }

    #[test]
    fn errors_name_the_file_and_the_line() {
        for (text, expected) in [
            ("1 2\n# c\n3\n", ":3: 1 columns where 2 are needed"),
            ("1 x\n", ":1: \"x\" is not a finite number"),
            ("1 nan\n", ":1: \"nan\" is not a finite number"),
            ("2 0\n1 0\n", ":2: time runs backwards, from 2 s to 1 s"),
            ("# nothing\n", ": no rows"),
        ] {
            let file = file(text);
            let error = timed_rows::<2>(file.path())
                .expect_err("malformed")
                .to_string();
            assert_eq!(error, format!("{}{expected}", file.path().display()));
        }
    }

    #[test]
    fn a_file_that_only_claims_to_be_packed_is_an_error() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        std::fs::write(folder.path().join("a.dat.gz"), "1 2\n").expect("written");
        let path = require(folder.path(), "a.dat").expect("found by its packed name");
        assert!(matches!(
            rows::<2>(&path),
            Err(ReadError {
                kind: ReadErrorKind::Io(_),
                ..
            })
        ));
    }
}
