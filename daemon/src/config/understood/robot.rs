//! Who the robot is, its clock and its tick.

use coloc_drivers::encoder::{Rounded, Time};

use super::super::{Config, InitialHeading, Member};
use super::page::{Page, chosen};

pub(super) fn write(config: &Config, page: &mut Page) {
    let (robot, all) = (&config.robot, config.peers().count() + 1);
    let text = format!("{} (number {}), {all} in the team", robot.name, robot.id);
    page.line("robot", text);
    let name = |peer: &Member| format!("{} (number {})", peer.name, peer.id);
    let peers: Vec<_> = config.peers().map(name).collect();
    if peers.is_empty() {
        page.line("team", "nobody else: it hears and sees no other robot");
    } else {
        page.line("team", format!("this one, {}", peers.join(", ")));
    }
    page.line("clock", chosen("clock.source", config.clock.source));
    tick(config, page);
    start(config, page);
}

fn tick(config: &Config, page: &mut Page) {
    let tick = &config.tick;
    let period = Time(1.0 / tick.rate_hz);
    page.line("tick", format!("{} Hz, every {period}", tick.rate_hz));
    page.line(
        "",
        format!("started by {}", chosen("tick.trigger", tick.trigger)),
    );
    page.line("", format!("waits by {}", chosen("tick.wait", tick.wait)));
}

fn place(config: &Config) -> String {
    let initial = &config.initial;
    let Some([x, y, heading]) = config.initial_pose() else {
        return "anywhere, looking anywhere: it finds itself once it drives and fixes or neighbours say where it is".into();
    };
    let [sx, sy, sh] = initial.sigma;
    let position = format!("x {x} m ± {sx} m, y {y} m ± {sy} m");
    if initial.heading == InitialHeading::Unknown {
        return format!(
            "{position}, looking anywhere: it finds its heading once it drives and has fixes"
        );
    }
    format!(
        "{position}, heading {heading} rad ± {sh} rad, which are {}° ± {}°",
        Rounded(heading.to_degrees()),
        Rounded(sh.to_degrees())
    )
}

fn start(config: &Config, page: &mut Page) {
    let initial = &config.initial;
    page.line("start", place(config));
    if initial.resume {
        let age = Time(initial.resume_max_age_s);
        page.line(
            "",
            format!("or the saved belief, if it is not older than {age}"),
        );
    }
}
