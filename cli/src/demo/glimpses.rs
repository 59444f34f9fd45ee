//! Who saw whom, now and then: the sightings that the picture shows.

use coloc_sim::StepInputs;
use coloc_sim::laser::hall::TURN_S;

use super::record::Record;
use super::scene::{Camera, Eyes};
use super::world::Stage;
use crate::pictures::{GLIMPSES, Glimpse};

impl Stage {
    /// Who saw whom until `until_s`, at moments that are spread evenly; of scans what was heard of it.
    #[allow(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss
    )] // Steps of a run.
    pub(crate) fn glimpses(&self, until_s: f64, records: &[Record]) -> Vec<Glimpse> {
        // Where there are sightings: a multiple of their period.
        let period = self.period_of_sightings() as f64;
        let mut glimpses = Vec::new();
        for moment in 1..=GLIMPSES {
            let steps = moment as f64 / GLIMPSES as f64 * until_s / self.step_s();
            let step = ((steps / period).floor() * period) as usize;
            let seen = self.who_sees_whom(step, records).into_iter();
            let shown = seen.filter(|(seer, seen, _)| self.is_shown(moment + seer + seen));
            glimpses.extend(shown.filter_map(|pair| self.glimpse(moment, step, pair)));
        }
        glimpses
    }

    /// Scanners see nearly everybody nearly always: of their sightings a third is enough for a picture.
    fn is_shown(&self, number: usize) -> bool {
        !matches!(self.eyes(), Eyes::Scans(_)) || number.is_multiple_of(3)
    }

    /// In steps.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // A few.
    fn period_of_sightings(&self) -> usize {
        let rate_hz = match self.eyes() {
            Eyes::Poses => self.scenario().sightings.rate_hz,
            Eyes::Camera(_) => 1.0 / Camera::EVERY_S,
            Eyes::Scans(_) => 1.0 / TURN_S,
        };
        (1.0 / rate_hz / self.step_s()).round().max(1.0) as usize
    }

    /// The seer first, and whether the seen is told.
    fn who_sees_whom(&self, step: usize, records: &[Record]) -> Vec<(usize, usize, bool)> {
        match self.eyes() {
            Eyes::Poses => {
                let mut inputs = StepInputs::default();
                self.sensors().fill(step, &mut inputs);
                let seen = inputs.sightings.iter();
                let seen =
                    seen.filter(|it| self.is_looked_at(it) && !self.is_gone(it.observer, step));
                seen.map(|it| (it.observer, it.observed, self.is_told_of(it)))
                    .collect()
            }
            Eyes::Camera(camera) => {
                let seen = self.glances(camera, step).into_iter();
                seen.map(|it| (it.observer, it.observed, true)).collect()
            }
            Eyes::Scans(_) => {
                #[allow(clippy::cast_precision_loss)] // Steps of a run.
                let time_s = step as f64 * self.step_s();
                let heard = records.iter().enumerate();
                heard
                    .flat_map(|(seer, record)| {
                        let seen = record.seen_between(time_s - TURN_S, time_s);
                        seen.into_iter().map(move |seen| (seer, seen, true))
                    })
                    .collect()
            }
        }
    }

    /// Nothing of those who do not take part.
    fn glimpse(
        &self,
        moment: usize,
        step: usize,
        (seer, seen, told): (usize, usize, bool),
    ) -> Option<Glimpse> {
        let place = |robot| {
            let pose = self.world().truth(step, robot)?;
            (robot < self.robots()).then_some((pose.x, pose.y))
        };
        Some(Glimpse {
            moment,
            seer,
            seen,
            places: [place(seer)?, place(seen)?],
            told,
        })
    }
}
