//! What is wrong or unlikely about a setting, before its line is known.

/// Something that is to be said about a setting.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Finding {
    /// Dotted key; members of an array by their number: `team.1.id`.
    pub(super) key: String,
    /// Others that are to blame where `key` was left to its default.
    pub(super) or: &'static [&'static str],
    /// A word to look for below `key`, where that is as much as is known.
    pub(super) word: Option<String>,
    /// The value and what is allowed.
    pub(super) problem: String,
}

impl Finding {
    pub(super) fn new(key: impl Into<String>, problem: impl Into<String>) -> Self {
        Self {
            key: key.into(),
            or: &[],
            word: None,
            problem: problem.into(),
        }
    }
}
