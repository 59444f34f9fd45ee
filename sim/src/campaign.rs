//! What the campaigns have in common: programs that hold hundreds of robots to bars, say what they found, and write it into a document.

use std::error::Error;
use std::fmt::Write as _;
use std::io::{Write as _, stdout};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use crate::honest::splice::{self, spliced};

/// What came of a part.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Finding {
    /// Of the part.
    pub title: String,
    /// What was found, for people, in Markdown.
    pub text: String,
    /// Every bar that was missed, in a line.
    pub missed: Vec<String>,
}

/// A part of a campaign and its name; how much of it is done is an `F`.
pub type Part<F> = (&'static str, fn(&F) -> Finding);

/// A document, and the mark in it after which the findings stand.
#[derive(Copy, Clone, Debug)]
pub struct Page<'a> {
    /// Its file.
    pub path: &'a Path,
    /// `<!-- mark -->`
    pub mark: &'a str,
}

/// Runs those of `parts` that are named in `only`, all if none is; says what came of each, and writes it into `page`.
///
/// # Errors
/// There is no such part, or the page cannot be written to, which is found before hours are spent.
pub fn run<F>(
    parts: &[Part<F>],
    only: &[String],
    form: &F,
    page: Option<Page<'_>>,
) -> Result<ExitCode, Box<dyn Error>> {
    let is_none = |name: &&String| parts.iter().all(|(part, _)| part != name);
    if let Some(name) = only.iter().find(is_none) {
        return Err(format!("there is no part {name}").into());
    }
    if let Some(page) = page {
        spliced(page.path, page.mark, "")?;
    }
    let (mut text, mut missed) = (String::new(), 0);
    let is_chosen = |name: &str| only.is_empty() || only.iter().any(|it| it == name);
    for (_, find) in parts.iter().filter(|(name, _)| is_chosen(name)) {
        let begun = Instant::now();
        let finding = find(form);
        let words = told(&finding, begun.elapsed().as_secs());
        stdout().write_all(words.as_bytes())?;
        text.push_str(&words);
        missed += finding.missed.len();
    }
    if let Some(page) = page {
        splice::write(page.path, page.mark, &text)?;
    }
    writeln!(stdout(), "{missed} bars missed")?;
    Ok(ExitCode::from(u8::from(missed > 0)))
}

/// The folder with recordings: what is `given`, else `COLOC_DATA`, else `shared/data` beside the repository or above.
#[must_use]
pub fn recordings(given: Option<PathBuf>) -> Option<PathBuf> {
    let named = || std::env::var_os("COLOC_DATA").map(PathBuf::from);
    given.or_else(named).or_else(|| {
        let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
        let mut candidates = above.map(|parent| parent.join("shared/data"));
        candidates.find(|it| it.is_dir())
    })
}

fn told(finding: &Finding, took_s: u64) -> String {
    let Finding {
        title,
        text,
        missed,
    } = finding;
    let mut verdict = String::new();
    for it in missed {
        let _ = writeln!(verdict, "* MISSED: {it}"); // A string takes all.
    }
    if missed.is_empty() {
        verdict.push_str("All bars held.\n");
    }
    format!("### {title}\n\n{text}\n{verdict}\nIt took {took_s} s.\n\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    const PARTS: [Part<Finding>; 2] = [("first", Finding::clone), ("second", Finding::clone)];

    fn missing(bar: &str) -> Finding {
        Finding {
            missed: vec![bar.into()],
            ..Finding::default()
        }
    }

    #[test]
    fn a_part_that_is_not_there_and_a_page_without_its_mark_are_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("page.md");
        std::fs::write(&path, "no marks").expect("a file");
        let page = Page {
            path: &path,
            mark: "bars",
        };
        let form = Finding::default();
        assert!(run(&PARTS, &["third".into()], &form, None).is_err());
        assert!(run(&PARTS, &[], &form, Some(page)).is_err());
    }

    #[test]
    fn what_missed_a_bar_says_so_and_fails() {
        let words = told(&missing("a bar"), 1);
        assert!(words.contains("* MISSED: a bar\n") && !words.contains("held"));
        let ended = |form| run(&PARTS, &["second".into()], &form, None).expect("a run");
        assert_eq!(ended(Finding::default()), ExitCode::SUCCESS);
        assert_ne!(ended(missing("a bar")), ExitCode::SUCCESS);
    }
}
