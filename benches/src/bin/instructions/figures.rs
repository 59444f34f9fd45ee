//! The committed figures: `benches/instructions.tsv`, a name and a count a line.

use std::io;
use std::path::PathBuf;

/// Instructions per call, by function.
#[derive(Default)]
pub(crate) struct Figures(Vec<(String, u64)>);

impl Figures {
    pub(crate) fn push(&mut self, name: &str, count: u64) {
        self.0.push((name.into(), count));
    }

    pub(crate) fn get(&self, name: &str) -> Option<u64> {
        self.iter()
            .find(|(known, _)| *known == name)
            .map(|(_, count)| count)
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = (&str, u64)> {
        self.0.iter().map(|(name, count)| (name.as_str(), *count))
    }

    pub(crate) fn read() -> io::Result<Self> {
        let text = std::fs::read_to_string(path()).map_err(|error| {
            io::Error::new(error.kind(), format!("{}: {error}", path().display()))
        })?;
        let line = |line: &str| {
            let (name, count) = line.split_once('\t')?;
            Some((name.to_owned(), count.trim().parse().ok()?))
        };
        Ok(Self(text.lines().filter_map(line).collect()))
    }

    pub(crate) fn write(&self) -> io::Result<()> {
        let lines: Vec<String> = self
            .iter()
            .map(|(name, count)| format!("{name}\t{count}"))
            .collect();
        std::fs::write(path(), lines.join("\n") + "\n")
    }
}

fn path() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("instructions.tsv")
}
