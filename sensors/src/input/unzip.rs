//! Bytes as they are, or out of gzip: the first two say which.

use std::io::{self, Write};

use flate2::write::MultiGzDecoder;

const MAGIC: [u8; 2] = [0x1f, 0x8b];

/// Takes in bytes in pieces of any size, and gives out what they mean.
#[derive(Debug, Default)]
pub(super) enum Unzip {
    /// Nothing has come yet, or one byte that may be the first of a gzip.
    #[default]
    Begin,
    First,
    Plain,
    Gzip(Box<MultiGzDecoder<Vec<u8>>>),
}

impl Unzip {
    /// Adds what `bytes` mean to `out`.
    pub(super) fn take(&mut self, bytes: &[u8], out: &mut Vec<u8>) -> io::Result<()> {
        match self {
            Self::Plain => out.extend_from_slice(bytes),
            Self::Gzip(decoder) => {
                decoder.write_all(bytes)?;
                out.append(decoder.get_mut());
            }
            Self::Begin => match bytes {
                [] => {}
                [first] if *first == MAGIC[0] => *self = Self::First,
                _ => return self.decide(bytes, out),
            },
            Self::First => return self.decide(&[&MAGIC[..1], bytes].concat(), out),
        }
        Ok(())
    }

    fn decide(&mut self, bytes: &[u8], out: &mut Vec<u8>) -> io::Result<()> {
        *self = if bytes.starts_with(&MAGIC) {
            Self::Gzip(Box::new(MultiGzDecoder::new(Vec::new())))
        } else {
            Self::Plain
        };
        self.take(bytes, out)
    }

    /// Adds what is left at the end.
    pub(super) fn end(&mut self, out: &mut Vec<u8>) -> io::Result<()> {
        match self {
            Self::First => out.extend_from_slice(&MAGIC[..1]),
            Self::Gzip(decoder) => {
                let ended = decoder.try_finish();
                out.append(decoder.get_mut());
                return ended;
            }
            Self::Begin | Self::Plain => {}
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use flate2::Compression;
    use flate2::write::GzEncoder;

    use super::*;

    fn unzipped(bytes: &[u8], piece: usize) -> io::Result<Vec<u8>> {
        let (mut unzip, mut out) = (Unzip::default(), Vec::new());
        for piece in bytes.chunks(piece) {
            unzip.take(piece, &mut out)?;
        }
        unzip.end(&mut out).map(|()| out)
    }

    fn zipped(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    }

    #[test]
    fn both_come_out_alike_in_pieces_of_any_size() {
        let plain: Vec<u8> = (0..3000_u32).map(|n| (n * n % 251) as u8).collect();
        let two = [zipped(&plain), zipped(&plain)].concat();
        for piece in [1, 2, 7, 5000] {
            assert_eq!(unzipped(&plain, piece).unwrap(), plain);
            assert_eq!(unzipped(&two, piece).unwrap(), plain.repeat(2));
        }
        assert_eq!(unzipped(&[0x1f], 1).unwrap(), [0x1f]);
        assert_eq!(unzipped(&[0x1f, 0], 1).unwrap(), [0x1f, 0]);
        assert!(unzipped(&[], 1).unwrap().is_empty());
    }

    #[test]
    fn a_gzip_that_was_cut_gives_what_it_has_and_says_so() {
        let plain = vec![b'a'; 100_000];
        let mut cut = zipped(&plain);
        cut.truncate(cut.len() / 2);
        assert!(unzipped(&cut, 16).is_err());
    }
}
