//! Who is in the team.

use coloc_shm_types::Channel;

use super::super::Config;
use super::super::finding::Finding;

/// Members that contradict the robot or one another, or find no room.
pub(super) fn refusals(config: &Config) -> impl Iterator<Item = Finding> {
    let member = |index| member(config, index);
    (0..config.team.len())
        .filter_map(member)
        .chain(room(config))
}

/// All robots speak on one channel of each.
fn room(config: &Config) -> Option<Finding> {
    let (peers, most) = (config.peers().count(), Channel::TEAM);
    let problem = format!(
        ": has {peers} other robots, and there is room for {most}: list those only that this robot can see or hear"
    );
    (peers > most).then(|| Finding::new("team", problem))
}

fn member(config: &Config, index: usize) -> Option<Finding> {
    let (member, robot, earlier) = (&config.team[index], &config.robot, &config.team[..index]);
    let id = |problem: String| {
        let problem = format!(" = {}: {problem}", member.id);
        Some(Finding::new(format!("team.{index}.id"), problem))
    };
    match (member.id == robot.id, member.name == robot.name) {
        (true, false) => return id(format!("is the number of this robot, `{}`", robot.name)),
        (false, true) => return id(format!("this robot is number {} in [robot]", robot.id)),
        _ => {}
    }
    if let Some(other) = earlier.iter().find(|other| other.id == member.id) {
        let name = &other.name;
        return id(format!(
            "is already the number of `{name}`; numbers must differ"
        ));
    }
    let twice = earlier.iter().any(|other| other.name == member.name);
    twice.then(|| {
        let problem = format!(" = \"{}\": is listed twice; names must differ", member.name);
        Finding::new(format!("team.{index}.name"), problem)
    })
}
