//! What two links say to one another about their clocks.
use coloc_shm_types::Plain;

/// The last stamp that was heard from the receiver, and when: together with the envelope's own stamp, two-way time stamps.
///
/// | offset in the body | field | |
/// | --- | --- | --- |
/// | 0 | `echo_ns` | i64 |
/// | 8 | `heard_ns` | i64 |
#[derive(Copy, Clone, Debug, Default, PartialEq, Eq)]
pub struct ClockWord {
    /// `stamp_ns` of the receiver's last clock word, by its clock (ns); 0 if none was heard.
    pub echo_ns: i64,
    /// When that came, by the speaker's `CLOCK_REALTIME` (ns).
    pub heard_ns: i64,
}

impl ClockWord {
    /// The body.
    #[must_use]
    pub fn body(&self) -> [u8; 16] {
        let mut body = [0; 16];
        let (echo, heard) = body.split_at_mut(8);
        echo.copy_from_slice(&self.echo_ns.to_le_bytes());
        heard.copy_from_slice(&self.heard_ns.to_le_bytes());
        body
    }

    /// What a body says; what a later version appends is passed over. `None` if it is too short.
    #[must_use]
    pub fn of(body: &[u8]) -> Option<Self> {
        let (echo_ns, from) = Plain::take(body)?;
        let (heard_ns, _) = Plain::take(from)?;
        Some(Self { echo_ns, heard_ns })
    }
}
