//! Whether leaders and children are a team, and its events fit into the history.

use coloc_estimator::RobotId;
use coloc_estimator::assist::events::OPEN_EVENTS;
use coloc_estimator::assist::search::MOST_READINGS;
use coloc_estimator::assist::team::Team;

use super::super::finding::Finding;
use super::super::{AssistMode, Config};

pub(super) fn refusal(config: &Config) -> Option<Finding> {
    let assist = &config.assist;
    if !assist.is_on() {
        let problem = ": is of no use without assist.leaders";
        let is_led = !assist.children.is_empty();
        return is_led.then(|| Finding::new("assist.children", problem));
    }
    team(config)
        .or_else(|| unknown(config))
        .or_else(|| own(config))
        .or_else(|| readings(config))
        .or_else(|| times(config))
        .or_else(|| delay(config))
}

fn team(config: &Config) -> Option<Finding> {
    let assist = &config.assist;
    let ids = |list: &[u16]| list.iter().map(|id| RobotId(*id)).collect::<Vec<_>>();
    let problem = Team::new(&ids(&assist.leaders), &ids(&assist.children)).err()?;
    Some(Finding::new("assist.leaders", format!(": {problem}")))
}

fn unknown(config: &Config) -> Option<Finding> {
    let lists = [
        ("leaders", &config.assist.leaders),
        ("children", &config.assist.children),
    ];
    let is_known = |id: u16| id == config.robot.id || config.team.iter().any(|it| it.id == id);
    let mut all = lists
        .into_iter()
        .flat_map(|(name, list)| list.iter().map(move |id| (name, *id)));
    let (name, id) = all.find(|(_, id)| !is_known(*id))?;
    let problem = format!(": robot {id} is not in [[team]]");
    Some(Finding::new(format!("assist.{name}"), problem))
}

fn own(config: &Config) -> Option<Finding> {
    let (assist, id) = (&config.assist, config.robot.id);
    let is_listed = [&assist.leaders, &assist.children]
        .into_iter()
        .any(|it| it.contains(&id));
    let problem = format!(
        ": this robot, number {id}, is in neither list; list it, or leave [assist] out on it and take it out of the lists of others"
    );
    (!is_listed).then(|| Finding::new("assist.children", problem))
}

/// Where leaders are told all readings, these and their time have an end.
fn readings(config: &Config) -> Option<Finding> {
    let (assist, rate_hz) = (&config.assist, config.tick.rate_hz);
    if assist.mode != AssistMode::Full {
        return None;
    }
    if assist.children.len() > MOST_READINGS {
        let problem = format!(
            ": {} are more than the {MOST_READINGS} that mode \"full\" has room for; \"bounded-instant\" carries more",
            assist.children.len()
        );
        return Some(Finding::new("assist.children", problem));
    }
    let deadline_s = f64::from(assist.deadline_ms(rate_hz)) / 1e3;
    let least_s = 4.0 / rate_hz;
    let problem = if deadline_s < least_s {
        format!("{least_s} s or more at {rate_hz} Hz, four ticks")
    } else if deadline_s > assist.period_s {
        format!("{} s or less, assist.period_s", assist.period_s)
    } else {
        return None;
    };
    let problem = format!(" (or what comes of the default) is {deadline_s} s: must be {problem}");
    Some(Finding {
        or: &["assist.period_s"],
        ..Finding::new("assist.readings_deadline_ms", problem)
    })
}

#[allow(clippy::cast_precision_loss)] // Eight.
fn times(config: &Config) -> Option<Finding> {
    let (assist, rate_hz) = (&config.assist, config.tick.rate_hz);
    if assist.period_s * rate_hz < 2.0 {
        let problem = format!(
            " = {}: must be {} s or more at {rate_hz} Hz, two ticks",
            assist.period_s,
            2.0 / rate_hz
        );
        return Some(Finding::new("assist.period_s", problem));
    }
    let closes_ms = assist.closes_after_ms(rate_hz, config.history.length_s);
    let closes_s = f64::from(closes_ms) / 1e3;
    let open_s = assist.period_s * OPEN_EVENTS as f64;
    let problem = if closes_ms < assist.ack_timeout_ms {
        format!(
            "{} ms or more, assist.ack_timeout_ms",
            assist.ack_timeout_ms
        )
    } else if closes_s > config.history.length_s {
        format!(
            "{} s or less, history.length_s: what comes later could not be fused",
            config.history.length_s
        )
    } else if closes_s > open_s {
        format!("{open_s} s or less: no more than {OPEN_EVENTS} events can be open")
    } else {
        return None;
    };
    let problem = format!(" (or what comes of the default) is {closes_s} s: must be {problem}");
    Some(Finding {
        or: &[
            "assist.ack_timeout_ms",
            "history.length_s",
            "assist.period_s",
        ],
        ..Finding::new("assist.close_after_ms", problem)
    })
}

fn delay(config: &Config) -> Option<Finding> {
    let (assist, rate_hz) = (&config.assist, config.tick.rate_hz);
    let closes_ms = assist.closes_after_ms(rate_hz, config.history.length_s);
    let delay_ms = assist.delay_ms(rate_hz).filter(|it| *it > closes_ms)?;
    let problem = format!(
        " (or what comes of the default) is {delay_ms} ms: must be {closes_ms} ms or less, when a child stops to take anything"
    );
    Some(Finding {
        or: &["assist.close_after_ms"],
        ..Finding::new("assist.max_delay_ms", problem)
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn said(lines: &str) -> Result<Config, String> {
        let text = format!(
            "[robot]\nname = \"a\"\nid = 1\n[[team]]\nname = \"b\"\nid = 2\n[[team]]\nname = \"c\"\nid = 3\n[assist]\n{lines}"
        );
        Config::parse(&text, Path::new("a.toml")).map_err(|it| it.to_string())
    }

    #[test]
    fn a_team_with_leaders_and_children_gives_the_robot_its_part() {
        let of = |lines: &str| said(lines).unwrap().assistant();
        assert!(of("").is_none());
        assert!(of("leaders = [1]\nchildren = [2, 3]\n").unwrap().leads());
        assert!(!of("leaders = [3]\nchildren = [1, 2]\n").unwrap().leads());
        let config = said("leaders = [3]\nchildren = [1, 2]\n").unwrap();
        assert_eq!(config.assist.closes_after_ms(50.0, 1.0), 160 + 2 * 3 * 20);
        assert_eq!(config.assist.ack_bounds(50.0, 1.0), None);
        let config = said("leaders = [3]\nchildren = [1, 2]\nack_timeout_ms = 0\n").unwrap();
        assert_eq!(config.assist.closes_after_ms(50.0, 1.0), 1000);
        let bounds = config.assist.ack_bounds(50.0, 1.0).unwrap();
        assert_eq!([bounds.least, bounds.first, bounds.most], [40, 160, 880]);
    }

    #[test]
    fn what_is_no_team_or_does_not_fit_is_refused_with_its_reason() {
        let cases = [
            ("children = [1]\n", "is of no use without assist.leaders"),
            (
                "leaders = [1]\nchildren = [1, 2]\n",
                "robot 1 is listed twice",
            ),
            (
                "leaders = [1]\nchildren = [9]\n",
                "robot 9 is not in [[team]]",
            ),
            ("leaders = [2]\nchildren = [3]\n", "is in neither list"),
            ("leaders = [1]\nperiod_s = 0.03\n", "must be 0.04 s or more"),
            ("leaders = [1]\nclose_after_ms = 1200\n", "history.length_s"),
            ("leaders = [1]\nclose_after_ms = 100\n", "160 ms or more"),
            (
                "leaders = [1]\nperiod_s = 0.05\nclose_after_ms = 500\n",
                "0.4 s or less",
            ),
            ("leaders = [1]\nmode = \"fast\"\n", "bounded-instant"),
            (
                "leaders = [1]\nmode = \"full\"\nreadings_deadline_ms = 210\n",
                "0.2 s or less, assist.period_s",
            ),
            (
                "leaders = [1]\nmode = \"full\"\nreadings_deadline_ms = 60\n",
                "four ticks",
            ),
            (
                "leaders = [1]\nmode = \"full\"\nperiod_s = 1.0\n",
                "history.length_s",
            ),
            (
                "leaders = [1]\nmode = \"bounded-delayed\"\nmax_delay_ms = 900\n",
                "when a child stops",
            ),
        ];
        for (lines, expected) in cases {
            let refusal = said(lines).unwrap_err();
            assert!(refusal.contains(expected), "{lines}: {refusal}");
        }
    }
}
