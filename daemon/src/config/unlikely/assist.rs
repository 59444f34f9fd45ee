//! Settings with which what a child has in common with leaders cannot be tracked.

use super::super::finding::Finding;
use super::super::{AssistFusion, Config, GyroSource};

pub(super) fn findings(config: &Config) -> Vec<Finding> {
    let assist = &config.assist;
    if !assist.is_on() || assist.fusion != AssistFusion::Cross || config.fusion.paper {
        return Vec::new();
    }
    let leads = assist.leaders.contains(&config.robot.id);
    let slow_m = config.position.slow_sigma_m;
    let reasons = [
        (
            config.gyro.source != GyroSource::None,
            "this robot has a gyro, whose bias is in the error of all that follows".to_owned(),
        ),
        (
            leads && slow_m > 0.0,
            format!("this leader's fixes have a slow error, position.slow_sigma_m = {slow_m}"),
        ),
        (
            config.sighting.heard,
            "this robot learns from what others see in part, sighting.heard".to_owned(),
        ),
    ];
    let reasons = reasons.into_iter().filter(|(holds, _)| *holds);
    let finding = |(_, reason)| {
        let problem = format!(
            " = \"cross\": comes to what \"split\" comes to: {reason}, so that nobody can say what becomes of that error"
        );
        Finding::new("assist.fusion", problem)
    };
    reasons.map(finding).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn found(lines: &str) -> Vec<String> {
        let text = format!(
            "[robot]\nname = \"a\"\nid = 1\n[[team]]\nname = \"b\"\nid = 2\n[assist]\nleaders = [1]\nchildren = [2]\n{lines}"
        );
        let config = Config::parse(&text, Path::new("a.toml")).unwrap();
        let found = findings(&config).into_iter();
        found.map(|it| it.problem).collect()
    }

    #[test]
    fn cross_that_comes_to_split_is_said_with_its_reason() {
        let cross = "fusion = \"cross\"\n";
        let slow = "[position]\nslow_sigma_m = 1.0\n";
        let gyro = "[gyro]\nsource = \"channel\"\n";
        assert!(found(cross).is_empty());
        let split = "fusion = \"split\"\n";
        for lines in [slow, gyro] {
            assert!(found(&format!("{split}{lines}")).is_empty());
        }
        for (lines, expected) in [
            (slow, "slow_sigma_m = 1"),
            (gyro, "has a gyro"),
            ("[sighting]\nheard = true\n", "sighting.heard"),
        ] {
            let said = found(&format!("{cross}{lines}"));
            assert_eq!(said.len(), 1, "{said:?}");
            assert!(said[0].contains(expected), "{said:?}");
        }
    }
}
