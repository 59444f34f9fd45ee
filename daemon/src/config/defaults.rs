//! What a section is where `robot.toml` says nothing. What the estimator has a choice of its own for is as it chooses.

use std::path::PathBuf;

use coloc_estimator::partial::PositionSettings;
use coloc_estimator::{FusionSettings, Settings};

use super::{
    Clock, ClockSource, Criterion, Fusion, GateWeight, Health, History, Initial, InitialHeading,
    LogLevel, Mode, Partial, Position, Propagation, Realtime, Scheduler, Shm, Telemetry, Tick,
    Trigger, TrustJump, WaitMode,
};

impl Default for Clock {
    fn default() -> Self {
        Self {
            source: ClockSource::Realtime,
        }
    }
}

impl Default for Tick {
    fn default() -> Self {
        Self {
            rate_hz: 50.0,
            trigger: Trigger::Auto,
            wait: WaitMode::Sleep,
        }
    }
}

impl Default for Shm {
    fn default() -> Self {
        Self {
            root: PathBuf::new(),
            prefix: coloc_shm_types::places::DEFAULT_PREFIX.into(),
            group: String::new(),
        }
    }
}

impl Default for Initial {
    fn default() -> Self {
        Self {
            pose: None,
            heading: InitialHeading::default(),
            sigma: [0.1, 0.1, 0.05],
            resume: false,
            resume_max_age_s: 60.0,
        }
    }
}

/// Of satellites the slow error lasts for minutes.
impl Default for Position {
    fn default() -> Self {
        Self {
            receivers: 0,
            trust_jump: TrustJump::default(),
            lever_m: [0.0; 2],
            slow_sigma_m: 0.0,
            slow_time_s: 60.0,
            delay_s: 0.0,
            receiver: Vec::new(),
        }
    }
}

impl Default for Fusion {
    fn default() -> Self {
        let settings = Settings::default();
        let FusionSettings {
            heading_lever_m,
            damping,
            memory,
            reset_on_transmit,
            gate,
            ..
        } = settings.fusion;
        Self {
            mode: Mode::default(),
            paper: false,
            propagation: Propagation::default(),
            criterion: Criterion::default(),
            heading_lever_m,
            damping,
            memory_s: memory.as_seconds(),
            reset_on_transmit,
            neighbour_gate: gate,
            gate_weight: GateWeight::default(),
            position_gate: settings.position_gate,
            heading_gate: settings.heading_gate,
            position: Partial::default(),
            relative_pose_floor: [0.0; 3],
            neighbour_floor: [0.0; 3],
            position_floor: [0.0; 2],
            heading_floor: 0.0,
        }
    }
}

impl Default for Partial {
    fn default() -> Self {
        let PositionSettings {
            heading_lever_m,
            damping,
            memory,
            gate,
            gate_alone,
        } = PositionSettings::default();
        Self {
            heading_lever_m,
            damping,
            memory_s: memory.as_seconds(),
            gate,
            gate_alone,
        }
    }
}

impl Default for History {
    fn default() -> Self {
        let settings = Settings::default();
        Self {
            length_s: settings.history.as_seconds(),
            future_tolerance_s: settings.future_tolerance.as_seconds(),
            capacity: 1024,
        }
    }
}

impl Default for Health {
    fn default() -> Self {
        Self {
            odometry_stale_s: 0.1,
            relative_pose_stale_s: 1.0,
            position_stale_s: 1.0,
            neighbours_stale_s: 1.0,
            fit_position_m: 0.0,
            fit_heading_rad: 0.0,
        }
    }
}

impl Default for Realtime {
    fn default() -> Self {
        Self {
            scheduler: Scheduler::Fifo,
            priority: 80,
            cpus: Vec::new(),
            lock_memory: true,
            prefault_stack_kib: 256,
            required: false,
        }
    }
}

impl Default for Telemetry {
    fn default() -> Self {
        Self {
            log: LogLevel::Info,
            log_file: PathBuf::new(),
            state_file: PathBuf::new(),
            state_hz: 1.0,
            record: PathBuf::new(),
            watchdog_ticks: 10,
        }
    }
}
