//! What a section is where `robot.toml` says nothing.

use std::path::PathBuf;

use super::{
    Clock, ClockSource, Criterion, Fusion, GateWeight, Health, History, Initial, LogLevel, Motion,
    Realtime, Scheduler, Shm, Telemetry, Tick, Trigger, Variance, WaitMode,
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
            trigger: Trigger::Timer,
            wait: WaitMode::Sleep,
        }
    }
}

impl Default for Shm {
    fn default() -> Self {
        Self {
            root: PathBuf::new(),
            prefix: coloc_shm_types::places::DEFAULT_PREFIX.into(),
        }
    }
}

impl Default for Motion {
    fn default() -> Self {
        Self {
            forward: Variance {
                b: 5.075,
                ..Variance::default()
            },
            sideways: Variance::default(),
            turning: Variance {
                a: 0.345,
                ..Variance::default()
            },
            reference_period_s: 0.02,
            hold_s: 0.2,
            hold_growth: 0.5,
            outage_variance: [5.075, 5.075, 0.345],
        }
    }
}

impl Default for Initial {
    fn default() -> Self {
        Self {
            pose: [0.0; 3],
            sigma: [0.1, 0.1, 0.05],
            resume: false,
            resume_max_age_s: 60.0,
        }
    }
}

impl Default for Fusion {
    fn default() -> Self {
        Self {
            paper: false,
            criterion: Criterion::Trace,
            heading_lever_m: 4.0,
            damping: 0.5,
            memory_s: 1.0,
            reset_on_transmit: true,
            neighbour_gate: 11.344_866_730_144_373,
            gate_weight: GateWeight::Update,
            position_gate: 9.210_340_371_976_182,
            relative_pose_floor: [0.0; 3],
            neighbour_floor: [0.0; 3],
            position_floor: [0.0; 2],
        }
    }
}

impl Default for History {
    fn default() -> Self {
        Self {
            length_s: 1.0,
            future_tolerance_s: 0.1,
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
