//! The machine that the figures belong to.

use std::fs::read_to_string;

use serde::Serialize;

/// What a reader of the figures must know.
#[derive(Debug, Serialize)]
pub(crate) struct Facts {
    pub(crate) processor: String,
    pub(crate) processors: usize,
    pub(crate) kernel: String,
    pub(crate) preemption: String,
    pub(crate) governor: String,
    pub(crate) isolated: String,
    pub(crate) load_average: String,
    pub(crate) version: &'static str,
}

impl Facts {
    pub(crate) fn gather() -> Self {
        let unknown = || "unknown".to_owned();
        let build = first_line("/proc/sys/kernel/version").unwrap_or_default();
        Self {
            processor: processor().unwrap_or_else(unknown),
            processors: std::thread::available_parallelism().map_or(1, usize::from),
            kernel: first_line("/proc/sys/kernel/osrelease").unwrap_or_else(unknown),
            preemption: preemption(
                &build,
                first_line("/sys/kernel/debug/sched/preempt").as_deref(),
            ),
            governor: first_line("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")
                .unwrap_or_else(|| "not shown by this machine".into()),
            isolated: first_line("/sys/devices/system/cpu/isolated")
                .filter(|list| !list.is_empty())
                .unwrap_or_else(|| "none".into()),
            load_average: first_line("/proc/loadavg").unwrap_or_else(unknown),
            version: env!("CARGO_PKG_VERSION"),
        }
    }
}

fn first_line(path: &str) -> Option<String> {
    Some(read_to_string(path).ok()?.lines().next()?.trim().to_owned())
}

fn processor() -> Option<String> {
    let text = read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

/// The build string names the strongest model; a kernel that can choose shows its choice in parentheses.
fn preemption(build: &str, choice: Option<&str>) -> String {
    let chosen = choice.and_then(|models| models.split_once('(')?.1.split_once(')'));
    if let Some((model, _)) = chosen {
        return model.to_owned();
    }
    let model = build
        .split(' ')
        .find(|word| word.starts_with("PREEMPT"))
        .unwrap_or("PREEMPT_NONE or VOLUNTARY (the kernel does not say)");
    model.to_owned()
}

/// Scheduling class of a process's thread with that name.
pub(crate) fn scheduling_class(pid: u32, thread: &str) -> String {
    let class = || {
        let tasks = std::fs::read_dir(format!("/proc/{pid}/task")).ok()?;
        let stats = tasks
            .flatten()
            .filter_map(|task| read_to_string(task.path().join("stat")).ok());
        let stat = stats
            .into_iter()
            .find(|stat| stat.contains(&format!("({thread})")))?;
        class_of(&stat)
    };
    class().unwrap_or_else(|| "unknown".into())
}

/// Fields 40 and 41 of `/proc/…/stat` are the priority and the policy; the name in parentheses is field 2.
fn class_of(stat: &str) -> Option<String> {
    let fields: Vec<&str> = stat.rsplit_once(") ")?.1.split(' ').collect();
    let (priority, policy) = (fields.get(37)?, fields.get(38)?);
    Some(match *policy {
        "0" => "SCHED_OTHER".into(),
        "1" => format!("SCHED_FIFO {priority}"),
        "2" => format!("SCHED_RR {priority}"),
        other => format!("policy {other}"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scheduling_class_is_read_behind_the_name() {
        let numbers: Vec<String> = (3..=52).map(|field: u32| field.to_string()).collect();
        let stat = format!("7 (a b) c) {}", numbers.join(" "));
        assert_eq!(class_of(&stat), Some("policy 41".into()));
        let own = scheduling_class(std::process::id(), "nobody");
        assert_eq!(own, "unknown");
    }

    #[test]
    fn the_preemption_model_is_the_one_chosen() {
        assert_eq!(
            preemption("#1 SMP PREEMPT_DYNAMIC", Some("none (full) lazy")),
            "full"
        );
        assert_eq!(preemption("#1 SMP PREEMPT_RT", None), "PREEMPT_RT");
    }
}
