//! The manager, sighting by sighting.

use coloc_estimator::{RobotId, Span, Stamp};
use coloc_track::manager::{MOST_TRACKS, Odometry};
use coloc_track::{
    Config, Core, Gates, Manager, Rate, Reading, Seen, Sensor, Sensors, Sighting, Status, Track,
    Verdict,
};
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;

use crate::case::{check_covariance, check_mean, from_triangle, mount, read_vectors, slow_errors};

#[derive(Deserialize)]
struct Sequence {
    meta: Meta,
    steps: Vec<Step>,
}

#[derive(Deserialize)]
struct Meta {
    dt: f64,
    T0: f64,
    sensors: Vec<Sensed>,
    config: Settings,
}

#[derive(Deserialize)]
struct Sensed {
    white: [f64; 3],
    slow: Option<[f64; 4]>,
    mount: [f64; 3],
}

#[derive(Deserialize)]
struct Settings {
    gate: f64,
    confirm_hits: u32,
    tentative_s: f64,
    coast_s: f64,
    delete_s: f64,
    tentative_rejects: u32,
    max_rejects: u32,
    max_sigma_m: f64,
    convert_sigma: f64,
    margin: f64,
    outage: [f64; 3],
}

#[derive(Deserialize)]
struct Step {
    odometry: Vec<Option<[f64; 2]>>,
    #[serde(default)]
    sightings: Vec<Given>,
    #[serde(default)]
    verdicts: Vec<Stated>,
    tracks: Vec<Expected>,
}

#[derive(Deserialize)]
struct Given {
    t: f64,
    sensor: Option<usize>,
    sequence: u64,
    id: Option<u16>,
    rho: Option<f64>,
    theta: Option<f64>,
    reciprocal: Option<f64>,
    var: Option<f64>,
}

#[derive(Deserialize)]
struct Stated {
    sequence: u64,
    verdict: String,
    d2: Option<f64>,
    assigned: Option<u16>,
}

#[derive(Deserialize)]
struct Expected {
    id: u16,
    status: String,
    mode: String,
    hits: Option<u32>,
    x: Option<Vec<f64>>,
    P: Option<Vec<f64>>,
}

impl Meta {
    fn sensors(&self) -> Sensors {
        let all: Vec<_> = self
            .sensors
            .iter()
            .map(|it| Sensor {
                mount: mount(it.mount),
                slow: it.slow.map(slow_errors),
            })
            .collect();
        Sensors::new(&all).unwrap()
    }

    fn config(&self) -> Config {
        let it = &self.config;
        let defaults = Gates::default();
        assert!((it.gate - defaults.two).abs() < 1e-12);
        Config {
            gates: defaults,
            confirm_hits: it.confirm_hits,
            tentative: Span::from_seconds(it.tentative_s),
            coast: Span::from_seconds(it.coast_s),
            delete: Span::from_seconds(it.delete_s),
            tentative_rejects: it.tentative_rejects,
            max_rejects: it.max_rejects,
            max_sigma_m: it.max_sigma_m,
            convert_sigma_rad: it.convert_sigma,
            margin: it.margin,
            outage: it.outage.map(|q| self.T0 * q),
        }
    }

    fn rate(&self, [v, omega]: [f64; 2]) -> Rate {
        let variances = Vector3::new(5.075 * v * v, 0.0, 0.345);
        Rate {
            velocity: Vector3::new(v, 0.0, omega),
            covariance_per_s: Matrix3::from_diagonal(&variances) * self.T0,
        }
    }

    fn sighting(&self, given: &Given) -> Sighting {
        let seen = match (given.reciprocal, given.sensor) {
            (Some(bearing_rad), _) => Seen::Reciprocal {
                id: RobotId(given.id.unwrap()),
                bearing_rad,
                variance: given.var.unwrap(),
            },
            (None, Some(sensor)) => Seen::Neighbour {
                id: given.id.map(RobotId),
                sensor: u16::try_from(sensor).unwrap(),
                reading: self.reading(sensor, given),
            },
            (None, None) => panic!("sighting {} of no sensor", given.sequence),
        };
        Sighting {
            stamp: Stamp::default() + Span::from_seconds(given.t),
            sequence: given.sequence,
            seen,
        }
    }

    fn reading(&self, sensor: usize, given: &Given) -> Reading {
        let [relative, absolute, bearing] = self.sensors[sensor].white;
        let range_variance = |rho: f64| (relative * rho).powi(2) + absolute * absolute;
        let bearing_variance = bearing * bearing;
        match (given.rho, given.theta) {
            (Some(rho), Some(theta)) => Reading::RangeBearing {
                range_m: rho,
                bearing_rad: theta,
                white: [range_variance(rho), bearing_variance],
            },
            (Some(rho), None) => Reading::Range {
                range_m: rho,
                white: range_variance(rho),
            },
            (None, Some(theta)) => Reading::Bearing {
                bearing_rad: theta,
                white: bearing_variance,
            },
            (None, None) => panic!("sighting {} says nothing", given.sequence),
        }
    }
}

impl Stated {
    fn check(&self, name: &str, sighting: &Sighting, verdict: Verdict) {
        assert_eq!(self.sequence, sighting.sequence, "{name}: order");
        let (word, d2) = match verdict {
            Verdict::Started => ("started", None),
            Verdict::Restarted => ("restarted", None),
            Verdict::Accepted { d2, .. } => ("accepted", Some(d2)),
            Verdict::Rejected { d2 } => ("rejected", Some(d2)),
            Verdict::Ignored => ("ignored", None),
            Verdict::Ambiguous => ("ambiguous", None),
            Verdict::Unassigned => ("unassigned", None),
            Verdict::OutOfStep => ("out of step", None),
        };
        assert_eq!(word, self.verdict, "{name}: {}", self.sequence);
        if let (Some(found), Some(stated)) = (d2, self.d2) {
            let error = (found - stated).abs();
            assert!(
                error <= 1e-6 * stated + 1e-12,
                "{name}: {}: d² {found}",
                self.sequence
            );
        }
        if let (Some(assigned), Verdict::Accepted { id, .. }) = (self.assigned, verdict) {
            assert_eq!(id, RobotId(assigned), "{name}: {}", self.sequence);
        }
    }
}

impl Expected {
    fn check(&self, name: &str, found: &Track) {
        let status = match found.status {
            Status::Tentative => "tentative",
            Status::Confirmed => "confirmed",
            Status::Coasted => "coasted",
        };
        let mode = match found.state.core {
            Core::Linear => "linear",
            Core::Heading => "heading",
        };
        assert_eq!(
            (status, mode),
            (self.status.as_str(), self.mode.as_str()),
            "{name}"
        );
        if let Some(hits) = self.hits {
            assert_eq!(found.hits, hits, "{name}");
        }
        let Some(x) = &self.x else { return };
        check_mean(name, &found.state, x, 1e-9);
        if let Some(entries) = &self.P {
            let rows = from_triangle(entries, x.len());
            check_covariance(name, &found.state, &rows, 1e-8);
        }
    }
}

fn check(file: &str) {
    let Some(sequence) = read_vectors::<Sequence>(file) else {
        return;
    };
    let meta = &sequence.meta;
    let storage = vec![None; MOST_TRACKS];
    let mut manager = Manager::new(meta.config(), meta.sensors(), Stamp::default(), storage);
    let mut heard = 0;
    for (index, step) in sequence.steps.iter().enumerate() {
        let name = format!("{file}, step {index}");
        #[allow(clippy::cast_precision_loss)] // Hundreds of steps.
        let now = Stamp::default() + Span::from_seconds(meta.dt * (index + 1) as f64);
        let rate = |id: usize| step.odometry[id].map(|it| meta.rate(it));
        let neighbours: Vec<_> = (1..step.odometry.len())
            .filter_map(|id| Some((RobotId(u16::try_from(id).unwrap()), rate(id)?)))
            .collect();
        let odometry = Odometry {
            observer: rate(0),
            neighbours: &neighbours,
        };
        let mut sightings: Vec<_> = step.sightings.iter().map(|it| meta.sighting(it)).collect();
        let mut stated = step.verdicts.iter();
        manager.step(now, &odometry, &mut sightings, |sighting, verdict| {
            stated.next().unwrap().check(&name, sighting, verdict);
            heard += 1;
        });
        assert!(stated.next().is_none(), "{name}: a verdict is missing");
        assert_eq!(
            manager.tracks().count(),
            step.tracks.len(),
            "{name}: tracks"
        );
        for expected in &step.tracks {
            let name = format!("{name}, track {}", expected.id);
            let found = manager.track(RobotId(expected.id));
            expected.check(
                &name,
                found.unwrap_or_else(|| panic!("{name} is not there")),
            );
        }
    }
    assert!(heard > 100, "{heard}");
}

#[test]
fn with_identities() {
    check("sequence_a.json");
}

#[test]
fn without_identities() {
    check("sequence_b.json");
}

#[test]
fn by_several_sensors() {
    check("sequence_c.json");
}
