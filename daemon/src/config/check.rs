//! What is allowed beyond a value by itself: the values against one another, and what only a program can look up.

use coloc_drivers::encoder::{ConfigError, OdometryDecoder};
use coloc_estimator::MOST_SLOTS;

use super::{Config, History, Scheduler, WaitMode};

/// Values that are allowed each, but not so.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Refusal {
    /// Dotted key; members of an array by their number: `team.1.id`.
    pub(super) key: String,
    /// Others that are to blame where `key` was left to its default.
    pub(super) or: &'static [&'static str],
    /// A word to look for below `key`, where that is as much as is known.
    pub(super) word: Option<String>,
    /// The value and what is allowed.
    pub(super) problem: String,
}

impl Refusal {
    fn new(key: impl Into<String>, problem: impl Into<String>) -> Self {
        Self {
            key: key.into(),
            or: &[],
            word: None,
            problem: problem.into(),
        }
    }
}

/// Everything that is not allowed.
pub(super) fn check(config: &Config) -> Vec<Refusal> {
    let team = (0..config.team.len()).filter_map(|index| member(config, index));
    let rest = [
        root(config),
        prefix(config),
        odometry(config),
        capacity(config),
        polling(config),
    ];
    team.chain(rest.into_iter().flatten()).collect()
}

fn member(config: &Config, index: usize) -> Option<Refusal> {
    let (member, robot, earlier) = (&config.team[index], &config.robot, &config.team[..index]);
    let id = |problem: String| {
        let problem = format!(" = {}: {problem}", member.id);
        Some(Refusal::new(format!("team.{index}.id"), problem))
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
        Refusal::new(format!("team.{index}.name"), problem)
    })
}

fn root(config: &Config) -> Option<Refusal> {
    let root = &config.shm.root;
    let problem = format!(
        " = \"{}\": must be an absolute path, as \"/run/coloc\" is",
        root.display()
    );
    let is_default = root.as_os_str().is_empty();
    (!is_default && !root.is_absolute()).then(|| Refusal::new("shm.root", problem))
}

fn prefix(config: &Config) -> Option<Refusal> {
    let prefix = &config.shm.prefix;
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let problem = format!(" = {prefix:?}: must have letters, digits and `_` only");
    (!prefix.chars().all(plain)).then(|| Refusal::new("shm.prefix", problem))
}

/// Whether the signals are in the DBC file and make sense together is the decoder's to say.
fn odometry(config: &Config) -> Option<Refusal> {
    let error = OdometryDecoder::new(config.odometry.as_ref()?).err()?;
    let word = match &error {
        ConfigError::Setting { setting, problem } => {
            return Some(Refusal::new(
                format!("odometry.{setting}"),
                format!(": {problem}"),
            ));
        }
        ConfigError::UnknownSignal { signal, .. } | ConfigError::Signal { signal, .. } => signal,
        ConfigError::UnknownMessage { message, .. } | ConfigError::Identifier { message, .. } => {
            message
        }
        ConfigError::ReadDbc { .. }
        | ConfigError::ParseDbc { .. }
        | ConfigError::Ambiguous { .. } => {
            return Some(Refusal::new("odometry.dbc", format!(": {error}")));
        }
    };
    Some(Refusal {
        word: Some(word.clone()),
        ..Refusal::new("odometry", format!(": {error}"))
    })
}

/// What it takes to apply a measurement of the history again, where it is a neighbour's pose \[s\].
const REPLAY_S: f64 = 450e-9;

/// A history that is full forgets. One that is large makes a long tick of a late measurement: everything since is applied
/// again.
fn capacity(config: &Config) -> Option<Refusal> {
    let (history, rate_hz) = (&config.history, config.tick.rate_hz);
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    // 60 s × 1 kHz × 2; 1 s / 4 / 450 ns.
    let [least, most] = [
        (2.0 * history.length_s * rate_hz).ceil(),
        0.25 / rate_hz / REPLAY_S,
    ]
    .map(|count| count as usize);
    let most = most.min(MOST_SLOTS);
    if least > most {
        return Some(length(history, rate_hz, most));
    }
    let problem = match history.capacity {
        capacity if capacity < least => {
            format!("{least} or more, two places for every tick of history.length_s")
        }
        capacity if capacity > most => {
            format!(
                "{most} or less, for a tick to apply all of them again in a quarter of its period"
            )
        }
        _ => return None,
    };
    let problem = format!(" = {}: must be {problem}", history.capacity);
    Some(Refusal {
        or: &["history.length_s", "tick.rate_hz"],
        ..Refusal::new("history.capacity", problem)
    })
}

fn length(history: &History, rate_hz: f64, most: usize) -> Refusal {
    #[allow(clippy::cast_precision_loss)] // Thousands.
    let longest_s = most as f64 / (2.0 * rate_hz);
    let problem = format!(
        " = {}: must be {longest_s} s or less at {rate_hz} Hz: a tick can apply {most} measurements again in a quarter of \
         its period, and there are two places for each",
        history.length_s
    );
    Refusal {
        or: &["tick.rate_hz"],
        ..Refusal::new("history.length_s", problem)
    }
}

/// The kernel takes a real-time thread that never sleeps off its processor for 50 ms of every second.
fn polling(config: &Config) -> Option<Refusal> {
    let refused =
        config.tick.wait == WaitMode::Poll && config.realtime.scheduler != Scheduler::Other;
    let problem = " = \"poll\": needs realtime.scheduler = \"other\": the kernel stops a real-time thread that never \
                   sleeps for 50 ms of every second";
    refused.then(|| Refusal::new("tick.wait", problem))
}
