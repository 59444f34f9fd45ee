//! Everything that was found out, as JSON.

use serde::Serialize;
use serde_json::{Map, Value, json};

use super::args::{LatencyArgs, WaitArg};
use super::facts::Facts;
use super::pass::Pass;
use super::percentiles::Durations;
use crate::demo::bus::Buses;

/// Facts, settings and passes.
pub(crate) struct Report {
    pub(crate) facts: Facts,
    pub(crate) settings: Settings,
    pub(crate) passes: Vec<Pass>,
}

/// What was asked for and obtained.
#[derive(Debug, Serialize)]
pub(crate) struct Settings {
    pub(crate) seconds: f64,
    pub(crate) rate_hz: f64,
    pub(crate) neighbours: u16,
    pub(crate) trigger: &'static str,
    pub(crate) can: &'static str,
    pub(crate) can_because: String,
    pub(crate) buses: usize,
    /// From a wheel's frame to the other's.
    pub(crate) gap_us: u16,
    pub(crate) clock_ppm: i32,
    pub(crate) load_threads: u16,
    /// How the reader waits, if not as the daemon.
    pub(crate) reader: Option<&'static str>,
}

impl Report {
    pub(crate) fn new(facts: Facts, args: &LatencyArgs, buses: &Buses) -> Self {
        let settings = Settings {
            seconds: args.seconds,
            rate_hz: args.rate,
            neighbours: args.neighbours,
            trigger: args.trigger.name(),
            can: buses.kind,
            can_because: buses.reason.clone(),
            buses: buses.specs.len(),
            gap_us: args.gap_us,
            clock_ppm: args.clock_ppm,
            load_threads: args.load,
            reader: args.reader.map(WaitArg::name),
        };
        Self {
            facts,
            settings,
            passes: Vec::new(),
        }
    }

    /// For the picture.
    pub(crate) fn title(&self) -> String {
        let Settings {
            rate_hz,
            trigger,
            neighbours,
            can,
            ..
        } = &self.settings;
        format!(
            "colocd: frame to estimate at {rate_hz} Hz, {trigger}, {neighbours} neighbours, {can} bus"
        )
    }

    /// As JSON.
    pub(crate) fn text(&self) -> String {
        let passes: Vec<Value> = self.passes.iter().map(pass).collect();
        let all = json!({ "machine": self.facts, "settings": self.settings, "passes": passes });
        format!("{all:#}\n")
    }
}

fn pass(pass: &Pass) -> Value {
    let stages: Map<String, Value> = pass
        .stages
        .iter()
        .map(|(name, durations)| ((*name).to_owned(), json!(durations.percentiles())))
        .collect();
    json!({
        "wait": pass.mode.name(),
        "scheduling_class": pass.class,
        "frame_due_to_estimate": pass.frames.percentiles(),
        "frames": pass.account,
        "frame_in_kernel_to_estimate": pass.from_kernel.percentiles(),
        "frame_in_kernel_to_ready": pass.ready.percentiles(),
        "stages": stages,
        "floors_sent": pass.floors.sent,
        "floor_frame_read": pass.floors.frame.percentiles(),
        "floor_transport": pass.floors.transport.percentiles(),
        "floor_clock_read": pass.floors.clock.percentiles(),
        "ratio_to_floors": { "p50": pass.ratio(|p| p.p50_ns), "p99": pass.ratio(|p| p.p99_ns) },
        "subscriber_join_ns": pass.join_ns,
        "worst_frame": pass.worst,
        "plain_program": pass.plain.as_ref().map(Durations::percentiles),
        "ratio_to_plain": {
            "p50": pass.ratio_to_plain(|p| p.p50_ns), "p99": pass.ratio_to_plain(|p| p.p99_ns),
        },
        "busy": pass.busy,
        "objections": pass.objections(),
    })
}
