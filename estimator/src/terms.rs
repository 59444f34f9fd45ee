//! On which terms measurements act: the settings, and what is known of the sources.

use crate::output::Source;
use crate::rounds::Lates;
use crate::settings::Settings;

/// The same for all measurements of a replay.
#[derive(Copy, Clone, Debug)]
pub(crate) struct Terms<'a> {
    pub(crate) settings: &'a Settings,
    /// Who is judged and not fused.
    suspended: &'a [Source],
    /// Whether others may be told where they are.
    pub(crate) tells: bool,
    /// Corrections that came after the history.
    pub(crate) lates: &'a Lates,
}

impl<'a> Terms<'a> {
    pub(crate) fn new(
        settings: &'a Settings,
        suspended: &'a [Source],
        tells: bool,
        lates: &'a Lates,
    ) -> Self {
        Self {
            settings,
            suspended,
            tells,
            lates,
        }
    }

    /// Whether what it says may change the belief.
    #[inline]
    pub(crate) fn trusts(&self, source: Source) -> bool {
        !self.suspended.contains(&source)
    }
}
