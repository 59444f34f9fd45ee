//! The robots' configurations.

use std::fmt::Write;
use std::fs;
use std::path::PathBuf;

use super::{Fleet, OTHER, VICTIM};

pub(super) const ROBOTS: [&str; 2] = ["robot1", "robot2"];
pub(super) const PREFIX: &str = "chaos";
/// Where a scene does not say otherwise.
const ORDINARY: &str = "[realtime]\nscheduler = \"other\"\nlock_memory = false\n";
const STATE: &str = "[telemetry]\nstate_file = \"{at}/{robot}.belief.toml\"\n";

impl Fleet {
    pub(super) fn config(&self, robot: usize) -> PathBuf {
        self.notes.path().join(format!("{}.toml", ROBOTS[robot]))
    }

    pub(super) fn write_configurations(&self) {
        for robot in [VICTIM, OTHER] {
            fs::write(self.config(robot), self.configuration(robot)).unwrap();
        }
    }

    fn configuration(&self, robot: usize) -> String {
        let (id, name) = (robot + 1, ROBOTS[robot]);
        let mut text = String::new();
        for (id, name) in (1..).zip(ROBOTS) {
            let _ = writeln!(text, "[[team]]\nname = \"{name}\"\nid = {id}");
        }
        let _ = writeln!(text, "[robot]\nname = \"{name}\"\nid = {id}");
        let _ = writeln!(text, "[shm]\nroot = \"{{at}}/shm\"\nprefix = \"{PREFIX}\"");
        text += "[initial]\nresume = true\n";
        text += &self.settings;
        for (section, usual) in [("[realtime]", ORDINARY), ("[telemetry]", STATE)] {
            if !self.settings.contains(section) {
                text += usual;
            }
        }
        text.replace("{at}", &self.directory.path().display().to_string())
            .replace("{robot}", name)
    }
}
