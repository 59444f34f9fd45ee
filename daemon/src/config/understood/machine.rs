//! What is asked of the operating system, and where files are.

use std::path::Path;

use coloc_drivers::encoder::Rounded;
use coloc_shm_types::Group;

use super::super::{Config, Scheduler};
use super::page::{Page, chosen};

pub(super) fn write(config: &Config, page: &mut Page) {
    realtime(config, page);
    shm(config, page);
    files(config, page);
}

fn realtime(config: &Config, page: &mut Page) {
    let realtime = &config.realtime;
    let priority = if realtime.scheduler == Scheduler::Other {
        String::new()
    } else {
        format!(", priority {}", realtime.priority)
    };
    let class = chosen("realtime.scheduler", realtime.scheduler);
    page.line("realtime", format!("{class}{priority}"));
    let memory = if realtime.lock_memory {
        "memory locked"
    } else {
        "memory not locked"
    };
    let refused = if realtime.required {
        "does not start if any of it is refused"
    } else {
        "goes on with a warning where it is refused"
    };
    page.line(
        "",
        format!(
            "processors: {}; {memory}; stack {} KiB; {refused}",
            cpus(&realtime.cpus),
            realtime.prefault_stack_kib
        ),
    );
}

fn cpus(cpus: &[usize]) -> String {
    if cpus.is_empty() {
        return "any".into();
    }
    let cpus: Vec<_> = cpus.iter().map(ToString::to_string).collect();
    cpus.join(", ")
}

fn shm(config: &Config, page: &mut Page) {
    let prefix = &config.shm.prefix;
    let place = match config.shm_root() {
        Ok(root) => format!("{root}, prefix {prefix}"),
        Err(problem) => problem.to_string(),
    };
    page.line("shm", place);
    if let Some(readers) = readers(&config.shm.group) {
        page.line("", readers);
    }
}

/// Whether that group exists is told by a warning.
fn readers(group: &str) -> Option<String> {
    let group = Group::find(group).map_or_else(|_| group.into(), |it| it.to_string());
    let said = format!("the newest estimate can be read by the users of the group {group}");
    (!group.is_empty()).then_some(said)
}

fn files(config: &Config, page: &mut Page) {
    let files = &config.telemetry;
    let log = place(&files.log_file, "standard error");
    page.line(
        "log",
        format!("{log}, from level {}", chosen("telemetry.log", files.log)),
    );
    if config.initial.resume {
        let state = config.state_place();
        page.line(
            "state",
            format!("{state}, saved {} times a second", Rounded(files.state_hz)),
        );
    }
    if !files.record.as_os_str().is_empty() {
        page.line("record", files.record.display().to_string());
    }
    page.line(
        "watchdog",
        format!(
            "speaks up after {} ticks that did not come",
            files.watchdog_ticks
        ),
    );
}

fn place(path: &Path, default: &str) -> String {
    if path.as_os_str().is_empty() {
        return default.into();
    }
    path.display().to_string()
}
