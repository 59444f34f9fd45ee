//! What `colocd check` says it understood: one line a subject.

use std::fmt;

use coloc_drivers::encoder::describe;

use super::{Config, Scheduler};

/// A configuration in a short readable form.
#[derive(Copy, Clone, Debug)]
pub struct Summary<'a>(pub &'a Config);

impl fmt::Display for Summary<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let c = self.0;
        writeln!(
            f,
            "robot     {} (number {}), {} in the team",
            c.robot.name,
            c.robot.id,
            c.peers().count() + 1
        )?;
        writeln!(
            f,
            "clock     {:?}, a step is anything beyond {} ms",
            c.clock.source,
            c.clock.step_s * 1e3
        )?;
        writeln!(
            f,
            "tick      {} Hz, started by {:?}, waited for by {:?}",
            c.tick.rate_hz, c.tick.trigger, c.tick.wait
        )?;
        self.shm(f)?;
        writeln!(f, "wheels    {}", self.wheels())?;
        self.signals(f)?;
        self.estimator(f)?;
        self.realtime(f)
    }
}

impl Summary<'_> {
    fn shm(self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let prefix = &self.0.shm.prefix;
        match self.0.shm_root() {
            Ok(root) => writeln!(f, "shm       {root}, prefix {prefix}"),
            Err(problem) => writeln!(f, "shm       {problem}"),
        }
    }

    fn wheels(self) -> String {
        let Some(odometry) = &self.0.odometry else {
            return "none".into();
        };
        let buses: Vec<_> = odometry.buses.iter().map(ToString::to_string).collect();
        let dbc = odometry
            .dbc
            .as_ref()
            .map_or("coloc's own frames".into(), |dbc| dbc.display().to_string());
        format!(
            "{}, {dbc}, at most {} m/s",
            buses.join(" and "),
            odometry.max_speed_mps
        )
    }

    /// Every signal as it will be read, and what is unlikely about them.
    fn signals(self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let odometry = self.0.odometry.as_ref();
        let Some(Ok(description)) = odometry.map(describe) else {
            return Ok(());
        };
        for signal in &description.signals {
            writeln!(f, "          {signal}")?;
        }
        for warning in &description.warnings {
            writeln!(f, "warning   odometry.{warning}")?;
        }
        Ok(())
    }

    fn estimator(self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let c = self.0;
        let ([x, y, phi], [sx, sy, sphi]) = (c.initial.pose, c.initial.sigma);
        writeln!(
            f,
            "initial   ({x} ± {sx} m, {y} ± {sy} m, {phi} ± {sphi} rad){}",
            if c.initial.resume {
                ", or the saved belief"
            } else {
                ""
            }
        )?;
        let fusion = &c.fusion;
        let method = if fusion.paper {
            "the paper's".into()
        } else {
            format!(
                "damping {} with a memory of {} s, reset on transmit {}",
                fusion.damping, fusion.memory_s, fusion.reset_on_transmit
            )
        };
        writeln!(
            f,
            "fusion    {:?}, {method}, gates {:.4} and {:.4}",
            fusion.criterion, fusion.neighbour_gate, fusion.position_gate
        )?;
        writeln!(
            f,
            "history   {} s, {} measurements",
            c.history.length_s, c.history.capacity
        )
    }

    fn realtime(self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let r = &self.0.realtime;
        let class = match r.scheduler {
            Scheduler::Other => "ordinary scheduling".into(),
            class => format!("{class:?} {}", r.priority),
        };
        let memory = if r.lock_memory {
            "memory locked"
        } else {
            "memory not locked"
        };
        write!(
            f,
            "realtime  {class}, cpus {}, {memory}, {}",
            cpus(&r.cpus),
            if r.required {
                "required"
            } else {
                "as far as granted"
            }
        )
    }
}

fn cpus(cpus: &[usize]) -> String {
    if cpus.is_empty() {
        "any".into()
    } else {
        format!("{cpus:?}")
    }
}
