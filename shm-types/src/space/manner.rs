//! For those who take part and those who only want to hear.

/// What is done about something that is not there.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) enum Manner {
    /// It is made.
    Make,
    /// It is not.
    Find,
}
