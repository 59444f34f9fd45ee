//! Wheels that do not fit one another: seen, named, and made noise of.
//!
//! * Ways are added up over a tenth of a second at least, so that what whole counts leave open is small, and one late frame is no
//!   slip.
//! * Along each unit vector n that no motion of the robot explains (see [`LeastSquares`]) the misfit is `n · ways / max |n|`: how
//!   far a single wheel would have to be wrong, at the least. Beyond `slip_mps` for the time, `slip_share` of the longest way,
//!   and a count of each wheel, the wheels slip.
//! * Which of the wheels it was no single moment tells. Each is as likely as another in the noise: with `S` the sum of the
//!   misfits since slipping began, `S²` times the mean of the squares of what each wheel would have done to the body's way is
//!   added, step by step as `S²` grows, because the errors of one slip all point the same way.
//! * Named is the wheel without which the robot's velocity would have changed least when it began; only after
//!   [`CONVINCING`] spans.
//! * It has ended when the wheels have fitted one another for [`CALM_S`].

use super::kinematics::{NO_SPREAD, Spread};
use super::least_squares::{LeastSquares, sum_of_products};
use super::merge::MAX_CHANNELS;

/// From what on wheels slip.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct SlipLimits {
    pub(super) mps: f64,
    pub(super) share: f64,
    /// One count of each wheel \[m\]; 0 for one that says a speed.
    pub(super) counts_m: [f64; MAX_CHANNELS],
    /// A turn of one radian counts as that many metres.
    pub(super) lever_m: f64,
    /// The setting of each wheel.
    pub(super) names: [&'static str; MAX_CHANNELS],
}

/// Wheels that slip.
#[derive(Copy, Clone, Debug, PartialEq)]
pub struct Slip {
    /// The wheel that most likely does not fit the others: its setting, as `mecanum.rear_left`.
    pub wheel: &'static str,
    /// It is too fast by so much, if it is that one; too slow if negative \[m/s\].
    pub misfit_mps: f64,
    /// More than this is slip \[m/s\].
    pub limit_mps: f64,
}

/// Watches the wheels of one robot.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct SlipWatch {
    limits: SlipLimits,
    ways: [f64; MAX_CHANNELS],
    span_s: f64,
    /// Velocity of the last span in which all wheels fitted.
    steady: [f64; 3],
    episode: Option<Episode>,
    count: u64,
}

#[derive(Copy, Clone, Debug, Default, PartialEq)]
struct Episode {
    /// Of the parts along each n \[m\].
    sums: [f64; 2],
    /// Spans in which wheels slipped, and how long none did since.
    spans: u32,
    calm_s: f64,
    /// Squares of what each wheel's fault would have changed of the velocity when it began.
    changes: [f64; MAX_CHANNELS],
    latest: Option<Slip>,
}

/// Long enough for counts, short for a person.
const SPAN_S: f64 = 0.1;

/// So many spans are no lost frame.
const CONVINCING: u32 = 2;

/// Later than this the motion before has nothing to say.
const TELLING: u32 = 5;

const CALM_S: f64 = 1.0;

impl SlipWatch {
    pub(super) fn new(limits: SlipLimits) -> Self {
        Self {
            limits,
            ways: [0.0; MAX_CHANNELS],
            span_s: 0.0,
            steady: [0.0; 3],
            episode: None,
            count: 0,
        }
    }

    /// How often wheels began to slip.
    pub(super) fn count(&self) -> u64 {
        self.count
    }

    /// What is known of slip now.
    pub(super) fn slip(&self) -> Option<Slip> {
        let known = |it: &Episode| it.spans >= CONVINCING;
        self.episode.filter(known)?.latest
    }

    /// Nothing that was said before belongs to what follows.
    pub(super) fn forget(&mut self) {
        (self.ways, self.span_s) = ([0.0; MAX_CHANNELS], 0.0);
    }

    /// Mean speeds over `dt_s`; what is to be added to the covariance of the body's velocity in that time.
    pub(super) fn note(
        &mut self,
        wheels: &LeastSquares,
        speeds: [f64; MAX_CHANNELS],
        dt_s: f64,
    ) -> Spread {
        for (way, speed) in self.ways.iter_mut().zip(speeds) {
            *way += speed * dt_s;
        }
        self.span_s += dt_s;
        // Rounding is no reason to wait.
        if self.span_s < SPAN_S * (1.0 - 1e-9) {
            return NO_SPREAD;
        }
        let grown = self.judge(wheels);
        self.forget();
        let per_square_second = 1.0 / (dt_s * dt_s);
        grown.map(|row| row.map(|entry| entry * per_square_second))
    }

    /// What the span adds to the covariance of the body's way.
    fn judge(&mut self, wheels: &LeastSquares) -> Spread {
        let (mut grown, mut slips) = (NO_SPREAD, false);
        let ways = self.ways;
        for (place, n) in wheels.redundant().enumerate() {
            let along = sum_of_products(n, ways);
            let largest = n.iter().fold(0.0, |most, n| n.abs().max(most));
            let limit_m = self.limit_m(n, largest);
            if along.abs() <= limit_m * largest {
                continue;
            }
            slips = true;
            let variance = self.grow(place, along);
            add(&mut grown, wheels.of_slip(n), variance);
            self.suspect(wheels, n, along, limit_m);
        }
        self.close(wheels, slips);
        grown
    }

    /// A single wheel may be so far off \[m\].
    fn limit_m(&self, n: [f64; MAX_CHANNELS], largest: f64) -> f64 {
        let SlipLimits {
            mps,
            share,
            counts_m,
            ..
        } = self.limits;
        let longest_m = self.ways.iter().fold(0.0, |most, way| way.abs().max(most));
        let open_m = sum_of_products(n.map(f64::abs), counts_m) / largest;
        mps * self.span_s + share * longest_m + open_m
    }

    /// By how much the square of the sum grows.
    fn grow(&mut self, place: usize, along: f64) -> f64 {
        let episode = self.episode.get_or_insert_default();
        let Some(sum) = episode.sums.get_mut(place) else {
            return 0.0;
        };
        let before = *sum * *sum;
        *sum += along;
        (*sum * *sum - before).max(0.0)
    }

    fn suspect(&mut self, wheels: &LeastSquares, n: [f64; MAX_CHANNELS], along: f64, limit_m: f64) {
        let (span_s, steady) = (self.span_s, self.steady);
        let SlipLimits { lever_m, names, .. } = self.limits;
        let found = wheels.velocity(self.ways);
        let episode = self.episode.get_or_insert_default();
        let mut least = None;
        for (wheel, error) in wheels.suspects(n, along) {
            let Some(changes) = episode.changes.get_mut(wheel) else {
                continue;
            };
            if episode.spans < TELLING {
                *changes += change(found, error, steady, span_s, lever_m);
            }
            if least.is_none_or(|(_, before)| *changes < before) {
                least = Some((wheel, *changes));
            }
        }
        episode.latest = least.and_then(|(wheel, _)| {
            Some(Slip {
                wheel: names.get(wheel)?,
                misfit_mps: along / n.get(wheel)? / span_s,
                limit_mps: limit_m / span_s,
            })
        });
    }

    fn close(&mut self, wheels: &LeastSquares, slips: bool) {
        let Some(episode) = &mut self.episode else {
            self.steady = wheels.velocity(self.ways).map(|way| way / self.span_s);
            return;
        };
        if slips {
            (episode.spans, episode.calm_s) = (episode.spans.saturating_add(1), 0.0);
            self.count += u64::from(episode.spans == CONVINCING);
            return;
        }
        episode.calm_s += self.span_s;
        if episode.calm_s >= CALM_S {
            self.episode = None;
        }
    }
}

/// Square of how far the velocity without `error` is from the one before \[m²/s²\].
fn change(way: [f64; 3], error: [f64; 3], steady: [f64; 3], span_s: f64, lever_m: f64) -> f64 {
    let [x, y, turn] = way;
    let [ex, ey, eturn] = error;
    let [vx, vy, omega] = steady;
    let along = (x - ex) / span_s - vx;
    let across = (y - ey) / span_s - vy;
    let turning = ((turn - eturn) / span_s - omega) * lever_m;
    along * along + across * across + turning * turning
}

fn add(to: &mut Spread, more: Spread, factor: f64) {
    for (to, more) in to.iter_mut().flatten().zip(more.into_iter().flatten()) {
        *to += factor * more;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LEVER_M: f64 = 0.45;
    const NAMES: [&str; MAX_CHANNELS] = ["0", "1", "2", "3"];

    fn mecanum() -> LeastSquares {
        LeastSquares::mecanum(0.25, 0.2, 0.0).unwrap()
    }

    fn watch(counts_m: f64) -> SlipWatch {
        SlipWatch::new(SlipLimits {
            mps: 0.05,
            share: 0.1,
            counts_m: [counts_m; MAX_CHANNELS],
            lever_m: LEVER_M,
            names: NAMES,
        })
    }

    fn speeds([vx, vy, omega]: [f64; 3]) -> [f64; MAX_CHANNELS] {
        let turn = LEVER_M * omega;
        [
            vx - vy - turn,
            vx + vy + turn,
            vx + vy - turn,
            vx - vy + turn,
        ]
    }

    /// A steady drive, in which wheel `wheel` is off by `by_mps` from 2 s on and until 5 s.
    fn drive(rate_hz: u32, wheel: usize, by_mps: f64) -> (SlipWatch, Vec<Option<Slip>>, Spread) {
        let (wheels, mut watch, mut total) = (mecanum(), watch(0.0), NO_SPREAD);
        let dt_s = 1.0 / f64::from(rate_hz);
        let mut seen = Vec::new();
        for sample in 0..8 * rate_hz {
            let time_s = f64::from(sample) * dt_s;
            let mut speeds = speeds([0.8, 0.2, 0.3 + 0.05 * time_s]);
            if (2.0..5.0).contains(&time_s) {
                speeds[wheel] += by_mps;
            }
            let spread = watch.note(&wheels, speeds, dt_s);
            add(&mut total, spread, dt_s * dt_s);
            seen.push(watch.slip());
        }
        (watch, seen, total)
    }

    #[test]
    fn the_wheel_that_slips_is_named_at_once_and_while_it_does() {
        for rate_hz in [10, 50, 200] {
            for (wheel, name) in NAMES.into_iter().enumerate() {
                for by_mps in [0.4, -0.4] {
                    let (watch, seen, _) = drive(rate_hz, wheel, by_mps);
                    let per_s = rate_hz as usize;
                    let first = seen.iter().position(Option::is_some).unwrap();
                    assert!(first >= 2 * per_s && first <= 2 * per_s + 3 * per_s / 10);
                    let slip = seen[5 * per_s - 1].unwrap();
                    assert_eq!(slip.wheel, name, "{slip:?}");
                    assert!((slip.misfit_mps - by_mps).abs() < 1e-9, "{slip:?}");
                    assert_eq!(watch.slip(), None, "it has ended");
                }
            }
        }
    }

    #[test]
    fn what_is_within_the_limit_and_what_counts_leave_open_is_no_slip() {
        let (_, seen, total) = drive(50, 1, 0.05);
        assert!(seen.iter().all(Option::is_none));
        assert!(total.iter().flatten().all(|&it| it == 0.0));
        let (wheels, mut coarse) = (mecanum(), watch(0.01));
        for _ in 0..50 {
            // Half a count a wheel and span, as rounding has it at its worst.
            let spread = coarse.note(&wheels, [0.1, 0.1, -0.1, -0.1], 0.1);
            assert!(spread.iter().flatten().all(|&it| it == 0.0));
        }
    }

    /// Three seconds of 0.4 m/s: whichever wheel it was, the body's way is off by a quarter of 1.2 m along x.
    #[test]
    fn the_noise_of_a_slip_is_the_square_of_all_of_its_way() {
        for rate_hz in [10, 50, 200] {
            let (_, _, total) = drive(rate_hz, 2, 0.4);
            let (error, found) = (1.2 / 4.0, total[0][0].sqrt());
            assert!((found - error).abs() < 1e-9, "{found} at {rate_hz} Hz");
        }
    }
}
