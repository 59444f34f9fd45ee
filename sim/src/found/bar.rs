//! What must come of many robots.

use super::outcome::Outcome;

/// Of 10,000 robots so many may fail, which shows 99.9 %.
const MAY_FAIL: usize = 4;
const OF: usize = 10_000;

/// Honest means and shares of the NEES of a pose, the shares above 1 % and 0.1 % of χ².
const MEAN: [f64; 2] = [2.6, 3.3];
const PERCENT: (f64, f64) = (11.345, 0.015);
const PER_MILLE: (f64, f64) = (16.27, 0.004);

/// Of fewer samples shares of a few per mille say nothing: a robot's follow each other.
const ENOUGH: f64 = 20_000.0;

/// A robot's moments follow each other: who is beyond a limit at one is so at others.
const MOMENTS: f64 = 8.0;

/// What a median may be above the prototype's \[s\].
const LATER_S: f64 = 0.5;

/// What must come of the robots of a row, or of many rows.
#[derive(Copy, Clone, Debug, PartialEq)]
pub enum Bar {
    /// All but four of 10,000 are found by then \[s\].
    FoundBy(f64),
    /// Half of them by then, to half a second \[s\].
    Median(f64),
    /// All but four of 10,000 are `ok` and not wrong 20 s after the event.
    RightAt20,
    /// All but four of 10,000 have a position by then \[s\].
    PlacedBy(f64),
    /// Nobody follows a hypothesis that is wrong.
    NoWrongTakeover,
    /// Nobody is `ok` and wrong for longer \[s\].
    WrongAtMost(f64),
    /// Nobody is `ok` and wrong later than that \[s\].
    RightAfter(f64),
    /// Nobody is ever `ok`.
    NeverOk,
    /// Nobody leaves `ok`.
    AlwaysOk,
    /// The liar is named at the end in all but four of 10,000.
    LiarNamed,
    /// No honest source is ever named.
    HonestUnnamed,
    /// At most so many leave `ok`, all together.
    Alarms(u32),
    /// All are `lost` by then \[s\].
    LostBy(f64),
    /// The NEES after it was found is that of an honest pose; judged of 20,000 samples and more.
    Nees,
    /// Or lower.
    NeesAtMost,
}

/// NEES at many moments.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Honesty {
    count: f64,
    sum: f64,
    percent: f64,
    per_mille: f64,
}

impl Honesty {
    /// Of all moments of these robots.
    #[must_use]
    pub fn of<'a>(outcomes: impl IntoIterator<Item = &'a Outcome>) -> Self {
        let samples = outcomes.into_iter().flat_map(|it| it.nees);
        let mut honesty = Self::default();
        samples.flatten().for_each(|nees| honesty.add(nees));
        honesty
    }

    fn add(&mut self, nees: f64) {
        let above = |limit: f64| f64::from(u8::from(nees > limit));
        self.count += 1.0;
        self.sum += nees;
        self.percent += above(PERCENT.0);
        self.per_mille += above(PER_MILLE.0);
    }

    /// Both together.
    #[must_use]
    pub fn and(self, other: &Self) -> Self {
        Self {
            count: self.count + other.count,
            sum: self.sum + other.sum,
            percent: self.percent + other.percent,
            per_mille: self.per_mille + other.per_mille,
        }
    }

    fn missed(&self, least: f64, chance: f64) -> Option<String> {
        if self.count < ENOUGH {
            return None;
        }
        let Self {
            count,
            sum,
            percent,
            per_mille,
        } = *self;
        let mean = sum / count;
        let holds = (least..=MEAN[1]).contains(&mean)
            && percent <= by_chance(PERCENT.1 * count, MOMENTS, chance)
            && per_mille <= by_chance(PER_MILLE.1 * count, MOMENTS, chance);
        (!holds).then(|| format!("NEES after it was found: {}", self.text()))
    }

    /// Mean, and how many are above the two limits.
    #[must_use]
    pub fn text(&self) -> String {
        if self.count == 0.0 {
            return "–".into();
        }
        format!(
            "{:.2}; {} and {} of {}",
            self.sum / self.count,
            self.percent,
            self.per_mille,
            self.count
        )
    }
}

impl Bar {
    /// What is to be said of robots that miss it; what counts shares allows so many σ of `chance` beyond them.
    #[must_use]
    pub fn missed(self, robots: &[&Outcome], chance: f64) -> Option<String> {
        let few = |what: &str, fails: &dyn Fn(&Outcome) -> bool| few(robots, chance, what, fails);
        match self {
            Self::FoundBy(by) => few(&format!("not found by {by} s"), &|it| {
                it.found_s.is_none_or(|found| found > by)
            }),
            Self::Median(by) => {
                let median = median(robots.iter().map(|it| it.found_s));
                let late = median.is_none_or(|it| it > by + LATER_S);
                late.then(|| format!("half of them found by {}, not {by} s", seconds(median)))
            }
            Self::RightAt20 => few("not right 20 s after it", &|it| !it.right_at_20),
            Self::PlacedBy(by) => few(&format!("no position by {by} s"), &|it| {
                it.placed_s.is_none_or(|placed| placed > by)
            }),
            Self::NoWrongTakeover => none(robots, "followed wrongly", |it| it.wrongly > 0),
            Self::WrongAtMost(most) => none(
                robots,
                &format!("ok and wrong for more than {most} s"),
                |it| it.wrong_longest_s > most + 1e-6,
            ),
            Self::RightAfter(from) => none(robots, &format!("ok and wrong after {from} s"), |it| {
                it.wrong_last_s > from
            }),
            Self::NeverOk => none(robots, "ok", |it| it.found_s.is_some() || it.wrong_s > 0.0),
            Self::AlwaysOk => none(robots, "not always ok", |it| it.not_ok_s > 0.0),
            Self::LiarNamed => few("whose liar is not named", &|it| !it.liar_at_end),
            Self::HonestUnnamed => none(robots, "name an honest source", |it| it.honest_named > 0),
            Self::Alarms(most) => {
                let alarms: u32 = robots.iter().map(|it| it.alarms).sum();
                (alarms > most).then(|| format!("{alarms} alarms, more than {most}"))
            }
            Self::LostBy(by) => none(robots, &format!("not lost by {by} s"), |it| {
                it.lost_s.is_none_or(|lost| lost > by)
            }),
            Self::Nees => Honesty::of(robots.iter().copied()).missed(MEAN[0], chance),
            Self::NeesAtMost => Honesty::of(robots.iter().copied()).missed(0.0, chance),
        }
    }
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss
)] // Some thousand robots.
fn few(
    robots: &[&Outcome],
    chance: f64,
    what: &str,
    fails: impl Fn(&Outcome) -> bool,
) -> Option<String> {
    let expected = (MAY_FAIL * robots.len()) as f64 / OF as f64;
    let most = by_chance(expected, 1.0, chance) as usize;
    at_most(robots, most, what, fails)
}

/// So many that `expected` is not refuted by so many σ; they come in bunches of a `size`.
fn by_chance(expected: f64, size: f64, chance: f64) -> f64 {
    expected + chance * (expected * size).sqrt()
}

fn none(robots: &[&Outcome], what: &str, fails: impl Fn(&Outcome) -> bool) -> Option<String> {
    at_most(robots, 0, what, fails)
}

/// Says who failed, the first of them by number.
fn at_most(
    robots: &[&Outcome],
    most: usize,
    what: &str,
    fails: impl Fn(&Outcome) -> bool,
) -> Option<String> {
    let failed: Vec<_> = (0..robots.len())
        .filter(|&at| robots.get(at).is_some_and(|it| fails(it)))
        .collect();
    let first: Vec<_> = failed.iter().take(5).map(ToString::to_string).collect();
    (failed.len() > most).then(|| {
        format!(
            "{} of {} {what} (robot {})",
            failed.len(),
            robots.len(),
            first.join(", ")
        )
    })
}

/// The middle of them; who has none comes last.
#[must_use]
pub(super) fn median(times: impl Iterator<Item = Option<f64>>) -> Option<f64> {
    let mut times: Vec<_> = times.map(|it| it.unwrap_or(f64::INFINITY)).collect();
    times.sort_by(f64::total_cmp);
    let middle = times.get(times.len() / 2).copied();
    middle.filter(|it| it.is_finite())
}

/// For people.
#[must_use]
pub(super) fn seconds(time_s: Option<f64>) -> String {
    time_s.map_or_else(|| "–".into(), |it| format!("{it:.1} s"))
}

#[cfg(test)]
mod tests {
    use super::super::outcome::MOMENTS_S;
    use super::*;

    fn found(at_s: f64, nees: f64) -> Outcome {
        Outcome {
            found_s: Some(at_s),
            nees: [Some(nees); MOMENTS_S.len()],
            ..Outcome::default()
        }
    }

    fn misses(bar: Bar, robots: &[Outcome]) -> bool {
        bar.missed(&robots.iter().collect::<Vec<_>>(), 0.0)
            .is_some()
    }

    #[test]
    fn four_of_ten_thousand_may_be_late_and_none_of_six_hundred() {
        let with_late = |late, of| {
            let mut robots = vec![found(5.0, 3.0); of];
            robots[..late].fill(found(15.1, 3.0));
            robots
        };
        assert!(!misses(Bar::FoundBy(15.0), &with_late(4, 10_000)));
        assert!(misses(Bar::FoundBy(15.0), &with_late(5, 10_000)));
        assert!(misses(Bar::FoundBy(15.0), &with_late(1, 600)));
        assert!(misses(Bar::FoundBy(15.0), &[Outcome::default()]), "never");
    }

    #[test]
    fn one_who_follows_wrongly_is_said_by_number() {
        let wrong = Outcome {
            wrongly: 1,
            ..found(5.0, 3.0)
        };
        let robots = [found(5.0, 3.0), wrong];
        let said = Bar::NoWrongTakeover.missed(&robots.iter().collect::<Vec<_>>(), 0.0);
        assert_eq!(said.as_deref(), Some("1 of 2 followed wrongly (robot 1)"));
    }

    #[test]
    fn who_claims_too_much_or_too_little_is_not_honest() {
        let robots = |nees| vec![found(5.0, nees); 2500];
        assert!(!misses(Bar::Nees, &robots(3.0)));
        assert!(misses(Bar::Nees, &robots(3.4)) && misses(Bar::Nees, &robots(2.5)));
        assert!(!misses(Bar::NeesAtMost, &robots(2.5)));
        let mut tails = robots(2.9);
        tails[..40].fill(found(5.0, 12.0)); // 1.6 %
        assert!(misses(Bar::Nees, &tails));
    }

    #[test]
    fn half_of_them_and_half_a_second() {
        let robots: Vec<_> = [1.0, 2.0, 9.0].map(|at_s| found(at_s, 3.0)).into();
        assert!(!misses(Bar::Median(1.5), &robots) && misses(Bar::Median(1.4), &robots));
        assert!(median([None, None, Some(1.0)].into_iter()).is_none());
    }
}
