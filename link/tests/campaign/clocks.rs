//! A clock that is wrong: who has it is refused or corrected, as configured, and nobody else notices.
use std::time::Instant;

use coloc_link::weather::{Cloud, Weather};
use coloc_link::wrong_clock::WrongClock;

use crate::Extent;
use crate::support::{PATIENCE, free_address, roster};
use crate::talk::Talk;
use crate::team::{Robot, members, team};

/// Whose clock is wrong, of three.
const WRONG: u16 = 3;
/// As `[link]` has it where nothing else is said.
const MOST_S: f64 = 0.05;
/// Of `coloc-link check`.
const REFUSED: &str = "it is not heard";

/// Three robots, one with a wrong clock; and what is between them.
struct Team {
    robots: Vec<Robot>,
    clouds: Vec<Cloud>,
    talk: Talk,
    _home: tempfile::TempDir,
}

impl Team {
    /// `clock` is what the last one's link is told of its clock.
    fn start(clock: &str, correct: bool, weather: Weather) -> Self {
        let home = tempfile::tempdir().unwrap();
        let mut robots = team(home.path(), 3);
        let mut listed = members(&robots);
        let clouds = (1..).zip(&mut listed).map(|(seed, member)| {
            let listens = member.addresses[0].parse().unwrap();
            let cloud = Cloud::open(free_address(), listens, weather, seed).unwrap();
            member.addresses = vec![cloud.address().to_string()];
            cloud
        });
        let clouds = clouds.collect();
        let text = roster(1, listed);
        let rule = format!("max_offset_s = {MOST_S}\ncorrect_offset = {correct}");
        for robot in &mut robots {
            robot.configure(|text| text.replace("max_offset_s = 1.0", &rule));
            robot.goes_by(&text);
            if robot.id == WRONG {
                assert!(clock.parse::<WrongClock>().is_ok());
                robot.told = vec![format!("--wrong-clock={clock}")];
            }
            robot.start_link();
        }
        let talk = Talk::new(&robots, |_, _| true, 10.0);
        Self {
            robots,
            clouds,
            talk,
            _home: home,
        }
    }

    /// Until the first robot's `coloc-link check` says that the wrong one is not heard; how long that took (s).
    fn until_named(&mut self) -> f64 {
        let begin = Instant::now();
        loop {
            self.talk.go_on(0.5);
            let said = self.robots[0].check();
            let mut about = said.lines().filter(|line| line.contains("robot3"));
            if about.any(|line| line.contains(REFUSED)) {
                return begin.elapsed().as_secs_f64();
            }
            assert!(begin.elapsed() < PATIENCE, "it is never named: {said}");
        }
    }

    /// How many were heard of that pair.
    fn heard(&self, from: u16, to: u16) -> usize {
        self.talk
            .heard
            .get(&(from, to))
            .map_or(0, |it| it.counted(1))
    }

    /// The most that a stamp that came from or to the wrong one was off (s).
    fn stamp_off_s(&self) -> f64 {
        let all = self.talk.heard.iter();
        let of_it = all.filter(|((from, to), _)| [from, to].contains(&&WRONG));
        of_it.map(|(_, it)| it.stamp_off_s).fold(0.0, f64::max)
    }
}

/// Wrong by a second, and by 200 ppm.
pub(crate) fn wrong(extent: Extent) {
    from_the_start(extent);
    if extent == Extent::Full {
        let foul = Weather {
            loss: 0.5,
            delay_s: [0.0, 0.4],
            ..Weather::default()
        };
        for (words, weather) in [("fair", Weather::default()), ("foul", foul)] {
            for offset in ["1,200", "-1,-200"] {
                a_step_is_refused(words, offset, weather);
                a_step_is_corrected(words, offset, weather);
            }
        }
    }
}

fn from_the_start(extent: Extent) {
    let mut team = Team::start("1,200,0", false, Weather::default());
    team.talk.until_heard(1, 2);
    team.talk.until_heard(2, 1);
    let named_s = team.until_named();
    team.talk.go_on(extent.of(0.5, 5.0));
    println!("clocks: 1 s ahead from the start, refused: named after {named_s:.1} s");
    for (from, to) in [(WRONG, 1), (WRONG, 2), (1, WRONG), (2, WRONG)] {
        assert_eq!(team.heard(from, to), 0, "robot{from} by robot{to}");
    }
    assert!(team.heard(1, 2) > 0 && team.heard(2, 1) > 0);
    drop(team);
    let mut team = Team::start("1,200,0", true, Weather::default());
    team.talk.until_all_are_heard();
    team.talk.go_on(extent.of(1.0, 5.0));
    let off_s = team.stamp_off_s();
    println!("clocks: 1 s ahead from the start, corrected: stamps are off by {off_s:.4} s at most");
    // On a quiet network it is a millisecond; uncorrected, a second.
    assert!(off_s < 0.5, "stamps are off by {off_s} s");
}

/// Long enough that all three hear one another before.
const AFTER_S: f64 = 20.0;

/// It is right for a while, and heard; then everything of it is refused.
fn a_step_is_refused(words: &str, offset: &str, weather: Weather) {
    let begin = Instant::now();
    let mut team = Team::start(&format!("{offset},{AFTER_S}"), false, weather);
    team.talk.until_all_are_heard();
    team.talk.go_on(AFTER_S - begin.elapsed().as_secs_f64());
    team.talk.forget();
    let named_s = team.until_named();
    let (before, off_s) = (team.heard(WRONG, 1), team.stamp_off_s());
    team.talk.forget();
    team.talk.go_on(40.0);
    println!(
        "clocks: {words}, a step by {offset}, refused: named after {named_s:.1} s; of the wrong one {before} heard until then, off by {off_s:.3} s at most, \
         {} in the 40 s after; others: {} of 800 heard, the longest gap {:.2} s; {}",
        team.heard(WRONG, 1) + team.heard(WRONG, 2),
        team.heard(1, 2) + team.heard(2, 1),
        team.talk.longest_gap_s(Some(WRONG)),
        lost(&team.clouds)
    );
}

/// It is right for a while; then its stamps are corrected.
fn a_step_is_corrected(words: &str, offset: &str, weather: Weather) {
    let begin = Instant::now();
    let mut team = Team::start(&format!("{offset},{AFTER_S}"), true, weather);
    team.talk.until_all_are_heard();
    team.talk.go_on(AFTER_S - begin.elapsed().as_secs_f64());
    for seconds in [10.0, 50.0] {
        team.talk.forget();
        team.talk.go_on(seconds);
        let of_it = team.heard(WRONG, 1) + team.heard(1, WRONG);
        println!(
            "clocks: {words}, a step by {offset}, corrected, {seconds} s more: {of_it} of {} to and from it heard, stamps off by {:.4} s at most, the \
             longest gap {:.2} s; others: {} heard; {}",
            20.0 * seconds,
            team.stamp_off_s(),
            team.talk.longest_gap_s(None),
            team.heard(1, 2) + team.heard(2, 1),
            lost(&team.clouds)
        );
    }
    let said = team.robots[0].check();
    let line = said
        .lines()
        .find(|line| line.contains("robot3") && line.contains("ppm"));
    println!("clocks: {}", line.unwrap_or_default().trim());
}

fn lost(clouds: &[Cloud]) -> String {
    let (came, passed) = clouds.iter().fold((0, 0), |(came, passed), cloud| {
        let tally = cloud.tally();
        (came + tally.came, passed + tally.passed)
    });
    format!("{passed} of {came} packets passed")
}
