//! Saved beliefs: what is resumed can be believed.

use std::cell::OnceCell;
use std::path::Path;

use coloc_daemon::config::Config;
use coloc_daemon::saved::{Saved, When};
use coloc_estimator::{Belief, Bend, Covariance3, Parts, Pose};

use super::{Target, scratch};

pub(super) const TARGET: Target = Target {
    name: "belief",
    run,
    samples,
};

thread_local! {
    static CONFIG: OnceCell<Config> = const { OnceCell::new() };
}

fn run(bytes: &[u8]) {
    let path = scratch::file("belief", bytes);
    CONFIG.with(|config| {
        let config = config.get_or_init(|| configure(&path));
        let Ok(resumed) = Saved::resume(config, &at(130.0)) else {
            return;
        };
        let Belief {
            pose: Pose { x, y, phi },
            parts: Parts {
                independent,
                dependent,
            },
            bend,
        } = resumed.belief;
        let [bias, variance] = resumed.gyro.unwrap_or([0.0, 1.0]);
        let numbers = [x, y, phi, resumed.age_s, bias, variance];
        let mut numbers = numbers.into_iter().chain(bend.to_array());
        assert!(numbers.all(f64::is_finite) && variance > 0.0, "{resumed:?}");
        let as_told = Parts::from_row_major(independent.to_row_major(), dependent.to_row_major());
        assert_eq!(as_told.err(), None, "{resumed:?}");
    });
}

fn configure(path: &Path) -> Config {
    let path = path.display();
    let text = format!(
        "[robot]\nname = \"a\"\nid = 3\n[initial]\nresume = true\n[gyro]\nsource = \"channel\"\n[telemetry]\nstate_file = \"{path}\"\n"
    );
    Config::parse(&text, Path::new("/nowhere/a.toml")).unwrap()
}

fn at(seconds: f64) -> When {
    #[expect(clippy::cast_possible_truncation, reason = "minutes")]
    let boottime_ns = (seconds * 1e9) as i64;
    When {
        boot_id: "this".into(),
        boottime_ns,
        realtime_ns: 0,
    }
}

fn samples() -> Vec<Vec<u8>> {
    let covariance = Covariance3::diagonal([0.01, 0.04, 0.0025]).unwrap();
    let belief = Belief {
        bend: Bend::from_array([1e-5, -2e-5, 1e-6, -2e-6, 3e-6, 1e-7]),
        ..Belief::gaussian(Pose::new(1.0, -2.0, 3.0), Parts::dependent(covariance))
    };
    let saved = |seconds, velocity: Option<[f64; 3]>| {
        let saved = Saved {
            gyro: velocity.map(|_| [0.02, 1e-3]),
            ..Saved::new(3, at(seconds), &belief, velocity)
        };
        toml::to_string(&saved).unwrap().into_bytes()
    };
    vec![saved(100.0, None), saved(129.9, Some([1.0, 0.0, 0.1]))]
}
