//! The robots' configurations.

use std::fs;
use std::path::{Path, PathBuf};

use coloc_daemon::config::{Config, Initial, Member, Realtime, Robot, Scheduler, Shm, Telemetry};
use coloc_shm_types::RobotName;

use super::{Fleet, OTHER, VICTIM};

pub(super) const ROBOTS: [&str; 2] = ["robot1", "robot2"];
pub(super) const PREFIX: &str = "chaos";

/// What a scene has otherwise; it is told the fleet's directory.
pub(super) type Settings = Box<dyn Fn(&mut Config, &Path)>;

impl Fleet {
    pub(super) fn config(&self, robot: usize) -> PathBuf {
        self.notes.path().join(format!("{}.toml", ROBOTS[robot]))
    }

    pub(super) fn write_configurations(&self) {
        for robot in [VICTIM, OTHER] {
            let mut config = ordinary(robot, self.directory.path());
            (self.settings)(&mut config, self.directory.path());
            fs::write(self.config(robot), toml::to_string(&config).unwrap()).unwrap();
        }
    }
}

fn ordinary(robot: usize, at: &Path) -> Config {
    let Member { name, id } = member(robot);
    Config {
        team: [VICTIM, OTHER].map(member).into(),
        shm: Shm {
            root: at.join("shm"),
            prefix: PREFIX.into(),
            ..Shm::default()
        },
        initial: Initial {
            resume: true,
            ..Initial::default()
        },
        realtime: Realtime {
            scheduler: Scheduler::Other,
            lock_memory: false,
            ..Realtime::default()
        },
        telemetry: Telemetry {
            state_file: at.join(format!("{name}.belief.toml")),
            ..Telemetry::default()
        },
        ..Config::of(Robot { name, id })
    }
}

fn member(robot: usize) -> Member {
    Member {
        name: RobotName::new(ROBOTS[robot]).unwrap(),
        id: u16::try_from(robot + 1).unwrap(),
    }
}
