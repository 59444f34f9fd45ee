//! Cuts bytes into lines, wherever they were cut before.

/// A scan of 2048 beams takes no more \[bytes\].
const LONGEST: usize = 1 << 16;

/// Holds what has no end yet.
#[derive(Debug)]
pub struct Lines {
    held: Vec<u8>,
    /// The line is too long to be one: until its end it is passed over.
    skips: bool,
    /// Lines that were too long or no text.
    pub broken: u64,
}

impl Default for Lines {
    fn default() -> Self {
        Self {
            held: Vec::with_capacity(LONGEST),
            skips: false,
            broken: 0,
        }
    }
}

impl Lines {
    /// Gives `each` line that is complete now.
    pub fn take(&mut self, bytes: &[u8], mut each: impl FnMut(&str)) {
        for piece in bytes.split_inclusive(|byte| *byte == b'\n') {
            if self.held.len() + piece.len() > LONGEST {
                self.held.clear();
                self.skips = true;
            } else if !self.skips {
                self.held.extend_from_slice(piece);
            }
            if piece.ends_with(b"\n") {
                self.end(&mut each);
            }
        }
    }

    /// What `read` reads of the line that `piece` ends, if it ends one.
    pub fn peek<T>(&self, piece: &[u8], read: impl FnOnce(&str) -> Option<T>) -> Option<T> {
        if self.skips || !piece.ends_with(b"\n") {
            return None;
        }
        let line = [self.held.as_slice(), piece].concat();
        read(std::str::from_utf8(&line).ok()?)
    }

    /// Nothing more of the line will come.
    pub fn end(&mut self, mut each: impl FnMut(&str)) {
        match std::str::from_utf8(&self.held) {
            Ok(line) if !self.skips => each(line),
            _ => self.broken += 1,
        }
        self.held.clear();
        self.skips = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_come_out_whole_however_they_come_in() {
        let text = format!("one\ntwo\n{}\nthree\n", "x".repeat(LONGEST + 1));
        let mut bytes = text.into_bytes();
        bytes.extend(b"\xff\nfour");
        for size in [1, 7, bytes.len()] {
            let (mut lines, mut seen) = (Lines::default(), Vec::new());
            for piece in bytes.chunks(size) {
                lines.take(piece, |line| seen.push(line.trim_end().to_owned()));
            }
            lines.end(|line| seen.push(line.to_owned()));
            assert_eq!(
                (seen, lines.broken),
                (
                    ["one", "two", "three", "four"].map(String::from).to_vec(),
                    2
                )
            );
        }
    }
}
