//! What the sensors and the radio are like: the paper's Table 2, and the ways in which life differs from it.

use serde::Serialize;

/// A setting to evaluate in.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Scenario {
    /// What to call it on the command line.
    pub name: &'static str,
    /// What it is, in a line.
    pub description: &'static str,
    /// Robots that see one another.
    pub sightings: Sightings,
    /// Satellite fixes.
    pub fixes: Fixes,
    /// Gross errors in sightings and fixes.
    pub outliers: Option<Outliers>,
    /// What the radio does to messages.
    pub radio: Radio,
    /// Silences of the wheel encoders.
    pub drop_outs: Option<DropOuts>,
    /// What the filters believe of the odometry noise.
    pub odometry: Odometry,
    /// And by how much it is multiplied.
    pub noise_factor: f64,
    /// How many robots a synthetic world has; a recording has those that it has.
    pub synthetic_robots: usize,
}

/// Relative poses.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sightings {
    /// \[Hz\]
    pub rate_hz: f64,
    /// How far a robot sees \[m\].
    pub range_m: f64,
    /// Standard deviations of δx, δy, δφ \[m, m, rad\].
    pub sigma: [f64; 3],
    /// Whether robots see only those with a higher number, so that help flows one way.
    pub one_way: bool,
}

/// Satellite fixes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fixes {
    /// \[Hz\]
    pub rate_hz: f64,
    /// Robots that have a receiver, from 0.
    pub robots: Vec<usize>,
    /// Standard deviation of x and of y \[m\].
    pub sigma_m: f64,
    /// Length of a silence in the middle of the run \[s\].
    pub outage_s: f64,
}

/// Errors added to the position of a sighting or a fix, in a direction at random.
#[derive(Copy, Clone, Debug, PartialEq, Serialize)]
pub struct Outliers {
    /// Share of measurements that have one.
    pub probability: f64,
    /// Shortest and longest \[m\], uniform between.
    pub size_m: [f64; 2],
}

/// What happens to messages between robots.
#[derive(Copy, Clone, Debug, Default, PartialEq, Serialize)]
pub struct Radio {
    /// Share of messages that never arrive.
    pub loss: f64,
    /// Shortest and longest time under way \[s\], uniform between.
    pub delay_s: [f64; 2],
}

/// What filters believe of the wheels.
#[derive(Copy, Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Odometry {
    /// Table 2: no slip, and no noise at standstill.
    Paper,
    /// That they slip sideways and roll on after a stop: without it a joint filter is overconfident.
    Slip,
}

/// Silences of the odometry.
#[derive(Copy, Clone, Debug, PartialEq, Serialize)]
pub struct DropOuts {
    /// There is one in every such period \[s\], at a time at random.
    pub every_s: f64,
    /// Shortest and longest \[s\], uniform between.
    pub length_s: [f64; 2],
}

impl Default for Scenario {
    fn default() -> Self {
        Self::paper()
    }
}

impl Scenario {
    /// Table 2 of the paper.
    #[must_use]
    pub fn paper() -> Self {
        Self {
            name: "paper",
            description: "the paper's Table 2: relative poses and fixes at 10 Hz, range 10 m, DGPS on R1 and R2",
            sightings: Sightings {
                rate_hz: 10.0,
                range_m: 10.0,
                sigma: [0.1, 0.1, 1.0_f64.to_radians()],
                one_way: false,
            },
            fixes: Fixes {
                rate_hz: 10.0,
                robots: vec![0, 1],
                sigma_m: 0.1,
                outage_s: 0.0,
            },
            outliers: None,
            radio: Radio::default(),
            drop_outs: None,
            odometry: Odometry::Paper,
            noise_factor: 1.0,
            synthetic_robots: 5,
        }
    }

    /// Every named scenario, the paper's first.
    #[must_use]
    pub fn all() -> Vec<Self> {
        let (paper, mut all) = (Self::paper(), vec![Self::paper()]);
        let mut add = |name, description, change: &dyn Fn(&mut Self)| {
            let mut scenario = Self {
                name,
                description,
                ..paper.clone()
            };
            change(&mut scenario);
            all.push(scenario);
        };
        add("slow", "relative poses at 2 Hz", &|s| {
            s.sightings.rate_hz = 2.0;
        });
        add("near", "robots see 4 m far", &|s| s.sightings.range_m = 4.0);
        add(
            "one-way",
            "robots see only those with a higher number",
            &|s| s.sightings.one_way = true,
        );
        add("lossy", "half of all messages are lost", &|s| {
            s.radio.loss = 0.5;
        });
        add("delayed", "messages take 0 to 400 ms", &|s| {
            s.radio.delay_s = [0.0, 0.4];
        });
        add("one-dgps", "DGPS on R1 only", &|s| s.fixes.robots = vec![0]);
        add(
            "one-dgps-slow",
            "DGPS on R1 only, relative poses at 2 Hz",
            &|s| {
                s.fixes.robots = vec![0];
                s.sightings.rate_hz = 2.0;
            },
        );
        add(
            "dgps-outage",
            "no fixes for 60 s in the middle of the run",
            &|s| s.fixes.outage_s = 60.0,
        );
        add(
            "outliers",
            "2 % of sightings and fixes are off by 3 to 5 m",
            &|s| {
                s.outliers = Some(Outliers {
                    probability: 0.02,
                    size_m: [3.0, 5.0],
                });
            },
        );
        add("ten-robots", "ten robots (synthetic world only)", &|s| {
            s.synthetic_robots = 10;
        });
        add(
            "drop-outs",
            "odometry silent for 0.2 to 1.4 s once in every 10 s",
            &|s| {
                s.drop_outs = Some(DropOuts {
                    every_s: 10.0,
                    length_s: [0.2, 1.4],
                });
            },
        );
        add(
            "slip",
            "filters believe that wheels slip sideways and roll on: 5e-3 + 5.075 v², sideways 1e-3",
            &|s| s.odometry = Odometry::Slip,
        );
        add("slip-one-dgps", "the same, DGPS on R1 only", &|s| {
            s.odometry = Odometry::Slip;
            s.fixes.robots = vec![0];
        });
        add(
            "slip-lossy",
            "the same with DGPS on R1 and R2, three of ten messages lost",
            &|s| {
                s.odometry = Odometry::Slip;
                s.radio.loss = 0.3;
            },
        );
        add(
            "q-small",
            "filters believe odometry noise five times too small",
            &|s| s.noise_factor = 0.2,
        );
        add(
            "q-large",
            "filters believe odometry noise five times too large",
            &|s| s.noise_factor = 5.0,
        );
        all
    }

    /// The scenario of that name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::all()
            .into_iter()
            .find(|scenario| scenario.name == name)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn names_are_unique_and_find_their_scenario() {
        let all = Scenario::all();
        assert_eq!(
            all.iter()
                .map(|scenario| scenario.name)
                .collect::<BTreeSet<_>>()
                .len(),
            all.len()
        );
        assert!(
            all.iter()
                .all(|scenario| Scenario::named(scenario.name).as_ref() == Some(scenario))
        );
    }

    #[test]
    fn every_scenario_differs_from_the_papers() {
        for scenario in Scenario::all().into_iter().skip(1) {
            let renamed = Scenario {
                name: "paper",
                description: Scenario::paper().description,
                ..scenario
            };
            assert_ne!(renamed, Scenario::paper());
        }
    }
}
