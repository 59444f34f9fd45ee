//! A drive, slot by slot: what the robots' sensors say, what the team's filter believes of it, and what the monitor makes of it.

use std::f64::consts::TAU;

use coloc_bounds::AngleInterval;
use coloc_bounds::evidence::{Area, Evidence, Gather, Seen};
use coloc_bounds::monitor::{Monitor, Outcome};
use coloc_estimator::{Belief, Covariance3, Pose};

use super::setting::{SLOT_S, SLOT_STEPS, Setting, WHEELS, monitor};
use crate::method::{self, FilterSettings, Kind};
use crate::random::{Noise, Purpose};
use crate::scenario::Scenario;
use crate::sensors::{Fix, Sensors, Sighting, StepInputs};
use crate::world::World;

/// How well the start is known \[m, rad\].
const START: [f64; 2] = [0.5, 0.2];

/// What happened in a slot.
#[derive(Clone, Debug, Default)]
pub(super) struct Slot {
    /// At its end.
    pub(super) truth: Vec<Option<Pose>>,
    /// At its end, of the filter.
    pub(super) estimates: Vec<[f64; 2]>,
    odometry: Vec<Vec<Option<[f64; 2]>>>,
    sightings: Vec<(usize, Sighting)>,
    fixes: Vec<(usize, Fix)>,
    compasses: Vec<Option<AngleInterval>>,
}

/// A whole run.
#[derive(Clone, Debug)]
pub(super) struct Drive {
    setting: Setting,
    scenario: Scenario,
    start: Vec<Pose>,
    pub(super) slots: Vec<Slot>,
}

/// What lies, and how.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) struct Fault {
    pub(super) source: Source,
    pub(super) lie: Lie,
    /// Of what is off.
    pub(super) direction_rad: f64,
}

/// How something lies.
#[derive(Copy, Clone, Debug, PartialEq)]
pub(super) enum Lie {
    /// It is off, and goes on.
    Off {
        /// At its beginning \[m\].
        metres: f64,
        /// \[m/s\]
        drift: f64,
    },
    /// It says again and again what it said last.
    Stuck,
    /// It takes each robot that it sees for another one.
    Mistaken,
}

#[derive(Copy, Clone, Debug, PartialEq, Eq)]
pub(super) enum Source {
    /// Of this robot.
    Fix(usize),
    /// All that this robot sees.
    Sightings(usize),
    /// Of this robot.
    Wheels(usize),
}

impl Fault {
    /// So many slots after its beginning \[m\].
    #[allow(clippy::cast_precision_loss)] // Minutes.
    fn off(&self, slots: usize) -> [f64; 2] {
        let Lie::Off { metres, drift } = self.lie else {
            return [0.0; 2];
        };
        let metres = metres + drift * SLOT_S * slots as f64;
        let (sin, cos) = self.direction_rad.sin_cos();
        [metres * cos, metres * sin]
    }
}

/// A direction at random, for the fault number `number` at `slot`.
pub(super) fn direction(noise: &Noise, slot: usize, number: usize) -> f64 {
    let mut draws = noise.draws(Purpose::Integrity, slot, 100 + number, 0);
    draws.uniform(0.0, TAU)
}

impl Drive {
    /// Run number `run` in `world`, at most `most` slots of it, judged by the estimates of `kind`.
    pub(super) fn new(
        world: &(impl World + ?Sized),
        setting: Setting,
        kind: Kind,
        [seed, run]: [u64; 2],
        most: usize,
    ) -> Self {
        let scenario = Scenario::paper();
        let run = u16::try_from(run).unwrap_or(u16::MAX);
        let noise = Noise::new(seed, run);
        let sensors = Sensors::new(world, &scenario, seed, run);
        let robots = 0..world.robots();
        let start: Vec<_> = robots
            .clone()
            .map(|it| world.initial(it).unwrap_or_default())
            .collect();
        let covariance = Covariance3::diagonal([0.0025, 0.0025, 0.0012]).unwrap_or_default();
        let believed: Vec<_> = start
            .iter()
            .map(|it| Belief::independent(*it, covariance))
            .collect();
        let settings = FilterSettings::new(&scenario, world.dt_s());
        let mut team = method::build(kind, &settings, &believed);
        let count = most.min((world.steps() - 1) / SLOT_STEPS);
        let mut inputs = StepInputs::default();
        let mut slots = Vec::with_capacity(count);
        for number in 0..count {
            let mut slot = Slot {
                odometry: vec![Vec::with_capacity(SLOT_STEPS); world.robots()],
                ..Slot::default()
            };
            for place in 1..=SLOT_STEPS {
                sensors.fill(number * SLOT_STEPS + place, &mut inputs);
                setting.cut(world, &scenario, &noise, &mut inputs);
                team.step(&inputs, &mut |_| ());
                for (all, now) in slot.odometry.iter_mut().zip(&inputs.odometry) {
                    all.push(*now);
                }
                slot.sightings
                    .extend(inputs.sightings.iter().map(|it| (place, *it)));
                slot.fixes
                    .extend(inputs.fixes.iter().map(|it| (place, *it)));
            }
            let end = (number + 1) * SLOT_STEPS;
            for robot in robots.clone() {
                let truth = world.truth(end, robot);
                let compass = truth.and_then(|it| setting.compass(&noise, end, robot, it.phi));
                let (pose, _) = team.estimate(robot);
                slot.truth.push(truth);
                slot.compasses.push(compass);
                slot.estimates.push([pose.x, pose.y]);
            }
            slots.push(slot);
        }
        Self {
            setting,
            scenario,
            start,
            slots,
        }
    }

    /// A monitor before the first slot.
    pub(super) fn monitor(&self) -> Monitor {
        let mut monitor = Monitor::new(self.start.len(), monitor(self.setting.means));
        for (robot, pose) in self.start.iter().enumerate() {
            let area = Area {
                centre: [pose.x, pose.y],
                half: [START[0]; 2],
            };
            monitor.place(robot, area, AngleInterval::new(pose.phi, START[1]));
        }
        monitor
    }

    /// Closes slot `number`, with a fault that began some slots ago.
    pub(super) fn close(
        &self,
        monitor: &mut Monitor,
        number: usize,
        fault: Option<(&Fault, usize)>,
    ) -> Outcome {
        let evidence: Vec<_> = (0..self.start.len())
            .map(|robot| Some(self.evidence(monitor, number, robot, fault)))
            .collect();
        // The arena of the settings is one.
        monitor.close(&evidence).unwrap_or_else(|_| unreachable!())
    }

    /// Whether `source` says anything in slot `number` that could be a lie.
    pub(super) fn says(&self, number: usize, source: Source) -> bool {
        let slot = &self.slots[number];
        match source {
            Source::Fix(robot) => slot.fixes.iter().any(|it| it.1.robot == robot),
            Source::Sightings(robot) => slot.sightings.iter().any(|it| it.1.observer == robot),
            Source::Wheels(robot) => slot.odometry[robot].iter().any(Option::is_some),
        }
    }

    /// Where the wheels of `robot` take it from `pose` in slot `number`.
    pub(super) fn driven(&self, number: usize, robot: usize, mut pose: Pose) -> Pose {
        let step_s = SLOT_S / 25.0;
        for [speed, rate] in self.slots[number].odometry[robot].iter().flatten() {
            let (sin, cos) = (pose.phi + 0.5 * rate * step_s).sin_cos();
            pose.x += speed * step_s * cos;
            pose.y += speed * step_s * sin;
            pose.phi += rate * step_s;
        }
        pose
    }

    /// For whom `observer` takes `observed`.
    fn mistaken(&self, [observer, observed]: [usize; 2]) -> usize {
        let robots = self.start.len();
        let next = (observed + 1) % robots;
        if next == observer {
            (next + 1) % robots
        } else {
            next
        }
    }

    /// What the receiver of `robot` said last before slot `first`.
    fn last_fix(&self, first: usize, robot: usize) -> Option<[f64; 2]> {
        let mut fixes = self.slots[..first]
            .iter()
            .rev()
            .flat_map(|it| it.fixes.iter().rev());
        fixes.find(|it| it.1.robot == robot).map(|it| it.1.position)
    }

    /// What `observer` last saw of `observed` before slot `first`.
    fn last_sighting(&self, first: usize, [observer, observed]: [usize; 2]) -> Option<Pose> {
        let mut seen = self.slots[..first]
            .iter()
            .rev()
            .flat_map(|it| it.sightings.iter().rev());
        seen.find(|it| [it.1.observer, it.1.observed] == [observer, observed])
            .map(|it| it.1.relative)
    }

    fn evidence(
        &self,
        monitor: &Monitor,
        number: usize,
        robot: usize,
        fault: Option<(&Fault, usize)>,
    ) -> Evidence {
        let slot = &self.slots[number];
        let off = |source| match fault {
            Some((fault, since)) if fault.source == source => fault.off(since),
            _ => [0.0; 2],
        };
        let (fix_off, seen_off) = (off(Source::Fix(robot)), off(Source::Sightings(robot)));
        let lies = |source, lie| {
            fault
                .filter(|(fault, _)| (fault.source, fault.lie) == (source, lie))
                .map(|(_, since)| number - since)
        };
        let stuck_fix =
            lies(Source::Fix(robot), Lie::Stuck).and_then(|first| self.last_fix(first, robot));
        let stuck_eyes = lies(Source::Sightings(robot), Lie::Stuck);
        let is_mistaken = lies(Source::Sightings(robot), Lie::Mistaken).is_some();
        let stuck_wheels = lies(Source::Wheels(robot), Lie::Stuck)
            .and_then(|first| *self.slots[first.checked_sub(1)?].odometry[robot].last()?);
        let Setting { sigmas, .. } = self.setting;
        let fix_half = sigmas * self.scenario.fixes.sigma_m;
        let half = self.scenario.sightings.sigma.map(|it| sigmas * it);
        let mut gather = Gather::begin(WHEELS, monitor.team.headings[robot]);
        let step_s = SLOT_S / 25.0;
        for (index, odometry) in slot.odometry[robot].iter().enumerate() {
            let place = index + 1;
            let odometry = stuck_wheels.or(*odometry);
            gather.drive(
                &odometry.map_or_else(|| WHEELS.unknown(step_s), |it| WHEELS.motion(it, step_s)),
            );
            for (_, fix) in slot
                .fixes
                .iter()
                .filter(|it| it.0 == place && it.1.robot == robot)
            {
                let [x, y] = stuck_fix.unwrap_or(fix.position);
                gather.fix(Area {
                    centre: [x + fix_off[0], y + fix_off[1]],
                    half: [fix_half; 2],
                });
            }
            for (_, seen) in slot
                .sightings
                .iter()
                .filter(|it| it.0 == place && it.1.observer == robot)
            {
                let stuck =
                    stuck_eyes.and_then(|first| self.last_sighting(first, [robot, seen.observed]));
                let relative = stuck.unwrap_or(seen.relative);
                gather.see(Seen {
                    observed: if is_mistaken {
                        self.mistaken([robot, seen.observed])
                    } else {
                        seen.observed
                    },
                    area: Area {
                        centre: [relative.x + seen_off[0], relative.y + seen_off[1]],
                        half: [half[0], half[1]],
                    },
                    turn: AngleInterval::new(relative.phi, half[2]),
                });
            }
        }
        if let Some(compass) = slot.compasses[robot] {
            gather.turn_to(compass);
        }
        gather.end().0
    }
}

/// How far `at` is inside of all half-planes of `robot` \[m\]; negative outside.
#[allow(clippy::cast_precision_loss)] // Sixteen.
pub(super) fn margin(monitor: &Monitor, robot: usize, at: [f64; 2]) -> f64 {
    let region = monitor.team.regions[robot].values();
    let angles = (0_u32..).map(|k| TAU * f64::from(k) / region.len() as f64);
    region
        .iter()
        .zip(angles)
        .map(|(support, psi)| support - psi.cos() * at[0] - psi.sin() * at[1])
        .fold(f64::INFINITY, f64::min)
}
