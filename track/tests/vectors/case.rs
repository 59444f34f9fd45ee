//! Finds and reads the vectors, and what all cases have in common.

use std::path::{Path, PathBuf};
use std::{env, fs};

use coloc_estimator::Pose;
use coloc_estimator::angle::wrap;
use coloc_track::{Core, Sensor, Sensors, SlowErrors, State};
use serde::de::DeserializeOwned;

/// The vectors in `tracking/<file>`; `None`, and a loud line, on a machine that does not have them.
///
/// # Panics
/// If the file is there but is not what the test expects: that must not pass for a missing file.
pub(crate) fn read_vectors<T: DeserializeOwned>(file: &str) -> Option<T> {
    let Some(directory) = directory() else {
        eprintln!(
            "SKIPPED: no test vectors; set COLOC_VECTORS to the directory that holds tracking/{file}"
        );
        return None;
    };
    let path = directory.join("tracking").join(file);
    let text =
        fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    Some(serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display())))
}

/// `COLOC_VECTORS`, else `shared/vectors` beside the repository or above it.
fn directory() -> Option<PathBuf> {
    if let Some(given) = env::var_os("COLOC_VECTORS") {
        return Some(given.into());
    }
    let above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
    above
        .map(|parent| parent.join("shared/vectors"))
        .find(|candidate| candidate.is_dir())
}

/// A state of the numbers that are there, in their order.
pub(crate) fn state(core: Core, x: &[f64], P: &[Vec<f64>]) -> State {
    let of_core = if core == Core::Linear { 4 } else { 3 };
    let mut state = State {
        core,
        slow: (x.len() - of_core) / 2,
        ..State::default()
    };
    let places: Vec<usize> = state.places().collect();
    assert_eq!(places.len(), x.len());
    for (i, &row) in places.iter().enumerate() {
        state.mean[row] = x[i];
        for (j, &column) in places.iter().enumerate() {
            state.covariance[(row, column)] = P[i][j];
        }
    }
    state
}

/// Row by row, of the upper triangle.
pub(crate) fn from_triangle(entries: &[f64], size: usize) -> Vec<Vec<f64>> {
    let mut rows = vec![vec![0.0; size]; size];
    let mut next = entries.iter();
    for (i, j) in (0..size).flat_map(|i| (i..size).map(move |j| (i, j))) {
        let entry = *next.next().unwrap();
        (rows[i][j], rows[j][i]) = (entry, entry);
    }
    assert!(next.next().is_none());
    rows
}

pub(crate) fn core(name: &str) -> Core {
    match name {
        "heading" => Core::Heading,
        "linear" => Core::Linear,
        other => panic!("{other}"),
    }
}

pub(crate) fn mount([x, y, phi]: [f64; 3]) -> Pose {
    Pose::new(x, y, phi)
}

pub(crate) fn slow_errors(
    [range_sigma, range_tau_s, bearing_sigma, bearing_tau_s]: [f64; 4],
) -> SlowErrors {
    SlowErrors {
        range_sigma,
        range_tau_s,
        bearing_sigma,
        bearing_tau_s,
    }
}

/// `count` sensors with slow errors, all at the same place.
pub(crate) fn sensors(count: usize, at: [f64; 3], slow: SlowErrors) -> Sensors {
    let one = Sensor {
        mount: mount(at),
        slow: Some(slow),
    };
    Sensors::new(&vec![one; count]).unwrap()
}

/// The mean within `tolerance` max(1, |x|), the heading on the circle.
pub(crate) fn check_mean(name: &str, found: &State, expected: &[f64], tolerance: f64) {
    let places: Vec<usize> = found.places().collect();
    assert_eq!(places.len(), expected.len(), "{name}");
    for (&place, &value) in places.iter().zip(expected) {
        let error = found.mean[place] - value;
        let is_angle = found.core == Core::Heading && place == 2;
        let error = if is_angle { wrap(error) } else { error };
        let allowed = tolerance * value.abs().max(1.0);
        assert!(
            error.abs() <= allowed,
            "{name}: x[{place}] off by {error:e}"
        );
    }
}

/// Every entry within `tolerance` of the deviations concerned.
pub(crate) fn check_covariance(name: &str, found: &State, expected: &[Vec<f64>], tolerance: f64) {
    let places: Vec<usize> = found.places().collect();
    let sigma = |i: usize| expected[i][i].max(0.0).sqrt();
    for (i, &row) in places.iter().enumerate() {
        for (j, &column) in places.iter().enumerate() {
            let error = (found.covariance[(row, column)] - expected[i][j]).abs();
            let allowed = tolerance * sigma(i) * sigma(j) + 1e-18;
            assert!(
                error <= allowed,
                "{name}: P[{i}][{j}] off by {error:e}, {allowed:e} allowed"
            );
        }
    }
}
