//! The filter that learns them.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Matrix2, Matrix3, RowDVector, Vector2, Vector3};

use crate::CHI2_1_999;
use crate::calibration::{Calibration, Corrected};

/// What is known of radios before they are heard.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Settings {
    /// Standard deviation of what is new in every reading \[m\].
    pub sigma_m: f64,
    /// Of the scale.
    pub scale_sigma: f64,
    /// Of the offset \[m\].
    pub offset_sigma_m: f64,
    /// How much of the scale changes in a second, of its variance the root: by the square root of the seconds.
    pub scale_drift: f64,
    /// Of the offset \[m\]: circuits that warm up.
    pub offset_drift_m: f64,
    /// How long the error of another robot's place stays as it is \[s\]: so long its readings do not average it out.
    pub place_memory_s: f64,
    /// A reading counts if its d² is at most this.
    pub gate: f64,
    /// After so many refused readings in a row the pose is not believed any more.
    pub lost_after: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            sigma_m: 0.15,
            scale_sigma: 0.1,
            offset_sigma_m: 0.5,
            scale_drift: 5e-5,
            offset_drift_m: 1e-3,
            place_memory_s: 60.0,
            gate: CHI2_1_999,
            lost_after: 20,
        }
    }
}

/// How the robot moved, in its own frame at the start.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Increment {
    /// How long that took \[s\].
    pub seconds: f64,
    /// Forward, left, turned left \[m, m, rad\].
    pub displacement: Vector3<f64>,
    /// Of it.
    pub covariance: Matrix3<f64>,
}

/// Where the other radio is.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Place {
    /// \[m\]
    pub position: Vector2<f64>,
    /// \[m²\]
    pub covariance: Matrix2<f64>,
    /// Of a robot: its error changes, but slowly. That of an anchor is a part of the offset that is learned.
    pub moves: bool,
}

/// Why nothing is learned of a reading.
#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub enum Refused {
    /// No range, or the two radios are in one place.
    NoRange,
    /// It is too far off.
    Gate,
}

/// Nearer than this a range has no direction \[m\].
const NEAREST_M: f64 = 1e-3;

/// Two readings of a pair are no closer in time \[s\].
const SHORTEST_S: f64 = 1e-3;

/// x, y, φ come first, then scale and offset of every pair.
const POSE: usize = 3;

/// Pose, and scale and offset of every pair of radios that was heard.
#[derive(Clone, Debug)]
pub struct Ranging {
    settings: Settings,
    state: DVector<f64>,
    covariance: DMatrix<f64>,
    pairs: BTreeMap<u16, Pair>,
    refused: u32,
    /// Since the filter began \[s\].
    time_s: f64,
}

/// A pair of radios.
#[derive(Copy, Clone, Debug)]
struct Pair {
    /// Where in the state it begins.
    at: usize,
    /// When it was last learned of \[s\].
    learned_s: f64,
}

impl Ranging {
    /// Of a robot that is there. All radios are to be learned.
    #[must_use]
    pub fn new(settings: Settings, pose: Vector3<f64>, covariance: Matrix3<f64>) -> Self {
        let mut ranging = Self {
            settings,
            state: DVector::zeros(POSE),
            covariance: DMatrix::zeros(POSE, POSE),
            pairs: BTreeMap::new(),
            refused: 0,
            time_s: 0.0,
        };
        ranging.place(pose, covariance);
        ranging
    }

    /// What is known of a pair before it is heard: as it was learned on another day. Nothing happens if it was heard.
    pub fn know(&mut self, other: u16, calibration: &Calibration) {
        if !self.pairs.contains_key(&other) {
            self.add(other, calibration);
        }
    }

    /// The robot is there, whatever was believed; what was learned of radios stays.
    pub fn place(&mut self, pose: Vector3<f64>, covariance: Matrix3<f64>) {
        self.state.fixed_rows_mut::<POSE>(0).copy_from(&pose);
        self.covariance.rows_mut(0, POSE).fill(0.0);
        self.covariance.columns_mut(0, POSE).fill(0.0);
        let mut block = self.covariance.fixed_view_mut::<POSE, POSE>(0, 0);
        block.copy_from(&covariance);
        self.refused = 0;
    }

    /// Whether so many readings were refused that the robot has to be [placed](Self::place) anew.
    #[must_use]
    pub fn is_lost(&self) -> bool {
        self.refused >= self.settings.lost_after
    }

    /// Where the filter itself takes the robot to be.
    #[must_use]
    pub fn pose(&self) -> Vector3<f64> {
        self.state.fixed_rows::<POSE>(0).into_owned()
    }

    /// The robot moved.
    pub fn drive(&mut self, increment: &Increment) {
        let (sin, cos) = libm::sincos(self.state[2]);
        let turn = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
        let moved = turn * increment.displacement;
        let mut map = DMatrix::identity(self.state.len(), self.state.len());
        (map[(0, 2)], map[(1, 2)]) = (-moved.y, moved.x);
        let mut pose = self.state.fixed_rows_mut::<POSE>(0);
        pose += moved;
        self.covariance = &map * &self.covariance * map.transpose();
        let mut block = self.covariance.fixed_view_mut::<POSE, POSE>(0, 0);
        block += turn * increment.covariance * turn.transpose();
        self.drift(increment.seconds);
    }

    fn drift(&mut self, seconds: f64) {
        let Settings {
            scale_drift,
            offset_drift_m,
            ..
        } = self.settings;
        for Pair { at, .. } in self.pairs.values().copied() {
            self.covariance[(at, at)] += scale_drift * scale_drift * seconds;
            self.covariance[(at + 1, at + 1)] += offset_drift_m * offset_drift_m * seconds;
        }
        self.time_s += seconds;
    }

    /// What is known of a pair.
    #[must_use]
    pub fn calibration(&self, other: u16) -> Calibration {
        let Some(&Pair { at, .. }) = self.pairs.get(&other) else {
            return self.unheard();
        };
        Calibration {
            scale: self.state[at],
            offset_m: self.state[at + 1],
            covariance: self.covariance.fixed_view::<2, 2>(at, at).into_owned(),
        }
    }

    /// A reading without what the radios say too much; `None` where nothing is left of it.
    #[must_use]
    pub fn corrected(&self, other: u16, said_m: f64) -> Option<Corrected> {
        let calibration = self.calibration(other);
        calibration.corrected(said_m, self.settings.sigma_m)
    }

    /// What a reading teaches, of a radio at `mount` on the robot.
    ///
    /// # Errors
    /// Why it teaches nothing.
    pub fn learn(
        &mut self,
        other: u16,
        said_m: f64,
        mount: Vector2<f64>,
        place: &Place,
    ) -> Result<(), Refused> {
        let Pair {
            at: pair,
            learned_s,
        } = self.pair(other);
        let (sin, cos) = libm::sincos(self.state[2]);
        let arm = Vector2::new(cos * mount.x - sin * mount.y, sin * mount.x + cos * mount.y);
        let line = place.position - self.state.fixed_rows::<2>(0) - arm;
        let range = line.norm();
        if !(range >= NEAREST_M && said_m > 0.0 && said_m.is_finite()) {
            return Err(Refused::NoRange);
        }
        let (along, stretch) = (line / range, 1.0 + self.state[pair]);
        let mut slope = RowDVector::zeros(self.state.len());
        (slope[0], slope[1]) = (-stretch * along.x, -stretch * along.y);
        slope[2] = stretch * (along.x * arm.y - along.y * arm.x);
        (slope[pair], slope[pair + 1]) = (range, 1.0);
        let sigma = self.settings.sigma_m;
        let by_place = self.lasting(place, learned_s) * along.dot(&(place.covariance * along));
        let noise = sigma * sigma + stretch * stretch * by_place;
        let difference = said_m - (self.state[pair + 1] + stretch * range);
        self.update(&slope, difference, noise)?;
        if let Some(pair) = self.pairs.get_mut(&other) {
            pair.learned_s = self.time_s;
        }
        Ok(())
    }

    /// White noise that averages out as slowly as an error that stays has so many times its variance.
    fn lasting(&self, place: &Place, learned_s: f64) -> f64 {
        let since_s = self.time_s - learned_s;
        let stays_s = 2.0 * self.settings.place_memory_s;
        if place.moves && since_s < stays_s {
            stays_s / since_s.max(SHORTEST_S)
        } else {
            1.0
        }
    }

    fn update(
        &mut self,
        slope: &RowDVector<f64>,
        difference: f64,
        noise: f64,
    ) -> Result<(), Refused> {
        let common = &self.covariance * slope.transpose();
        let variance = (slope * &common)[0] + noise;
        if difference * difference > self.settings.gate * variance {
            self.refused = self.refused.saturating_add(1);
            return Err(Refused::Gate);
        }
        self.refused = 0;
        let gain = common / variance;
        self.state += &gain * difference;
        // Joseph's form: a sum of squares, which no rounding makes negative.
        let size = self.state.len();
        let kept = DMatrix::identity(size, size) - &gain * slope;
        self.covariance =
            &kept * &self.covariance * kept.transpose() + &gain * noise * gain.transpose();
        self.covariance = (&self.covariance + self.covariance.transpose()) * 0.5;
        Ok(())
    }

    fn pair(&mut self, other: u16) -> Pair {
        let known = self.pairs.get(&other).copied();
        known.unwrap_or_else(|| self.add(other, &self.unheard()))
    }

    fn add(&mut self, other: u16, calibration: &Calibration) -> Pair {
        let at = self.state.len();
        self.state = self.state.clone().resize_vertically(at + 2, 0.0);
        self.covariance = self.covariance.clone().resize(at + 2, at + 2, 0.0);
        (self.state[at], self.state[at + 1]) = (calibration.scale, calibration.offset_m);
        let mut block = self.covariance.fixed_view_mut::<2, 2>(at, at);
        block.copy_from(&calibration.covariance);
        let pair = Pair {
            at,
            learned_s: f64::NEG_INFINITY,
        };
        self.pairs.insert(other, pair);
        pair
    }

    fn unheard(&self) -> Calibration {
        let [scale, offset] = [self.settings.scale_sigma, self.settings.offset_sigma_m];
        Calibration {
            scale: 0.0,
            offset_m: 0.0,
            covariance: Matrix2::from_diagonal(&Vector2::new(scale * scale, offset * offset)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ANCHORS: [[f64; 2]; 3] = [[0.0, 20.0], [20.0, -5.0], [-15.0, -10.0]];

    fn known(index: usize) -> Place {
        let [x, y] = ANCHORS[index];
        Place {
            position: Vector2::new(x, y),
            covariance: Matrix2::from_diagonal_element(1e-4),
            moves: false,
        }
    }

    fn begun() -> Ranging {
        let sure = Matrix3::from_diagonal_element(1e-4);
        Ranging::new(Settings::default(), Vector3::zeros(), sure)
    }

    fn leg(turn: f64) -> Increment {
        Increment {
            seconds: 0.5,
            displacement: Vector3::new(0.5, 0.0, turn),
            covariance: Matrix3::from_diagonal(&Vector3::new(1e-4, 1e-6, 1e-4)),
        }
    }

    /// A way that turns, without noise; every leg is followed by what `said` makes of the range to an anchor.
    fn driven(ranging: &mut Ranging, legs: usize, said: impl Fn(u16, f64) -> f64) -> Vector2<f64> {
        let mut truth = Vector3::zeros();
        for (step, index) in (0..legs).zip((0..ANCHORS.len()).cycle()) {
            let turn = if step % 60 < 30 { 0.1 } else { -0.03 };
            let (sin, cos) = f64::sin_cos(truth.z);
            truth += Vector3::new(0.5 * cos, 0.5 * sin, turn);
            ranging.drive(&leg(turn));
            let other = u16::try_from(index).expect("few anchors");
            let range = (known(index).position - truth.xy()).norm();
            let _ = ranging.learn(other, said(other, range), Vector2::zeros(), &known(index));
        }
        truth.xy()
    }

    #[test]
    fn what_radios_say_too_much_is_learned_without_a_reference() {
        let mut ranging = begun();
        let said = |other, range| {
            let k = f64::from(other);
            0.2 * k + (1.05 + 0.01 * k) * range
        };
        let truth = driven(&mut ranging, 600, said);
        assert!((ranging.pose().xy() - truth).norm() < 0.05);
        for other in 0..3 {
            let k = f64::from(other);
            let it = ranging.calibration(other);
            let sigma = [it.covariance.m11.sqrt(), it.covariance.m22.sqrt()];
            assert!(
                (it.scale - (0.05 + 0.01 * k)).abs() < 3.0 * sigma[0],
                "{it:?}"
            );
            assert!((it.offset_m - 0.2 * k).abs() < 3.0 * sigma[1], "{it:?}");
            assert!(sigma[0] < 0.01 && sigma[1] < 0.15, "{it:?}");
            let corrected = ranging
                .corrected(other, said(other, 12.0))
                .expect("a range");
            assert!((corrected.range_m - 12.0).abs() < 0.1, "{corrected:?}");
        }
    }

    #[test]
    fn a_reading_that_is_far_off_teaches_nothing() {
        let mut ranging = begun();
        let _ = driven(&mut ranging, 300, |_, range| 1.07 * range);
        let before = ranging.clone();
        let refused = ranging.learn(0, 90.0, Vector2::zeros(), &known(0));
        assert_eq!(refused, Err(Refused::Gate));
        assert_eq!(ranging.state, before.state);
        assert_eq!(ranging.covariance, before.covariance);
        let none = ranging.learn(0, f64::NAN, Vector2::zeros(), &known(0));
        assert_eq!(none, Err(Refused::NoRange));
    }

    #[test]
    fn who_was_carried_away_is_lost_until_it_is_placed_and_what_was_learned_stays() {
        let mut ranging = begun();
        let _ = driven(&mut ranging, 300, |_, range| 1.07 * range);
        let learned = ranging.calibration(1);
        for _ in 0..20 {
            let _ = ranging.learn(1, 70.0, Vector2::zeros(), &known(1));
        }
        assert!(ranging.is_lost());
        ranging.place(Vector3::zeros(), Matrix3::identity());
        assert!(!ranging.is_lost());
        assert_eq!(ranging.calibration(1), learned);
    }

    #[test]
    fn where_the_error_of_a_place_stays_many_readings_teach_no_more_than_one() {
        let [mut of_anchor, mut of_robot] = [begun(), begun()];
        let unsure = |moves| Place {
            covariance: Matrix2::from_diagonal_element(0.25),
            moves,
            ..known(0)
        };
        for _ in 0..50 {
            for (ranging, moves) in [(&mut of_anchor, false), (&mut of_robot, true)] {
                ranging.drive(&Increment {
                    seconds: 1.0,
                    displacement: Vector3::zeros(),
                    covariance: Matrix3::zeros(),
                });
                let said = ranging.learn(0, 20.0, Vector2::zeros(), &unsure(moves));
                assert_eq!(said, Ok(()));
            }
        }
        let sigma = |it: &Ranging| 20.0 * it.corrected(0, 20.0).expect("a range").slow;
        assert!(sigma(&of_anchor) < 0.12, "{}", sigma(&of_anchor));
        assert!(sigma(&of_robot) > 0.4, "{}", sigma(&of_robot));
    }

    #[test]
    fn a_radio_off_the_middle_is_seen_where_it_is() {
        let mut ranging = begun();
        let settings = Settings::default();
        let here = Vector3::new(0.0, 0.0, 1.0);
        ranging.place(here, Matrix3::from_diagonal_element(1e-12));
        let (sin, cos) = 1.0_f64.sin_cos();
        let arm = Vector2::new(2.0 * cos, 2.0 * sin);
        let range = (known(0).position - arm).norm();
        let slack = Calibration {
            scale: 0.0,
            offset_m: 0.0,
            covariance: Matrix2::from_diagonal_element(1e-12),
        };
        ranging.know(0, &slack);
        let off = range + 2.0 * settings.sigma_m;
        let verdict = ranging.learn(0, off, Vector2::new(2.0, 0.0), &known(0));
        assert_eq!(verdict, Ok(()));
        let off = range + 4.0 * settings.sigma_m;
        let verdict = ranging.learn(0, off, Vector2::new(2.0, 0.0), &known(0));
        assert_eq!(verdict, Err(Refused::Gate));
    }
}
