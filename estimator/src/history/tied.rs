//! What an error becomes in the history: at a child what it has in common with leaders, at a leader what became of its own.

use nalgebra::Matrix3;

use super::History;
use super::entry::{Checkpoint, Entry};
use super::storage::{Samples, Slots};
use crate::assist::bond::Bonds;
use crate::assist::change::{Change, moved};
use crate::assist::ties::{Tie, Tied, Ties};
use crate::found::Gauge;
use crate::kind::{Key, Measured, Measurement};
use crate::outbox::Outbox;
use crate::pose::Pose;
use crate::settings::Settings;
use crate::stamp::Stamp;
use crate::terms::Terms;

impl<S: Slots, G: Samples> History<S, G> {
    /// Bonds after the entries before `index`, which are up to date.
    pub(super) fn bonds_before(&self, index: usize, ties: &Tied<'_>) -> Bonds {
        let key = self.entries.get(index).map(|it| &it.key);
        let (mut bonds, last) = ties.before(key);
        let from = last.map_or(0, |it| self.behind(&it));
        for slot in (from..index).filter_map(|it| self.entries.slot_of(it)) {
            bonds.follow(&ties.change(slot));
        }
        bonds
    }

    /// The entry behind that with this key.
    fn behind(&self, key: &Key) -> usize {
        self.entries.place_of(key).unwrap_or_else(|it| it + 1)
    }

    /// Applies an entry where errors are tracked.
    #[inline(never)]
    pub(super) fn apply_tied(
        &self,
        entry: &Entry,
        (at, bonds): (&mut Checkpoint, &mut Bonds),
        (terms, world): (&Terms<'_>, Option<&mut Outbox>),
        ties: &mut Tied<'_>,
    ) -> Gauge {
        at.filter.change = Some(Change::default());
        self.predict(at, entry.stamp(), terms.settings);
        let said = ties.said(&entry.key).copied();
        let gauge = match (&entry.measurement, said) {
            (Measurement::Assist(pose), Some(said)) => {
                bonds.follow(&at.filter.change.unwrap_or_default());
                let gauge = pose.apply_tied(&mut at.filter, (bonds, &said), terms, world);
                ties.settle(&entry.key, bonds);
                at.filter.change = None;
                gauge
            }
            _ => entry.measurement.apply(&mut at.filter, terms, world),
        };
        if let (Some(change), Some(slot)) = (
            at.filter.change.take(),
            self.entries.slot_of(self.evaluated),
        ) {
            bonds.follow(&change);
            ties.changed(slot, &change);
        }
        gauge
    }

    /// What became of the robot's error between two stamps of the history; `None` if nobody can say.
    pub(crate) fn transition<T, C>(
        &self,
        [from, to]: [Stamp; 2],
        settings: &Settings,
        ties: &Ties<T, C>,
    ) -> Option<Matrix3<f64>>
    where
        T: AsMut<[Tie]>,
        C: AsRef<[Change]> + AsMut<[Change]>,
    {
        let pose = |stamp| self.filter_at(stamp, settings).belief().pose;
        let [first, until] = [from, to].map(|it| self.entries.first_after(it).min(self.evaluated));
        if first >= until {
            return Some(moved(&pose(from), &pose(to)));
        }
        // The first change is that of all of its leg: what is before the beginning is taken back.
        let mut by = moved(&pose(from), &self.pose_before(first));
        for index in first..until {
            by = ties.change(self.entries.slot_of(index)?)?.by()? * by;
        }
        Some(moved(&self.pose_before(until), &pose(to)) * by)
    }

    fn pose_before(&self, index: usize) -> Pose {
        self.checkpoint_before(index).filter.belief().pose
    }

    /// Whether somebody can say what became of the error between two stamps.
    pub(crate) fn is_unbroken<T, C>(&self, [from, to]: [Stamp; 2], ties: &Ties<T, C>) -> bool
    where
        T: AsMut<[Tie]>,
        C: AsRef<[Change]> + AsMut<[Change]>,
    {
        let [first, until] = [from, to].map(|it| self.entries.first_after(it).min(self.evaluated));
        (first..until).all(|index| {
            let slot = self.entries.slot_of(index);
            let change = slot.and_then(|slot| ties.change(slot));
            change.is_none_or(|it| it.by().is_some())
        })
    }
}
