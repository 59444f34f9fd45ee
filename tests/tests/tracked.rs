//! Two robots that hear of one another by way of `coloc-track`: `colocd` and `coloc-track` of each as processes over shared memory.
#![allow(clippy::unwrap_used)] // A test may panic.

use std::process::Command;
use std::time::Duration;

use coloc_rig::Rig;
use coloc_sensors::Moment;
use coloc_shm_types::{
    Clock, Estimate, Neighbour, Publisher, Seen, Sender, Sighting, Subscriber, Tracked,
};

const PROGRAM: &str = env!("CARGO_BIN_EXE_colocd-under-test");
const ROBOTS: [&str; 2] = ["a", "b"];
/// Where they stand, and look.
const POSES: [[f64; 3]; 2] = [[0.0, 0.0, 0.3], [2.0, 0.5, 1.2]];
/// The first knows it, the other does not quite.
const INITIAL: [&str; 2] = [
    "pose = [0.0, 0.0, 0.3]\nsigma = [0.02, 0.02, 0.02]\n",
    "pose = [2.2, 0.3, 0.9]\nsigma = [0.4, 0.4, 0.5]\n",
];
/// Of a camera \[m², rad²\].
const WHITE: [f64; 2] = [1e-4, 1e-4];
/// From one image to the next.
const APART: Duration = Duration::from_millis(50);

/// Both robots' cameras.
struct Cameras([(Publisher<Sighting>, Sender); 2]);

impl Cameras {
    fn of(rig: &Rig) -> Self {
        let camera = |name| {
            (
                rig.publisher(name),
                Sender::start(0, Clock::Boottime).unwrap(),
            )
        };
        Self(ROBOTS.map(camera))
    }

    /// Each sees the other one.
    fn see(&mut self) {
        let now_ns = Moment::now().boottime_ns;
        for (robot, (camera, sender)) in self.0.iter_mut().enumerate() {
            let ([x, y, phi], [to_x, to_y, _]) = (POSES[robot], POSES[1 - robot]);
            let [dx, dy] = [to_x - x, to_y - y];
            let sighting = Sighting {
                header: sender.header(now_ns),
                observed: if robot == 0 { 2 } else { 1 },
                has: Sighting::RANGE | Sighting::BEARING,
                who: Sighting::ROBOT,
                range: dx.hypot(dy),
                bearing: dy.atan2(dx) - phi,
                white: WHITE,
                ..Sighting::default()
            };
            camera.send(sighting).unwrap();
        }
    }
}

/// Lets both see until `ear` hears what is wanted.
fn until<M: coloc_shm_types::Message>(
    cameras: &mut Cameras,
    ear: &Subscriber<M>,
    wanted: impl Fn(&M) -> bool,
) -> M {
    coloc_rig::until(cameras, APART, Cameras::see, |_| {
        let heard = std::iter::from_fn(|| ear.receive().unwrap());
        heard.filter(&wanted).last()
    })
}

#[test]
fn a_track_feeds_colocd_which_hears_no_sighting_but_by_way_of_it() {
    let mut rig = Rig::new("fed", PROGRAM);
    for (name, initial) in ROBOTS.iter().zip(INITIAL) {
        let lines = format!(
            "[initial]\n{initial}[sighting]\nheard = true\nthrough_track = true\n[track]\n\
             [motion]\npreset = \"paper\"\noutage_variance = [1e-6, 1e-6, 1e-9]\n\
             [realtime]\nscheduler = \"other\"\nlock_memory = false\n"
        );
        rig.configure(name, &ROBOTS, &lines);
    }
    let mut cameras = Cameras::of(&rig);
    let (estimates, seen, letters, tracks) = (
        rig.subscriber::<Estimate>("b"),
        rig.subscriber::<Seen>("b"),
        rig.subscriber::<Neighbour>("b"),
        rig.subscriber::<Tracked>("a"),
    );
    for name in ROBOTS {
        let command = rig.command("run", name);
        rig.start(command);
    }
    // Without coloc-track nothing is heard: what is believed grows no more certain.
    for _ in 0..20 {
        until(&mut cameras, &estimates, |_| true);
    }
    assert!(seen.receive().unwrap().is_none() && letters.receive().unwrap().is_none());
    for name in ROBOTS {
        let mut command = Command::new(PROGRAM);
        command.args(["coloc-track", "run"]);
        command.arg(rig.configuration(name));
        rig.start(command);
    }
    // First as it was seen, then as the track has it once that knows the heading.
    until(&mut cameras, &seen, |_| true);
    let track = until(&mut cameras, &tracks, Tracked::has_heading);
    assert!(track.covariance[8] < 0.35 * 0.35, "{track:?}");
    let letter = until(&mut cameras, &letters, |_| true);
    assert!(letter.independent.iter().all(|it| *it == 0.0), "{letter:?}");
    let is_surer = |it: &Estimate| it.total()[8] < 0.1 * 0.1;
    let estimate = until(&mut cameras, &estimates, is_surer);
    let [x, y, phi] = POSES[1];
    let off = [
        estimate.pose[0] - x,
        estimate.pose[1] - y,
        estimate.pose[2] - phi,
    ];
    assert!(off.iter().all(|it| it.abs() < 0.3), "{off:?}");
    for ended in rig.stop() {
        assert!(ended.status.success(), "{ended:?}");
    }
}
