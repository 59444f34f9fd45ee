//! Buses, signals, a base, and what happens when they say nothing.

use coloc_drivers::can::Controller;
use coloc_drivers::encoder::{
    BaseConfig, Description, Expected, Length, OdometryConfig, Rounded, SignalDescription, Time,
    describe,
};

use super::super::Config;
use super::noise;
use super::page::Page;
use crate::collect::backlog::KEPT;

pub(super) fn write(config: &Config, page: &mut Page) {
    let Some(odometry) = &config.odometry else {
        page.line(
            "wheels",
            "none: no [odometry]; fixes and neighbours alone tell where the robot is",
        );
        return outage(config, page);
    };
    if odometry.is_on_can() {
        wheels(odometry, page);
    }
    if let Some(it) = &odometry.base {
        base(config, it, page);
    }
    limits(odometry, page);
    noise::write(config, odometry, page);
    hold(config, page);
    outage(config, page);
}

fn wheels(odometry: &OdometryConfig, page: &mut Page) {
    // What cannot be described was refused with the configuration.
    let Ok(description) = describe(odometry) else {
        return;
    };
    buses(odometry, &description, page);
    for signal in &description.signals {
        write_signal(signal, page);
    }
    page.line("geometry", &description.geometry);
}

fn base(config: &Config, base: &BaseConfig, page: &mut Page) {
    let channel = format!("coloc/{}/odometry", config.robot.name);
    let mut lines = vec![
        format!("what its driver says on {channel}"),
        "velocities".into(),
    ];
    if let Some(track_m) = base.track_m {
        lines.push(format!(
            "distances of two wheels, {} apart",
            Length(track_m)
        ));
    }
    if let (Some(_), Some([left, right])) = (base.track_m, base.metres_per_count) {
        let [left, right] = [left, right].map(Length);
        lines.push(format!(
            "counts of two wheels, {left} each on the left, {right} on the right"
        ));
    }
    let [forward, sideways, turning] = base.floor;
    lines.push(if base.floor.iter().all(|sigma| *sigma == 0.0) {
        "believed to be as certain as it says".into()
    } else {
        format!(
            "no σ below {forward} m/s forward, {sideways} m/s sideways, {turning} rad/s turning"
        )
    });
    page.lines("base", lines);
}

fn buses(odometry: &OdometryConfig, description: &Description, page: &mut Page) {
    for (number, spec) in odometry.buses.iter().enumerate() {
        let own = |it: &&Expected| usize::from(it.bus) == number;
        let expected = description.expected.iter().filter(own);
        let expected: Vec<_> = expected.map(ToString::to_string).collect();
        let expected = if expected.is_empty() {
            "nothing".into()
        } else {
            expected.join(", ")
        };
        page.line(
            &format!("bus {number}"),
            format!("{spec}, from which is wanted {expected}"),
        );
        if let Some((_, controller)) = Controller::of_bus(spec) {
            page.line("", format!("it is {controller}"));
        }
    }
    page.line(
        "",
        format!(
            "the kernel is asked to keep their frames of {} s",
            KEPT.as_secs()
        ),
    );
    let dbc = odometry.dbc.as_ref();
    let dbc = dbc.map_or("none: the messages are coloc's own".into(), |path| {
        path.display().to_string()
    });
    page.line("dbc", dbc);
}

fn write_signal(signal: &SignalDescription, page: &mut Page) {
    let lines = [
        &signal.place,
        &signal.meaning,
        &signal.rhythm,
        &signal.proof,
    ];
    page.lines(&signal.setting, lines.map(Clone::clone));
}

fn limits(odometry: &OdometryConfig, page: &mut Page) {
    let says_turns = odometry.body.is_some() || odometry.base.is_some();
    let turn = says_turns.then(|| {
        let limit = odometry.max_turn_rate_radps;
        format!(" and {limit} rad/s ({}°/s)", Rounded(limit.to_degrees()))
    });
    page.line(
        "limits",
        format!(
            "{} m/s{}: what is faster is garbage",
            odometry.max_speed_mps,
            turn.unwrap_or_default()
        ),
    );
}

fn hold(config: &Config, page: &mut Page) {
    let motion = &config.motion;
    page.line(
        "no samples",
        format!(
            "the last velocity is held for {}, its variance growing by {} of itself every {}",
            Time(motion.hold_s),
            motion.hold_growth,
            Time(motion.reference_period_s)
        ),
    );
}

fn outage(config: &Config, page: &mut Page) {
    let motion = &config.motion;
    let [forward, sideways, turning] = motion
        .outage_variance
        .map(|variance| Rounded(variance.sqrt()));
    let subject = if config.odometry.is_some() {
        ""
    } else {
        "no samples"
    };
    page.line(
        subject,
        format!(
            "then it is taken to stand, with σ = {forward} m/s forward, {sideways} m/s sideways, {turning} rad/s turning, \
             each every {}",
            Time(motion.reference_period_s)
        ),
    );
}
