//! Who else had the processors meanwhile, and whether figures of such a time are worth anything.

use std::collections::HashMap;
use std::fs::{read_dir, read_to_string};

use serde::Serialize;

/// The kernel counts in these \[ms\]: `USER_HZ` is 100 on every architecture that matters.
const TICK_MS: u64 = 10;
/// Others with more of the processors' time than this make figures that are theirs.
const MOST_OTHERS: f64 = 0.05;
/// A host that takes more than this.
const MOST_STOLEN: f64 = 0.001;
/// So many programs are named.
const NAMED: usize = 3;

/// What the kernel had counted at a moment \[ticks\].
pub(crate) struct Snapshot {
    all: Times,
    programs: HashMap<u32, Program>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Times {
    busy: u64,
    idle: u64,
    stolen: u64,
}

struct Program {
    name: String,
    ticks: u64,
}

/// Between two moments; of several such times the sum.
#[derive(Clone, Debug, Default, Serialize)]
#[allow(clippy::struct_field_names)] // The unit belongs to the name.
pub(crate) struct Busy {
    /// All processors', busy or not \[ms\].
    pub(crate) time_ms: u64,
    /// For how long they ran neither this command nor what it has started \[ms\].
    pub(crate) others_ms: u64,
    /// For how long a host ran something else on them \[ms\].
    pub(crate) stolen_ms: u64,
    /// Whose it was, as far as they lived at its end \[ms\].
    pub(crate) programs_ms: HashMap<String, u64>,
}

impl Snapshot {
    pub(crate) fn take() -> Self {
        let stat = read_to_string("/proc/stat").unwrap_or_default();
        let entries = read_dir("/proc").into_iter().flatten().flatten();
        let numbers = entries.filter_map(|entry| entry.file_name().to_str()?.parse().ok());
        Self {
            all: stat.lines().next().and_then(times).unwrap_or_default(),
            programs: numbers
                .filter_map(|pid| Some((pid, program(pid)?)))
                .collect(),
        }
    }

    /// What has been since, apart from this process and `own` ones.
    pub(crate) fn until(&self, now: &Self, own: &[u32]) -> Busy {
        let before = |pid: &u32| self.programs.get(pid).map_or(0, |program| program.ticks);
        let grown = |(pid, program): (&u32, &Program)| program.ticks.saturating_sub(before(pid));
        let is_own = |pid: &u32| *pid == std::process::id() || own.contains(pid);
        let (ours, others): (Vec<_>, Vec<_>) =
            now.programs.iter().partition(|(pid, _)| is_own(pid));
        let ours: u64 = ours.into_iter().map(grown).sum();
        let mut programs_ms = HashMap::new();
        for (pid, program) in others {
            let grown = TICK_MS * grown((pid, program));
            if grown > 0 {
                *programs_ms.entry(program.name.clone()).or_default() += grown;
            }
        }
        let [busy, idle, stolen] = self.all.until(&now.all);
        Busy {
            time_ms: TICK_MS * (busy + idle + stolen),
            others_ms: TICK_MS * busy.saturating_sub(ours),
            stolen_ms: TICK_MS * stolen,
            programs_ms,
        }
    }
}

impl Times {
    fn until(self, now: &Self) -> [u64; 3] {
        [
            now.busy.saturating_sub(self.busy),
            now.idle.saturating_sub(self.idle),
            now.stolen.saturating_sub(self.stolen),
        ]
    }
}

impl Busy {
    /// Counts another time as well.
    pub(crate) fn add(&mut self, more: &Self) {
        self.time_ms += more.time_ms;
        self.others_ms += more.others_ms;
        self.stolen_ms += more.stolen_ms;
        for (name, ms) in &more.programs_ms {
            *self.programs_ms.entry(name.clone()).or_default() += ms;
        }
    }

    /// In words.
    pub(crate) fn describe(&self) -> String {
        let mut named: Vec<_> = self.programs_ms.iter().collect();
        named.sort_by_key(|(name, ms)| (std::cmp::Reverse(**ms), (*name).clone()));
        let named = named.into_iter().take(NAMED);
        let named: Vec<String> = named
            .map(|(name, ms)| format!("{name} {:.1} %", 100.0 * self.part(*ms)))
            .collect();
        format!(
            "others had {:.1} % of the processors' time{}{}   the host took {} ms",
            100.0 * self.part(self.others_ms),
            if named.is_empty() { "" } else { ", of it " },
            named.join(", "),
            self.stolen_ms
        )
    }

    /// What is wrong with figures of that time; nothing if they are worth comparing.
    pub(crate) fn objections(&self) -> Vec<&'static str> {
        let mut objections = Vec::new();
        if self.time_ms == 0 {
            objections.push("the kernel does not say who was busy");
        }
        if self.part(self.others_ms) > MOST_OTHERS {
            objections.push("other programs were busy");
        }
        if self.part(self.stolen_ms) > MOST_STOLEN {
            objections.push("the host took the processors away");
        }
        objections
    }

    #[allow(clippy::cast_precision_loss)] // Milliseconds of a day are far below 2^53.
    fn part(&self, ms: u64) -> f64 {
        ms as f64 / self.time_ms.max(1) as f64
    }
}

/// `cpu user nice system idle iowait irq softirq steal …`, of all processors.
fn times(line: &str) -> Option<Times> {
    let ticks: Option<Vec<u64>> = line
        .strip_prefix("cpu ")?
        .split_whitespace()
        .map(|word| word.parse().ok())
        .collect();
    let [user, nice, system, idle, waiting, irq, softirq, stolen, ..] = ticks?[..] else {
        return None;
    };
    Some(Times {
        busy: user + nice + system + irq + softirq,
        idle: idle + waiting,
        stolen,
    })
}

fn program(pid: u32) -> Option<Program> {
    program_of(&read_to_string(format!("/proc/{pid}/stat")).ok()?)
}

/// `pid (name) state …`; fields 14 and 15 are its own time and the kernel's for it. A name may hold anything.
fn program_of(stat: &str) -> Option<Program> {
    let (head, tail) = stat.rsplit_once(") ")?;
    let (_, name) = head.split_once('(')?;
    let mut times = tail
        .split(' ')
        .skip(11)
        .map_while(|it| it.parse::<u64>().ok());
    Some(Program {
        name: name.into(),
        ticks: times.next()? + times.next()?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINE: &str = "cpu  100 1 50 800 9 2 3 4 0 0";

    fn stat(name: &str, user: u64, system: u64) -> String {
        format!("7 ({name}) S 1 1 1 0 -1 4194560 10 0 0 0 {user} {system} 0 0 20 0 1 0 5")
    }

    fn snapshot(all: Times, programs: [(u32, u64); 3]) -> Snapshot {
        let programs = programs.into_iter().map(|(pid, ticks)| {
            let name = format!("program {pid}");
            (pid, Program { name, ticks })
        });
        Snapshot {
            all,
            programs: programs.collect(),
        }
    }

    #[test]
    fn the_kernels_lines_are_read() {
        let wanted = Times {
            busy: 156,
            idle: 809,
            stolen: 4,
        };
        assert_eq!(times(LINE), Some(wanted));
        assert_eq!(times("cpu0 1 2 3 4 5 6 7 8"), None);
        let program = program_of(&stat("a (b) c", 30, 12)).unwrap();
        assert_eq!((program.name.as_str(), program.ticks), ("a (b) c", 42));
        assert!(program_of("7 (a) S 1").is_none());
    }

    #[test]
    fn what_is_not_ours_is_the_others() {
        let times = |busy, idle| Times {
            busy,
            idle,
            stolen: 0,
        };
        let before = snapshot(times(1000, 5000), [(10, 100), (11, 5), (12, 700)]);
        let after = snapshot(times(1100, 5900), [(10, 130), (11, 5), (12, 760)]);
        let busy = before.until(&after, &[10]);
        assert_eq!((busy.time_ms, busy.others_ms), (10_000, 700));
        let named: Vec<_> = busy.programs_ms.iter().collect();
        assert_eq!(named, [(&"program 12".to_owned(), &600)]);
        assert_eq!(busy.objections(), ["other programs were busy"]);
    }

    #[test]
    fn an_idle_machine_has_nothing_against_it() {
        let mut busy = Busy {
            time_ms: 10_000,
            others_ms: 400,
            ..Busy::default()
        };
        assert!(busy.objections().is_empty());
        busy.add(&Busy {
            time_ms: 10_000,
            stolen_ms: 30,
            ..Busy::default()
        });
        assert_eq!(busy.objections(), ["the host took the processors away"]);
        assert_eq!(Busy::default().objections().len(), 1);
    }

    #[test]
    fn this_machine_says_who_is_busy() {
        let before = Snapshot::take();
        assert!(before.programs.contains_key(&std::process::id()));
        let busy = before.until(&Snapshot::take(), &[]);
        assert!(busy.describe().starts_with("others had "));
    }
}
