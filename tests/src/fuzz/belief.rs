//! Saved beliefs: what is resumed can be believed.

use std::cell::OnceCell;
use std::path::Path;

use coloc_daemon::config::Config;
use coloc_daemon::saved::{Saved, When};
use coloc_estimator::{Belief, Covariance3, Pose};

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
        let Ok((belief, age_s)) = Saved::resume(config, &at(130.0)) else {
            return;
        };
        let Belief {
            pose: Pose { x, y, phi },
            total,
            independent,
        } = belief;
        let numbers = [x, y, phi, age_s];
        assert!(
            numbers.into_iter().all(f64::is_finite),
            "{belief:?}, {age_s} s"
        );
        assert!(total.contains(&independent), "{belief:?}");
        for covariance in [total, independent] {
            let rows = covariance.to_row_major();
            assert_eq!(Covariance3::from_row_major(rows).err(), None, "{belief:?}");
        }
    });
}

fn configure(path: &Path) -> Config {
    let path = path.display();
    let text = format!(
        "[robot]\nname = \"a\"\nid = 3\n[initial]\nresume = true\n[telemetry]\nstate_file = \"{path}\"\n"
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
    let belief = Belief {
        pose: Pose::new(1.0, -2.0, 3.0),
        total: Covariance3::diagonal([0.01, 0.04, 0.0025]).unwrap(),
        independent: Covariance3::ZERO,
    };
    let saved = |seconds, velocity| {
        let saved = Saved::new(3, at(seconds), &belief, velocity);
        toml::to_string(&saved).unwrap().into_bytes()
    };
    vec![saved(100.0, None), saved(129.9, Some([1.0, 0.0, 0.1]))]
}
