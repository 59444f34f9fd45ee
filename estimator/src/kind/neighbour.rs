//! What a neighbour says about this robot: Algorithm 3.

use super::{Key, Kind, Measured, Origin, RobotId, check_numbers, check_variances};
use crate::convert::GlobalPose;
use crate::covariance::Covariance3;
use crate::filter::Filter;
use crate::found::Gauge;
use crate::outbox::Outbox;
use crate::output::{Source, Verdict};
use crate::parts::Parts;
use crate::pose::Pose;
use crate::rounds::Bond;
use crate::settings::{Floors, FusionSettings, Settings};
use crate::stamp::Stamp;
use crate::terms::Terms;

/// Pose of this robot in the common frame, as a neighbour computed it from its own belief and its sighting of us.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct NeighbourPose {
    /// When the neighbour saw us.
    pub stamp: Stamp,
    /// Who saw us, and its count of what it sent to us.
    pub origin: Origin,
    /// y*, in the common frame.
    pub pose: Pose,
    /// R*_i and R*_d.
    pub parts: Parts,
}

impl NeighbourPose {
    /// Who saw us.
    #[must_use]
    pub fn sender(&self) -> RobotId {
        RobotId(self.origin.source)
    }

    /// Whether nothing of it is independent, as of a [`TrackPose`](super::TrackPose): it may have this robot's own wheels in it.
    fn is_of_anything(&self) -> bool {
        self.parts.independent == Covariance3::ZERO
    }
}

/// `P_d := P`, `P_i := 0`: nothing of the belief is independent of what is heard next. In rounds nothing is anyway.
fn give_up(filter: &mut Filter) {
    if filter.bond.as_ref().is_none_or(Bond::is_apart) {
        filter.shared();
        filter.leave();
    }
}

/// It takes the place of sightings that say a part, and comes as often.
fn weighed_as_part(settings: &Settings) -> FusionSettings {
    FusionSettings {
        heading_lever_m: settings.partial.heading_lever_m,
        damping: settings.partial.damping,
        memory: settings.partial.memory,
        ..settings.fusion
    }
}

impl Measured for NeighbourPose {
    #[inline]
    fn key(&self) -> Key {
        Key::new(self.stamp, Kind::Neighbour, self.origin)
    }

    fn source(&self) -> Source {
        Source::new(Kind::Neighbour, self.origin.source)
    }

    fn check(&self) -> Result<(), Verdict> {
        check_numbers(self.pose.to_vector().as_slice())?;
        check_variances(&self.parts.total().variances())
    }

    /// What is added may be anything: it is dependent.
    fn with_floor(&self, floors: &Floors) -> Self {
        Self {
            parts: self.parts.with_floor(floors.neighbour),
            ..*self
        }
    }

    fn apply(&self, filter: &mut Filter, terms: &Terms<'_>, world: Option<&mut Outbox>) -> Gauge {
        let of_track;
        let settings = if self.is_of_anything() {
            give_up(filter);
            of_track = Settings {
                fusion: weighed_as_part(terms.settings),
                ..*terms.settings
            };
            &of_track
        } else {
            terms.settings
        };
        let received = GlobalPose {
            pose: self.pose,
            parts: self.parts,
        };
        let (verdict, gauge) =
            filter.hear(self.stamp, &received, terms.trusts(self.source()), settings);
        if let Some(world) = world {
            world.report(self.source(), self.stamp, verdict);
        }
        gauge
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::belief::Belief;
    use crate::rounds::Lates;

    /// What is wholly dependent may have this robot's own wheels in it: it meets a belief without an independent part.
    #[test]
    fn who_hears_what_may_depend_on_anything_gives_up_its_independent_part_first() {
        let covariance = Covariance3::diagonal([0.01, 0.02, 0.03]).unwrap();
        let word = |parts| NeighbourPose {
            stamp: Stamp::from_nanos(1_000_000_000),
            origin: Origin::counted(1),
            pose: Pose::new(0.05, 0.0, 0.0),
            parts,
        };
        let heard = |own: Parts, said: Parts| {
            let belief = Belief::gaussian(Pose::default(), own);
            let mut filter = Filter::beginning(Stamp::default(), belief);
            let (settings, said) = (Settings::default(), word(said));
            said.apply(
                &mut filter,
                &Terms::new(&settings, &[], true, &Lates::default()),
                None,
            );
            *filter.belief()
        };
        let (free, bound) = (Parts::independent(covariance), Parts::dependent(covariance));
        assert_eq!(heard(free, bound), heard(bound, bound));
        let split = Parts {
            independent: Covariance3::diagonal([1e-9; 3]).unwrap(),
            ..bound
        };
        assert_ne!(heard(free, split), heard(bound, split));
    }
}
