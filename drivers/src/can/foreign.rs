//! Files that are logs of another program, by how they begin.

/// What the file is, and what to do; `None` if that cannot be told.
pub(super) fn foreign(beginning: &[u8]) -> Option<&'static str> {
    let begins = |(magic, _): &&(&[u8], _)| beginning.starts_with(magic);
    if let Some((_, what)) = BY_MAGIC.iter().find(begins) {
        return Some(what);
    }
    let first = beginning.split(|byte| *byte == b'\n').next()?;
    let commas = first
        .iter()
        .filter(|byte| matches!(byte, b',' | b';'))
        .count();
    let is_table = first.first()?.is_ascii_alphabetic() && commas >= 2;
    is_table.then_some(
        "a table (CSV): convert it to a candump log, for instance with python-can's can_logconvert",
    )
}

const BY_MAGIC: [(&[u8], &str); 11] = [
    (
        b"\xFD7zXZ",
        "compressed with xz: unpack it first, or compress it with gzip",
    ),
    (
        b"\x28\xB5\x2F\xFD",
        "compressed with zstd: unpack it first, or compress it with gzip",
    ),
    (
        b"BZh",
        "compressed with bzip2: unpack it first, or compress it with gzip",
    ),
    (b"PK\x03\x04", "a zip archive: unpack it first"),
    (b"\xFF\xFE", "text in UTF-16: save it as UTF-8"),
    (b"\xFE\xFF", "text in UTF-16: save it as UTF-8"),
    (
        b"LOGG",
        "a BLF log: convert it to a candump log, for instance with python-can's can_logconvert",
    ),
    (
        b"MDF ",
        "an MDF log: convert it to a candump log, for instance with python-can's can_logconvert",
    ),
    (
        b"date ",
        "an ASC log: convert it to a candump log, for instance with python-can's can_logconvert",
    ),
    (
        b";$FILEVERSION",
        "a TRC log: convert it to a candump log, for instance with python-can's can_logconvert",
    ),
    (
        b"\xD4\xC3\xB2\xA1",
        "a pcap capture: convert it to a candump log",
    ),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logs_of_other_programs_are_named() {
        for (beginning, what) in [
            (&b"\xFD7zXZ\0\0"[..], "xz"),
            (b"\xFF\xFE(\0", "UTF-16"),
            (b"date Mon Jan 1 00:00:00 2024\nbase hex", "ASC"),
            (b";$FILEVERSION=2.1\n", "TRC"),
            (b"timestamp,arbitration_id,extended\n1.0,", "CSV"),
        ] {
            let named = foreign(beginning).unwrap();
            assert!(named.contains(what), "{named}");
        }
    }

    #[test]
    fn what_may_be_ours_is_not() {
        for beginning in [
            &b""[..],
            b"\n",
            b"(1.0) can0 1#",
            b"; remark, with, commas",
            b"hello",
        ] {
            assert_eq!(foreign(beginning), None);
        }
    }
}
