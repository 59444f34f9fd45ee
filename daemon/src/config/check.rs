//! What is allowed: every value by itself, then the values against one another.

use std::ops::RangeInclusive;

use coloc_drivers::encoder::{ConfigError, OdometryDecoder};

use super::error::Refusal;
use super::{
    Config, Fusion, Health, History, Initial, Motion, Realtime, Scheduler, Shm, Telemetry, WaitMode,
};

type Checked = Result<(), Refusal>;

/// The middleware's own limit on a path is 255 bytes; its file names need the rest.
const LONGEST_ROOT: usize = 100;

/// Refuses the first value that is not allowed.
///
/// # Errors
/// Its key, value and what is allowed.
pub fn check(config: &Config) -> Checked {
    team(config)?;
    seconds("clock.step_s", config.clock.step_s, 1e-4..=0.9)?;
    within("tick.rate_hz", config.tick.rate_hz, 1.0..=1000.0)?;
    shm(&config.shm)?;
    odometry(config)?;
    motion(&config.motion)?;
    initial(&config.initial)?;
    fusion(&config.fusion)?;
    history(&config.history, config.tick.rate_hz)?;
    health(&config.health)?;
    realtime(&config.realtime)?;
    polling(config)?;
    telemetry(&config.telemetry)
}

fn refuse(key: &str, value: impl std::fmt::Display, allowed: &str) -> Checked {
    Err(Refusal {
        key: key.into(),
        problem: format!(" = {value}: {allowed}"),
    })
}

fn within(key: &str, value: f64, allowed: RangeInclusive<f64>) -> Checked {
    if allowed.contains(&value) {
        return Ok(());
    }
    refuse(
        key,
        value,
        &format!("must be in {}..={}", allowed.start(), allowed.end()),
    )
}

fn seconds(key: &str, value: f64, allowed: RangeInclusive<f64>) -> Checked {
    if allowed.contains(&value) {
        return Ok(());
    }
    refuse(
        key,
        value,
        &format!("must be in {}..={} seconds", allowed.start(), allowed.end()),
    )
}

fn not_negative(key: &str, value: f64) -> Checked {
    if value.is_finite() && value >= 0.0 {
        return Ok(());
    }
    refuse(key, value, "must be a finite number, 0 or more")
}

fn prefix(key: &str, value: &str) -> Checked {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
    if (1..=16).contains(&value.len()) && value.chars().all(plain) {
        return Ok(());
    }
    refuse(
        key,
        format!("{value:?}"),
        "must be 1 to 16 letters, digits or `_`",
    )
}

fn team(config: &Config) -> Checked {
    let team = &config.team;
    for (index, member) in team.iter().enumerate() {
        let is_me = (
            member.id == config.robot.id,
            member.name == config.robot.name,
        );
        match is_me {
            (true, false) => refuse(
                &format!("team.{index}.id"),
                member.id,
                &format!("is the number of this robot, `{}`", config.robot.name),
            )?,
            (false, true) => refuse(
                &format!("team.{index}.id"),
                member.id,
                &format!("this robot is number {} in [robot]", config.robot.id),
            )?,
            _ => {}
        }
        let earlier = &team[..index];
        if let Some(other) = earlier.iter().find(|other| other.id == member.id) {
            refuse(
                &format!("team.{index}.id"),
                member.id,
                &format!(
                    "is already the number of `{}`; numbers must differ",
                    other.name
                ),
            )?;
        }
        if earlier.iter().any(|other| other.name == member.name) {
            refuse(
                &format!("team.{index}.name"),
                format!("`{}`", member.name),
                "is listed twice; names must differ",
            )?;
        }
    }
    Ok(())
}

fn shm(shm: &Shm) -> Checked {
    let root = shm.root.display();
    if shm.root.as_os_str().is_empty() {
        // The default place, which is found when it is wanted.
    } else if !shm.root.is_absolute() {
        refuse("shm.root", root, "must be an absolute path")?;
    } else if shm.root.as_os_str().len() > LONGEST_ROOT {
        refuse(
            "shm.root",
            root,
            &format!(
                "must be at most {LONGEST_ROOT} bytes long: the middleware limits paths to 255"
            ),
        )?;
    }
    prefix("shm.prefix", &shm.prefix)
}

/// Whether the signals are in the DBC file and make sense together is the decoder's to say.
fn odometry(config: &Config) -> Checked {
    let Some(Err(error)) = config.odometry.as_ref().map(OdometryDecoder::new) else {
        return Ok(());
    };
    Err(match error {
        ConfigError::Setting { setting, problem } => Refusal {
            key: format!("odometry.{setting}"),
            problem: format!(": {problem}"),
        },
        other => Refusal {
            key: "odometry".into(),
            problem: format!(": {other}"),
        },
    })
}

fn motion(motion: &Motion) -> Checked {
    let noises = [
        ("forward", motion.forward),
        ("sideways", motion.sideways),
        ("turning", motion.turning),
    ];
    for (axis, variance) in noises {
        for (coefficient, value) in [("a", variance.a), ("b", variance.b), ("c", variance.c)] {
            not_negative(&format!("motion.{axis}.{coefficient}"), value)?;
        }
    }
    seconds(
        "motion.reference_period_s",
        motion.reference_period_s,
        1e-4..=10.0,
    )?;
    seconds("motion.hold_s", motion.hold_s, 0.0..=60.0)?;
    not_negative("motion.hold_growth", motion.hold_growth)?;
    motion
        .outage_variance
        .iter()
        .enumerate()
        .try_for_each(|(axis, &sigma)| {
            not_negative(&format!("motion.outage_variance.{axis}"), sigma)
        })
}

fn initial(initial: &Initial) -> Checked {
    for (axis, &value) in initial.pose.iter().enumerate() {
        within(&format!("initial.pose.{axis}"), value, -1e9..=1e9)?;
    }
    for (axis, &sigma) in initial.sigma.iter().enumerate() {
        within(&format!("initial.sigma.{axis}"), sigma, 0.0..=1e6)?;
    }
    seconds(
        "initial.resume_max_age_s",
        initial.resume_max_age_s,
        0.0..=86_400.0,
    )
}

fn fusion(fusion: &Fusion) -> Checked {
    if !(fusion.damping > 0.0 && fusion.damping <= 1.0) {
        refuse(
            "fusion.damping",
            fusion.damping,
            "must be above 0 and at most 1",
        )?;
    }
    within("fusion.heading_lever_m", fusion.heading_lever_m, 0.0..=1e3)?;
    seconds("fusion.memory_s", fusion.memory_s, 0.0..=3600.0)?;
    for (key, gate) in [
        ("fusion.neighbour_gate", fusion.neighbour_gate),
        ("fusion.position_gate", fusion.position_gate),
    ] {
        // Infinity is a legal gate: it lets everything through.
        if gate.is_nan() || gate <= 0.0 {
            refuse(key, gate, "must be above 0; inf accepts everything")?;
        }
    }
    Ok(())
}

fn history(history: &History, rate_hz: f64) -> Checked {
    seconds("history.length_s", history.length_s, 0.0..=60.0)?;
    seconds(
        "history.future_tolerance_s",
        history.future_tolerance_s,
        0.0..=1.0,
    )?;
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // At most 60 s × 1 kHz × 2.
    let least = 64.max((2.0 * history.length_s * rate_hz).ceil() as usize);
    if !(least..=1 << 20).contains(&history.capacity) {
        let allowed = format!(
            "must be in {least}..={}: two places for every tick of history.length_s",
            1 << 20
        );
        refuse("history.capacity", history.capacity, &allowed)?;
    }
    Ok(())
}

fn health(health: &Health) -> Checked {
    seconds(
        "health.odometry_stale_s",
        health.odometry_stale_s,
        1e-3..=60.0,
    )?;
    seconds(
        "health.relative_pose_stale_s",
        health.relative_pose_stale_s,
        1e-3..=3600.0,
    )?;
    seconds(
        "health.position_stale_s",
        health.position_stale_s,
        1e-3..=3600.0,
    )?;
    seconds(
        "health.neighbours_stale_s",
        health.neighbours_stale_s,
        1e-3..=3600.0,
    )
}

/// The kernel takes a real-time thread that never sleeps off its processor for 50 ms of every second.
fn polling(config: &Config) -> Checked {
    if config.tick.wait == WaitMode::Poll && config.realtime.scheduler != Scheduler::Other {
        refuse(
            "tick.wait",
            "\"poll\"",
            "needs realtime.scheduler = \"other\": the kernel stops a real-time thread that never sleeps for 50 ms of every second",
        )?;
    }
    Ok(())
}

fn realtime(realtime: &Realtime) -> Checked {
    if realtime.scheduler != Scheduler::Other && !(1..=99).contains(&realtime.priority) {
        refuse("realtime.priority", realtime.priority, "must be in 1..=99")?;
    }
    for (index, &cpu) in realtime.cpus.iter().enumerate() {
        if cpu >= 1024 {
            refuse(
                &format!("realtime.cpus.{index}"),
                cpu,
                "must be in 0..=1023",
            )?;
        }
    }
    if !(16..=6144).contains(&realtime.prefault_stack_kib) {
        refuse(
            "realtime.prefault_stack_kib",
            realtime.prefault_stack_kib,
            "must be in 16..=6144",
        )?;
    }
    Ok(())
}

fn telemetry(telemetry: &Telemetry) -> Checked {
    within("telemetry.state_hz", telemetry.state_hz, 0.1..=100.0)?;
    if telemetry.watchdog_ticks < 2 {
        refuse(
            "telemetry.watchdog_ticks",
            telemetry.watchdog_ticks,
            "must be 2 or more",
        )?;
    }
    Ok(())
}
